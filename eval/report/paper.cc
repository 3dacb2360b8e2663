#include "sextant/eval/report/paper.h"

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"

namespace sextant {

std::span<const EmbeddedFile> published_files();

namespace {

const Json& member(const Json& object, const std::string& key) {
  const auto at = object.find(key);
  if (at == object.end()) throw InternalError("zhang2020_data.json: no '" + key + "'");
  return *at;
}

bool agrees(const std::string& pattern, const std::string& sequence) {
  if (!pattern.ends_with('*')) return pattern == sequence;
  return sequence.starts_with(pattern.substr(0, pattern.size() - 1));
}

}  // namespace

Json published_json(const std::string& name) {
  return parse_json(find_entry(published_files(), name, "file").text, "results/published/" + name);
}

bool RecordFilter::matches(const Record& record) const {
  return record.dataset == dataset && record.sequence == sequence && record.frame >= first_frame &&
         record.frame <= last_frame;
}

Paper::Paper(const Json& values, const Json& data)
    : published(values),
      flow_error_set(data.at("flow_error_set").get<std::string>()),
      baseline(data.at("baseline").get<std::string>()),
      method(data.at("method").get<std::string>()),
      code_procedure(data.at("code_procedure").get<std::string>()),
      recorded_dataset(data.at("recorded").at("dataset").get<std::string>()),
      recorded_title(data.at("recorded").at("title").get<std::string>()),
      recorded_rate_hz(data.at("recorded").at("rate_hz").get<double>()),
      stated(data.at("fig_4")),
      data_(data) {
  const Json& system = data.at("reference");
  reference = {system.at("name"), system.at("column"), system.at("title"), "", 0};
  for (const Json& set : data.at("sets")) {
    RecordFilter filter{set.at("dataset"), set.at("sequence")};
    if (set.contains("frames")) {
      filter.first_frame = set.at("frames").at(0).get<int>();
      filter.last_frame = set.at("frames").at(1).get<int>();
    }
    sets.push_back({set.at("set"), filter});
  }
  for (const Json& e : data.at("estimators"))
    estimators.push_back({e.at("name"), e.at("column"), e.at("title"), e.at("colour"), e.at("point")});
  for (const Json& s : data.at("sequences")) {
    sequences_.push_back({s.at("paper"), s.at("dataset"), s.at("sequence")});
    if (s.contains("part_of"))
      parts_of_recorded.emplace_back(s.value("sequence", ""), s.value("part_of", ""));
  }
}

std::optional<std::string> Paper::column_of(const std::string& estimator) const {
  const auto known =
      std::ranges::find(estimators, estimator.substr(0, estimator.find(',')), &PaperEstimator::name);
  return known == estimators.end() || known->column.empty() ? std::nullopt : std::optional(known->column);
}

std::set<int> Paper::ids_of(const std::string& sequence, const std::string& objects) const {
  for (const Json& group : data_.at("objects")) {
    if (group.at("sequence") == sequence && group.at("objects") == objects)
      return group.at("ids").get<std::set<int>>();
  }
  return {};
}

std::string Paper::sequence_of(const std::string& dataset, const std::string& sequence) const {
  for (const NamedSequence& named : sequences_) {
    if (named.dataset == dataset && agrees(named.sequence, sequence)) return named.paper;
  }
  return "";
}

std::string Paper::recorded_sequence(const Record& record) const {
  for (const auto& [own, recorded] : parts_of_recorded) {
    if (record.sequence == own) return recorded;
  }
  return record.sequence;
}

TableText Paper::table(const std::string& number) const {
  const Json& entry = member(data_.at("tables"), number);
  return {entry.value("title", ""), entry.value("caption", ""), entry.value("data", ""),
          fetch(entry.value("fetch", ""))};
}

Statement Paper::statement(const std::string& claim) const {
  const Json& entry = member(data_.at("claims"), claim);
  return {entry.value("statement", ""), entry.value("place", ""), entry.value("brief", ""),
          fetch(entry.value("fetch", ""))};
}

std::string Paper::fetch(const std::string& data) const {
  return data.empty() ? "" : member(data_.at("fetch"), data).get<std::string>();
}

const Paper& paper() {
  static const Paper paper(published_json("zhang2020.json"), published_json("zhang2020_data.json"));
  return paper;
}

std::optional<double> published_number(const Json& table, const std::string& key) {
  const auto it = table.find(key);
  if (it == table.end()) fail("published values: key '{}' is missing in {}", key, json_excerpt(table));
  if (it->is_null()) return std::nullopt;
  return json_member<double>(table, key, "published values");
}

std::string data_title(const std::string& dataset, const std::string& sequence) {
  for (const Json& entry : paper().data("data_titles")) {
    if (entry.at("dataset") != dataset ||
        entry.value("sequence", "") != (entry.contains("sequence") ? sequence : ""))
      continue;
    const std::string title = entry.value("title", "");
    return fmt::format(fmt::runtime(title), sequence);
  }
  return dataset + " " + sequence;
}

std::string data_title(const RecordFilter& filter) {
  const std::string title = data_title(filter.dataset, filter.sequence);
  if (filter.last_frame == RecordFilter{}.last_frame) return title;
  return fmt::format("{}, frames {}-{}", title, filter.first_frame, filter.last_frame);
}

std::string measuring_line(const std::string& fetch) {
  return fetch.starts_with("scripts/") ? fetch + " && sextant reproduce --data ROOT --out DIR" : fetch;
}

}  // namespace sextant
