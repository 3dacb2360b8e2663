#pragma once

// Verification of a submitted folder, a card with its sweeps. The checks:
//
//   suite      the card belongs to a suite of this program, by SHA-256
//   plans      every sweep has the sources, noise, levels, seeds and options of the suite
//   cases      every case of a plan exists, and its records have its source, noise, level, seed and
//              estimator: one record for each frame and body that the track counts according to the truth
//              of the source, which is not checked for sources whose data are missing; a motion that was
//              estimated has errors. Values that depend on the truth only are those of the data (truth_only,
//              metrics/definitions.h), and records of external programs, which give no covariances, have no
//              values that need one
//   card       card.json equals the card computed from the records, to the last digit, except for the version
//              of the program; card.md equals what that version writes
//   rerun      a random sample, one case of every sweep and five cases at least, is run again. It gives the
//              same results, and every number that a card reads agrees within a relative difference of 1e-8
//              or, for exact data, 1e-6 m, 1e-5 deg or 1e-4 km/h, except for times. Cases of estimators of
//              this program are always run again, cases of external programs on request only, because their
//              command comes from the submitted configuration
//   bounds     of a program that is not run, the bounds in the sample are compared with those of the same
//              points: every counted motion that was estimated has its bounds, and no record has others

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/experiment/sweep.h"

namespace sextant {

struct VerifyOptions {
  /// Name of a suite, or NAME.json; empty: the suite of the card, which must come with this program
  std::string suite;
  bool run_external = false;            ///< also run cases of external programs again
  bool all = false;                     ///< run all cases again
  std::optional<uint64_t> sample_seed;  ///< seed of the sample; nullopt: a random one
  SweepConfig sweep;                    ///< cache and jobs for the cases that are run again
  std::string data_root;
};

/// Returns lines that describe the checks, without the control characters of texts of the folder. Throws
/// Error at the first violation, with the file and the difference.
std::vector<std::string> verify_benchmark(const std::filesystem::path& folder, const VerifyOptions& options);

}  // namespace sextant
