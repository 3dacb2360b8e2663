#include "sextant/eval/report/words.h"

#include <algorithm>
#include <cctype>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/base/text.h"
#include "sextant/metrics/definitions.h"

namespace sextant {

std::span<const EmbeddedFile> word_files();

namespace {

/// Reads the terms of the field and of this program, and the statuses, from words.json.
std::vector<Word> written_words() {
  std::vector<Word> words;
  for (const Json& entry : parse_json(word_files().front().text, "words.json")) {
    words.push_back({entry.at("word"), entry.at("kind"), entry.at("meaning"),
                     entry.value("others", std::vector<std::string>())});
  }
  return words;
}

/// Replaces "[text](address)" by the text.
std::string without_links(std::string text) {
  for (size_t close = text.find("]("); close != std::string::npos; close = text.find("](", close)) {
    const size_t open = text.rfind('[', close), end = text.find(')', close);
    if (open == std::string::npos || end == std::string::npos) break;
    text.erase(close, end + 1 - close).erase(open, 1);
    --close;
  }
  return text;
}

std::vector<Word> made() {
  std::vector<Word> words = written_words();
  for (const MetricDefinition& m : metric_definitions()) {
    std::vector<std::string> others = {m.name, m.symbol};
    const std::string end =
        m.name.substr(m.stem().size());  // "_m"; for a number without unit, a part of its name
    if (end == "_m" || end == "_deg" || end == "_kmh" || end == "_px") others.push_back(m.stem());
    words.push_back({fmt::format("{}.{}", to_string(m.map), m.name), "number",
                     fmt::format("{} [{}], {}: {}", m.symbol, m.unit,
                                 m.body == "both" ? "every body" : m.body, without_links(m.definition)),
                     std::move(others)});
  }
  for (const MetricPreset& p : metric_presets())
    words.push_back(
        {p.name, "preset",
         fmt::format("{}. Objects: {}, {}, {} against {}; {}", p.description, p.object_Et_key,
                     p.object_ER_key, p.velocity_key, p.velocity_truth_key, to_string(p.aggregate))});
  return words;
}

/// Normalises a term: "split_nees" and "Split NEES" become "splitnees".
std::string plain(std::string_view word) {
  std::string text;
  for (const char c : word) {
    if (c != '_' && c != '-' && c != ' ')
      text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return text;
}

/// Returns the three terms one of whose names has the smallest edit distance to `wanted`.
std::vector<std::string> nearest(const std::string& wanted) {
  std::vector<std::pair<int, std::string>> near;
  for (const Word& word : all_words()) {
    int distance = edit_distance(wanted, plain(word.word));
    for (const std::string& other : word.others)
      distance = std::min(distance, edit_distance(wanted, plain(other)));
    near.emplace_back(distance, word.word);
  }
  std::ranges::stable_sort(near, {}, &std::pair<int, std::string>::first);
  near.resize(std::min<size_t>(near.size(), 3));
  std::vector<std::string> names;
  for (const auto& [distance, name] : near) names.push_back(name);
  return names;
}

}  // namespace

std::span<const Word> all_words() {
  static const std::vector<Word> words = made();
  return words;
}

std::vector<const Word*> explain(std::string_view asked) {
  const std::string wanted = plain(asked);
  std::vector<const Word*> found;
  const auto is_asked = [&](const std::string& name) { return plain(name) == wanted; };
  for (const Word& word : all_words()) {
    if (is_asked(word.word) || std::ranges::any_of(word.others, is_asked)) found.push_back(&word);
  }
  if (found.empty())
    fail("'{}' is an unknown term; similar terms: {}. `sextant explain` lists all terms", one_line(asked),
         fmt::join(nearest(wanted), ", "));
  return found;
}

}  // namespace sextant
