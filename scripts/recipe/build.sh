#!/usr/bin/env bash
# Build script of the recipe, with conda's variables: SRC_DIR (the checkout), PREFIX, PYTHON, SP_DIR (site-packages of PREFIX),
# CPU_COUNT, CMAKE_ARGS. SEXTANT_BUILD_DIR names another build folder. Installs the program, the library with its headers, and the Python package below PREFIX.
set -euo pipefail
build=${SEXTANT_BUILD_DIR:-$SRC_DIR/build/recipe}
# shellcheck disable=SC2086  # CMAKE_ARGS is a list of words
cmake -G Ninja -S "$SRC_DIR" -B "$build" ${CMAKE_ARGS:-} -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$PREFIX" \
  -DSEXTANT_TESTS=OFF -DSEXTANT_BENCHMARKS=OFF -DSEXTANT_PYTHON=ON -DPython3_EXECUTABLE="$PYTHON" \
  -DSEXTANT_PYTHON_SITE="${SP_DIR#"$PREFIX"/}"
cmake --build "$build" -j "${CPU_COUNT:-$(nproc)}"
cmake --install "$build"
