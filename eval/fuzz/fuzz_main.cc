// The program that scripts/maintain/fuzz runs: libFuzzer on the target named by SEXTANT_FUZZ_TARGET. The
// name "list" prints all targets.

#include <cstdio>
#include <cstdlib>

#include "sextant/base/error.h"
#include "sextant/base/names.h"
#include "sextant/eval/fuzz/targets.h"

namespace {

const sextant::FuzzTarget* target = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  using namespace sextant;
  const char* name = std::getenv("SEXTANT_FUZZ_TARGET");
  if (name != nullptr && std::string_view(name) == "list") {
    for (const FuzzTarget& entry : fuzz_targets()) std::puts(entry.name.c_str());
    std::exit(0);
  }
  try {
    target = &find_entry(fuzz_targets(), name == nullptr ? "" : name, "target (SEXTANT_FUZZ_TARGET)");
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::exit(2);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  refusal(*target, {reinterpret_cast<const char*>(bytes),
                    size});  // an exception ends the program, which libFuzzer reports as a finding
  return 0;
}
