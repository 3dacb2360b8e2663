#pragma once

// An output folder that is either complete or not there.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/file_lock.h"
#include "sextant/base/json.h"

namespace sextant {

/// Path relative to the output folder -> bytes.
using OutputFiles = std::map<std::string, std::string>;

/// The lock of an output folder, taken before anything is read or computed; none where no folder is given.
std::optional<FolderLock> lock_folder(const std::string& folder);

/// Throws Error when `folder` cannot take the results of `configuration` (resolved_configuration()): it is a
/// file, or it holds the records of another configuration and `force` is off. A run may be repeated in place.
void check_output_folder(const std::filesystem::path& folder, const Json& configuration, bool force);

/// A folder into which files are written under temporary names: `path(NAME)` is where to write NAME, commit()
/// moves them into place in the order given. Without commit() nothing of them stays, nor a folder that was
/// made for them and is empty. It holds the lock of the folder, and no file goes through a link below it
/// (base/file_lock.h, base/safe_paths.h).
class OutputFolder {
 public:
  explicit OutputFolder(std::filesystem::path folder);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  std::filesystem::path path(const std::string& name) const { return staging_ / name; }
  void commit(const std::vector<std::string>& names);

 private:
  std::filesystem::path folder_;
  FolderLock lock_;
  std::filesystem::path staging_;
};

/// Creates the folder where needed, writes every file into a subfolder of it and moves them into place when
/// all are there. When anything fails (or Ctrl-C comes) before, removes what it has written and created:
/// earlier results are as they were. Rethrows.
void write_output_folder(const std::filesystem::path& folder, const OutputFiles& files);

}  // namespace sextant
