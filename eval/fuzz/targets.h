#pragma once

// What fuzzing feeds: every reader of files of strangers, as a function of bytes. Any bytes whatever either
// are taken or throw Error; any other exception, a crash, a sanitizer's report, ten seconds or 2 GB are a
// defect. Where there is a writer, what was taken is written and must read back the same.
//
// How to add a reader: one line in the table of targets.cc, and in corpus/<name>/ small files of our own, one
// of them at least taken without an Error. Trajectory formats and adapters are targets by being in their
// registries; they need their files alone. scripts/maintain/check_layers.py refuses a reader in a header that no
// target calls, and targets_test.cc a target without files.
//
// corpus/<name>/        made by us, a few bytes to a few kB; each run of the tests replays all of them
// corpus/<name>/found/  what scripts/maintain/fuzz has found, kept when it is mended

#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace sextant {

struct FuzzTarget {
  std::string name;
  std::function<void(std::string_view)> read;
};

std::span<const FuzzTarget> fuzz_targets();

/// Why the target refuses the bytes; empty: it takes them. Lets every other exception through. The file
/// system's own errors (a name too long) are a refusal: programs report them as they report Error.
std::string refusal(const FuzzTarget& target, std::string_view bytes);

}  // namespace sextant
