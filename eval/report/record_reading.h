#pragma once

// What every table asks of a record.

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

/// The number of that name, if the record has it.
std::optional<double> find_number(const Record::Numbers& numbers, const std::string& key);

/// Truth in both frames, and worth estimating: an object that is static by truth is not.
bool has_truth(const Record& record);

/// Where a body stands in tables: 0 for ego, else its id.
int body_order(const Record& record);

/// "camera", "object 3".
std::string body_title(const std::string& body);

/// What was drawn independently (stats/bootstrap.h): a seed; of records that all have the same seed, a frame.
class Clusters {
 public:
  explicit Clusters(const std::vector<const Record*>& records);
  uint64_t of(const Record& record) const;
  bool are_frames() const { return n_seeds_ < 2; }
  int n_seeds() const { return n_seeds_; }

 private:
  int n_seeds_;
};

/// One error of the records that have it, ready for intervals.
struct ErrorSample {
  std::vector<double> values;
  std::vector<uint64_t> clusters;
};
ErrorSample error_sample(const std::vector<const Record*>& records, const std::string& key,
                         const Clusters& clusters);

/// Its two ends as cells; empty ones where there is none.
void add_interval(const std::optional<Interval>& interval, std::vector<Cell>& cells);

}  // namespace sextant
