#include "sextant/datasets/codec/object_pose_text.h"

#include <iterator>

#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/codec/text_rows.h"

namespace sextant {
namespace {

constexpr size_t n_keys = 2;
constexpr const char* header =
    "# T_camera_object per frame and track: an extension of KITTI tracking, whose label_02 has no roll and "
    "pitch.\n"
    "# frame track_id r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z (m; rectified camera 0; origin: middle of "
    "the\n"
    "# box's bottom face; axes: x right, y down, z ahead)\n";

}  // namespace

std::map<std::pair<int, int>, SE3> decode_object_poses(std::string_view text, const std::string& name) {
  std::map<std::pair<int, int>, SE3> poses;
  for (TextRows rows(text, name, ' ', '#'); rows.next();) {
    const size_t n = rows.fields().size();
    if (n != n_keys + 12 && n != n_keys + 16) {
      rows.fail_here("expected frame, track id and the 12 or 16 values of T_camera_object, got {} values", n);
    }
    const int frame = rows.frame(0);
    const int track = rows.track(1);
    if (!poses.emplace(std::pair(frame, track), read_pose_fields(rows, n_keys)).second) {
      rows.fail_here("track {} has a pose in frame {} already: every track may appear once", track, frame);
    }
  }
  return poses;
}

std::string encode_object_poses(const std::map<std::pair<int, int>, SE3>& poses) {
  std::string out = header;
  for (const auto& [key, pose] : poses) {
    const Eigen::Matrix4d m = pose.matrix();
    fmt::format_to(std::back_inserter(out), "{} {}", key.first, key.second);
    for (int i = 0; i < 12; ++i) fmt::format_to(std::back_inserter(out), " {:.17g}", m(i / 4, i % 4));
    out += '\n';
  }
  return out;
}

}  // namespace sextant
