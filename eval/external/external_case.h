#pragma once

// The folder of one case of an external program: input/, output/, stdout.txt, stderr.txt, calibration.yaml,
// settings.*, case.json and log.txt.

#include <filesystem>
#include <optional>
#include <string>

#include "sextant/datasets/dataset.h"
#include "sextant/eval/external/external_config.h"
#include "sextant/eval/external/process.h"
#include "sextant/noise/noise.h"

namespace sextant {

/// Creates the folder, replacing an existing one. The destructor removes what is not to be kept, also after
/// an exception.
class CaseFolder {
 public:
  /// With an empty `folder`, a temporary one is used and removed completely.
  CaseFolder(const std::filesystem::path& folder, Keep keep);
  ~CaseFolder();
  CaseFolder(const CaseFolder&) = delete;
  CaseFolder& operator=(const CaseFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path input() const { return path_ / "input"; }
  std::filesystem::path output() const { return path_ / "output"; }
  std::filesystem::path file(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
  std::optional<Keep> keep_;  ///< nullopt: keep nothing
};

/// Writes case.json: how the program ended, for reading its output again.
void write_case(const ProcessOutcome& outcome, const std::filesystem::path& folder);
/// Reads case.json. Throws Error if there is no finished case with its output.
ProcessOutcome read_case(const std::filesystem::path& folder);

/// Returns the last line of a text file that is not blank, with "?" for characters that are not printable
/// ASCII and "..." before the last 200 characters of a longer line; "" if there is none.
std::string last_line(const std::filesystem::path& path);

// ---- The sequence as an external program gets it. Its frames contain the noise of a case, with the same
// values that built-in estimators get at the same pixels (noise.h); frame n is at the time n / rate; ground
// truth is contained only if requested. Frames may be numbered from 0, and the last one may have a flow of
// zeros.

struct ShownSequence {
  bool truth = false;
  bool from_zero = false;       ///< numbers the first frame 0, whatever its number in the source
  bool zero_last_flow = false;  ///< adds zero flow to the last frame, which has no successor
};

class NoisySequence final : public Sequence {
 public:
  /// `base` must outlive this object.
  NoisySequence(const Sequence& base, Noise noise, uint64_t seed, const ShownSequence& shown);

  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }
  Frame read(int frame, Channels channels) const override;
  void check_files() const override { base_.check_files(); }

 private:
  const Sequence& base_;
  Noise noise_;
  Draws draws_;
  SequenceInfo info_;
  SequenceTruth truth_;
  int shift_ = 0;  ///< from frame numbers here to those of the source
  bool zero_last_flow_ = false;
};

}  // namespace sextant
