#include "sextant/eval/logs/trajectory_recordings.h"

#include <optional>

#include "sextant/base/interrupt.h"
#include "sextant/eval/logs/trajectory_message.h"

namespace sextant {
namespace {

constexpr std::string_view bag_magic = "#ROSBAG V2.0\n";
constexpr uint32_t longest_header = uint32_t{1} << 20;

enum BagOp : uint8_t { op_message = 0x02, op_chunk = 0x05, op_connection = 0x07 };

/// The fields NAME=VALUE of a record's header.
class Fields {
 public:
  Fields(std::string_view bytes, const std::string& where) : where_(where) {
    for (ByteCursor cursor(bytes, where); cursor.remaining() > 0;) {
      const std::string_view field = cursor.text();
      const size_t equals = field.find('=');
      if (equals == std::string_view::npos) fail("{}: a header field without '=': damaged", where);
      values_.emplace(field.substr(0, equals), field.substr(equals + 1));
    }
  }
  std::string text(const std::string& name) const {
    const auto found = values_.find(name);
    if (found == values_.end()) fail("{}: a record without the field '{}': damaged", where_, name);
    return found->second;
  }
  template <typename T>
  T number(const std::string& name) const {
    const std::string value = text(name);
    if (value.size() != sizeof(T))
      fail("{}: field '{}' has {} bytes, expected {}", where_, name, value.size(), sizeof(T));
    return ByteCursor(value, where_).number<T>();
  }

 private:
  const std::string& where_;
  std::map<std::string, std::string> values_;
};

class BagReader {
 public:
  BagReader(const ByteSource& bytes, const std::string& topic, const ReadRules& rules)
      : file_(bytes.name()), poses_(file_, topic, rules), decompressor_(bytes.size()) {}

  void read(ByteSource& bytes, uint64_t begin, uint64_t end, bool in_chunk) {
    for (uint64_t at = begin; at < end;) {
      check_interrupt();
      const std::string where =
          fmt::format("{}: record at byte {}{}", file_, at, in_chunk ? " of its chunk" : "");
      const auto length = [&] {
        if (end - at < 4) fail("{}: ends at byte {} within a record: the file is truncated", file_, end);
        const auto n = ByteCursor(bytes.view(at, 4), where).number<uint32_t>();
        at += 4;
        if (n > end - at) {
          fail(
              "{}: has {} bytes where {} are left: the bag is "
              "cut off or damaged; `rosbag reindex` may repair it",
              where, n, end - at);
        }
        return n;
      };
      const uint32_t header_bytes = length();
      if (header_bytes > longest_header) fail("{}: has a header of {} bytes: damaged", where, header_bytes);
      const Fields header(bytes.view(at, header_bytes), where);
      at += header_bytes;
      const uint32_t data_bytes = length();
      take(bytes, header, at, data_bytes, in_chunk, where);
      at += data_bytes;
    }
  }

  TrajectoryFile finish() { return poses_.finish(); }

 private:
  void take(ByteSource& bytes, const Fields& header, uint64_t at, uint32_t n, bool in_chunk,
            const std::string& where) {
    switch (header.number<uint8_t>("op")) {
      case op_connection: {
        const auto id = header.number<uint32_t>("conn");
        const std::string topic = header.text("topic");
        const bool wanted = poses_.announce(topic, Fields(bytes.view(at, n), where).text("type"), "ros1");
        const auto known = topics_.try_emplace(id, wanted ? std::optional(topic) : std::nullopt);
        if (wanted && known.first->second != topic)
          fail("{}: connection {} has two topics: damaged", where, id);
        break;
      }
      case op_message: {
        const auto connection = topics_.find(header.number<uint32_t>("conn"));
        if (connection == topics_.end()) fail("{}: a message before its connection: damaged", where);
        if (connection->second) poses_.add(*connection->second, bytes.view(at, n));
        break;
      }
      case op_chunk: {
        if (in_chunk) fail("{}: a chunk within a chunk: damaged", where);
        const std::string compression = header.text("compression");
        const auto size = header.number<uint32_t>("size");
        if (compression == "none") {
          if (size != n) fail("{}: a chunk of {} bytes whose header states {}: damaged", where, n, size);
          read(bytes, at, at + n, true);
        } else {
          const std::string chunk = decompressor_.decompress(compression, bytes.view(at, n), size, where);
          ByteSource inner(chunk, file_);
          read(inner, 0, chunk.size(), true);
        }
        break;
      }
      default:  // bag header, indices, chunk infos
        break;
    }
  }

  std::string file_;
  TopicPoses poses_;
  Decompressor decompressor_;
  std::map<uint32_t, std::optional<std::string>> topics_;  // of connections; nullopt: not wanted
};

}  // namespace

bool is_bag(std::string_view first_bytes) { return first_bytes.starts_with(bag_magic); }

TrajectoryFile read_bag(ByteSource& bytes, const std::string& topic, const ReadRules& rules) {
  if (bytes.size() < bag_magic.size() || bytes.view(0, bag_magic.size()) != bag_magic)
    fail("{}: is not a ROS bag of version 2.0", bytes.name());
  BagReader reader(bytes, topic, rules);
  reader.read(bytes, bag_magic.size(), bytes.size(), false);
  return reader.finish();
}

}  // namespace sextant
