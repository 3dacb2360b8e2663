#pragma once

// Looks at everything a source gives before a run relies on it: opens every file, decodes every frame, and
// says per channel how many frames have it, its size, the share of valid pixels and the range of values. Then
// checks that the parts agree with one another (conventions.h), with the likely cause where they do not, and
// measures flow and depth that are not the data set's truth against it (dense_truth.h).
//
// The convention checks look at all of up to 24 frames, and of longer sources at 6 runs of 4 successive
// frames, evenly spread: they take seconds whatever the length. Those of text truth and of the masks'
// outlines look at every frame decoded.

#include <optional>
#include <string>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/check/conventions.h"

namespace sextant {

/// One line of the check. Numbers that do not apply are empty.
struct SourceCheck {
  std::string
      name;  ///< "files", "gray", "depth", "flow", "mask", "poses", "objects", "static flow", ..., "note"
  bool convention = false;  ///< one of conventions.h: has value, limit and n, or a message why not
  CheckOutcome outcome = CheckOutcome::pass;
  std::optional<int> n_present;  ///< frames (files, channels, poses) or tracks (objects)
  std::optional<int> n_expected;
  std::string size_px;                     ///< "1242x375"
  std::optional<double> valid_share;       ///< 0..1, over all pixels of all frames
  std::optional<double> min, median, max;  ///< of valid values; the median over every 16th of them
  std::optional<double> value, limit;      ///< of a convention: passes up to the limit
  std::optional<int> n;                    ///< what the value was taken over
  std::string counted;                     ///< what n counts: "points"
  std::string unit;                        ///< of the range, or of value and limit
  std::string message;                     ///< what is wrong, or worth knowing
  std::string cause;  ///< the likely cause, or "no known cause fits"; empty when it passes
};

struct CheckSourceOptions {
  int jobs = 1;
  bool quiet = false;  ///< no progress line
  bool quick = false;  ///< decode only the frames that the convention checks look at
};

/// Bad frames become FAIL lines; only what stops the check altogether throws.
std::vector<SourceCheck> check_source(const Sequence& sequence, const CheckSourceOptions& options);

// ---- what check_source() has found, for people and for programs

/// Two tables, content and conventions, with the likely causes below.
std::string check_page(const std::string& source, const SequenceInfo& info,
                       const std::vector<SourceCheck>& checks);
/// {"source","failed","suspect","checks":[{"check","outcome",..,"cause","message"}]}
Json check_json(const std::string& source, const std::vector<SourceCheck>& checks);
/// Throws Error that names the first failed check, where there is one.
void refuse_failed(const std::string& source, const std::vector<SourceCheck>& checks);

}  // namespace sextant
