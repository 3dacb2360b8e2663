#pragma once

// Recordings for tests, written according to the specifications of the formats: ROS 1 bags, MCAP files and
// the SQLite files of rosbag2, with messages of poses and of transforms.

#include <bzlib.h>
#include <gtest/gtest.h>
#include <libdeflate.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/base/new_file.h"

namespace sextant::recordings {

template <typename T>
inline std::string bytes(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(T)};
}
inline std::string text32(const std::string& text) {
  return bytes(static_cast<uint32_t>(text.size())) + text;
}

struct Sample {
  uint32_t sec, nsec;
  double v[7];  ///< position, quaternion x y z w
  std::array<double, 36> covariance{};
};
inline const Sample samples[] = {{1000, 500'000'000, {1, 2, 3, 0, 0, 0, 1}},
                                 {1001, 0, {2, 2, 3, 0, 0, 0.6, 0.8}}};

inline std::string doubles(const double* v, size_t n) {
  return {reinterpret_cast<const char*>(v), n * sizeof(double)};
}

inline std::string ros1_message(const std::string& type, const Sample& s, const std::string& frame = "map") {
  std::string out = bytes(uint32_t{7}) + bytes(s.sec) + bytes(s.nsec) + text32(frame);
  if (type.ends_with("Odometry") || type.ends_with("TransformStamped")) out += text32("base");
  out += doubles(s.v, 7);
  if (!type.ends_with("Odometry") && !type.ends_with("CovarianceStamped")) return out;
  const std::vector<double> twist(type.ends_with("Odometry") ? 42 : 0);
  return out + doubles(s.covariance.data(), 36) + doubles(twist.data(), twist.size());
}

/// Writer of CDR in either byte order.
class CdrWriter {
 public:
  explicit CdrWriter(bool big) : big_(big) {}
  template <typename T>
  void put(T value) {
    while (out_.size() % sizeof(T) != 0) out_.push_back('\0');
    std::string raw = bytes(value);
    if (big_) std::reverse(raw.begin(), raw.end());
    out_ += raw;
  }
  void put(const std::string& text) {
    put(static_cast<uint32_t>(text.size() + 1));
    out_ += text + '\0';
  }
  std::string finish() const {
    return std::string("\0", 1) + (big_ ? '\0' : '\1') + std::string(2, '\0') + out_;
  }

 private:
  bool big_;
  std::string out_;
};

inline std::string cdr_message(const std::string& type, const Sample& s, bool big = false,
                               const std::string& frame = "map") {
  CdrWriter out(big);
  out.put(static_cast<int32_t>(s.sec));
  out.put(s.nsec);
  out.put(frame);
  if (type.ends_with("Odometry") || type.ends_with("TransformStamped")) out.put(std::string("base"));
  for (const double value : s.v) out.put(value);
  if (!type.ends_with("Odometry") && !type.ends_with("CovarianceStamped")) return out.finish();
  for (const double value : s.covariance) out.put(value);
  for (int i = 0; i < (type.ends_with("Odometry") ? 42 : 0); ++i) out.put(0.0);
  return out.finish();
}

inline std::string compressed(const std::string& kind, const std::string& in) {
  std::string out(in.size() + 1000, '\0');
  if (kind == "lz4") {
    out.resize(LZ4F_compressFrame(out.data(), out.size(), in.data(), in.size(), nullptr));
  } else if (kind == "zstd") {
    out.resize(ZSTD_compress(out.data(), out.size(), in.data(), in.size(), 1));
  } else if (kind == "bz2") {
    auto n = static_cast<unsigned>(out.size());
    EXPECT_EQ(BZ2_bzBuffToBuffCompress(out.data(), &n, const_cast<char*>(in.data()),
                                       static_cast<unsigned>(in.size()), 1, 0, 0),
              BZ_OK);
    out.resize(n);
  } else {
    out = in;
  }
  return out;
}

inline std::string bag_field(const std::string& name, const std::string& value) {
  return text32(name + "=" + value);
}
inline std::string bag_record(const std::string& header, const std::string& data) {
  return text32(header) + text32(data);
}
inline std::string op(char code) { return bag_field("op", std::string(1, code)); }

struct Channel {
  std::string topic, type;
  std::vector<std::string> messages;
};

/// `is_closed`: the header gives the place of the index.
inline std::string bag_of(const std::vector<Channel>& channels, const std::string& compression = "none",
                          bool is_closed = true) {
  std::string chunk;
  for (uint32_t id = 0; id < channels.size(); ++id) {
    const Channel& c = channels[id];
    chunk += bag_record(op('\x07') + bag_field("conn", bytes(id)) + bag_field("topic", c.topic),
                        bag_field("topic", c.topic) + bag_field("type", c.type) + bag_field("md5sum", "*"));
    for (const std::string& m : c.messages)
      chunk +=
          bag_record(op('\x02') + bag_field("conn", bytes(id)) + bag_field("time", bytes(uint64_t{5})), m);
  }
  const std::string header = op('\x05') + bag_field("compression", compression) +
                             bag_field("size", bytes(static_cast<uint32_t>(chunk.size())));
  const auto head = [](uint64_t index_at) {
    return "#ROSBAG V2.0\n" + bag_record(op('\x03') + bag_field("index_pos", bytes(index_at)) +
                                             bag_field("conn_count", bytes(uint32_t{1})),
                                         std::string(100, ' '));
  };
  const std::string chunks = bag_record(header, compressed(compression, chunk));
  return head(is_closed ? head(0).size() + chunks.size() : 0) + chunks +
         bag_record(op('\x04') + bag_field("ver", bytes(uint32_t{1})), std::string(16, '\0'));
}

