#include "sextant/eval/logs/trajectory_message.h"

#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>

#include "sextant/base/json.h"
#include "sextant/eval/logs/trajectory_bytes.h"

namespace sextant {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr size_t largest_message = size_t{1} << 20;
constexpr std::string_view static_ending = "_static";

/// Layout of a message after its header: an optional child frame id, the seven doubles of the pose, and
/// `doubles_after` further ones, the first 36 of which are the covariance of the pose.
struct PoseMessage {
  std::string_view type;
  bool has_child;
  size_t doubles_after;
};
constexpr PoseMessage messages[] = {
    {"geometry_msgs/PoseStamped", false, 0},
    {"geometry_msgs/PoseWithCovarianceStamped", false, 36},
    {"geometry_msgs/TransformStamped", true, 0},
    {"nav_msgs/Odometry", true, 36 + 6 + 36},
};

/// Foxglove's schema of a pose, in JSON.
constexpr std::string_view json_pose = "foxglove.PoseInFrame";

const PoseMessage* pose_message(std::string_view type) {
  const auto* found = std::find_if(std::begin(messages), std::end(messages),
                                   [&](const PoseMessage& m) { return m.type == type; });
  return found == std::end(messages) ? nullptr : found;
}

bool is_transforms(std::string_view type) { return type == "tf2_msgs/TFMessage" || type == "tf/tfMessage"; }

/// Returns the name of a topic without a leading slash, for comparisons.
std::string_view plain(std::string_view topic) {
  if (topic.starts_with('/')) topic.remove_prefix(1);
  return topic;
}

/// Reads one message in either serialisation.
class MessageReader {
 public:
  MessageReader(std::string_view message, bool cdr, const std::string& where)
      : bytes_(message, where), where_(where), cdr_(cdr) {
    if (!cdr) return;
    const std::string_view head = bytes_.take(4);
    const auto representation = static_cast<unsigned char>(head[1]);
    // CDR and XCDR 2 of plain structures, big and little endian.
    if (head[0] != 0 || (representation > 1 && representation != 6 && representation != 7))
      fail("{}: the second byte of the CDR header is {}: expected the bytes 0 and 0, 1, 6 or 7 (plain CDR)",
           where, representation);
    swap_ = representation == 0 || representation == 6;
    largest_alignment_ = representation > 1 ? 4 : 8;
  }

  template <typename T>
  T number() {
    if (cdr_) align(std::min(sizeof(T), largest_alignment_));
    at_ += sizeof(T);
    if (!swap_) return bytes_.number<T>();
    std::string raw(bytes_.take(sizeof(T)));
    std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }
  std::string_view text() {
    const auto n = number<uint32_t>();
    std::string_view out = bytes_.take(n);
    at_ += n;
    if (cdr_ && out.ends_with('\0')) out.remove_suffix(1);
    return out;
  }
  /// Throws Error unless exactly `n` doubles (and padding in CDR) are left.
  void expect_left(size_t n) {
    if (cdr_ && n > 0) align(largest_alignment_);
    const uint64_t left = bytes_.remaining(), expected = 8 * n;
    if (left < expected || left > expected + (cdr_ ? 3 : 0))
      fail("{}: has {} bytes after the pose, expected {}: the message is damaged", where_, left, expected);
  }

 private:
  void align(size_t to) {
    const size_t off = at_ % to;
    if (off == 0) return;
    bytes_.take(to - off);
    at_ += to - off;
  }

  ByteCursor bytes_;
  const std::string& where_;
  bool cdr_, swap_ = false;
  size_t largest_alignment_ = 1, at_ = 0;
};

double read_stamp(MessageReader& reader, bool cdr, const std::string& where) {
  if (!cdr) reader.number<uint32_t>();  // sequence number
  const double seconds = cdr ? reader.number<int32_t>() : reader.number<uint32_t>();
  const auto nanoseconds = reader.number<uint32_t>();
  if (nanoseconds > 999'999'999) {
    fail("{}: the stamp has {} nanoseconds, expected fewer than 1e9: the message is damaged", where,
         nanoseconds);
  }
  return seconds + nanoseconds / 1e9;
}

/// Pose in a message, with its time stamp and frame ids.
struct StampedPose {
  double stamp_s = 0;
  std::string frame_ids;
  double v[7] = {};  ///< position x y z (m), quaternion x y z w
};

StampedPose read_json_pose(std::string_view message, const std::string& where) {
  const Json json = parse_json(message, where);
  const Json stamp = json_object(json, "timestamp", where), pose = json_object(json, "pose", where);
  StampedPose read;
  read.stamp_s = json_member<double>(stamp, "sec", where) + json_member<double>(stamp, "nsec", where) / 1e9;
  read.frame_ids = json_member<std::string>(json, "frame_id", where);
  size_t i = 0;
  const Json position = json_object(pose, "position", where),
             rotation = json_object(pose, "orientation", where);
  for (const char* key : {"x", "y", "z"}) read.v[i++] = json_member<double>(position, key, where);
  for (const char* key : {"x", "y", "z", "w"}) read.v[i++] = json_member<double>(rotation, key, where);
  return read;
}

}  // namespace

