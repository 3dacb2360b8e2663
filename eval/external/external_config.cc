#include "sextant/eval/external/external_config.h"

#include <algorithm>
#include <cctype>

#include "sextant/base/error.h"
#include "sextant/base/json.h"
#include "sextant/base/text.h"
#include "sextant/datasets/layout.h"
#include "sextant/eval/logs/trajectory_files.h"

namespace sextant {

const char* read_value(const Json& value, FilePatterns& field) {
  const auto is_pattern = [](const Json& entry) {
    return entry.is_string() && !entry.get<std::string>().empty();
  };
  if (!value.is_array() || !std::ranges::all_of(value, is_pattern)) return "a list of names of files";
  field.assign(value.begin(), value.end());
  return nullptr;
}

const Placeholders& any_placeholders() {
  static const Placeholders any = [] {
    Placeholders p;
    for (const char* name : {"input", "output", "config", "sequence", "first", "last", "n", "calibration",
                             "settings", "fx", "fy", "cx", "cy", "bf", "rate", "width", "height", "seed"})
      p[name] = "x";
    return p;
  }();
  return any;
}

void ExternalCamera::check() const {
  std::vector<std::string> names = {"auto"};
  for (const TrajectoryFormat& known : trajectory_formats()) names.push_back(known.name);
  if (std::ranges::find(names, format) == names.end())
    fail("option format: unknown format '{}': {}", format, suggest(format, names));
}

void ExternalObjects::check() const {
  check_option(std::ranges::count(files, '*') == 1, "files", files, "a name with one * for the id");
}

void ExternalConfig::check() const {
  check_option(!command.empty(), "command", "''", "given: the program and its arguments");
  check_option(time_limit_s > 0, "time_limit_s", time_limit_s, "> 0");
  check_option(first_frame >= -1, "first_frame", first_frame, "-1 or a frame number");
  find_layout(layout);
  Placeholders known = any_placeholders();
  if (settings.empty()) known.erase("settings");
  check_option(!words_of(command, known).empty(), "command", command, "a program");
  fill_in(working_directory, known);
  const auto is_plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-';
  };
  for (const auto& [result, ignored] : results)
    check_option(!result.empty() && std::ranges::all_of(result, is_plain), "results", result,
                 "names of letters, digits, - and _");
  for (const std::string& setting : words_of(environment, known)) {
    check_option(setting.find('=') != std::string::npos && setting[0] != '=', "environment", setting,
                 "of the form NAME=VALUE");
  }
}

ExternalConfig read_external_config(const std::string& path, const Json& overrides) {
  Json json = overrides;
  if (!json.is_object() || json.erase(recorded_options) == 0) {
    json = read_json(path);
    if (!json.is_object()) fail("{}: expected an object with \"command\"", path);
    json.merge_patch(overrides);
  }
  ExternalConfig config;
  try {
    read_options(json, config);
  } catch (const Error& error) {
    fail("{}: {}", path, error.what());
  }
  if (config.name.empty()) config.name = fs::path(path).stem().string();
  return config;
}

std::string fill_in(const std::string& text, const Placeholders& values) {
  const auto of_name = [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; };
  std::string out;
  size_t at = 0;
  for (size_t open = text.find('{'); open != std::string::npos; open = text.find('{', open + 1)) {
    const auto* const begin = text.data() + open + 1;
    const auto* const end = std::find_if_not(begin, text.data() + text.size(), of_name);
    if (end == begin || end == text.data() + text.size() || *end != '}') continue;
    const std::string name(begin, end);
    const auto value = values.find(name);
    if (value == values.end()) {
      std::vector<std::string> names;
      for (const auto& [known, ignored] : values) names.push_back(known);
      const size_t line = text.rfind('\n', open) + 1;  // npos + 1 = 0
      fail("'{}': unknown placeholder {{{}}}: {}", text.substr(line, text.find('\n', open) - line), name,
           suggest(name, names));
    }
    out.append(text, at, open - at).append(value->second);
    at = open + name.size() + 2;
    open = at - 1;
  }
  return out.append(text, at, std::string::npos);
}

std::vector<std::string> words_of(const std::string& text, const Placeholders& values) {
  std::vector<std::string> words;
  std::string word;
  bool in_word = false;
  char quote = '\0';
  for (const char c : text) {
    if (quote != '\0' ? c == quote : c == '\'' || c == '"') {
      quote = quote != '\0' ? '\0' : c;
      in_word = true;
    } else if (quote == '\0' && (c == ' ' || c == '\t' || c == '\n')) {
      if (in_word) words.push_back(fill_in(word, values));
      word.clear();
      in_word = false;
    } else {
      word += c;
      in_word = true;
    }
  }
  if (quote != '\0') fail("'{}': the quote {} is not closed", text, quote);
  if (in_word) words.push_back(fill_in(word, values));
  return words;
}

}  // namespace sextant
