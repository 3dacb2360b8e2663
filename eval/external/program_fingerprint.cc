#include "sextant/eval/external/program_fingerprint.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <optional>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/eval/external/dependencies.h"

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

/// Returns the words of the first line "#! ..." of a file; nullopt if there is none.
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

class ProgramFingerprint {
 public:
  ProgramFingerprint(const ExternalConfig& config, const fs::path& file)
      : config_(config), file_(file), folder_(file.parent_path()) {}

  Fingerprint make() {
    found_.parts["configuration"] = sha256(json_line(write_options(config_)));
    add_command();
    if (!config_.settings.empty()) add_file(config_.settings, folder_ / config_.settings);
    Dependencies beside = find_dependencies(config_.depends, folder_);
    for (const fs::path& file : beside.files) {
      if (file != file_) add_file(file.lexically_relative(folder_).generic_string(), file);
    }
    found_.not_seen.insert(found_.not_seen.end(), beside.not_seen.begin(), beside.not_seen.end());
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
    } else if (fs::is_directory(file, ignored) && !lies_in_folder(file)) {
      found_.not_seen.push_back(
          fmt::format("{}: a folder; name the files in it that matter with \"depends\"", name));
    }
  }

  bool lies_in_folder(const fs::path& path) const {
    const fs::path relative = path.lexically_relative(folder_);
    return !relative.empty() && *relative.begin() != "..";
  }

  void add_file(const std::string& name, const fs::path& file) {
    const fs::path path = fs::absolute(file).lexically_normal();
    found_.parts[lies_in_folder(path) ? path.lexically_relative(folder_).generic_string() : name] =
        file_sha256(path);
  }

  const ExternalConfig& config_;
  const fs::path file_, folder_;
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
