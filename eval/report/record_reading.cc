#include "sextant/eval/report/record_reading.h"

#include <algorithm>
#include <map>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/noise/noise.h"

namespace sextant {

std::vector<double> numbers_of(const RecordRefs& records, NumberMap map, const std::string& key) {
  std::vector<double> numbers;
  for (const Record* record : records) {
    if (const auto number = find_number(record->numbers(map), key)) numbers.push_back(*number);
  }
  return numbers;
}

std::map<SeedFrame, double> errors_by_case(const RecordRefs& records, const std::string& key) {
  std::map<SeedFrame, double> errors;
  for (const Record* record : records) {
    if (const auto error = find_number(record->errors, key)) errors[{record->seed, record->frame}] = *error;
  }
  return errors;
}

std::string body_title(const std::string& body) {
  constexpr std::string_view object = "object:";
  return body == "ego" ? "camera" : "object " + body.substr(object.size());
}

Clusters::Clusters(const RecordRefs& records) {
  std::set<uint64_t> seeds;
  for (const Record* record : records) seeds.insert(record->seed);
  n_seeds_ = static_cast<int>(seeds.size());
}

uint64_t Clusters::of(const Record& record) const {
  return are_frames() ? static_cast<uint64_t>(record.frame) : record.seed;
}

Column metric_column(const MetricDefinition& metric) {
  return {.key = metric.name, .title = metric.heading(), .decimals = metric.digits};
}

std::vector<RecordSet> record_sets(const std::vector<Record>& records) {
  std::map<std::pair<std::string, std::string>, std::map<int, BodyRecords>> sets;
  for (const Record& record : records) {
    if (!has_truth(record) || record.status != Status::ok) continue;
    BodyRecords& body = sets[{record.dataset, record.sequence}][body_order(record.body)];
    body.title = body_title(record.body);
    body.records.push_back(&record);
  }
  std::vector<RecordSet> out;
  for (auto& [key, bodies] : sets) {
    RecordSet set{key.first + "_" + key.second, key.first + " " + key.second, {}};
    for (auto& [order, body] : bodies) set.bodies.push_back(std::move(body));
    out.push_back(std::move(set));
  }
  return out;
}

std::vector<std::string> estimators_of(const RecordSet& set) {
  std::vector<std::string> names;
  for (const BodyRecords& body : set.bodies) {
    for (const Record* record : body.records) add_distinct(record->estimator, names);
  }
  return names;
}

std::vector<const Record*> of_estimator(const std::vector<const Record*>& records,
                                        const std::string& estimator) {
  std::vector<const Record*> out;
  std::ranges::copy_if(records, std::back_inserter(out),
                       [&](const Record* record) { return record->estimator == estimator; });
  return out;
}

Leaves leaves_of(const Json& options) {
  Leaves leaves;
  for_each_leaf(options, false, [&](const std::string& key, const Json& value) { leaves[key] = value; });
  return leaves;
}

std::string noise_name(const Json& options) {
  if (options.contains("profile")) return "";  // would be read from a file
  try {
    return Noise(options).name();
  } catch (const Error&) {
    return "";
  }
}

namespace {

constexpr const char* one_sample =
    "their records would count as one sample; compare the folders (sextant compare), or report them apart";

/// Returns the label of a plan for an estimator of records: LABEL, or LABEL.NAME of a program with several
/// results. `labels` is a map by label.
template <typename Map>
typename Map::const_iterator find_label(const Map& labels, const std::string& estimator) {
  auto found = labels.find(estimator);
  for (size_t dot = estimator.rfind('.'); found == labels.end() && dot != std::string::npos && dot > 0;
       dot = estimator.rfind('.', dot - 1))
    found = labels.find(estimator.substr(0, dot));
  return found;
}

}  // namespace

void SameLabels::begin(const Json& run, const std::filesystem::path& folder) {
  const std::string file = (folder / "run.json").string();
  Folder& now = folders_.emplace_back(Folder{.file = file});
  last_.reset();
  now.versions = fingerprints_in(run, file);
  now.data = &*data_.insert(data_of(run)).first;
  const Json configuration = json_object(run, "configuration", file);
  const Json options = json_object(configuration, "options", file);
  const auto add_estimator = [&](const std::string& label, const Json& own, const Json& pipeline) {
    now.of_estimator[label] = leaves_of({{"estimator", own},
                                         {"pipeline", pipeline},
                                         {"extraction", json_object(options, "extraction", file)}});
  };
  const auto add_noise = [&](double level, const Json& noise) {
    const std::string name = noise.is_object() ? noise_name(noise) : "";
    if (!name.empty()) now.of_noise[{name, level}] = leaves_of(noise);
  };
  const Json pipeline = json_object(options, "pipeline", file);
  if (configuration.contains("estimator") && configuration["estimator"].is_string()) {  // of `sextant run`
    // The records of an external program have the label of its fingerprint.
    add_estimator(
        now.versions.empty() ? configuration["estimator"].get<std::string>() : now.versions.begin()->first,
        json_object(options, "estimator", file), pipeline);
  }
  for (const Json& entry : json_list(configuration, "estimators", file)) {
    if (!entry.is_object() || !entry.contains("label") || !entry["label"].is_string()) continue;
    add_estimator(entry["label"], json_object(entry, "options", file),
                  entry.contains("pipeline") ? json_object(entry, "pipeline", file) : pipeline);
  }
  for (const Json& source : json_list(configuration, "sources", file)) {
    if (source.is_string()) {  // of `sextant run`
      now.of_source[without_folder(source.get<std::string>())] =
          json_line(json_object(options, "source", file));
    } else if (source.is_object()) {
      now.of_source[without_folder(json_member<std::string>(source, "source", file, ""))] =
          json_line(json_object(source, "options", file));
    }
  }
  const Json noise = configuration.value("noise", Json());
  if (noise.is_object()) add_noise(json_member<double>(configuration, "level", file, 0), noise);
  if (!noise.is_array()) return;
  for (const Json& entry : noise) {
    if (entry.is_object())
      add_noise(json_member<double>(entry, "level", file, 0), json_object(entry, "noise", file));
  }
}

template <typename Key>
void SameLabels::compare(const Folder& first, const Folder& now, const char* what, const std::string& label,
                         const Key& key, std::map<Key, Leaves> Folder::*options) {
  const auto before = (first.*options).find(key), after = (now.*options).find(key);
  if (before == (first.*options).end() || after == (now.*options).end()) return;
  for (const auto& [name, value] : after->second) {
    const auto other = before->second.find(name);
    if (other == before->second.end() || other->second == value) continue;
    fail(
        "{}: {} '{}' has {} = {}, but {} in {}: their records would count as one sample; report the folders "
        "apart, or give the estimators of a plan different labels",
        now.file, what, label, name, json_excerpt(value), json_excerpt(other->second), first.file);
  }
}

void SameLabels::compare_origins(const Folder& first, const Folder& now, const std::string& estimator) {
  const auto before = find_label(first.versions, estimator), after = find_label(now.versions, estimator);
  if (before != first.versions.end() && after != now.versions.end() && before->second != after->second) {
    std::vector<Fingerprint> versions = before->second;
    for (const Fingerprint& version : after->second) add_distinct(version, versions);
    fail("{}: another version of '{}' ran than in {} ({}): {}", now.file, after->first, first.file,
         versions.size() > 1 ? difference(versions[0], versions[1]) : "", one_sample);
  }
  for (const auto& [source, options] : now.of_source) {
    const auto other = first.of_source.find(source);
    if (other == first.of_source.end() || other->second == options) continue;
    fail("{}: source '{}' has the options {}, but {} in {}: {}", now.file, source, options, other->second,
         first.file, one_sample);
  }
  if (now.data == first.data) return;
  if (const std::string changed = changed_data(*first.data, *now.data); !changed.empty())
    fail("{}: has other data than {} ({}): {}", now.file, first.file, changed, one_sample);
}

template <typename Key>
const SameLabels::Folder* SameLabels::earlier(const Key& key, std::map<Key, Holders>& holders) const {
  const size_t at = folders_.size() - 1;
  const auto [of_key, is_new] = holders.try_emplace(key, Holders{at, at});
  if (is_new || of_key->second.last == at) return nullptr;
  of_key->second.last = at;
  return &folders_[of_key->second.first];
}

void SameLabels::check(Interned estimator, Interned dataset, Interned sequence, Interned noise,
                       double level) {
  const Row row{estimator, dataset, sequence, noise, level};
  if (row == last_) return;
  last_ = row;
  const Folder& now = folders_.back();
  if (const Folder* first = earlier(row, of_row_)) {
    const auto label = find_label(now.of_estimator, estimator.str());
    if (label != now.of_estimator.end())
      compare(*first, now, "estimator", label->first, label->first, &Folder::of_estimator);
    compare(*first, now, "noise", noise.str(), std::pair(noise.str(), level), &Folder::of_noise);
  }
  if (const Folder* first = earlier(Curve{estimator, dataset, sequence}, of_curve_))
    compare_origins(*first, now, estimator.str());
}

void SextantVersions::add(const Json& run, const std::filesystem::path& folder) {
  const std::string file = (folder / "run.json").string();
  Json programs = json_list(run, "programs", file);
  if (programs.empty() && run.contains("version")) programs.push_back(run);  // of `sextant run`
  for (const Json& program : programs) {
    for (const char* key : {"version", "git_commit"}) json_member<std::string>(program, key, file, "");
    folder_of_.emplace(program_text(Json::array({program})), folder.string());
  }
}

std::vector<std::string> SextantVersions::warnings() const {
  if (folder_of_.size() < 2) return {};
  std::string list;
  for (const auto& [version, folder] : folder_of_)
    list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", version, folder);
  return {fmt::format(
      "the records come from different versions of Sextant, which may explain differences between them: {}",
      list)};
}

void GivenShards::add(const Json& run) {
  if (const auto shard = shard_of(run))
    given_[{run.value("configuration", Json()).dump(), shard->second}].insert(shard->first);
}

std::vector<std::string> GivenShards::warnings() const {
  std::vector<std::string> sentences;
  for (const auto& [sweep, given] : given_) {
    if (given.size() >= sweep.second) continue;
    std::string list;
    for (const size_t i : given) list += (list.empty() ? "" : ", ") + std::to_string(i);
    sentences.push_back(fmt::format(
        "{} {} of {} of a sweep, and not the others: seeds and levels that the others hold are "
        "missing, so estimators may not have the same cases",
        given.size() == 1 ? "the folders hold shard" : "the folders hold shards", list, sweep.second));
  }
  return sentences;
}

}  // namespace sextant
