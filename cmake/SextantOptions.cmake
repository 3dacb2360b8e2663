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
# -O2 costs the solver a third of its speed; assertions stay out of Release.
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Paths below the checkout count as relative, so that another clone finds what this one compiled. What a file
  # depends on is read from the compiler's list, which saves a first build the preprocessor's second run.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 CCACHE_DEPEND=1
      CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE_PROGRAM})
endif()

add_library(sextant_flags INTERFACE)
target_compile_features(sextant_flags INTERFACE cxx_std_20)
# -ffp-contract=off: a fused multiply-add on one machine and none on another
# would give different last digits for the same seed.
# -Wno-restrict: g++ 12 gives false alarms on string + string (GCC bug 105651).
target_compile_options(sextant_flags INTERFACE $<BUILD_INTERFACE:-Wall;-Wextra;$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>;-Wno-missing-field-initializers;-Wshadow;-Wnon-virtual-dtor;-ffp-contract=off>)
# Memory is cheaper than the time (a tenth) in which the compiler looks for what it can free.
target_compile_options(sextant_flags INTERFACE
  $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-expand=1000$<SEMICOLON>--param=ggc-min-heapsize=2000000>>)
if(SEXTANT_WERROR)
  target_compile_options(sextant_flags INTERFACE $<BUILD_INTERFACE:-Werror>)
endif()
if(SEXTANT_SANITIZE)
  target_compile_options(sextant_flags INTERFACE $<BUILD_INTERFACE:-fsanitize=${SEXTANT_SANITIZE};-fno-omit-frame-pointer;-fno-sanitize-recover=all>)
  target_link_options(sextant_flags INTERFACE $<BUILD_INTERFACE:-fsanitize=${SEXTANT_SANITIZE}>)
endif()
