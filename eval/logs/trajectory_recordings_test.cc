#include <bzlib.h>
#include <libdeflate.h>
#include <lz4frame.h>
#include <zstd.h>

#include <cmath>
#include <random>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/logs/trajectory_files.h"

namespace sextant {
namespace {

// ---- writers, after the formats' specifications

template <typename T>
std::string bytes(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(T)};
}
std::string text32(const std::string& text) { return bytes(static_cast<uint32_t>(text.size())) + text; }

struct Sample {
  uint32_t sec, nsec;
  double v[7];  ///< position, quaternion x y z w
};
const Sample samples[] = {{1000, 500'000'000, {1, 2, 3, 0, 0, 0, 1}}, {1001, 0, {2, 2, 3, 0, 0, 0.6, 0.8}}};

std::string doubles(const double* v, size_t n) {
  return {reinterpret_cast<const char*>(v), n * sizeof(double)};
}

std::string ros1_message(const std::string& type, const Sample& s, const std::string& frame = "map") {
  std::string out = bytes(uint32_t{7}) + bytes(s.sec) + bytes(s.nsec) + text32(frame);
  if (type.ends_with("Odometry") || type.ends_with("TransformStamped")) out += text32("base");
  out += doubles(s.v, 7);
  const std::vector<double> more(type.ends_with("Odometry")            ? 78
                                 : type.ends_with("CovarianceStamped") ? 36
                                                                       : 0);
  return out + doubles(more.data(), more.size());
}

/// CDR, either byte order.
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

std::string cdr_message(const std::string& type, const Sample& s, bool big = false,
                        const std::string& frame = "map") {
  CdrWriter out(big);
  out.put(static_cast<int32_t>(s.sec));
  out.put(s.nsec);
  out.put(frame);
  if (type.ends_with("Odometry") || type.ends_with("TransformStamped")) out.put(std::string("base"));
  for (const double value : s.v) out.put(value);
  const int more = type.ends_with("Odometry") ? 78 : type.ends_with("CovarianceStamped") ? 36 : 0;
  for (int i = 0; i < more; ++i) out.put(0.0);
  return out.finish();
}

std::string compressed(const std::string& kind, const std::string& in) {
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

std::string bag_field(const std::string& name, const std::string& value) {
  return text32(name + "=" + value);
}
std::string bag_record(const std::string& header, const std::string& data) {
  return text32(header) + text32(data);
}
std::string op(char code) { return bag_field("op", std::string(1, code)); }

struct Channel {
  std::string topic, type;
  std::vector<std::string> messages;
};

std::string bag_of(const std::vector<Channel>& channels, const std::string& compression = "none") {
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
  return "#ROSBAG V2.0\n" +
         bag_record(op('\x03') + bag_field("index_pos", bytes(uint64_t{0})) +
                        bag_field("conn_count", bytes(uint32_t{1})),
                    std::string(100, ' ')) +
         bag_record(header, compressed(compression, chunk)) +
         bag_record(op('\x04') + bag_field("ver", bytes(uint32_t{1})), std::string(16, '\0'));
}

std::string mcap_record(char code, const std::string& content) {
  return std::string(1, code) + bytes(static_cast<uint64_t>(content.size())) + content;
}

std::string mcap_of(const std::vector<Channel>& channels, const std::string& compression = "",
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

Channel ros1_channel(const std::string& topic, const std::string& type) {
  return {topic, type, {ros1_message(type, samples[0]), ros1_message(type, samples[1])}};
}
Channel cdr_channel(const std::string& topic, const std::string& type, bool big = false) {
  return {topic, type, {cdr_message(type, samples[0], big), cdr_message(type, samples[1], big)}};
}
const Channel images = {"/camera", "sensor_msgs/Image", {std::string(5000, 'x'), std::string(400'000, 'y')}};

void expect_samples(const TrajectoryFile& file) {
  ASSERT_EQ(file.poses.size(), 2);
  EXPECT_THAT(file.poses.stamps_s, ElementsAre(1000.5, 1001));
  EXPECT_EQ(file.poses.positions_m[1], Eigen::Vector3d(2, 2, 3));
  EXPECT_NEAR(file.poses.rotations[1](0, 0), 1 - 2 * 0.36, 1e-15) << "x y z w";
}

// ---- what is read

TEST(Bag, EveryTypeAndCompression) {
  for (const char* type : {"geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped",
                           "geometry_msgs/TransformStamped", "nav_msgs/Odometry"}) {
    for (const char* compression : {"none", "lz4", "bz2"}) {
      SCOPED_TRACE(std::string(type) + " " + compression);
      expect_samples(decode_trajectory(bag_of({images, ros1_channel("/pose", type)}, compression), "bag"));
    }
  }
}

TEST(Mcap, EveryTypeByteOrderAndCompression) {
  for (const char* type : {"geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped",
                           "geometry_msgs/msg/TransformStamped", "nav_msgs/msg/Odometry"}) {
    for (const char* compression : {"", "lz4", "zstd"}) {
      SCOPED_TRACE(std::string(type) + " " + compression);
      for (const bool big : {false, true})
        expect_samples(
            decode_trajectory(mcap_of({images, cdr_channel("/pose", type, big)}, compression), "mcap"));
    }
  }
  expect_samples(
      decode_trajectory(mcap_of({ros1_channel("/pose", "nav_msgs/Odometry")}, "zstd", "ros1"), "mcap"));
  expect_samples(
      decode_trajectory(mcap_of({cdr_channel("/pose", "nav_msgs/msg/Odometry")}, "", "cdr", false), "mcap"));
}

TEST(Recordings, AreFoundByTheirFirstBytesAndTakeATopic) {
  TempFolder folder;
  const std::vector<Channel> two = {ros1_channel("/a", "nav_msgs/Odometry"), images,
                                    ros1_channel("/b", "geometry_msgs/PoseStamped")};
  const std::string path = folder.write("run.bag", bag_of(two));
  EXPECT_EQ(read_trajectory(path + ":/a").format, "bag");
  expect_samples(read_trajectory(path + ":/b"));
  EXPECT_EQ(read_trajectory(folder.write("x", mcap_of({cdr_channel("/a", "nav_msgs/msg/Odometry")}))).format,
            "mcap");
  EXPECT_THAT(error_of([&] { read_trajectory(path); }),
              AllOf(HasSubstr("2 topics with poses"), HasSubstr("/a (nav_msgs/Odometry, 2 poses), /b (")));
  expect_error([&] { read_trajectory(path + ":/c"); }, "has no topic /c; it has: /a");
  expect_error([&] { read_trajectory(path + ":/camera"); }, "is of type sensor_msgs/Image");
  const std::string text = folder.write("a.tum", "1 1 2 3 0 0 0 1\n");
  expect_error([&] { read_trajectory(text + ":/a"); }, "only recordings");
}

// ---- what is refused

std::string bag_error(const std::string& b, const std::string& topic = "") {
  return error_of([&] { decode_trajectory(b, "bag", topic); });
}
std::string mcap_error(const std::string& b) {
  return error_of([&] { decode_trajectory(b, "mcap"); });
}

TEST(Recordings, PosesOfSeveralBodiesOnOneTopic) {
  const std::string type = "geometry_msgs/PoseStamped";
  EXPECT_THAT(bag_error(bag_of(
                  {{"/p", type, {ros1_message(type, samples[0]), ros1_message(type, samples[1], "odom")}}})),
              HasSubstr("poses of several bodies"));
}

TEST(Recordings, PosesThatAreNone) {
  const std::string type = "geometry_msgs/PoseStamped";
  const auto one = [&](Sample s) { return bag_error(bag_of({{"/p", type, {ros1_message(type, s)}}})); };
  EXPECT_THAT(one({1, 0, {NAN, 0, 0, 0, 0, 0, 1}}), HasSubstr("bytes:/p:1: position"));
  EXPECT_THAT(one({1, 0, {0, 0, 0, NAN, 0, 0, 1}}), HasSubstr("has norm nan"));
  EXPECT_THAT(one({1, 0, {0, 0, 0, 0, 0, 0, 0}}), HasSubstr("has norm 0"));
  EXPECT_THAT(one({1, 0, {1e9, 0, 0, 0, 0, 0, 1}}), HasSubstr("expected metres"));
  EXPECT_THAT(one({1, 2'000'000'000, {0, 0, 0, 0, 0, 0, 1}}), HasSubstr("nanoseconds"));
  const Sample zero = {0, 0, {0, 0, 0, 0, 0, 0, 1}};
  EXPECT_THAT(bag_error(bag_of({{"/p", type, {ros1_message(type, zero), ros1_message(type, zero)}}})),
              HasSubstr("are not stamped"));
  EXPECT_THAT(bag_error(bag_of({{"/p", type, {}}})), HasSubstr("no topic with poses"));
  EXPECT_THAT(bag_error(bag_of({{"/p", type, {}}}), "/p"), HasSubstr("holds no message"));
  EXPECT_THAT(bag_error(bag_of({{"/p", type, {ros1_message(type, samples[0]) + "x"}}})),
              HasSubstr("1 bytes after the pose"));
}

TEST(Recordings, CutOffAnywhereIsAnError) {
  const std::string bag = bag_of({images, ros1_channel("/pose", "nav_msgs/Odometry")}, "lz4");
  const std::string chunked = mcap_of({cdr_channel("/pose", "nav_msgs/msg/Odometry")}, "zstd");
  const std::string plain = mcap_of({cdr_channel("/pose", "nav_msgs/msg/Odometry")}, "", "cdr", false);
  const size_t index =
      bag.size() -
      bag_record(op('\x04') + bag_field("ver", bytes(uint32_t{1})), std::string(16, '\0')).size();
  for (size_t n = 0; n < bag.size(); ++n) {
    if (n == index) continue;  // a whole chunk, without its index
    EXPECT_NE(bag_error(bag.substr(0, n)), "no error") << n;
  }
  EXPECT_EQ(bag_error(bag.substr(0, index)), "no error");
  const size_t tail = mcap_record('\x02', std::string(20, '\0')).size() + 8;
  for (const std::string& mcap : {chunked, plain}) {
    for (size_t n = 0; n + tail < mcap.size(); ++n) EXPECT_NE(mcap_error(mcap.substr(0, n)), "no error") << n;
    EXPECT_EQ(mcap_error(mcap.substr(0, mcap.size() - tail)), "no error") << "whole data";
  }
}

TEST(Recordings, LengthsThatLieTakeNoMemory) {
  std::string bag = "#ROSBAG V2.0\n" + bytes(uint32_t{0xffffffff}) + "x";
  EXPECT_THAT(bag_error(bag), HasSubstr("4294967295 bytes where 1 are left"));
  const std::string header = op('\x05') + bag_field("compression", "lz4");
  const auto chunk = [&](const std::string& size) {
    return "#ROSBAG V2.0\n" + bag_record(header + bag_field("size", size), compressed("lz4", "short"));
  };
  EXPECT_THAT(bag_error(chunk(bytes(uint32_t{0xffffffff}))), HasSubstr("268435456 at most"));
  EXPECT_THAT(bag_error(chunk(bytes(uint32_t{200'000'000}))), HasSubstr("holds 5 of its 200000000 bytes"));
  EXPECT_THAT(bag_error(chunk(bytes(uint32_t{3}))), HasSubstr("more than its 3 bytes"));
  EXPECT_THAT(bag_error(chunk("12")), HasSubstr("field 'size' has 2 bytes"));
  EXPECT_THAT(mcap_error("\x89MCAP0\r\n" + std::string(1, '\x05') + bytes(~uint64_t{0})),
              HasSubstr("18446744073709551615 bytes"));
}

TEST(Recordings, UnknownCompressionAndDamagedChunks) {
  std::string bag = bag_of({ros1_channel("/pose", "nav_msgs/Odometry")}, "lz4");
  bag.replace(bag.find("compression=lz4"), 15, "compression=lzo");
  EXPECT_THAT(bag_error(bag), HasSubstr("unknown compression 'lzo': expected none, lz4, zstd or bz2"));
  std::string mcap = mcap_of({cdr_channel("/pose", "nav_msgs/msg/Odometry")});
  const size_t at = mcap.find("map");
  mcap[at] = 'n';
  EXPECT_THAT(mcap_error(mcap), HasSubstr("CRC")) << "a bit that only the CRC sees";
  EXPECT_THAT(bag_error("#ROSBAG V1.2\n"), HasSubstr("no ROS bag of version 2.0"));
  EXPECT_THAT(mcap_error(""), HasSubstr("no MCAP"));
}

TEST(Recordings, AnyDamageIsAResultOrAnError) {
  const char* rounds = std::getenv("SEXTANT_FUZZ_PROBLEMS");
  const int n = rounds ? std::atoi(rounds) : 3000;
  const std::vector<std::pair<std::string, std::string>> seeds = {
      {"bag", bag_of({images, ros1_channel("/pose", "nav_msgs/Odometry")})},
      {"bag", bag_of({ros1_channel("/pose", "geometry_msgs/PoseStamped")}, "lz4")},
      {"bag", bag_of({ros1_channel("/pose", "geometry_msgs/TransformStamped")}, "bz2")},
      {"mcap", mcap_of({cdr_channel("/pose", "nav_msgs/msg/Odometry")}, "", "cdr", false)},
      {"mcap", mcap_of({cdr_channel("/pose", "geometry_msgs/msg/PoseStamped", true)}, "zstd")},
      {"table", "t [s],tx [m],ty,tz,qw,qx,qy,qz,extra\n1,1,2,3,1,0,0,0,9\n2,1,2,3,1,0,0,0,9\n"},
      {"auto", "# timestamp tx ty tz qx qy qz qw\n1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0 1\n"}};
  std::mt19937_64 random(11);
  int read = 0;
  for (int i = 0; i < n; ++i) {
    const auto& [format, seed] = seeds[static_cast<size_t>(i) % seeds.size()];
    std::string damaged = seed;
    for (uint64_t k = random() % 6; k > 0; --k) {
      const size_t at = random() % damaged.size();
      switch (random() % 4) {
        case 0:
          damaged[at] = static_cast<char>(random());
          break;
        case 1:
          damaged.erase(at, 1 + random() % 9);
          if (damaged.empty()) damaged = "x";
          break;
        case 2:
          damaged.insert(at, std::string(1 + random() % 9, static_cast<char>(random())));
          break;
        default:
          for (size_t j = at; j < std::min(at + 4, damaged.size()); ++j) damaged[j] = static_cast<char>(0xff);
      }
    }
    try {
      const TrajectoryFile file = decode_trajectory(damaged, format);
      ++read;
      for (size_t k = 0; k < file.poses.size(); ++k) {
        ASSERT_TRUE(file.poses.positions_m[k].allFinite() && file.poses.rotations[k].allFinite());
        ASSERT_TRUE(std::isfinite(file.poses.stamps_s[k]));
      }
    } catch (const Error&) {
    }
  }
  EXPECT_GT(read, n / 50);
}

}  // namespace
}  // namespace sextant
