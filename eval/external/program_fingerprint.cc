#include "sextant/eval/external/program_fingerprint.h"

#include <fnmatch.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/base/text.h"

namespace sextant {

namespace {

bool is_regular(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

/// Finds a program like a shell does.
std::optional<fs::path> in_search_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  for (const std::string& folder : split(path == nullptr ? "/bin:/usr/bin" : path, ':')) {
    const fs::path file = fs::path(folder.empty() ? "." : folder) / program;
    if (is_regular(file) && ::access(file.c_str(), X_OK) == 0) return file;
  }
  return std::nullopt;
}

/// Returns the words of the first line "#! ..." of a file; empty if there is none.
std::vector<std::string> interpreter_words(const fs::path& file) {
  constexpr std::streamsize most_bytes = 256;
  std::string line(most_bytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(line.data(), most_bytes);
  line.resize(static_cast<size_t>(in.gcount()));
  line = line.substr(0, line.find('\n'));
  if (!line.starts_with("#!")) return {};
  std::vector<std::string> words;
  for (const std::string& word : split(std::string(trimmed(line.substr(2))), ' ')) {
    if (!word.empty()) words.push_back(word);
  }
  return words;
}

struct Dependencies {
  std::set<fs::path> files;  ///< absolute, without "." and ".."
  std::vector<std::string> not_seen;
};

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// Returns the object in a small JSON file; an empty object for any other file.
Json small_object(const fs::path& file) {
  constexpr uintmax_t most_bytes = 1'000'000;
  std::error_code error;
  if (file.extension() != ".json" || fs::file_size(file, error) > most_bytes || error) return Json::object();
  try {
    const std::optional<Json> json = try_parse_json(read_file(file));
    return json && json->is_object() ? *json : Json::object();
  } catch (const Error&) {
    return Json::object();
  }
}

/// Returns true for a plan, and for the plan file of a sweep.
bool is_plan(const fs::path& file) {
  const Json json = small_object(file);
  const bool is_of_sweep = json.contains("plan") && json.contains("shard") && json.contains("data");
  return is_of_sweep ||
         (json.contains("sources") && (json.contains("estimators") || json.contains("procedure")));
}

/// Returns true for a page that Sextant wrote (eval/report/html).
bool is_page(const fs::path& file) {
  constexpr size_t head_bytes = 512;
  if (file.extension() != ".html") return false;
  std::string head(head_bytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), head_bytes);
  return head.find("<meta name=\"generator\" content=\"Sextant\">") != std::string::npos;
}

bool is_file_of_ours(const fs::path& file) { return is_plan(file) || is_page(file); }

/// Returns true for folders that Sextant writes: results, also in shards, comparisons, reports, estimators of
/// a benchmark, correspondence caches.
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
  const bool is_of_benchmark =
      small_object(folder / "card.json").contains("sextant_card") ||
      (is_there(folder / "left_out.json") &&
       any_in(folder, [](const fs::directory_entry& sweep) { return is_plan(sweep.path() / "plan.json"); }));
  return is_of_benchmark ||
         any_in(folder,
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

bool is_own_folder(const fs::directory_entry& entry) {
  std::error_code ignored;
  return entry.is_directory(ignored) && !entry.is_symlink(ignored);
}

/// Adds the files below `folder` that match the rest of a pattern, from component `at` on.
void match(const fs::path& folder, const std::vector<std::string>& parts, size_t at,
           std::set<fs::path>& found) {
  const std::string& part = parts[at];
  const bool is_last = at + 1 == parts.size();
  if (part.find_first_of("*?") == std::string::npos) {
    const fs::path there = part.empty() ? folder : folder / part;
    if (!is_last)
      match(there, parts, at + 1, found);
    else if (is_regular(there))
      found.insert(there.lexically_normal());
    return;
  }
  if (part == "**" && !is_last) match(folder, parts, at + 1, found);
  for (const fs::directory_entry& entry : entries_of(folder)) {
    const fs::path& path = entry.path();
    if (part == "**" && is_own_folder(entry)) match(path, parts, at, found);
    const bool fits = part == "**" ? is_last : ::fnmatch(part.c_str(), path.filename().c_str(), 0) == 0;
    if (fits && !is_last) match(path, parts, at + 1, found);
    if (fits && is_last && is_regular(path) && !is_file_of_ours(path)) found.insert(path.lexically_normal());
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
      if (!is_regular(entry.path()) || is_noise(entry.path()) || is_file_of_ours(entry.path()) ||
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

/// Finds the files that match the patterns of "depends", which are relative to `folder`. Throws Error if a
/// pattern other than the default matches no file.
Dependencies find_dependencies(const FilePatterns& patterns, const fs::path& folder) {
  if (patterns == FilePatterns{"**"}) return FilesBeside(folder).find();
  Dependencies found;
  for (const std::string& pattern : patterns) {
    const bool is_absolute = pattern.starts_with('/');
    std::set<fs::path> files;
    match(is_absolute ? fs::path("/") : folder, split(pattern, '/'), 0, files);
    if (files.empty())
      fail("depends: '{}' matches no file{}", pattern, is_absolute ? "" : " in " + folder.string());
    found.files.merge(files);
  }
  return found;
}

class ProgramFingerprint {
 public:
  ProgramFingerprint(const ExternalConfig& config, const fs::path& file)
      : config_(config), file_(file), folder_(file.parent_path()) {}

  Fingerprint make() {
    found_.parts["configuration"] = sha256(json_line(write_options(config_)));
    depends_ = find_dependencies(config_.depends, folder_);
    add_command();
    if (!config_.settings.empty()) add_file(config_.settings, folder_ / config_.settings);
    for (const fs::path& file : depends_.files) {
      if (file != file_) add_file(file.lexically_relative(folder_).generic_string(), file);
    }
    found_.not_seen.insert(found_.not_seen.end(), depends_.not_seen.begin(), depends_.not_seen.end());
    return std::move(found_);
  }

 private:
  static constexpr char of_the_case = '\1';  ///< replaces what differs between cases

  static bool is_of_the_case(const std::string& word) { return word.find(of_the_case) != std::string::npos; }

  void add_command() {
    Placeholders as_written, known;
    for (const auto& [name, ignored] : any_placeholders()) {
      as_written[name] = "{" + name + "}";
      known[name] = name == "config" ? folder_.string() : std::string(1, of_the_case);
    }
    const std::vector<std::string> names = words_of(config_.command, as_written),
                                   words = words_of(config_.command, known);
    const std::string where = fill_in(config_.working_directory, known);
    const bool is_known_folder = !is_of_the_case(where);
    const fs::path working_folder = fs::absolute(where).lexically_normal();
    for (size_t i = 0; i < words.size(); ++i) {
      if (is_of_the_case(words[i])) continue;
      const bool is_searched = i == 0 && words[i].find('/') == std::string::npos;
      if (is_searched) {
        if (const auto program = in_search_path(words[i])) add_program(names[i], *program);
        continue;
      }
      const size_t equals = i == 0 ? std::string::npos : words[i].find('=');
      const std::string value = equals == std::string::npos ? words[i] : words[i].substr(equals + 1);
      if (value.empty() || (!fs::path(value).is_absolute() && !is_known_folder)) continue;
      const fs::path file = (working_folder / value).lexically_normal();
      if (i == 0)
        add_program(names[i], file);
      else
        add_argument(names[i], file);
    }
  }

  void add_program(const std::string& name, const fs::path& file) {
    if (!is_regular(file)) return;
    add_file("program " + name, file);
    std::vector<std::string> words = interpreter_words(file);
    if (words.empty()) return;
    size_t at = 0;
    if (fs::path(words[0]).filename() == "env") {
      ++at;
      while (at < words.size() && (words[at].starts_with('-') || words[at].find('=') != std::string::npos))
        ++at;
    }
    if (at == words.size()) return;
    const bool is_path = words[at].find('/') != std::string::npos;
    const std::optional<fs::path> interpreter = is_path ? fs::path(words[at]) : in_search_path(words[at]);
    if (interpreter && is_regular(*interpreter)) add_file("interpreter " + words[at], *interpreter);
  }

  void add_argument(const std::string& name, const fs::path& file) {
    std::error_code ignored;
    if (is_regular(file)) {
      add_file(name, file);
    } else if (fs::is_directory(file, ignored) && !fs::is_empty(file, ignored) && !holds_dependency(file)) {
      found_.not_seen.push_back(
          fmt::format("{}: a folder; name the files in it that matter with \"depends\"", name));
    }
  }

  static bool lies_in(const fs::path& folder, const fs::path& path) {
    const fs::path relative = path.lexically_relative(folder);
    return !relative.empty() && *relative.begin() != "..";
  }

  bool holds_dependency(const fs::path& folder) const {
    return std::ranges::any_of(depends_.files, [&](const fs::path& file) { return lies_in(folder, file); });
  }

  void add_file(const std::string& name, const fs::path& file) {
    const fs::path path = fs::absolute(file).lexically_normal();
    found_.parts[lies_in(folder_, path) ? path.lexically_relative(folder_).generic_string() : name] =
        file_sha256(path);
  }

  const ExternalConfig& config_;
  const fs::path file_, folder_;
  Dependencies depends_;
  Fingerprint found_;
};

}  // namespace

Fingerprint program_fingerprint(const ExternalConfig& config, const fs::path& file) {
  try {
    return ProgramFingerprint(config, file).make();
  } catch (const Error& error) {
    fail("{}: {}", file.string(), error.what());
  }
}

}  // namespace sextant
