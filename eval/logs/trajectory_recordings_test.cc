#include <cmath>
#include <random>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/logs/recordings_testing.h"
#include "sextant/eval/logs/trajectory_files.h"

namespace sextant {
namespace {

using namespace recordings;  // NOLINT: this file is written in their terms

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

// ---- accepted recordings

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

TEST(Rosbag2, EveryTypeAndByteOrder) {
  for (const char* type : {"geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped",
                           "geometry_msgs/msg/TransformStamped", "nav_msgs/msg/Odometry"}) {
    SCOPED_TRACE(type);
    for (const bool big : {false, true})
      expect_samples(decode_trajectory(rosbag2_of({images, cdr_channel("/pose", type, big)}), "rosbag2"));
  }
  Channel packed = cdr_channel("/pose", "nav_msgs/msg/Odometry");
  for (std::string& message : packed.messages) message = compressed("zstd", message);
  expect_samples(decode_trajectory(rosbag2_of({packed}), "rosbag2"));
}

TEST(Recordings, CovariancesOfPosesAreRead) {
  Sample known[2] = {samples[0], samples[1]};
  for (Sample& s : known) {
    for (size_t i = 0; i < 6; ++i) s.covariance[7 * i] = 0.01 * static_cast<double>(i + 1);
    s.covariance[5] = s.covariance[30] = 0.002;
  }
  const auto expect_read = [](const TrajectoryFile& file) {
    ASSERT_EQ(file.poses.covariances.size(), 2);
    EXPECT_EQ(file.poses.covariances[1](1, 1), 0.02);
    EXPECT_EQ(file.poses.covariances[1](0, 5), 0.002);
  };
  for (const std::string name : {"geometry_msgs/PoseWithCovarianceStamped", "nav_msgs/Odometry"}) {
    SCOPED_TRACE(name);
    const auto ros1 = [&](const Sample& a, const Sample& b) {
      return bag_of({Channel{"/pose", name, {ros1_message(name, a), ros1_message(name, b)}}});
    };
    expect_read(decode_trajectory(ros1(known[0], known[1]), "bag"));
    const std::string type = name.substr(0, name.find('/')) + "/msg" + name.substr(name.find('/'));
    for (const bool big : {false, true}) {
      const Channel channel{
          "/pose", type, {cdr_message(type, known[0], big), cdr_message(type, known[1], big)}};
      expect_read(decode_trajectory(mcap_of({channel}), "mcap"));
      expect_read(decode_trajectory(rosbag2_of({channel}), "rosbag2"));
    }
    EXPECT_TRUE(decode_trajectory(ros1(samples[0], samples[1]), "bag").poses.covariances.empty())
        << "zeros: unknown";
    const TrajectoryFile mixed = decode_trajectory(ros1(samples[0], known[1]), "bag");
    EXPECT_TRUE(mixed.poses.covariances.empty());
    EXPECT_THAT(mixed.warnings, ElementsAre(HasSubstr(":1: covariances that are unknown")));
    Sample bad = known[1];
    bad.covariance[30] = -0.002;
    EXPECT_THAT(error_of([&] { decode_trajectory(ros1(known[0], bad), "bag"); }),
                HasSubstr("/pose:2: the covariance of the pose is not symmetric"));
  }
}

TEST(Rosbag2, IsReadWithoutMetadata) {
  TempFolder folder;
  const std::string path =
      folder.write("odd %41 #?name.db3",
                   rosbag2_of({cdr_channel("/a", "nav_msgs/msg/Odometry"),
                               cdr_channel("/b'); DROP TABLE messages; --", "nav_msgs/msg/Odometry")}));
  EXPECT_EQ(read_trajectory(path + ":/a").format, "rosbag2");
  expect_samples(read_trajectory(path + ":a"));
  expect_samples(read_trajectory(path + ":/b'); DROP TABLE messages; --"));
  EXPECT_THAT(error_of([&] { read_trajectory(path + ":/' OR 1=1 --"); }),
              HasSubstr("has no topic /' OR 1=1 --; it has: /a"));
  EXPECT_THAT(error_of([&] { read_trajectory(path); }), HasSubstr("2 topics with poses"));
  expect_samples(read_trajectory(path + ":/a"));
  folder.write("odd %41 #?name.db3-wal", "not yet merged");
  expect_error([&] { read_trajectory(path + ":/a"); }, "the recording was not closed");
}

// A topic may be stored as "pose", as in evo's example, and requested as /pose, or vice versa.
TEST(Recordings, TheSlashOfATopicDoesNotCount) {
  TempFolder folder;
  for (const char* stored : {"pose", "/pose"}) {
    const std::string bag =
        folder.write("run.bag", bag_of({ros1_channel(stored, "nav_msgs/Odometry"), images}));
    const std::string mcap =
        folder.write("run.mcap", mcap_of({cdr_channel(stored, "nav_msgs/msg/Odometry")}));
    for (const char* asked : {":pose", ":/pose"}) {
      expect_samples(read_trajectory(bag + asked));
      expect_samples(read_trajectory(mcap + asked));
    }
  }
  const std::string both = folder.write("both.bag", bag_of({ros1_channel("pose", "nav_msgs/Odometry"),
                                                            ros1_channel("/pose", "nav_msgs/Odometry")}));
  expect_error([&] { read_trajectory(both + ":/pose"); }, "with and without its slash");
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

// ---- rejected recordings

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

TEST(Recordings, InvalidPosesAreErrors) {
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
    if (n == index) continue;  // a complete chunk, without its index
    EXPECT_NE(bag_error(bag.substr(0, n)), "no error") << n;
  }
  EXPECT_EQ(bag_error(bag.substr(0, index)), "no error");
  const size_t tail = mcap_record('\x02', std::string(20, '\0')).size() + 8;
  for (const std::string& mcap : {chunked, plain}) {
    for (size_t n = 0; n + tail < mcap.size(); ++n) EXPECT_NE(mcap_error(mcap.substr(0, n)), "no error") << n;
    EXPECT_EQ(mcap_error(mcap.substr(0, mcap.size() - tail)), "no error") << "whole data";
  }
}

TEST(Recordings, ABagThatIsCutAtARecordIsAnErrorOrHasAWarning) {
  const std::vector<Channel> channels = {images, ros1_channel("/pose", "nav_msgs/Odometry")};
  const std::string bag = bag_of(channels);
  EXPECT_THAT(decode_trajectory(bag, "bag").warnings, IsEmpty());
  // The chunk of a bag that is cut between two chunks is complete.
  const size_t index_at = bag.find("index_pos=") + 10;
  std::string cut = bag;
  cut.replace(index_at, 8, bytes(uint64_t{bag.size() + 1000}));
  EXPECT_THAT(bag_error(cut), AllOf(HasSubstr(fmt::format("has {} bytes", bag.size())),
                                    HasSubstr(fmt::format("more than {}", bag.size() + 1000))));
  const TrajectoryFile open = decode_trajectory(bag_of(channels, "none", false), "bag");
  EXPECT_EQ(open.poses.size(), std::size(samples));
  EXPECT_THAT(open.warnings, ElementsAre(HasSubstr("was not closed, so its end may be missing")));
}

TEST(Recordings, ForgedLengthsAllocateNoMemory) {
  std::string bag = "#ROSBAG V2.0\n" + bytes(uint32_t{0xffffffff}) + "x";
  EXPECT_THAT(bag_error(bag), HasSubstr("4294967295 bytes where 1 are left"));
  const std::string header = op('\x05') + bag_field("compression", "lz4");
  const auto chunk = [&](const std::string& size) {
    return "#ROSBAG V2.0\n" + bag_record(header + bag_field("size", size), compressed("lz4", "short"));
  };
  EXPECT_THAT(bag_error(chunk(bytes(uint32_t{0xffffffff}))), HasSubstr("268435456 at most"));
  EXPECT_THAT(bag_error(chunk(bytes(uint32_t{200'000'000}))),
              HasSubstr("more than 16 MB and 200 times the file"));
  EXPECT_THAT(bag_error(chunk(bytes(uint32_t{10'000'000}))),
              HasSubstr("has 5 bytes, but its header states 10000000"));
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
  EXPECT_THAT(bag_error("#ROSBAG V1.2\n"), HasSubstr("not a ROS bag of version 2.0"));
  EXPECT_THAT(mcap_error(""), HasSubstr("not an MCAP"));
}

TEST(Rosbag2, HostileFilesAreErrors) {
  const std::string good = rosbag2_of({images, cdr_channel("/pose", "nav_msgs/msg/Odometry")});
  const auto error = [](const std::string& b) { return error_of([&] { decode_trajectory(b, "rosbag2"); }); };
  for (size_t n = 0; n < good.size(); n += 509)
    EXPECT_THAT(error(good.substr(0, n)), testing::AnyOf(HasSubstr("cut off"), HasSubstr("not a SQLite")))
        << n;
  EXPECT_THAT(error(good.substr(0, good.size() - 1)), HasSubstr("it is cut off"));
  const auto with = [&](const std::string& sql) {
    return error(rosbag2_of({cdr_channel("/pose", "nav_msgs/msg/Odometry")}, sql));
  };
  EXPECT_EQ(with(""), "no error");
  EXPECT_THAT(with("DROP TABLE topics"), HasSubstr("no such table: topics"));
  EXPECT_THAT(with("DROP TABLE messages"), HasSubstr("no such table: messages"));
  EXPECT_THAT(with("ALTER TABLE messages RENAME TO m; CREATE VIEW messages AS SELECT * FROM m"),
              HasSubstr("cannot be read as a rosbag2"))
      << "what a view computes is never run";
  EXPECT_THAT(with("INSERT INTO messages VALUES(99, 7, 5, x'00')"), HasSubstr("topic with id 7"));
  EXPECT_THAT(with("UPDATE messages SET data = x'0001'"), HasSubstr("damaged"));
  EXPECT_THAT(with("UPDATE messages SET data = x'28b52ffd00'"), HasSubstr("compressed message"));
  EXPECT_THAT(with("UPDATE topics SET serialization_format = 'protobuf'"), HasSubstr("no topic with poses"));
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
      {"rosbag2", rosbag2_of({cdr_channel("/pose", "nav_msgs/msg/Odometry")})},
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
        ASSERT_TRUE(file.poses.positions_m[k].allFinite() && std::isfinite(file.poses.stamps_s[k]));
        ASSERT_TRUE(!file.poses.has_rotations() || file.poses.rotations[k].allFinite());
      }
    } catch (const Error&) {
    }
  }
  EXPECT_GT(read, n / 50);
}

}  // namespace
}  // namespace sextant
