#pragma once

// Fuzz targets: every reader of untrusted files, as a function of bytes. A reader must either accept any
// bytes or throw Error; another exception, a crash, a sanitizer's report, more than ten seconds or more
// than 2 GB are defects. For formats that also have a writer, accepted data are written and must read back
// unchanged.
//
// How to add a reader: add one line to the table of targets.cc, and to corpus/<name>/ a few small files of
// our own, at least one of which is accepted. Trajectory formats and adapters are targets as soon as they
// are in their registries, and only need files. scripts/maintain/check_layers.py refuses a reader in a
// header that no target calls, and targets_test.cc refuses a target without files.
//
// corpus/<name>/        hand-made files of a few bytes to a few kB; each run of the tests replays all of them
// corpus/<name>/found/  inputs found by scripts/maintain/fuzz, kept as regression tests once mended

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

/// Returns the target's reason for refusing the bytes; empty if it accepts them. Other exceptions pass
/// through. Errors of the file system (such as a name that is too long) count as a refusal, since programs
/// report them like Error.
std::string refusal(const FuzzTarget& target, std::string_view bytes);

}  // namespace sextant
