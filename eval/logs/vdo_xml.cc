#include "sextant/eval/logs/trajectory_readers.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "sextant/base/text.h"

namespace sextant {
namespace {

/// Iterates over the leaf elements of a file: <name>text</name>, and the beginning and end of containers. A
/// separate parser, because loading pugixml's document alone takes as long as all of this (codec_bench:
/// poses_as_xml, xml_pugixml).
class XmlLeaves {
 public:
  XmlLeaves(std::string_view text, std::string path) : text_(text), path_(std::move(path)) {}

  /// Advances to the next leaf; returns false at the end. name() is the name of the leaf, within() are the
  /// names of its containers from the outermost on.
  bool next() {
    for (;;) {
      const size_t open = text_.find('<', at_);
      if (open == std::string_view::npos) {
        if (!stack_.empty()) fail_here("the file ends inside <{}>: it is cut off", stack_.back());
        return false;
      }
      move_to(open);
      const size_t close = text_.find('>', open);
      if (close == std::string_view::npos) fail_here("a tag without end: the file is cut off");
      const std::string_view tag = text_.substr(open + 1, close - open - 1);
      if (tag.starts_with('?') || tag.starts_with('!')) {
        at_ = close + 1;
      } else if (tag.starts_with('/')) {
        if (stack_.empty() || stack_.back() != tag.substr(1)) fail_here("unexpected </{}>", tag.substr(1));
        stack_.pop_back();
        at_ = close + 1;
      } else if (begin_element(tag.substr(0, tag.find_first_of(" \t\r\n")), close)) {
        return true;
      }
    }
  }

  std::string_view name() const { return name_; }
  const std::vector<std::string_view>& within() const { return stack_; }
  double value() const {
    const std::optional<double> v = number_in(leaf_);
    if (!v || !std::isfinite(*v))
      fail_here("expected a finite number in <{}>, got '{}'", name_, leaf_.substr(0, 40));
    return *v;
  }
  int64_t line() const { return line_; }

  template <typename... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> format, Args&&... args) const {
    fail("{}:{}: {}", path_, line_, fmt::format(format, std::forward<Args>(args)...));
  }

 private:
  bool begin_element(std::string_view name, size_t close) {
    const size_t next_tag = text_.find('<', close);
    const std::string closing = "</" + std::string(name) + ">";
    if (next_tag != std::string_view::npos && text_.substr(next_tag).starts_with(closing)) {
      name_ = name;
      leaf_ = text_.substr(close + 1, next_tag - close - 1);
      at_ = next_tag + closing.size();
      return true;
    }
    constexpr size_t deepest = 32;
    if (stack_.size() >= deepest) fail_here("elements nested deeper than {}", deepest);
    stack_.push_back(name);
    at_ = close + 1;
    return false;
  }
  void move_to(size_t position) {
    line_ += std::count(text_.begin() + static_cast<std::ptrdiff_t>(counted_),
                        text_.begin() + static_cast<std::ptrdiff_t>(position), '\n');
    counted_ = position;
  }

  std::string_view text_;
  std::string path_;
  size_t at_ = 0, counted_ = 0;
  int64_t line_ = 1;
  std::vector<std::string_view> stack_;
  std::string_view name_, leaf_;
};

/// One <pose> or <gt_pose> during parsing.
struct XmlPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  int n_rotation = 0, n_position = 0;

  bool complete() const { return n_rotation == 9 && n_position == 3; }
};

void take(XmlPose& pose, const XmlLeaves& xml) {
  const std::string_view name = xml.name();
  if (name.size() == 5 && name.starts_with("rot")) {
    const int row = name[3] - '1', column = name[4] - '1';
    if (row < 0 || row > 2 || column < 0 || column > 2) xml.fail_here("unexpected <{}>", name);
    pose.rotation(row, column) = xml.value();
    ++pose.n_rotation;
  } else if (name == "item") {
    if (pose.n_position >= 3) xml.fail_here("a translation of more than 3 values");
    pose.position_m[pose.n_position++] = xml.value();
  }
}

}  // namespace

void read_vdo_frontend_xml(const std::string& path, const FileKind& kind, PoseSeries& estimate,
                           PoseSeries& truth, RepairLog& log) {
  const std::string text = read_file(path, kind);
  XmlPose poses[2];
  XmlLeaves xml(text, path);
  const auto inside = [&](std::string_view name) {
    return std::find(xml.within().begin(), xml.within().end(), name) != xml.within().end();
  };
  while (xml.next()) {
    if (inside("pose")) take(poses[0], xml);
    if (inside("gt_pose")) take(poses[1], xml);
    if (xml.name() != "frame_id") continue;
    const double frame = xml.value();
    if (frame != std::trunc(frame) || frame < 0 || frame > 1e9)
      xml.fail_here("expected a frame number, got {}", frame);
    for (const XmlPose& pose : poses) {
      if (!pose.complete())
        xml.fail_here("frame {} has no complete <pose> and <gt_pose>: expected rot11..rot33 and 3 items each",
                      frame);
      check_rotation(pose.rotation, path, xml.line(), log);
      PoseSeries& series = &pose == &poses[0] ? estimate : truth;
      series.frames.push_back(static_cast<int>(frame));
      series.add(pose.rotation, pose.position_m);
    }
    poses[0] = poses[1] = XmlPose();
  }
  if (estimate.empty()) fail("{}: holds no <frame_id>: expected the log of VDO-SLAM's front end", path);
}

}  // namespace sextant
