# `cpack` in the build folder: sextant, sextant-dev and, where the Python package is built, python3-sextant as Debian
# packages. What they depend on follows from what was found and linked, so the same lines serve Debian and Ubuntu.
# Whoever builds packages answers for them, named as Debian's tools and git name him; scripts/release refuses an address that
# cannot receive mail.
set(name "$ENV{DEBFULLNAME}")
set(address "$ENV{DEBEMAIL}")
if(name STREQUAL "")
  execute_process(COMMAND git config user.name WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE name
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(address STREQUAL "")
  execute_process(COMMAND git config user.email WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE address
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(name STREQUAL "" OR address STREQUAL "")
  cmake_host_system_information(RESULT host QUERY FQDN)
  set(name "local build")
  set(address "root@${host}")
endif()
set(SEXTANT_MAINTAINER "${name} <${address}>" CACHE STRING "Who answers for the packages: NAME <ADDRESS>")
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME sextant)
set(CPACK_PACKAGE_CONTACT ${SEXTANT_MAINTAINER})
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER ${SEXTANT_MAINTAINER})
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(long_description "Sextant measures the 6-DoF motion of the camera and of every moving
object against the truth, with named error definitions, a status for every
object in every frame, noise of known size on the measurements, and results
that are the same bytes every time.")

# ---- sextant
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME sextant)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "${long_description}")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "gnuplot-nox | gnuplot-qt | gnuplot-x11, fonts-dejavu-core")  # figures
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "python3, ca-certificates")  # share/sextant/scripts/fetch

# ---- sextant-dev: the packages that hold what find_package() found
set(found ${Eigen3_DIR} ${fmt_DIR} ${nlohmann_json_DIR} ${CLI11_DIR} ${Ceres_DIR} ${embree_DIR}
  ${Boost_DIR} ${boost_headers_DIR} ${boost_iostreams_DIR} ${boost_filesystem_DIR} ${boost_system_DIR}
  ${OPENSSL_CRYPTO_LIBRARY} ${JPEG_LIBRARY_RELEASE} ${LIBDEFLATE_LIBRARY} ${LZ4_INCLUDE_DIR}/lz4frame.h
  ${ZSTD_INCLUDE_DIR}/zstd.h ${BZIP2_INCLUDE_DIR}/bzlib.h ${SQLite3_INCLUDE_DIR}/sqlite3.h ${OpenCV_DIR})
string(REPLACE " " ";" opencv_components "${SEXTANT_OPENCV_COMPONENTS}")
foreach(component ${opencv_components})
  list(APPEND found ${OpenCV_INCLUDE_DIR}/opencv2/${component}.hpp)
endforeach()
list(FILTER found EXCLUDE REGEX "NOTFOUND$")
find_program(DPKG_QUERY dpkg-query)
mark_as_advanced(DPKG_QUERY)
set(needs libminizip-dev)
if(DPKG_QUERY)
  foreach(file ${found})
    execute_process(COMMAND ${DPKG_QUERY} -S ${file} OUTPUT_VARIABLE owner ERROR_QUIET)
    if(owner MATCHES "^([a-z0-9.+-]+)[:,]")
      list(APPEND needs ${CMAKE_MATCH_1})
    endif()
  endforeach()
endif()
list(REMOVE_DUPLICATES needs)
list(SORT needs)
list(JOIN needs ", " needs)
set(CPACK_DEBIAN_DEV_PACKAGE_NAME sextant-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "${needs}")
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "sextant (= ${PROJECT_VERSION}), cmake, ninja-build")
set(CPACK_DEBIAN_DEV_DESCRIPTION "${long_description}
This package holds the headers, the static libraries and what
find_package(Sextant) of CMake reads.")

# ---- python3-sextant
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-sextant)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/python3-sextant/prerm)
set(python_needs "sextant (= ${PROJECT_VERSION}), python3-numpy, python3-pandas")
if(Python3_VERSION_MINOR)
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  string(APPEND python_needs ", python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next_minor})")
endif()
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "${python_needs}")
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "${long_description}
This package holds the module sextant: results as pandas frames, noise on
numpy arrays, errors of poses and objects.")

# ---- what every package has
get_cmake_property(components COMPONENTS)
set(CPACK_COMPONENTS_ALL program dev)
if(python IN_LIST components)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
foreach(component ${CPACK_COMPONENTS_ALL})
  string(TOUPPER ${component} upper)
  install(CODE "
    set(package ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
    set(version ${PROJECT_VERSION})
    set(maintainer \"${SEXTANT_MAINTAINER}\")
    set(source \"${PROJECT_SOURCE_DIR}\")
    set(work \"${PROJECT_BINARY_DIR}/pages\")
    set(data_dir \"${CMAKE_INSTALL_DATADIR}\")
    include(\"${CMAKE_CURRENT_LIST_DIR}/install_debian.cmake\")" COMPONENT ${component})
endforeach()
include(CPack)