TopicPath split_topic(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored)) return {path, ""};
  for (size_t colon = path.find(':'); colon != std::string::npos; colon = path.find(':', colon + 1)) {
    const std::string file = path.substr(0, colon);
    if (std::filesystem::is_regular_file(file, ignored)) return {file, path.substr(colon + 1)};
  }
  const size_t at = path.find(":/");
  if (at == std::string::npos) return {path, ""};
  return {path.substr(0, at), path.substr(at + 1)};
}

TopicPoses::TopicPoses(std::string file, const std::string& topic, const ReadRules& rules)
    : covariance_(rules.covariance), file_(std::move(file)) {
  const size_t colon = topic.find(':');
  wanted_ = topic.substr(0, colon);
  if (colon != std::string::npos) frames_ = topic.substr(colon + 1);
}

bool TopicPoses::announce(const std::string& topic, const std::string& type, const std::string& encoding) {
  Topic& t = topics_[topic];
  const size_t msg = type.find("/msg/");
  const std::string name = msg == std::string::npos ? type : type.substr(0, msg) + type.substr(msg + 4);
  if (!t.type.empty() && (t.type != name || t.encoding != encoding))
    fail("{}:{}: has the type {} ({}) and also the type {} ({}): expected one type per topic", file_, topic,
         t.type, t.encoding, name, encoding);
  t.type = name;
  t.encoding = encoding;
  const bool known = encoding == "ros1" || encoding == "cdr";
  t.readable = known ? pose_message(name) != nullptr : encoding == "json" && name == json_pose;
  t.holds_transforms = known && is_transforms(name);
  if (t.holds_transforms) {
    return !wanted_.empty() && (plain(topic) == plain(wanted_) ||
                                plain(topic) == std::string(plain(wanted_)).append(static_ending));
  }
  return t.readable && (wanted_.empty() || plain(topic) == plain(wanted_));
}

void TopicPoses::add(const std::string& topic, std::string_view message) {
  Topic& t = topics_.at(topic);
  const std::string path = file_ + ":" + topic;
  if (message.size() > largest_message) {
    fail("{}: a message has {} bytes, expected {} at most for poses", path, message.size(), largest_message);
  }
  if (t.holds_transforms) {
    add_transforms(t, path, message, topic.ends_with(static_ending));
  } else {
    add_pose(t, path, message);
  }
}

void TopicPoses::add_pose(Topic& t, const std::string& path, std::string_view message) {
  const auto number = static_cast<int64_t>(t.poses.size()) + 1;
  const std::string where = fmt::format("{}:{}", path, number);
  if (t.poses.size() == most_poses_of_file)
    fail("{}: more than {} poses: cut the recording into parts, or thin it out", path, most_poses_of_file);
  StampedPose pose;
  std::array<double, 36> covariance{};
  bool has_covariance = false;
  if (t.encoding == "json") {
    pose = read_json_pose(message, where);
  } else {
    const PoseMessage& kind = *pose_message(t.type);
    const bool cdr = t.encoding == "cdr";
    MessageReader reader(message, cdr, where);
    pose.stamp_s = read_stamp(reader, cdr, where);
    pose.frame_ids = reader.text();
    if (kind.has_child) pose.frame_ids.append(" -> ").append(reader.text());
    for (double& value : pose.v) value = reader.number<double>();
    has_covariance = kind.doubles_after >= covariance.size();
    if (has_covariance) {
      for (double& value : covariance) value = reader.number<double>();
    }
    reader.expect_left(kind.doubles_after - (has_covariance ? covariance.size() : 0));
  }
  if (number == 1) t.frame_ids = pose.frame_ids;
  if (pose.frame_ids != t.frame_ids) {
    fail(
        "{}: its frame ids are '{}', those of the first message '{}': "
        "the topic holds poses of several bodies; record one alone",
        where, pose.frame_ids.substr(0, 80), t.frame_ids.substr(0, 80));
  }
  if (pose.stamp_s == 0 && ++t.n_without_stamp > 1)
    fail("{}: a second pose with the time stamp 0: the headers of this topic are not stamped", where);
  const auto& v = pose.v;
  const Eigen::Vector3d p(v[0], v[1], v[2]);
  check_position(p, path, number);
  t.poses.stamps_s.push_back(pose.stamp_s);
  t.poses.add(checked_rotation({v[6], v[3], v[4], v[5]}, path, number, t.log), p);
  if (!has_covariance) return;
  const bool is_unknown =
      covariance[0] == -1 || std::ranges::all_of(covariance, [](double value) { return value == 0; });
  if (is_unknown && t.n_unknown_covariances++ == 0) t.first_unknown = number;
  if (is_unknown)
    t.poses.covariances.push_back(PoseCovariance::Zero());
  else
    add_covariance(t.poses, covariance, covariance_, path, number);
}

