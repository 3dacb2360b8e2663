# `cmake --install` and find_package(Sextant): every module as Sextant::<name>, its public headers under
# include/sextant/. sextant_module installs the headers. Components: `program` (what runs, with pages, plans and
# documents), `dev` (headers and libraries), `python` where that is built; cmake/SextantPackage.cmake makes a package of each.
include(CMakePackageConfigHelpers)
foreach(header ${SEXTANT_PUBLIC_HEADERS})
  if(NOT EXISTS ${PROJECT_BINARY_DIR}/headers/${header})
    message(FATAL_ERROR "docs/reference.txt: there is no header ${header}")
  endif()
endforeach()
get_property(modules GLOBAL PROPERTY SEXTANT_MODULES)
set_target_properties(sextant_flags PROPERTIES EXPORT_NAME flags)
if(TARGET sextant_libdeflate)
  set_target_properties(sextant_libdeflate PROPERTIES EXPORT_NAME libdeflate)
endif()
install(TARGETS sextant_flags ${modules} EXPORT SextantTargets COMPONENT dev
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Sextant)
install(EXPORT SextantTargets NAMESPACE Sextant:: DESTINATION ${package_dir} COMPONENT dev)
string(REPLACE ";" " " SEXTANT_OPENCV_COMPONENTS "${SEXTANT_OPENCV_COMPONENTS}")
string(REGEX MATCH "^[0-9]+" SEXTANT_EMBREE_MAJOR "${embree_VERSION}")
configure_package_config_file(
  ${CMAKE_CURRENT_LIST_DIR}/SextantConfig.cmake.in ${PROJECT_BINARY_DIR}/SextantConfig.cmake
  INSTALL_DESTINATION ${package_dir})
# 0.x: a minor version may break the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/SextantConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/SextantConfig.cmake
  ${PROJECT_BINARY_DIR}/SextantConfigVersion.cmake
  ${CMAKE_CURRENT_LIST_DIR}/FindOpenCV.cmake
  DESTINATION ${package_dir} COMPONENT dev)

# The program's own files. README's links to docs/ hold there too.
set(doc_dir ${CMAKE_INSTALL_DATADIR}/doc/sextant)
set(data_dir ${CMAKE_INSTALL_DATADIR}/sextant)
install(TARGETS sextant RUNTIME COMPONENT program)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${doc_dir} COMPONENT license)  # Debian has it already
install(FILES README.md CONTRIBUTING.md CITATION.cff DESTINATION ${doc_dir} COMPONENT program)
install(DIRECTORY docs DESTINATION ${doc_dir} COMPONENT program)
install(DIRECTORY eval/plans DESTINATION ${data_dir} COMPONENT program FILES_MATCHING PATTERN *.json)
install(DIRECTORY results/published DESTINATION ${data_dir} COMPONENT program)
install(PROGRAMS scripts/fetch DESTINATION ${data_dir}/scripts COMPONENT program)
install(FILES scripts/fetch_data_sets.py scripts/fetch_checksums.txt DESTINATION ${data_dir}/scripts COMPONENT program)

# Man pages and completions, which the program writes itself.
install(CODE "
  set(program \"$<TARGET_FILE:sextant>\")
  set(work \"${PROJECT_BINARY_DIR}/pages\")
  set(data_dir \"${CMAKE_INSTALL_DATADIR}\")
  include(\"${CMAKE_CURRENT_LIST_DIR}/install_pages.cmake\")" COMPONENT program)
