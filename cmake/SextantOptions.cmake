# Language level, warnings and sanitizers for every target.
option(SEXTANT_TESTS "Build the tests" ${PROJECT_IS_TOP_LEVEL})
option(SEXTANT_BENCHMARKS "Build the Google Benchmark programs" ${PROJECT_IS_TOP_LEVEL})
# No test waits for a clock; this only ends one that hangs, also under sanitizers on a busy machine.
set(SEXTANT_TEST_TIMEOUT_S 6000)
option(SEXTANT_WERROR "Treat warnings as errors" OFF)
set(SEXTANT_SANITIZE "" CACHE STRING "Sanitizers, e.g. 'address,undefined' or 'thread'")

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set_property(GLOBAL PROPERTY GLOBAL_DEPENDS_NO_CYCLES ON)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Paths below the checkout count as relative, so that another clone finds what this one compiled. CMake's unity sources name
  # the files that they include by absolute paths, which differ between clones; ccache compares the preprocessed text instead
  # (its depend mode, CCACHE_DEPEND, would not), and -fmacro-prefix-map below keeps __FILE__ the same in it.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1
      CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE_PROGRAM})
endif()

# Headers are included as "sextant/<folder>/file.h", where lib/ is dropped: lib/geometry/se3.h is "sextant/geometry/se3.h",
# in a build by a link to each folder, as in an installed package.
set(include_root ${PROJECT_BINARY_DIR}/headers)
file(MAKE_DIRECTORY ${include_root}/sextant)
file(GLOB folders CONFIGURE_DEPENDS lib/* datasets eval)
foreach(folder ${folders})
  if(IS_DIRECTORY ${folder})
    get_filename_component(name ${folder} NAME)
    file(CREATE_LINK ${folder} ${include_root}/sextant/${name} SYMBOLIC)
  endif()
endforeach()

add_library(sextant_flags INTERFACE)
target_compile_features(sextant_flags INTERFACE cxx_std_20)
target_include_directories(sextant_flags INTERFACE
  $<BUILD_INTERFACE:${include_root}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/sextant/internal>)
# -ffp-contract=off: a fused multiply-add on one machine and none on another
# would give different last digits for the same seed.
# -fno-math-errno, -fno-trapping-math: the compiler vectorises loops with sqrt() and comparisons; no result changes.
# -fmacro-prefix-map: messages name sources relative to the checkout, and programs hold no path of the machine that built them.
# -Wno-restrict: g++ 12 gives false alarms on string + string (GCC bug 105651).
target_compile_options(sextant_flags INTERFACE $<BUILD_INTERFACE:-ffp-contract=off;-fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=;-fno-math-errno;-fno-trapping-math>
  $<BUILD_INTERFACE:-Wall;-Wextra;$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>;-Wno-missing-field-initializers;-Wshadow;-Wnon-virtual-dtor>)
if(SEXTANT_WERROR)
  target_compile_options(sextant_flags INTERFACE $<BUILD_INTERFACE:-Werror>)
endif()
if(SEXTANT_SANITIZE)
  target_compile_options(sextant_flags INTERFACE $<BUILD_INTERFACE:-fsanitize=${SEXTANT_SANITIZE};-fno-omit-frame-pointer;-fno-sanitize-recover=all>)
  target_link_options(sextant_flags INTERFACE $<BUILD_INTERFACE:-fsanitize=${SEXTANT_SANITIZE}>)
  # Eigen aligns memory by itself under the address sanitizer, but Ceres's archive holds instances of the same templates that do not.
  target_compile_definitions(sextant_flags INTERFACE $<BUILD_INTERFACE:EIGEN_MALLOC_ALREADY_ALIGNED=1>)
endif()