void TopicPoses::add_transforms(Topic& t, const std::string& path, std::string_view message, bool is_static) {
  const auto number = static_cast<int64_t>(++t.n_messages);
  const std::string where = fmt::format("{}:{}", path, number);
  const bool cdr = t.encoding == "cdr";
  MessageReader reader(message, cdr, where);
  for (auto n = reader.number<uint32_t>(); n > 0; --n) {
    if (tree_.size() == most_poses_of_file)
      fail("{}: more than {} transforms: cut the recording into parts, or thin it out", path,
           most_poses_of_file);
    const double stamp_s = read_stamp(reader, cdr, where);
    const std::string parent(reader.text()), child(reader.text());
    double v[7];
    for (double& value : v) value = reader.number<double>();
    tree_.add(parent, child, stamp_s, {v[6], v[3], v[4], v[5]}, {v[0], v[1], v[2]}, is_static, path, number);
  }
  reader.expect_left(0);
}

std::string TopicPoses::list(bool readable) const {
  constexpr size_t most = 12;
  std::string out;
  size_t n = 0;
  for (const auto& [name, topic] : topics_) {
    if (readable && !topic.readable) continue;
    if (n++ == most) return out + ", ...";
    out += fmt::format("{}{} ({}, {})", n > 1 ? ", " : "", name.substr(0, 100), topic.type.substr(0, 80),
                       topic.readable           ? fmt::format("{} poses", topic.poses.size())
                       : topic.holds_transforms ? fmt::format("give {}:PARENT.CHILD", name.substr(0, 100))
                                                : topic.encoding);
  }
  return n > 0 ? out : "none";
}

TrajectoryFile TopicPoses::finish_transforms() {
  const std::string where = fmt::format("{}:{}:{}", file_, wanted_, frames_);
  TrajectoryFile out;
  RepairLog log;
  out.poses = tree_.path(frames_, where, log);
  out.warnings = log.warnings(where);
  out.comments = lower_case(wanted_ + ":" + frames_);
  return out;
}

TrajectoryFile TopicPoses::finish() {
  constexpr const char* expected_types =
      "PoseStamped, PoseWithCovarianceStamped, TransformStamped (geometry_msgs), Odometry (nav_msgs) or "
      "foxglove.PoseInFrame (JSON)";
  std::string topic = wanted_;
  if (topic.empty()) {
    size_t n = 0;
    for (const auto& [name, t] : topics_) {
      if (!t.readable || t.poses.empty()) continue;
      topic = name;
      ++n;
    }
    if (n == 0) fail("{}: has no topic with poses, {}; it has: {}", file_, expected_types, list(false));
    if (n > 1)
      fail("{}: has {} topics with poses: choose one with {}:/TOPIC; the topics are {}", file_, n, file_,
           list(true));
  }
  const auto is_it = [&](const auto& entry) { return plain(entry.first) == plain(topic); };
  if (std::ranges::count_if(topics_, is_it) > 1)
    fail("{}: has the topic {} with and without its slash: they are indistinguishable", file_, topic);
  const auto found = std::ranges::find_if(topics_, is_it);
  if (found == topics_.end()) fail("{}: has no topic {}; it has: {}", file_, topic, list(false));
  Topic& t = found->second;
  if (t.holds_transforms) return finish_transforms();
  if (!frames_.empty())
    fail("{}:{}: is of type {}, which has no frames to choose: give the topic alone", file_, topic, t.type);
  if (!t.readable)
    fail("{}:{}: is of type {} ({}): expected {}", file_, topic, t.type, t.encoding, expected_types);
  if (t.poses.empty()) fail("{}:{}: holds no message: choose another topic", file_, topic);
  TrajectoryFile out;
  out.poses = std::move(t.poses);
  if (t.n_unknown_covariances > 0 && t.n_unknown_covariances < out.poses.size())
    t.log.note(
        "covariances that are unknown (zeros, or -1) although others are known: none is used, so there is no "
        "NEES",
        t.first_unknown);
  if (t.n_unknown_covariances > 0) out.poses.covariances.clear();
  finish_covariances(out.poses, file_ + ":" + topic, t.log);
  sort_and_unite(out.poses, nullptr, t.log);
  out.warnings = t.log.warnings(file_ + ":" + topic);
  out.comments = lower_case(topic);
  return out;
}

}  // namespace sextant
