#include "sextant/eval/logs/trajectory_readers.h"

#include <libdeflate.h>
#include <sqlite3.h>
#include <zstd.h>
#include <cstring>
#include <map>
#include <memory>
#include <optional>

#include "sextant/base/interrupt.h"
#include "sextant/eval/logs/mcap_writer.h"
#include "sextant/eval/logs/trajectory_message.h"

namespace sextant {

namespace {

constexpr std::string_view bag_magic = "#ROSBAG V2.0\n";
constexpr uint32_t longest_header = uint32_t{1} << 20;
constexpr const char* repair_bag = "the bag is damaged; `rosbag reindex` may repair it";
constexpr const char* repair_mcap = "the file is damaged; `mcap recover` may repair it";

enum BagOp : uint8_t { op_message = 0x02, op_bag_header = 0x03, op_chunk = 0x05, op_connection = 0x07 };

/// The fields NAME=VALUE of a record's header.
class Fields {
 public:
  Fields(std::string_view bytes, const std::string& where) : where_(where) {
    for (ByteCursor cursor(bytes, where); cursor.remaining() > 0;) {
      const std::string_view field = cursor.text();
      const size_t equals = field.find('=');
      if (equals == std::string_view::npos) fail("{}: a header field has no '=': the bag is damaged", where);
      values_.emplace(field.substr(0, equals), field.substr(equals + 1));
    }
  }
  std::string text(const std::string& name) const {
    const auto found = values_.find(name);
    if (found == values_.end()) fail("{}: has no field '{}': the bag is damaged", where_, name);
    return found->second;
  }
  template <typename T>
  T number(const std::string& name) const {
    const std::string value = text(name);
    if (value.size() != sizeof(T))
      fail("{}: field '{}' has {} bytes, expected {}: the bag is damaged", where_, name, value.size(),
           sizeof(T));
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
              "{}: has {} bytes where {} are left: the bag is cut off or damaged; `rosbag reindex` may "
              "repair it",
              where, n, end - at);
        }
        return n;
      };
      const uint32_t header_bytes = length();
      if (header_bytes > longest_header) {
        fail("{}: has a header of {} bytes, expected {} at most: the bag is damaged", where, header_bytes,
             longest_header);
      }
      const Fields header(bytes.view(at, header_bytes), where);
      at += header_bytes;
      const uint32_t data_bytes = length();
      take(bytes, header, at, data_bytes, in_chunk, where);
      at += data_bytes;
    }
  }

  TrajectoryFile finish() {
    TrajectoryFile file = poses_.finish();
    if (is_open_) {
      file.warnings.push_back(fmt::format(
          "{}: the recording was not closed, so its end may be missing: `rosbag reindex` closes it", file_));
    }
    return file;
  }

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
          fail("{}: connection {} has two topics: the bag is damaged", where, id);
        break;
      }
      case op_message: {
        const auto connection = topics_.find(header.number<uint32_t>("conn"));
        if (connection == topics_.end())
          fail("{}: a message precedes the record of its connection: {}", where, repair_bag);
        if (connection->second) poses_.add(*connection->second, bytes.view(at, n));
        break;
      }
      case op_chunk: {
        if (in_chunk) fail("{}: a chunk contains another chunk: {}", where, repair_bag);
        const std::string compression = header.text("compression");
        const auto size = header.number<uint32_t>("size");
        if (compression == "none") {
          if (size != n)
            fail("{}: a chunk has {} bytes, but its header states {}: the bag is damaged", where, n, size);
          read(bytes, at, at + n, true);
        } else {
          const std::string chunk = decompressor_.decompress(compression, bytes.view(at, n), size, where);
          ByteSource inner(chunk, file_);
          read(inner, 0, chunk.size(), true);
        }
        break;
      }
      case op_bag_header: {
        if (in_chunk) break;
        const auto index_at = header.number<uint64_t>("index_pos");
        is_open_ = index_at == 0;  // written when the recording is closed
        if (index_at > bytes.size()) {
          fail(
              "{}: has {} bytes, expected more than {}, where its header places the index: the bag is cut "
              "off: copy it again; `rosbag reindex` accepts the remaining messages",
              file_, bytes.size(), index_at);
        }
        break;
      }
      default:  // indices, chunk infos
        break;
    }
  }

  std::string file_;
  TopicPoses poses_;
  Decompressor decompressor_;
  bool is_open_ = false;                                   // true if the recording was not closed
  std::map<uint32_t, std::optional<std::string>> topics_;  // of connections; nullopt: not wanted
};

}  // namespace

bool is_bag(std::string_view first_bytes) { return first_bytes.starts_with(bag_magic); }