inline std::string mcap_record(char code, const std::string& content) {
  return std::string(1, code) + bytes(static_cast<uint64_t>(content.size())) + content;
}

inline std::string mcap_of(const std::vector<Channel>& channels, const std::string& compression = "",
                           const std::string& encoding = "cdr", bool whole_chunk = true) {
  std::string chunk;
  for (uint16_t id = 1; id <= channels.size(); ++id) {
    const Channel& c = channels[id - 1];
    chunk += mcap_record('\x03', bytes(id) + text32(c.type) + text32("ros2msg") + text32("the definition"));
    chunk +=
        mcap_record('\x04', bytes(id) + bytes(id) + text32(c.topic) + text32(encoding) + bytes(uint32_t{0}));
    for (const std::string& m : c.messages)
      chunk +=
          mcap_record('\x05', bytes(id) + bytes(uint32_t{1}) + bytes(uint64_t{5}) + bytes(uint64_t{5}) + m);
  }
  const std::string magic = "\x89MCAP0\r\n", header = mcap_record('\x01', text32("ros2") + text32("test"));
  const std::string end =
      mcap_record('\x0f', bytes(uint32_t{0})) + mcap_record('\x02', std::string(20, '\0')) + magic;
  if (!whole_chunk) return magic + header + chunk + end;
  const std::string packed = compressed(compression, chunk);
  return magic + header +
         mcap_record('\x06', bytes(uint64_t{0}) + bytes(uint64_t{9}) +
                                 bytes(static_cast<uint64_t>(chunk.size())) +
                                 bytes(libdeflate_crc32(0, chunk.data(), chunk.size())) +
                                 text32(compression) + bytes(static_cast<uint64_t>(packed.size())) + packed) +
         end;
}

/// Returns a rosbag2 in its SQLite storage (schema version 3).
inline std::string rosbag2_of(const std::vector<Channel>& channels, const std::string& more_sql = "") {
  const ScratchFolder folder("sextant_rosbag2_");
  const std::string path = (folder.path() / "bag_0.db3").string();
  sqlite3* db = nullptr;
  const auto expect = [&](int code) {
    EXPECT_TRUE(code == SQLITE_OK || code == SQLITE_DONE) << sqlite3_errmsg(db);
  };
  expect(sqlite3_open(path.c_str(), &db));
  const auto run = [&](const char* sql) { expect(sqlite3_exec(db, sql, nullptr, nullptr, nullptr)); };
  run("CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
      "INSERT INTO schema VALUES(3, 'humble');"
      "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT "
      "NULL);CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
      "  serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,"
      "  data BLOB NOT NULL);"
      "CREATE INDEX timestamp_idx ON messages (timestamp ASC);");
  const auto insert = [&](const char* sql, int id, const std::vector<std::string>& values) {
    sqlite3_stmt* row = nullptr;
    expect(sqlite3_prepare_v2(db, sql, -1, &row, nullptr));
    expect(sqlite3_bind_int(row, 1, id));
    for (size_t i = 0; i < values.size(); ++i) {
      const auto n = static_cast<int>(values[i].size());
      expect(values.size() == 1
                 ? sqlite3_bind_blob(row, 2, values[i].data(), n, SQLITE_TRANSIENT)
                 : sqlite3_bind_text(row, static_cast<int>(i) + 2, values[i].data(), n, SQLITE_TRANSIENT));
    }
    expect(sqlite3_step(row));
    sqlite3_finalize(row);
  };
  int id = 0;
  for (const Channel& channel : channels) {
    insert("INSERT INTO topics VALUES(?1, ?2, ?3, 'cdr', '')", ++id, {channel.topic, channel.type});
    for (const std::string& message : channel.messages)
      insert("INSERT INTO messages(topic_id, timestamp, data) VALUES(?1, 5, ?2)", id, {message});
  }
  if (!more_sql.empty()) run(more_sql.c_str());
  expect(sqlite3_close(db));
  return read_file(path);
}

/// One transform of a TFMessage.
struct Transform {
  std::string parent, child;
  Sample at;
};

inline std::string ros1_transforms(const std::vector<Transform>& transforms) {
  std::string out = bytes(static_cast<uint32_t>(transforms.size()));
  for (const Transform& t : transforms) {
    out += bytes(uint32_t{7}) + bytes(t.at.sec) + bytes(t.at.nsec) + text32(t.parent) + text32(t.child) +
           doubles(t.at.v, 7);
  }
  return out;
}

inline std::string cdr_transforms(const std::vector<Transform>& transforms, bool big = false) {
  CdrWriter out(big);
  out.put(static_cast<uint32_t>(transforms.size()));
  for (const Transform& t : transforms) {
    out.put(static_cast<int32_t>(t.at.sec));
    out.put(t.at.nsec);
    out.put(t.parent);
    out.put(t.child);
    for (const double value : t.at.v) out.put(value);
  }
  return out.finish();
}

}  // namespace sextant::recordings
