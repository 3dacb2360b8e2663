#include "sextant/eval/records/record_truth.h"

namespace sextant {

bool has_truth(const Record& record) {
  if (record.is_ego()) return record.values.contains("step_gt_m");
  const auto dynamic = record.values.find("dynamic_gt");
  return record.values.contains("distance_gt_m") && (dynamic == record.values.end() || dynamic->second != 0);
}

int body_order(Interned body) { return body == "ego" ? 0 : std::stoi(body.str().substr(body.str().find(':') + 1)); }

}  // namespace sextant
