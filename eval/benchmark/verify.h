#pragma once

// Checks a submitted folder (a card with its sweeps): whoever reads a card may trust its numbers as far as this goes.
//
//   suite      the card is of a suite of this program, by SHA-256
//   plans      every sweep has the sources, noise, levels, seeds and options of the suite
//   cases      every case of a plan is there, with records of its own source, noise, level, seed and estimator
//   card       the card computed from the records is the one in the folder, to the last digit; costs are not compared
//   rerun      a sample of cases is run again and gives the same records (times apart). Estimators of this program
//              always; external programs only on request, because that runs the command of a submitted configuration

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/eval/benchmark/benchmark_run.h"

namespace sextant {

struct VerifyOptions {
  std::string suite;          ///< a name or NAME.json; empty: that of the card, which must come with this program
  int n_rerun = 5;            ///< cases run again
  bool run_external = false;  ///< also those of external programs
  SweepConfig sweep;          ///< cache and jobs of the cases run again
  std::string data_root;
};

/// Lines about what was checked. Throws Error that names the file and what differs at the first refusal.
std::vector<std::string> verify_benchmark(const std::filesystem::path& folder, const VerifyOptions& options);

}  // namespace sextant