TrajectoryFile read_bag(ByteSource& bytes, const std::string& topic, const ReadRules& rules) {
  if (bytes.size() < bag_magic.size() || bytes.view(0, bag_magic.size()) != bag_magic)
    fail("{}: is not a ROS bag of version 2.0: expected a file that begins with #ROSBAG V2.0", bytes.name());
  BagReader reader(bytes, topic, rules);
  reader.read(bytes, bag_magic.size(), bytes.size(), false);
  return reader.finish();
}

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
      if (channel == channels_.end())
        fail("{}: a message precedes the record of its channel: {}", where, repair_mcap);
      cursor.take(4 + 8 + 8);  // sequence number, time of recording, time of publication
      if (channel->second) poses_.add(*channel->second, cursor.take(cursor.remaining()));
    } else {
      if (in_chunk) fail("{}: a chunk contains another chunk: {}", where, repair_mcap);
      read_chunk(cursor, where);
    }
  }

  void add_channel(ByteCursor& cursor, const std::string& where) {
    const auto id = cursor.number<uint16_t>();
    const auto schema_id = cursor.number<uint16_t>();
    const std::string topic(cursor.text()), encoding(cursor.text());
    const auto schema = schemas_.find(schema_id);
    if (schema == schemas_.end() && schema_id != 0)
      fail("{}: a channel refers to a schema that does not precede it: {}", where, repair_mcap);
    const bool wanted = poses_.announce(topic, schema_id == 0 ? "no schema" : schema->second, encoding);
    const auto known = channels_.try_emplace(id, wanted ? std::optional(topic) : std::nullopt);
    if (wanted && known.first->second != topic)
      fail("{}: channel {} has two topics: the file is damaged", where, id);
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
        fail("{}: a chunk has {} bytes, but its header states {}: the file is damaged", where, packed.size(),
             size);
      records = packed;
    } else {
      records = decompressor_.decompress(compression, packed, size, where);
    }
    if (crc != 0 && libdeflate_crc32(0, records.data(), records.size()) != crc)
      fail("{}: the chunk's CRC does not agree with its content: the file is damaged: copy it again", where);
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

