#pragma once

// The folder of one case of an external program: input/, output/, stdout.txt, stderr.txt, calibration.yaml,
// settings.*, case.json and log.txt.

#include <filesystem>
#include <optional>
#include <string>

#include "sextant/eval/external/external_config.h"
#include "sextant/eval/external/process.h"

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

/// Returns the last non-blank line of a text file, at most 200 characters, all printable; "" if there is
/// none.
std::string last_line(const std::filesystem::path& path);

}  // namespace sextant
