#include <sqlite3.h>
#include <zstd.h>

#include <map>
#include <memory>
#include <optional>

#include "sextant/eval/logs/trajectory_message.h"
#include "sextant/eval/logs/trajectory_recordings.h"

namespace sextant {
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

/// Throws Error on a file that is shorter than the pages counted in its header, or not finished.
void check_whole(ByteSource& bytes, bool in_memory) {
  constexpr uint64_t header_bytes = 100;
  if (bytes.size() < sqlite_magic.size() || bytes.view(0, sqlite_magic.size()) != sqlite_magic)
    fail("{}: is not a SQLite database: expected the .db3 of a rosbag2", bytes.name());
  if (bytes.size() < header_bytes) fail("{}: ends within its header: it is cut off", bytes.name());
  const std::string header(bytes.view(0, header_bytes));
  const uint64_t stored =
      static_cast<unsigned char>(header[16]) << 8 | static_cast<unsigned char>(header[17]);
  const uint64_t page = stored == 1 ? 65536 : stored;
  const bool count_holds =
      big_endian32(std::string_view(header).substr(24)) == big_endian32(std::string_view(header).substr(92));
  const uint64_t pages = big_endian32(std::string_view(header).substr(28));
  if (count_holds && pages * page > bytes.size()) {
    fail(
        "{}: has {} bytes where its header counts {} pages of {}: it is cut off; `ros2 bag reindex` or `sqlite3 FILE "
        ".recover` may repair it",
        bytes.name(), bytes.size(), pages, page);
  }
  if (in_memory) return;
  for (const char* ending : {"-wal", "-journal"}) {
    std::error_code none;
    const uint64_t size = fs::file_size(bytes.name() + ending, none);
    if (!none && size > 0) {
      fail(
          "{}: the recording was not closed, {}{} holds a part of it: run `sqlite3 {} 'PRAGMA journal_mode=DELETE'`",
          bytes.name(), bytes.name(), ending, bytes.name());
    }
  }
}

/// Decompresses a message (compression mode MESSAGE).
std::string decompressed(Decompressor& decompressor, std::string_view message, const std::string& where) {
  const unsigned long long size = ZSTD_getFrameContentSize(message.data(), message.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN)
    fail("{}: a compressed message without its size: damaged", where);
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
      fail("{}: message {} is of the topic with id {}, which the table topics does not have: damaged",
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
