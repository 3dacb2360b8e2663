#include "sextant/datasets/codec/kitti_labels.h"

#include <iterator>
#include <map>
#include <utility>

#include "sextant/datasets/codec/text_rows.h"

namespace sextant {
namespace {

constexpr size_t dynosam_columns = 17;

void read_pose(const TextRows& rows, KittiLabel& label) {
  label.height_m = rows.metres(10, "the height");
  label.width_m = rows.metres(11, "the width");
  label.length_m = rows.metres(12, "the length");
  label.position_m = {rows.metres(13, "x"), rows.metres(14, "y"), rows.metres(15, "z")};
  label.rotation_y_rad = rows.finite(16, "rotation_y");
  if (label.dont_care()) return;
  if (label.track_id < 0)
    rows.fail_here("expected a track id >= 0 for a {}, got {}", label.type, label.track_id);
  rows.track(1);
  if (!(label.height_m > 0 && label.width_m > 0 && label.length_m > 0)) {
    rows.fail_here("expected height, width and length > 0 for a {}, got {} {} {}", label.type, label.height_m,
                   label.width_m, label.length_m);
  }
}

KittiLabel read_label(const TextRows& rows) {
  if (rows.fields().size() != dynosam_columns) {
    rows.fail_here(
        "expected 17 columns (frame track_id type truncated occluded alpha "
        "left top right bottom height width length x y z rotation_y), got {}",
        rows.fields().size());
  }
  KittiLabel label;
  label.frame = rows.frame(0);
  label.track_id = rows.integer(1, "the track id");
  label.type = rows.field(2);
  label.truncated = rows.finite(3, "truncated");
  label.occluded = rows.integer(4, "occluded");
  label.alpha_rad = rows.finite(5, "alpha");
  label.box = rows.box(6);
  read_pose(rows, label);
  return label;
}

}  // namespace

std::vector<KittiLabel> decode_kitti_labels(std::string_view text, const std::string& name) {
  std::vector<KittiLabel> labels;
  std::map<std::pair<int, int>, int64_t> line_of;
  for (TextRows rows(text, name); rows.next();) {
    labels.push_back(read_label(rows));
    const KittiLabel& label = labels.back();
    if (label.dont_care()) continue;
    const auto [at, is_new] = line_of.emplace(std::pair(label.frame, label.track_id), rows.line());
    if (!is_new) {
      rows.fail_here("track {} is in frame {} twice, line {} has it already: every track may appear once",
                     label.track_id, label.frame, at->second);
    }
  }
  return labels;
}

std::string encode_kitti_labels(const std::vector<KittiLabel>& labels) {
  std::string out;
  for (const KittiLabel& l : labels) {
    fmt::format_to(std::back_inserter(out),
                   "{} {} {} {:.6f} {} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f} "
                   "{:.6f} {:.6f} {:.6f} {:.17g} {:.17g} {:.17g} {:.17g}\n",
                   l.frame, l.track_id, l.type, l.truncated, l.occluded, l.alpha_rad, l.box.left, l.box.top,
                   l.box.right, l.box.bottom, l.height_m, l.width_m, l.length_m, l.position_m.x(),
                   l.position_m.y(), l.position_m.z(), l.rotation_y_rad);
  }
  return out;
}

}  // namespace sextant
