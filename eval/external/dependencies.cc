#include "sextant/eval/external/dependencies.h"

#include <fnmatch.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <optional>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/base/text.h"
#include "sextant/eval/external/program_fingerprint.h"

namespace sextant {
namespace {

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// Returns true for a plan, and for the plan file of a sweep.
bool is_plan(const fs::path& file) {
  constexpr uintmax_t most_bytes = 1'000'000;
  std::error_code error;
  if (file.extension() != ".json" || fs::file_size(file, error) > most_bytes || error) return false;
  try {
    const std::optional<Json> json = try_parse_json(read_file(file));
    if (!json || !json->is_object()) return false;
    const bool is_of_sweep = json->contains("plan") && json->contains("shard") && json->contains("data");
    return is_of_sweep ||
           (json->contains("sources") && (json->contains("estimators") || json->contains("procedure")));
  } catch (const Error&) {
    return false;
  }
}

/// Returns true for folders that Sextant writes: results, also in shards, comparisons, reports,
/// correspondence caches.
bool is_folder_of_ours(const fs::path& folder) {
  for (const char* name :
       {"records.jsonl", "summary.bin", "journal.jsonl", "unfinished.jsonl", "comparison.json"}) {
    if (is_there(folder / name)) return true;
  }
  if (is_there(folder / "report.html") && is_there(folder / "report.md")) return true;
  for (const char* of_sweep : {"plan.json", "slurm/plan.json"}) {
    if (is_there(folder / of_sweep) && is_plan(folder / of_sweep)) return true;
  }
  const auto any_in = [](const fs::path& there, const auto& is_ours) {
    std::error_code error;
    return std::ranges::any_of(fs::directory_iterator(there, error), is_ours);
  };
  return any_in(folder,
                [](const fs::directory_entry& entry) { return entry.path().extension() == ".pack"; }) ||
         any_in(folder / "shards",
                [](const fs::directory_entry& shard) { return is_there(shard.path() / "plan.json"); });
}

bool is_passed_over(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  if (name.starts_with('.') || name == "__pycache__") return true;
  std::error_code ignored;
  return entry.is_directory(ignored) && is_folder_of_ours(entry.path());
}

/// Returns the entries ordered by name; empty if the folder cannot be read.
std::vector<fs::directory_entry> entries_of(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::directory_entry> entries;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!is_passed_over(entry)) entries.push_back(entry);
  }
  std::ranges::sort(entries);
  return entries;
}

bool is_file(const fs::directory_entry& entry) {
  std::error_code ignored;
  return entry.is_regular_file(ignored);
}

bool is_own_folder(const fs::directory_entry& entry) {
  std::error_code ignored;
  return entry.is_directory(ignored) && !entry.is_symlink(ignored);
}

bool has_wildcard(const std::string& text) { return text.find_first_of("*?") != std::string::npos; }

/// Adds the files below `folder` that match the rest of a pattern, from component `at` on.
void match(const fs::path& folder, const std::vector<std::string>& parts, size_t at,
           std::set<fs::path>& found) {
  const std::string& part = parts[at];
  const bool is_last = at + 1 == parts.size();
  if (part.empty() || part == "." || part == ".." || !has_wildcard(part)) {
    const fs::path there = part.empty() ? folder : folder / part;
    std::error_code ignored;
    if (!is_last)
      match(there, parts, at + 1, found);
    else if (fs::is_regular_file(there, ignored))
      found.insert(there.lexically_normal());
    return;
  }
  if (part == "**" && !is_last) match(folder, parts, at + 1, found);
  for (const fs::directory_entry& entry : entries_of(folder)) {
    const std::string name = entry.path().filename().string();
    if (part == "**") {
      if (is_own_folder(entry)) match(entry.path(), parts, at, found);
      if (is_last && is_file(entry) && !is_plan(entry.path())) found.insert(entry.path().lexically_normal());
    } else if (::fnmatch(part.c_str(), name.c_str(), 0) == 0) {
      if (!is_last)
        match(entry.path(), parts, at + 1, found);
      else if (is_file(entry) && !is_plan(entry.path()))
        found.insert(entry.path().lexically_normal());
    }
  }
}

// ---- the default pattern

bool is_output_of_this_process(const fs::path& file) {
  struct stat of_file {};
  if (::stat(file.c_str(), &of_file) != 0) return false;
  for (const int stream : {1, 2}) {
    struct stat of_stream {};
    if (::fstat(stream, &of_stream) == 0 && of_stream.st_dev == of_file.st_dev &&
        of_stream.st_ino == of_file.st_ino)
      return true;
  }
  return false;
}

class FilesBeside {
 public:
  explicit FilesBeside(fs::path folder) : folder_(std::move(folder)) {}

  Dependencies find() {
    if (!add(folder_, /*below=*/true)) {
      found_ = {};
      found_.not_seen.push_back(
          fmt::format("folders beside it: more than {} files; name those that matter with \"depends\"",
                      most_files_beside));
      add(folder_, /*below=*/false);
    }
    return std::move(found_);
  }

 private:
  /// Returns false if there are too many files; without subfolders the number is not limited.
  bool add(const fs::path& folder, bool below) {
    for (const fs::directory_entry& entry : entries_of(folder)) {
      if (below && is_own_folder(entry) && !add(entry.path(), below)) return false;
      if (!is_file(entry) || is_noise(entry.path()) || is_plan(entry.path()) ||
          is_output_of_this_process(entry.path()))
        continue;
      std::error_code error;
      const uintmax_t size = entry.file_size(error);
      if (!error && size > most_bytes_beside) {
        found_.not_seen.push_back(fmt::format("{}: larger than {} MB; name it with \"depends\" if it matters",
                                              entry.path().lexically_relative(folder_).generic_string(),
                                              most_bytes_beside / 1'000'000));
        continue;
      }
      found_.files.insert(entry.path().lexically_normal());
      if (below && found_.files.size() > most_files_beside) return false;
    }
    return true;
  }

  static bool is_noise(const fs::path& file) {
    const std::string name = file.filename().string();
    return std::ranges::any_of(std::array{".log", ".tmp", ".pyc", "~"},
                               [&](const char* end) { return name.ends_with(end); });
  }

  fs::path folder_;
  Dependencies found_;
};

}  // namespace

Dependencies find_dependencies(const FilePatterns& patterns, const fs::path& folder) {
  if (patterns == FilePatterns{"**"}) return FilesBeside(folder).find();
  Dependencies found;
  for (const std::string& pattern : patterns) {
    const bool is_absolute = pattern.starts_with('/');
    std::set<fs::path> files;
    match(is_absolute ? fs::path("/") : folder, split(pattern, '/'), 0, files);
    if (files.empty()) fail("depends: '{}' matches no file in {}", pattern, folder.string());
    found.files.merge(files);
  }
  return found;
}

}  // namespace sextant