namespace {

constexpr std::string_view sqlite_magic("SQLite format 3\0", 16);
constexpr std::string_view zstd_magic = "\x28\xb5\x2f\xfd";

uint32_t big_endian32(std::string_view bytes) {
  uint32_t value = 0;
  for (const char c : bytes.substr(0, 4)) value = value << 8 | static_cast<unsigned char>(c);
  return value;
}

struct Close {
  void operator()(sqlite3* db) const { sqlite3_close(db); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

/// Authorizer that allows statements to read only. Views, triggers and functions of the file's schema never
/// run.
int allow_reading(void* /*context*/, int action, const char* /*a*/, const char* /*b*/,
                  const char* /*database*/, const char* view) {
  const bool reads = action == SQLITE_SELECT || action == SQLITE_READ;
  return reads && view == nullptr ? SQLITE_OK : SQLITE_DENY;
}

/// An untrusted database, opened for reading. All messages begin with its name.
class Database {
 public:
  Database(ByteSource& bytes, bool in_memory) : name_(bytes.name()) {
    sqlite3* db = nullptr;
    const std::string uri = in_memory ? "file::memory:" : uri_of(name_);
    const int code = sqlite3_open_v2(uri.c_str(), &db, flags(in_memory), nullptr);
    db_.reset(db);
    expect(code);
    if (in_memory) load(bytes);
    sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_limit(db, SQLITE_LIMIT_LENGTH, static_cast<int>(largest_block));
    expect(sqlite3_set_authorizer(db, allow_reading, nullptr));
  }

  std::unique_ptr<sqlite3_stmt, Close> prepare(const char* sql) {
    sqlite3_stmt* statement = nullptr;
    expect(sqlite3_prepare_v2(db_.get(), sql, -1, &statement, nullptr));
    return std::unique_ptr<sqlite3_stmt, Close>(statement);
  }
  /// Returns false at the end.
  bool step(sqlite3_stmt* statement) {
    const int code = sqlite3_step(statement);
    if (code != SQLITE_ROW && code != SQLITE_DONE) expect(code);
    return code == SQLITE_ROW;
  }

 private:
  static int flags(bool in_memory) {
    return SQLITE_OPEN_URI | (in_memory ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY);
  }
  /// `immutable`: neither locks nor journals are used, which a finished recording does not have.
  static std::string uri_of(const std::string& path) {
    std::string uri = "file:";
    for (const char c : fs::absolute(path).lexically_normal().string()) {
      if (c == '%' || c == '?' || c == '#') {
        uri += fmt::format("%{:02x}", static_cast<unsigned>(c));
      } else {
        uri += c;
      }
    }
    return uri + "?mode=ro&immutable=1";
  }
  void load(ByteSource& bytes) {
    const std::string_view all = bytes.view(0, bytes.size());
    auto* copy = static_cast<unsigned char*>(sqlite3_malloc64(all.size()));
    if (copy == nullptr) fail("{}: no memory for {} bytes", name_, all.size());
    std::memcpy(copy, all.data(), all.size());
    expect(sqlite3_deserialize(db_.get(), "main", copy, static_cast<sqlite3_int64>(all.size()),
                               static_cast<sqlite3_int64>(all.size()),
                               SQLITE_DESERIALIZE_FREEONCLOSE | SQLITE_DESERIALIZE_READONLY));
  }
  void expect(int code) const {
    if (code == SQLITE_OK) return;
    const std::string reason = db_ ? sqlite3_errmsg(db_.get()) : sqlite3_errstr(code);
    fail("{}: cannot be read as a rosbag2 of SQLite, with tables topics and messages: {}", name_, reason);
  }

  std::string name_;
  std::unique_ptr<sqlite3, Close> db_;
};

std::string text_at(sqlite3_stmt* row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text == nullptr ? "" : std::string(text, static_cast<size_t>(sqlite3_column_bytes(row, column)));
}

/// Throws Error on a file that is not a SQLite database, is shorter than the pages counted in its header, or
/// was not closed (a journal or write-ahead log with content lies beside it).
void check_whole(ByteSource& bytes, bool in_memory) {
  constexpr uint64_t header_bytes = 100;
  if (bytes.size() < sqlite_magic.size() || bytes.view(0, sqlite_magic.size()) != sqlite_magic)
    fail("{}: is not a SQLite database: expected the .db3 of a rosbag2", bytes.name());
  if (bytes.size() < header_bytes)
    fail("{}: ends within its header: it is cut off: copy it again", bytes.name());
  const std::string header(bytes.view(0, header_bytes));
  const uint64_t stored =
      static_cast<unsigned char>(header[16]) << 8 | static_cast<unsigned char>(header[17]);
  const uint64_t page = stored == 1 ? 65536 : stored;
  const bool count_holds =
      big_endian32(std::string_view(header).substr(24)) == big_endian32(std::string_view(header).substr(92));
  const uint64_t pages = big_endian32(std::string_view(header).substr(28));
  if (count_holds && pages * page > bytes.size()) {
    fail(
        "{}: has {} bytes where its header counts {} pages of {}: it is cut off; `ros2 bag reindex` or "
        "`sqlite3 FILE .recover` may repair it",
        bytes.name(), bytes.size(), pages, page);
  }
  if (in_memory) return;
  for (const char* ending : {"-wal", "-journal"}) {
    std::error_code none;
    const uint64_t size = fs::file_size(bytes.name() + ending, none);
    if (!none && size > 0) {
      fail(
          "{}: the recording was not closed, {}{} holds a part of it: run `sqlite3 {} 'PRAGMA "
          "journal_mode=DELETE'`",
          bytes.name(), bytes.name(), ending, bytes.name());
    }
  }
}

/// Decompresses a message (compression mode MESSAGE).
std::string decompressed(Decompressor& decompressor, std::string_view message, const std::string& where) {
  const unsigned long long size = ZSTD_getFrameContentSize(message.data(), message.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN)
    fail("{}: a compressed message does not state its size: the recording is damaged", where);
  return decompressor.decompress("zstd", message, size, where);
}

}  // namespace

bool is_rosbag2(std::string_view first_bytes) { return first_bytes.starts_with(sqlite_magic); }

TrajectoryFile read_rosbag2(ByteSource& bytes, const std::string& topic, const ReadRules& rules) {
  const bool in_memory = bytes.is_in_memory();
  check_whole(bytes, in_memory);
  Database db(bytes, in_memory);
  TopicPoses poses(bytes.name(), topic, rules);
  Decompressor decompressor(bytes.size());
  std::map<int64_t, std::optional<std::string>> topics;  // by id; nullopt: not wanted
  const auto rows = db.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
  while (db.step(rows.get())) {
    const std::string name = text_at(rows.get(), 1);
    const bool wanted = poses.announce(name, text_at(rows.get(), 2), text_at(rows.get(), 3));
    topics[sqlite3_column_int64(rows.get(), 0)] = wanted ? std::optional(name) : std::nullopt;
  }
  const auto messages = db.prepare("SELECT topic_id, data FROM messages ORDER BY rowid");
  for (int64_t number = 1; db.step(messages.get()); ++number) {
    const auto found = topics.find(sqlite3_column_int64(messages.get(), 0));
    if (found == topics.end()) {
      fail(
          "{}: message {} is of the topic with id {}, which the table topics does not have: the file is "
          "damaged",
          bytes.name(), number, sqlite3_column_int64(messages.get(), 0));
    }
    if (!found->second) continue;
    const void* blob = sqlite3_column_blob(messages.get(), 1);
    const auto n = static_cast<size_t>(sqlite3_column_bytes(messages.get(), 1));
    const std::string_view message(blob == nullptr ? "" : static_cast<const char*>(blob),
                                   blob == nullptr ? 0 : n);
    if (message.starts_with(zstd_magic)) {
      poses.add(*found->second,
                decompressed(decompressor, message, fmt::format("{}: message {}", bytes.name(), number)));
    } else {
      poses.add(*found->second, message);
    }
  }
  return poses.finish();
}

}  // namespace sextant
