#include "sextant/eval/logs/trajectory_message.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <filesystem>

#include "sextant/eval/logs/trajectory_bytes.h"

namespace sextant {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr size_t most_poses = 20'000'000;
constexpr size_t largest_message = size_t{1} << 20;

/// What follows the header: whether a child's frame id does, and how many doubles after the pose's seven.
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

const PoseMessage* pose_message(std::string_view type) {
  const auto* found = std::find_if(std::begin(messages), std::end(messages),
                                   [&](const PoseMessage& m) { return m.type == type; });
  return found == std::end(messages) ? nullptr : found;
}

/// One message, whatever its serialisation.
class MessageReader {
 public:
  MessageReader(std::string_view message, bool cdr, const std::string& where)
      : bytes_(message, where), where_(where), cdr_(cdr) {
    if (!cdr) return;
    const std::string_view head = bytes_.take(4);
    const auto representation = static_cast<unsigned char>(head[1]);
    // CDR and XCDR 2 of plain structures, big and little endian.
    if (head[0] != 0 || (representation > 1 && representation != 6 && representation != 7))
      fail("{}: unknown representation {} of CDR", where, representation);
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
  /// Nothing may be left but `n` doubles (and padding in CDR).
  void expect_left(size_t n) {
    if (cdr_ && n > 0) align(largest_alignment_);
    const uint64_t left = bytes_.remaining(), expected = 8 * n;
    if (left < expected || left > expected + (cdr_ ? 3 : 0))
      fail("{}: has {} bytes after the pose, expected {}: damaged", where_, left, expected);
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

}  // namespace

TopicPath split_topic(const std::string& path) {
  std::error_code ignored;
  const size_t at = path.find(":/");
  if (at == std::string::npos || std::filesystem::exists(path, ignored)) return {path, ""};
  return {path.substr(0, at), path.substr(at + 1)};
}

bool TopicPoses::announce(const std::string& topic, const std::string& type, const std::string& encoding) {
  Topic& t = topics_[topic];
  const size_t msg = type.find("/msg/");
  const std::string plain = msg == std::string::npos ? type : type.substr(0, msg) + type.substr(msg + 4);
  if (!t.type.empty() && (t.type != plain || t.encoding != encoding))
    fail("{}:{}: is of type {} ({}) and of type {} ({})", file_, topic, t.type, t.encoding, plain, encoding);
  t.type = plain;
  t.encoding = encoding;
  t.readable = (encoding == "ros1" || encoding == "cdr") && pose_message(plain) != nullptr;
  return t.readable && (wanted_.empty() || topic == wanted_);
}

void TopicPoses::add(const std::string& topic, std::string_view message) {
  Topic& t = topics_.at(topic);
  const std::string path = file_ + ":" + topic;
  const auto number = static_cast<int64_t>(t.poses.size()) + 1;
  const std::string where = fmt::format("{}:{}", path, number);
  if (message.size() > largest_message)
    fail("{}: a message of {} bytes: {} at most for a pose", where, message.size(), largest_message);
  if (t.poses.size() == most_poses)
    fail("{}: more than {} poses: cut the recording into parts, or thin it out", path, most_poses);
  const PoseMessage& kind = *pose_message(t.type);
  const bool cdr = t.encoding == "cdr";
  MessageReader reader(message, cdr, where);
  if (!cdr) reader.number<uint32_t>();  // sequence number
  const double seconds = cdr ? reader.number<int32_t>() : reader.number<uint32_t>();
  const auto nanoseconds = reader.number<uint32_t>();
  if (nanoseconds > 999'999'999) fail("{}: a stamp with {} nanoseconds: damaged", where, nanoseconds);
  std::string frame_ids(reader.text());
  if (kind.has_child) frame_ids.append(" -> ").append(reader.text());
  if (number == 1) t.frame_ids = frame_ids;
  if (frame_ids != t.frame_ids) {
    fail(
        "{}: its frame ids are '{}', those of the first message '{}': "
        "the topic holds poses of several bodies; record one alone",
        where, frame_ids.substr(0, 80), t.frame_ids.substr(0, 80));
  }
  double v[7];
  for (double& value : v) value = reader.number<double>();
  reader.expect_left(kind.doubles_after);
  if (seconds == 0 && nanoseconds == 0 && ++t.n_without_stamp > 1)
    fail("{}: a second pose with the time stamp 0: the headers of this topic are not stamped", where);
  const Eigen::Vector3d p(v[0], v[1], v[2]);
  check_position(p, path, number);
  t.poses.stamps_s.push_back(seconds + nanoseconds / 1e9);
  t.poses.add(checked_rotation({v[6], v[3], v[4], v[5]}, path, number, t.log), p);
}

std::string TopicPoses::list(bool readable) const {
  constexpr size_t most = 12;
  std::string out;
  size_t n = 0;
  for (const auto& [name, topic] : topics_) {
    if (readable && !topic.readable) continue;
    if (n++ == most) return out + ", ...";
    out += fmt::format("{}{} ({}, {})", n > 1 ? ", " : "", name.substr(0, 100), topic.type.substr(0, 80),
                       topic.readable ? fmt::format("{} poses", topic.poses.size()) : topic.encoding);
  }
  return n > 0 ? out : "none";
}

TrajectoryFile TopicPoses::finish() {
  constexpr const char* expected_types =
      "PoseStamped, PoseWithCovarianceStamped, TransformStamped (geometry_msgs) or Odometry (nav_msgs)";
  std::string topic = wanted_;
  if (topic.empty()) {
    size_t n = 0;
    for (const auto& [name, t] : topics_) {
      if (!t.readable || t.poses.empty()) continue;
      topic = name;
      ++n;
    }
    if (n == 0) fail("{}: has no topic with poses, {}; it has: {}", file_, expected_types, list(false));
    if (n > 1) fail("{}: has {} topics with poses: give one as {}:/TOPIC of {}", file_, n, file_, list(true));
  }
  const auto found = topics_.find(topic);
  if (found == topics_.end()) fail("{}: has no topic {}; it has: {}", file_, topic, list(false));
  Topic& t = found->second;
  if (!t.readable)
    fail("{}:{}: is of type {} ({}): expected {} in ros1 or cdr", file_, topic, t.type, t.encoding,
         expected_types);
  if (t.poses.empty()) fail("{}:{}: holds no message", file_, topic);
  TrajectoryFile out;
  out.poses = std::move(t.poses);
  sort_and_unite(out.poses, nullptr, t.log);
  out.warnings = t.log.warnings(file_ + ":" + topic);
  out.comments = topic;
  std::transform(out.comments.begin(), out.comments.end(), out.comments.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

}  // namespace sextant
