#pragma once

// The folder of one case of an external program: input/, output/, stdout.txt, stderr.txt, calibration.yaml,
// settings.*, case.json and log.txt.

#include <filesystem>
#include <optional>
#include <string>

#include "sextant/eval/external/external_config.h"
#include "sextant/eval/external/process.h"

namespace sextant {

/// Made anew. What is not to be kept goes in the end, also with an exception.
class CaseFolder {
 public:
  /// An empty `folder`: a temporary one, of which nothing stays.
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
  std::optional<Keep> keep_;  ///< none: nothing
};

/// case.json of a folder: how the program ended, for those who score its output again.
void write_case(const ProcessOutcome& outcome, const std::filesystem::path& folder);
/// Throws Error when there is no finished case with its output.
ProcessOutcome read_case(const std::filesystem::path& folder);

/// The last line of a text file that is not blank, at most 200 characters, each printable; "" where there is
/// none.
std::string last_line(const std::filesystem::path& path);

}  // namespace sextant
