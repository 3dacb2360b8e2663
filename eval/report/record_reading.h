#pragma once

// Access to records that all tables share.

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

using RecordRefs = std::vector<const Record*>;

// ---- Cases of records in columns: a row is one seed and frame, for one estimator and body. Noise levels
// (noise_level.h) and the subjects of a comparison (eval/gate/subject_cases.h) add their numbers as
// further columns.

/// A seed of the noise and a frame; estimators are paired by it.
using SeedFrame = std::pair<uint64_t, int>;

struct CaseColumns {
  std::vector<uint64_t> seeds;
  std::vector<int> frames;

  size_t size() const { return seeds.size(); }
  SeedFrame case_of(size_t row) const { return {seeds[row], frames[row]}; }
  void add(uint64_t seed, int frame) {
    seeds.push_back(seed);
    frames.push_back(frame);
  }
  /// Returns the order of the rows by case; rows of the same case keep their order. nullopt if the rows are
  /// already in order.
  std::optional<std::vector<size_t>> sorting_order() const {
    std::vector<size_t> order(size());
    std::iota(order.begin(), order.end(), size_t{0});
    const auto case_at = [&](size_t row) { return case_of(row); };
    if (std::ranges::is_sorted(order, {}, case_at)) return std::nullopt;
    std::ranges::stable_sort(order, {}, case_at);
    return order;
  }
};

/// Puts a column into another order.
template <typename T>
void reorder(const std::vector<size_t>& order, std::vector<T>& values) {
  std::vector<T> ordered;
  ordered.reserve(values.size());
  for (const size_t i : order) ordered.push_back(values[i]);
  values = std::move(ordered);
}

/// Calls visit(row of first, row of second) for each case of two sorted tables, in order; a row is nullopt if
/// its table does not have the case.
template <typename Visit>
void for_each_case(const CaseColumns& first, const CaseColumns& second, const Visit& visit) {
  for (size_t a = 0, b = 0; a < first.size() || b < second.size();) {
    const bool only_first = b == second.size(), only_second = a == first.size();
    const bool in_first = only_first || (!only_second && first.case_of(a) <= second.case_of(b));
    const bool in_second = only_second || (!only_first && second.case_of(b) <= first.case_of(a));
    visit(in_first ? std::optional(a) : std::nullopt, in_second ? std::optional(b) : std::nullopt);
    a += in_first;
    b += in_second;
  }
}

// ---- Numbers of records.

/// Returns the value of a map under `key`; null if there is none.
template <typename Map>
const typename Map::mapped_type* find_in(const Map& map, const typename Map::key_type& key) {
  const auto it = map.find(key);
  return it == map.end() ? nullptr : &it->second;
}

/// Returns the keys that all of these maps have, in order: the cases in which they can be compared.
template <typename Map>
std::vector<typename Map::key_type> common_keys(const std::vector<const Map*>& maps) {
  std::vector<typename Map::key_type> keys;
  for (const auto& [key, value] : *maps.front()) {
    if (std::ranges::all_of(maps, [&key = key](const Map* map) { return map->contains(key); }))
      keys.push_back(key);
  }
  return keys;
}

/// Returns the values of one member, each once, in order of first appearance.
template <typename Item, typename Member>
std::vector<std::string> distinct(const std::vector<const Item*>& items, Member member) {
  std::vector<std::string> values;
  for (const Item* item : items) add_distinct(item->*member, values);
  return values;
}

/// Returns the number called `key`; empty if the record does not have it.
template <typename Map>
std::optional<double> find_number(const Map& numbers, const typename Map::key_type& key) {
  const double* number = find_in(numbers, key);
  return number == nullptr ? std::nullopt : std::optional(*number);
}

/// Returns the number called `key` of each record that has it.
std::vector<double> numbers_of(const RecordRefs& records, NumberMap map, const std::string& key);

/// Returns the error called `key` of each record that has it, by seed and frame.
std::map<SeedFrame, double> errors_by_case(const RecordRefs& records, const std::string& key);

/// Formats a body for readers: "camera", "object 3".
std::string body_title(const std::string& body);

/// Independent units of the bootstrap (stats/bootstrap.h): seeds, or frames if all records have the same
/// seed.
class Clusters {
 public:
  explicit Clusters(const RecordRefs& records);
  uint64_t of(const Record& record) const;
  bool are_frames() const { return n_seeds_ < 2; }
  int n_seeds() const { return n_seeds_; }

