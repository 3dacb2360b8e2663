# OpenCV from whichever Debian packages are there.
#
# Debian keeps OpenCVConfig.cmake in libopencv-dev, which pulls in every module with VTK, HDF5 and GDAL
# behind them. The modules' own packages (libopencv-core-dev, ...) hold headers and libraries only, so the
# targets opencv_<component> are made here when there is no OpenCVConfig.cmake.
find_package(OpenCV ${OpenCV_FIND_VERSION} CONFIG QUIET COMPONENTS ${OpenCV_FIND_COMPONENTS})
if(NOT OpenCV_FOUND)
  find_path(OpenCV_INCLUDE_DIR opencv2/core/version.hpp PATH_SUFFIXES opencv4)
  mark_as_advanced(OpenCV_INCLUDE_DIR)
  set(OpenCV_VERSION "")
  if(OpenCV_INCLUDE_DIR)
    file(READ ${OpenCV_INCLUDE_DIR}/opencv2/core/version.hpp version_header)
    foreach(part MAJOR MINOR REVISION)
      string(REGEX MATCH "#define CV_VERSION_${part} +([0-9]+)" _ "${version_header}")
      list(APPEND OpenCV_VERSION ${CMAKE_MATCH_1})
    endforeach()
    list(JOIN OpenCV_VERSION "." OpenCV_VERSION)
  endif()
  foreach(component ${OpenCV_FIND_COMPONENTS})
    find_library(OpenCV_${component}_LIBRARY opencv_${component})
    find_path(OpenCV_${component}_HEADER opencv2/${component}.hpp PATH_SUFFIXES opencv4)
    mark_as_advanced(OpenCV_${component}_LIBRARY OpenCV_${component}_HEADER)
    if(OpenCV_${component}_LIBRARY AND OpenCV_${component}_HEADER)
      set(OpenCV_${component}_FOUND TRUE)
      if(NOT TARGET opencv_${component})
        add_library(opencv_${component} SHARED IMPORTED)
        set_target_properties(opencv_${component} PROPERTIES
          IMPORTED_LOCATION ${OpenCV_${component}_LIBRARY}
          INTERFACE_INCLUDE_DIRECTORIES ${OpenCV_INCLUDE_DIR})
      endif()
    endif()
  endforeach()
  include(FindPackageHandleStandardArgs)
  find_package_handle_standard_args(OpenCV
    REQUIRED_VARS OpenCV_INCLUDE_DIR VERSION_VAR OpenCV_VERSION HANDLE_COMPONENTS)
endif()
