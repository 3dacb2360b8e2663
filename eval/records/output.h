#pragma once

// Output folders whose results appear completely or not at all.

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sextant/base/file_lock.h"
#include "sextant/base/json.h"

namespace sextant {

/// Bytes of each file, by path relative to the output folder.
using OutputFiles = std::map<std::string, std::string>;

/// Receives the bytes of one file, by its path relative to the output folder.
using FileWriter = std::function<void(const std::string& name, const std::string& bytes)>;

/// Takes the lock of an output folder, before anything is read or computed; nullopt if `folder` is empty.
std::optional<FolderLock> lock_folder(const std::string& folder);

/// Throws Error if `folder` cannot receive the results of `configuration` (resolved_configuration()): it is a
/// file, or it contains the records of another configuration and `force` is off. A run may be repeated in
/// place.
void check_output_folder(const std::filesystem::path& folder, const Json& configuration, bool force);

/// A folder into which files are written under temporary names: write NAME to path(NAME); commit() moves the
/// files into place in the given order. Without commit() all of them are removed, and the folder too if it
/// was created for them and is empty. Holds the lock of the folder, and writes no file through a link below
/// it (base/file_lock.h, base/new_file.h).
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

/// Creates the folder if needed, writes every file into a subfolder and moves them into place when all are
/// complete. On any failure or Ctrl-C before, removes what it wrote and created, so that earlier results are
/// unchanged, and rethrows.
void write_output_folder(const std::filesystem::path& folder, const OutputFiles& files);
/// Overload for files that are written as soon as `make` has made each of them.
void write_output_folder(const std::filesystem::path& folder,
                         const std::function<void(const FileWriter& write)>& make);

/// Removes the files directly in `folder` that an earlier run of the same command wrote: names that the
/// file .sextant_outputs there lists, that match `pattern` (ECMAScript) and are not in `written`. Then lists
/// `written` there. Leaves a folder that is reached through a link unchanged.
void remove_stale_files(const std::filesystem::path& folder, const std::string& pattern,
                        const std::set<std::string>& written);

/// Writes the files of a report with write_output_folder(), and removes figures, tables, curves and tracks
/// of an earlier report.
void replace_report(const std::filesystem::path& folder, const OutputFiles& files);

}  // namespace sextant
