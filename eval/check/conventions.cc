#include "sextant/eval/check/conventions.h"

#include "sextant/stats/summary.h"

namespace sextant {

CheckOutcome Finding::outcome() const {
  if (!checkable()) return CheckOutcome::note;
  if (passes()) return CheckOutcome::pass;
  return fails() ? CheckOutcome::fail : CheckOutcome::suspect;
}

bool Finding::measure(const std::vector<double>& values) {
  n = static_cast<int>(values.size());
  if (!values.empty()) value = median(values);
  return !values.empty();
}

const Finding& Finding::not_checkable(std::string_view why) {
  message = fmt::format("not checkable: {}", why);
  return *this;
}

double Finding::ratio() const {
  if (!checkable()) return 0;
  if (limit > 0) return *value / limit;
  return *value > 0 ? 1 + *value : 0;
}

std::vector<Finding> check_conventions(const ConventionData& data) {
  return {check_static_flow(data),    check_depth_scale(data),  check_depth_order(data),
          check_object_flow(data),    check_object_depth(data), check_mask_ids(data),
          check_mask_boxes(data),     check_box_sideways(data), check_box_upright(data),
          check_heading(data),        check_camera_model(data), check_camera_path(data),
          check_repeated_poses(data), check_speed(data),        check_times(data)};
}

}  // namespace sextant
