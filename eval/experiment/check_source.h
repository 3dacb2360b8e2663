#pragma once

// Looks at everything a source gives before a run relies on it: opens every file, decodes every frame, and
// says per channel how many frames have it, its size, the share of valid pixels and the range of values.

#include <optional>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"

namespace sextant {

enum class CheckOutcome { pass, warn, fail };
std::string_view to_string(CheckOutcome outcome);  ///< "PASS", "WARN", "FAIL"

/// One line of the check. Numbers that do not apply are empty.
struct SourceCheck {
  std::string name;  ///< "files", "gray", "depth", "flow", "mask", "poses", "objects", "note"
  CheckOutcome outcome = CheckOutcome::pass;
  std::optional<int> n_present;  ///< frames (files, channels, poses) or tracks (objects)
  std::optional<int> n_expected;
  std::string size_px;                     ///< "1242x375"
  std::optional<double> valid_share;       ///< 0..1, over all pixels of all frames
  std::optional<double> min, median, max;  ///< of valid values; the median over every 16th of them
  std::string unit;                        ///< of the range
  std::string message;                     ///< what is wrong, or worth knowing
};

/// Bad frames become FAIL lines; only what stops the check altogether throws.
std::vector<SourceCheck> check_source(const Sequence& sequence, int jobs, bool quiet);

}  // namespace sextant
