// Part of limits_test.py: a library, loaded with LD_PRELOAD, that opens files before main(), as libraries of
// some distributions do.

#include <unistd.h>

namespace {

const int opened = [] {
  int ends[2];
  return ::pipe(ends);
}();

}  // namespace
