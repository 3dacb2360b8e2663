#pragma once

// Checks of folders whose records are counted together in one report: the labels of records stand for the
// same options, and no shard of a sweep is missing.

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/records/record.h"

namespace sextant {

/// Options by dotted key; a list is one value.
using Leaves = std::map<std::string, Json>;
Leaves leaves_of(const Json& options);

/// Returns the name in records of a noise with these options; "" if this version cannot read them.
std::string noise_name(const Json& options);

/// Refuses folders in which equal names of an estimator or a noise stand for other options, because their
/// records would count as one sample. An option that only one folder records is ignored, because another
/// version of the program may not have it.
class SameLabels {
 public:
  /// Begins the next folder. `run`: content of its run.json.
  void begin(const Json& run, const std::filesystem::path& folder);
  /// Checks the labels of a record of the folder. Throws Error if an earlier folder holds records with the
  /// same labels and other options.
  void check(Interned estimator, Interned dataset, Interned sequence, Interned noise, double level);

 private:
  using Row = std::tuple<Interned, Interned, Interned, Interned, double>;
  struct Folder {
    std::string file;
    std::map<std::string, Leaves> of_estimator;                 ///< by label
    std::map<std::pair<std::string, double>, Leaves> of_noise;  ///< by name and level
  };
  template <typename Key>
  static void compare(const Folder& first, const Folder& now, const char* what, Interned label,
                      const Key& key, std::map<Key, Leaves> Folder::*options);
  /// Folders with records of a row, as indices.
  struct RowFolders {
    size_t first, last;
  };

  std::vector<Folder> folders_;
  std::map<Row, RowFolders> folders_of_;
  std::optional<Row> last_;  ///< the row of the last record
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
