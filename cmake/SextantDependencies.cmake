# Everything comes from packages of Debian or Ubuntu; scripts/setup installs them.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
# imgcodecs, which brings GDAL and with it most of the time that a program takes to start, and features2d are
# for tests and benchmarks alone.
set(SEXTANT_OPENCV_COMPONENTS core imgproc calib3d video dnn)
set(references "")
if(SEXTANT_TESTS OR SEXTANT_BENCHMARKS)
  set(references imgcodecs features2d)
endif()
find_package(OpenCV 4 REQUIRED COMPONENTS ${SEXTANT_OPENCV_COMPONENTS} ${references})
find_package(JPEG REQUIRED)
find_package(Ceres REQUIRED)
# Embree 3 or 4: Debian 12 and Ubuntu 22.04 have 3, Ubuntu 24.04 and Debian 13 have 4.
find_package(embree REQUIRED)
if(NOT embree_VERSION VERSION_GREATER_EQUAL 3 OR NOT embree_VERSION VERSION_LESS 5)
  message(FATAL_ERROR "Embree ${embree_VERSION} in ${embree_DIR}: expected version 3 or 4 (Debian package libembree-dev)")
endif()
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(CLI11 REQUIRED)
find_path(LIBDEFLATE_INCLUDE_DIR libdeflate.h REQUIRED)
find_library(LIBDEFLATE_LIBRARY deflate REQUIRED)
# Chunks of ROS bags and MCAP files.
find_path(LZ4_INCLUDE_DIR lz4frame.h REQUIRED)
find_path(ZSTD_INCLUDE_DIR zstd.h REQUIRED)
find_path(BZIP2_INCLUDE_DIR bzlib.h REQUIRED)
# `sextant export --format sqlite`.
find_package(SQLite3 REQUIRED)
# gnuplot-iostream is one header over Boost's streams.
find_path(GNUPLOT_IOSTREAM_INCLUDE_DIR gnuplot-iostream.h REQUIRED)
find_package(Boost REQUIRED COMPONENTS iostreams filesystem system)
if(SEXTANT_TESTS)
  find_package(GTest REQUIRED)
endif()
if(SEXTANT_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()
