# `cmake --install` and find_package(Sextant): every module as Sextant::<name>, its headers under
# include/sextant/. sextant_module installs the headers, eval/cli the program.
include(CMakePackageConfigHelpers)
get_property(modules GLOBAL PROPERTY SEXTANT_MODULES)
set_target_properties(sextant_flags PROPERTIES EXPORT_NAME flags)
if(TARGET sextant_libdeflate)
  set_target_properties(sextant_libdeflate PROPERTIES EXPORT_NAME libdeflate)
endif()
install(TARGETS sextant_flags ${modules} EXPORT SextantTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Sextant)
install(EXPORT SextantTargets NAMESPACE Sextant:: DESTINATION ${package_dir})
string(REPLACE ";" " " SEXTANT_OPENCV_COMPONENTS "${SEXTANT_OPENCV_COMPONENTS}")
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
  DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
