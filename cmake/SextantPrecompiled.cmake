# sextant_precompile(TARGET KIND)
#
# Headers of libraries that nearly every source reads, parsed once.
# Only headers of others stand here, so that a change of ours never compiles everything anew. A compiler takes a
# precompiled header only for the options it was made with, so there is one per KIND of target: `hot`, `plain` and
# `test`.
# The preset `debug` builds without, which finds a missing #include.
option(SEXTANT_PRECOMPILE "Precompile headers of libraries" ON)

set(SEXTANT_PRECOMPILED_HEADERS
  <algorithm> <array> <charconv> <cmath> <filesystem> <fstream> <functional> <limits> <map> <memory> <numeric>
  <optional> <random> <set> <span> <sstream> <string> <string_view> <tuple> <vector>
  <Eigen/Dense> <fmt/ranges.h> <nlohmann/json.hpp>)

function(sextant_precompile TARGET KIND)
  if(NOT SEXTANT_PRECOMPILE)
    return()
  endif()
  set(holder sextant_precompiled_${KIND})
  if(NOT TARGET ${holder})
    set(source ${PROJECT_BINARY_DIR}/generated/${holder}.cc)
    file(CONFIGURE OUTPUT ${source} CONTENT "// Holds a precompiled header.\nint main() {}\n")
    set(headers ${SEXTANT_PRECOMPILED_HEADERS})
    if(KIND STREQUAL "test")
      add_executable(${holder} ${source})
      target_link_libraries(${holder} PRIVATE GTest::gtest GTest::gmock)
      list(APPEND headers <gmock/gmock.h> <gtest/gtest.h>)
    else()
      add_library(${holder} OBJECT ${source})
    endif()
    target_link_libraries(${holder} PRIVATE sextant_flags Eigen3::Eigen fmt::fmt nlohmann_json::nlohmann_json
      Threads::Threads)
    sextant_optimise(${holder} ${KIND})
    target_precompile_headers(${holder} PRIVATE ${headers})
  endif()
  target_precompile_headers(${TARGET} REUSE_FROM ${holder})
endfunction()

# `hot` code is optimised for speed; of the rest (arguments, readers of text, pages, tests) compiling takes longer than
# optimising saves. Loops with sqrt() and comparisons are vectorised only when neither sets errno nor traps: no result changes.
function(sextant_optimise TARGET KIND)
  if(KIND STREQUAL "hot")
    target_compile_options(${TARGET} PRIVATE -fno-math-errno -fno-trapping-math)
  else()
    target_compile_options(${TARGET} PRIVATE $<$<CONFIG:Release>:-Og>)
  endif()
endfunction()