 private:
  int n_seeds_;
};

/// Column titled "E_t [m]", with the decimals of the list of metrics.
Column metric_column(const MetricDefinition& metric);

// ---- Records for figures: sets of frames, each with its bodies in order.

struct BodyRecords {
  std::string title;  ///< "camera", "Obj1"
  std::vector<const Record*> records;
};

struct RecordSet {
  std::string name;   ///< used in file names: "s18"
  std::string title;  ///< "scenario s18"
  std::vector<BodyRecords> bodies;
};

/// Groups estimated records with truth by data set and sequence; the camera first, objects by id. The results
/// point into `records`.
std::vector<RecordSet> record_sets(const std::vector<Record>& records);

/// Returns the estimators in order of first appearance.
std::vector<std::string> estimators_of(const RecordSet& set);

/// Selects the records of one estimator.
std::vector<const Record*> of_estimator(const std::vector<const Record*>& records,
                                        const std::string& estimator);

// ---- Checks of folders whose records are counted together in one report: the labels of records stand for
// the same options, programs and data; no shard of a sweep is missing; versions of Sextant are named.

/// Options by dotted key; a list is one value.
using Leaves = std::map<std::string, Json>;
Leaves leaves_of(const Json& options);

/// Returns the name in records of a noise with these options; "" if this version cannot read them.
std::string noise_name(const Json& options);

/// Refuses folders whose records would count as one sample although they differ in more than the seed: equal
/// names of an estimator or a noise stand for other options, another version of an external program ran, or a
/// source has other data or options. What only one folder records is ignored, because another version of the
/// program may not have it.
class SameLabels {
 public:
  /// Begins the next folder. `run`: content of its run.json.
  void begin(const Json& run, const std::filesystem::path& folder);
  /// Checks the labels of a record of the folder. Throws Error if an earlier folder holds records with the
  /// same labels that differ. Programs, data and source options are compared for equal estimator, data set
  /// and sequence, because a curve joins their noise levels.
  void check(Interned estimator, Interned dataset, Interned sequence, Interned noise, double level);

 private:
  using Curve = std::tuple<Interned, Interned, Interned>;
  using Row = std::tuple<Interned, Interned, Interned, Interned, double>;
  struct Folder {
    std::string file;
    std::map<std::string, Leaves> of_estimator;                 ///< by label
    std::map<std::pair<std::string, double>, Leaves> of_noise;  ///< by name and level
    Fingerprints versions;                                      ///< by label
    std::map<std::string, std::string> of_source;               ///< options, by source without its folder
    const SourceData* data = nullptr;
  };
  /// Folders with records of a row or curve, as indices.
  struct Holders {
    size_t first, last;
  };
  /// Returns the first folder that holds `key`; null if it is the present one, or was compared with it.
  template <typename Key>
  const Folder* earlier(const Key& key, std::map<Key, Holders>& holders) const;
  template <typename Key>
  static void compare(const Folder& first, const Folder& now, const char* what, const std::string& label,
                      const Key& key, std::map<Key, Leaves> Folder::*options);
  static void compare_origins(const Folder& first, const Folder& now, const std::string& estimator);

  std::vector<Folder> folders_;
  std::set<SourceData> data_;  ///< the data of the folders, each once: shards of a sweep have the same
  std::map<Row, Holders> of_row_;
  std::map<Curve, Holders> of_curve_;
  std::optional<Row> last_;  ///< the row of the last record
};

/// Collects the versions of Sextant that made the folders.
class SextantVersions {
 public:
  /// `run`: content of the run.json in `folder`.
  void add(const Json& run, const std::filesystem::path& folder);
  /// Returns a sentence if there are several versions.
  std::vector<std::string> warnings() const;

 private:
  std::map<std::string, std::string> folder_of_;  ///< the first folder, by version
};

/// Collects which shards of sweeps are among the folders.
class GivenShards {
 public:
  /// `run`: content of a run.json.
  void add(const Json& run);
  /// Returns a sentence for each sweep of which shards are missing.
  std::vector<std::string> warnings() const;

 private:
  std::map<std::pair<std::string, size_t>, std::set<size_t>> given_;  ///< by configuration and their number
};

}  // namespace sextant
