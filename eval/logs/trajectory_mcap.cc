#include "sextant/eval/logs/trajectory_recordings.h"

#include <libdeflate.h>

#include <cstring>
#include <optional>

#include "sextant/base/interrupt.h"
#include "sextant/eval/logs/mcap_writer.h"
#include "sextant/eval/logs/trajectory_message.h"

namespace sextant {
namespace {

class McapReader {
 public:
  McapReader(const ByteSource& bytes, const std::string& topic, const ReadRules& rules)
      : file_(bytes.name()), poses_(file_, topic, rules), decompressor_(bytes.size()) {}

  /// Reads records from `at` on; returns true if the end of data was found.
  bool read(ByteSource& bytes, uint64_t at, bool in_chunk) {
    constexpr uint64_t head_bytes = 1 + 8;
    while (at < bytes.size()) {
      check_interrupt();
      // Evaluated only when needed: a chunk may contain millions of records that are skipped.
      const auto where = [&, begin = at] {
        return fmt::format("{}: record at byte {}{}", file_, begin, in_chunk ? " of its chunk" : "");
      };
      const std::string_view head = bytes.view(at, head_bytes);
      const auto op = static_cast<McapOp>(head[0]);
      uint64_t n = 0;
      std::memcpy(&n, head.data() + 1, sizeof n);
      at += head_bytes;
      if (n > bytes.size() - at) {
        fail(
            "{}: has {} bytes where {} are left: the file is cut off or damaged; `mcap recover` may repair "
            "it",
            where(), n, bytes.size() - at);
      }
      if (op == McapOp::data_end && !in_chunk) return true;
      if (op == McapOp::schema || op == McapOp::channel || op == McapOp::message || op == McapOp::chunk)
        take(op, bytes.view(at, n), in_chunk, where());
      at += n;
    }
    return false;
  }

  TrajectoryFile finish() { return poses_.finish(); }

 private:
  void take(McapOp op, std::string_view content, bool in_chunk, const std::string& where) {
    ByteCursor cursor(content, where);
    if (op == McapOp::schema) {
      const auto id = cursor.number<uint16_t>();
      schemas_[id] = cursor.text();
    } else if (op == McapOp::channel) {
      add_channel(cursor, where);
    } else if (op == McapOp::message) {
      const auto channel = channels_.find(cursor.number<uint16_t>());
      if (channel == channels_.end()) fail("{}: a message before its channel: damaged", where);
      cursor.take(4 + 8 + 8);  // sequence number, time of recording, time of publication
      if (channel->second) poses_.add(*channel->second, cursor.take(cursor.remaining()));
    } else {
      if (in_chunk) fail("{}: a chunk within a chunk: damaged", where);
      read_chunk(cursor, where);
    }
  }

  void add_channel(ByteCursor& cursor, const std::string& where) {
    const auto id = cursor.number<uint16_t>();
    const auto schema_id = cursor.number<uint16_t>();
    const std::string topic(cursor.text()), encoding(cursor.text());
    const auto schema = schemas_.find(schema_id);
    if (schema == schemas_.end() && schema_id != 0) fail("{}: a channel before its schema: damaged", where);
    const bool wanted = poses_.announce(topic, schema_id == 0 ? "no schema" : schema->second, encoding);
    const auto known = channels_.try_emplace(id, wanted ? std::optional(topic) : std::nullopt);
    if (wanted && known.first->second != topic) fail("{}: channel {} has two topics: damaged", where, id);
  }

  void read_chunk(ByteCursor& cursor, const std::string& where) {
    cursor.take(8 + 8);  // times of the first and last message
    const auto size = cursor.number<uint64_t>();
    const auto crc = cursor.number<uint32_t>();
    const std::string compression(cursor.text());
    const std::string_view packed = cursor.take(cursor.number<uint64_t>());
    std::string records;
    if (compression.empty()) {
      if (packed.size() != size)
        fail("{}: a chunk of {} bytes whose header states {}: damaged", where, packed.size(), size);
      records = packed;
    } else {
      records = decompressor_.decompress(compression, packed, size, where);
    }
    if (crc != 0 && libdeflate_crc32(0, records.data(), records.size()) != crc)
      fail("{}: the chunk's CRC does not agree with its content: damaged", where);
    ByteSource inner(records, file_);
    read(inner, 0, true);
  }

  std::string file_;
  TopicPoses poses_;
  Decompressor decompressor_;
  std::map<uint16_t, std::string> schemas_;                  // names
  std::map<uint16_t, std::optional<std::string>> channels_;  // topics; nullopt: not wanted
};

}  // namespace

bool is_mcap(std::string_view first_bytes) { return first_bytes.starts_with(mcap_magic); }

TrajectoryFile read_mcap(ByteSource& bytes, const std::string& topic, const ReadRules& rules) {
  if (bytes.size() < mcap_magic.size() || bytes.view(0, mcap_magic.size()) != mcap_magic)
    fail("{}: is not an MCAP file of version 0", bytes.name());
  McapReader reader(bytes, topic, rules);
  if (!reader.read(bytes, mcap_magic.size(), false))
    fail("{}: has no end-of-data record: the recording is truncated; `mcap recover` may repair it",
         bytes.name());
  return reader.finish();
}

}  // namespace sextant
