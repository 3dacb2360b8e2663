#include "sextant/eval/logs/trajectory_files.h"

#include "sextant/base/error.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {
using testing::SizeIs;

constexpr const char* tum = "# time x y z\n1.0 1 2 3 0 0 0 1\n1.1 2 2 3 0 0 0.6 0.8\n";
constexpr const char* kitti = "1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 2 0 1 0 2 0 0 1 3\n";

class TrajectoryFiles : public testing::Test {
 protected:
  TrajectoryFile read(const std::string& bytes, const std::string& format = "auto") {
    return read_trajectory(folder.write("file.txt", bytes), format);
  }
  std::string error(const std::string& bytes, const std::string& format) {
    return error_of([&] { read(bytes, format); });
  }
  TempFolder folder;
};

TEST_F(TrajectoryFiles, EveryFormatReadsItsExampleAndIsDetected) {
  const std::string euroc =
      "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v_x,v_y\n1403636579763555584,1,2,3,1,0,0,0,9,"
      "9\n1403636579863555584,2,2,3,1,0,0,0,9,9\n";
  const std::string vdo = "4 1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\n5 1 0 0 2 0 1 0 2 0 0 1 3 0 0 0 1\n";
  const std::string dynosam =
      "frame_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,gt_ty,gt_tz,gt_qx,gt_qy,gt_qz,gt_qw\n"
      "4,1,2,3,0,0,0,1,5,2,3,0,0,0,1\n5,2,2,3,0,0,0,1,6,2,3,0,0,0,1\n";
  const std::string pose =
      "<R_><rot11>1</rot11><rot12>0</rot12><rot13>0</rot13><rot21>0</rot21><rot22>1</rot22><rot23>0</rot23>"
      "<rot31>0</rot31><rot32>0</rot32><rot33>1</rot33></R_><t_><data><item>1</item><item>2</item><item>3</"
      "item></data></t_>";
  const std::string xml =
      "<?xml version=\"1.0\"?>\n<!DOCTYPE "
      "boost_serialization>\n<boost_serialization><val><count>1</count><item><pose>" +
      pose + "</pose><gt_pose>" + pose +
      "</gt_pose>\n<frame_id>4</frame_id></item></val></boost_serialization>\n";
  for (const auto& [format, bytes] : std::map<std::string, std::string>{{"tum", tum},
                                                                        {"kitti", kitti},
                                                                        {"euroc", euroc},
                                                                        {"vdo", vdo},
                                                                        {"dynosam", dynosam},
                                                                        {"vdo_xml", xml}}) {
    SCOPED_TRACE(format);
    const TrajectoryFile file = read(bytes);
    EXPECT_EQ(file.format, format);
    EXPECT_EQ(file.poses.positions_m[0], Eigen::Vector3d(1, 2, 3));
    EXPECT_THAT(file.warnings, IsEmpty());
    EXPECT_EQ(file.truth.has_value(), format == "dynosam" || format == "vdo_xml");
  }
  EXPECT_THAT(read(euroc).poses.stamps_s, ElementsAre(1403636579763555584 / 1e9, 1403636579863555584 / 1e9));
  EXPECT_THAT(read(vdo).poses.frames, ElementsAre(4, 5));
  EXPECT_EQ(read(dynosam).truth->positions_m[1], Eigen::Vector3d(6, 2, 3));
}

TEST_F(TrajectoryFiles, QuaternionsAreXyzwInTumAndWxyzInEuroc) {
  EXPECT_NEAR(read(tum).poses.rotations[1](0, 0), 1 - 2 * 0.36, 1e-15);
  EXPECT_NEAR(read("1e18,0,0,0,0.8,0,0,0.6\n", "euroc").poses.rotations[0](0, 0), 1 - 2 * 0.36, 1e-15);
}

TEST_F(TrajectoryFiles, KittiWithFrameNumbers) {
  EXPECT_THAT(read("7 1 0 0 1 0 1 0 2 0 0 1 3\n9 1 0 0 2 0 1 0 2 0 0 1 3\n").poses.frames, ElementsAre(7, 9));
  EXPECT_THAT(error("7.5 1 0 0 1 0 1 0 2 0 0 1 3\n", "kitti"), HasSubstr(":1: expected a frame number"));
}

TEST_F(TrajectoryFiles, PosesWithoutATimeAreThoseOfTheirRow) {
  const TrajectoryFile file = read("1 2 3 0 0 0 1\n2 2 3 0 0 0.6 0.8\n");
  EXPECT_EQ(file.format, "tartanair");
  EXPECT_EQ(file.poses.positions_m[1], Eigen::Vector3d(2, 2, 3));
  EXPECT_NEAR(file.poses.rotations[1](0, 0), 1 - 2 * 0.36, 1e-15) << "x y z w";
  EXPECT_THAT(file.poses.stamps_s, IsEmpty());
  EXPECT_EQ(read("tx,ty,tz,qx,qy,qz,qw\n1,2,3,0,0,0,1\n").format, "tartanair");
  EXPECT_THAT(error("# tx ty tz qw qx qy qz\n1 2 3 1 0 0 0\n", "auto"), HasSubstr("in another order"));
  EXPECT_THAT(error("1 2 3 0 0 0 2\n", "auto"), HasSubstr("has norm 2"));
  EXPECT_THAT(error("1 1 2 3 0 0 0 1\n", "tartanair"), HasSubstr("7 values"));
}

TEST_F(TrajectoryFiles, WindowsTextIsRead) {
  const std::string text = "\xef\xbb\xbf# t\r\n1.0 1 2 3 0 0 0 1 \r\n\r\n  1.1\t2 2 3 0 0 0 +1e0";
  EXPECT_THAT(read(text).poses.stamps_s, ElementsAre(1.0, 1.1));
}

TEST_F(TrajectoryFiles, DamageIsReportedWithItsLine) {
  EXPECT_THAT(error("1 1 2 3 0 0 0 1\n2 nan 2 3 0 0 0 1\n", "tum"), HasSubstr(":2: value 2 is 'nan'"));
  EXPECT_THAT(error("1 1 2 3 0 0 0 1\n2 -inf 2 3 0 0 0 1\n", "tum"), HasSubstr(":2: value 2 is '-inf'"));
  EXPECT_THAT(error("1 1 2 3 0 0 0 1\n2 1e999 2 3 0 0 0 1\n", "tum"), HasSubstr(":2: value 2"));
  EXPECT_THAT(error("1 1 2 3 0 0 0\n", "tum"), HasSubstr(":1: expected t tx ty tz qx qy qz qw, got 7"));
  EXPECT_THAT(error("1 1 2 3 0 0 0 1\n2 1 2 3 0 0\n", "tum"),
              HasSubstr(":2: expected 8 values as in the lines before"));
  EXPECT_THAT(error("1 1,234.5 2 3 0 0 0 1\n", "tum"), HasSubstr("thousands separators"));
  EXPECT_THAT(error("1e18,\"1,234\",2,3,1,0,0,0\n", "euroc"), HasSubstr(":1: expected a number for value 2"));
  EXPECT_THAT(error("1 x 2 3 0 0 0 1\n", "tum"), HasSubstr(":1: expected a number for value 2, got 'x'"));
  EXPECT_THAT(error("", "tum"), HasSubstr("holds no pose"));
  EXPECT_THAT(error("# only a comment\n\n", "kitti"), HasSubstr("holds no pose"));
  EXPECT_THAT(error("1 9e9 2 3 0 0 0 1\n", "tum"), HasSubstr("expected metres"));
  EXPECT_THAT(error("1,,2,3,1,0,0,0\n", "euroc"), HasSubstr("value 2 is empty"));
  EXPECT_THAT(error(std::string("\0\1\2\3", 4), "tum"), HasSubstr("expected a text file"));
  EXPECT_THAT(error(std::string(100000, '1'), "tum"), HasSubstr(":1:"));
  EXPECT_THAT(error("\xff\xfe"
                    "1\0",
                    "tum"),
              HasSubstr("UTF-16"));
  expect_error([] { read_trajectory("/nowhere/at/all.txt", "tum"); }, "cannot open");
  expect_error([&] { read_trajectory(folder.path().string(), "tum"); }, "is a folder, expected a file");
}

TEST_F(TrajectoryFiles, QuaternionsOffUnitNorm) {
  EXPECT_THAT(read("1 1 2 3 0 0 0 1.0009\n").warnings, IsEmpty());
  const TrajectoryFile rounded = read("1 1 2 3 0 0 0.6 0.81\n");
  EXPECT_THAT(rounded.warnings, ElementsAre(HasSubstr("normalised")));
  EXPECT_NEAR(rounded.poses.rotations[0].determinant(), 1, 1e-15);
  EXPECT_THAT(error("1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0 1.03\n", "tum"), HasSubstr(":2: quaternion"));
  EXPECT_THAT(error("1 1 2 3 0 0 0 1.2\n", "tum"), HasSubstr("has norm 1.2"));
  EXPECT_THAT(error("1 1 2 3 0 0 0 0\n", "tum"), HasSubstr("has norm 0"));
}

TEST_F(TrajectoryFiles, MatricesOffOrthonormal) {
  EXPECT_THAT(read("1.000001 0 0 1 0 1 0 2 0 0 1 3\n").warnings, IsEmpty());
  EXPECT_THAT(read("1.001 0 0 1 0 1 0 2 0 0 1 3\n").warnings, ElementsAre(HasSubstr("not orthonormal")));
  EXPECT_THAT(error("1.1 0 0 1 0 1 0 2 0 0 1 3\n", "kitti"), HasSubstr("expected a rotation matrix"));
  EXPECT_THAT(error("-1 0 0 1 0 1 0 2 0 0 1 3\n", "kitti"), HasSubstr("reflection"));
}

TEST_F(TrajectoryFiles, StampsAndFramesMustRise) {
  const std::string rest = " 2 0 0 0 0 0 1\n";
  EXPECT_THAT(error("# t\n2" + rest + "1" + rest + "3" + rest, "tum"),
              HasSubstr(":3: time stamp 1 comes after 2 of line 2"));
  EXPECT_THAT(error("1" + rest + "1" + rest + "3.00000123" + rest, "tum"),
              HasSubstr(":2: time stamp 1 stands in line 1 too"));
  EXPECT_THAT(error("1.403637e+09" + rest + "1.403637e+09" + rest + "1.403638e+09" + rest, "tum"),
              HasSubstr("as \"%.6e\" prints them"));
  EXPECT_THAT(error("1.403637e+09" + rest + "1.403637e+09" + rest, "tum"),
              HasSubstr("as \"%.6e\" prints them"));
  EXPECT_THAT(error("4.900000" + rest + "5.000000" + rest + "5.000000" + rest, "tum"),
              HasSubstr(":3: time stamp 5 stands in line 2 too: expected one pose each"));
  const std::string matrix = " 1 0 0 1 0 1 0 2 0 0 1 3\n";
  EXPECT_THAT(error("4" + matrix + "4" + matrix, "kitti"),
              HasSubstr(":2: frame number 4 stands in line 1 too"));
  EXPECT_THAT(error("5" + matrix + "4" + matrix, "kitti"), HasSubstr(":2: frame number 4 comes after 5"));
}

TEST_F(TrajectoryFiles, PositionsWithoutRotations) {
  for (const char* text :
       {"1 1 2 3\n2 4 5 6\n", "1,1,2,3\n2,4,5,6\n", "t [ms],x,y,z,sigma\n1000,1,2,3,9\n2000,4,5,6,9\n",
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m]\n1000000000,1,2,3\n2000000000,4,5,6\n"}) {
    const TrajectoryFile file = read(text);
    EXPECT_FALSE(file.poses.has_rotations()) << text;
    EXPECT_THAT(file.poses.stamps_s, ElementsAre(1, 2)) << text;
    EXPECT_EQ(file.poses.positions_m[1], Eigen::Vector3d(4, 5, 6)) << text;
  }
  EXPECT_THAT(error("1 2 3\n", "positions"), HasSubstr("expected t x y z, got 3"));
}

std::string numbers(const Eigen::VectorXd& v) {
  std::string text;
  for (const double x : v) text += fmt::format(" {:.12g}", x);
  return text;
}

/// Positive definite, with distinct elements.
PoseCovariance covariance() {
  PoseCovariance A;
  for (int i = 0; i < 36; ++i) A(i / 6, i % 6) = std::sin(1.0 + i * i);
  return 0.01 * (A * A.transpose() + PoseCovariance::Identity());
}

TEST_F(TrajectoryFiles, CovariancesBehindTumLines) {
  const PoseCovariance P = covariance();
  const std::string pose = "1 1 2 3 0 0 0.6 0.8";  // rotated about z
  Eigen::VectorXd triangle(21), blocks(12), full(36);
  int k = 0, b = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) full[6 * i + j] = P(i, j);
    for (int j = i; j < 6; ++j) triangle[k++] = P(i, j);
  }
  for (const int at : {3, 0}) {
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) blocks[b++] = P(at + i, at + j);
    }
  }
  for (const Eigen::VectorXd& v : {triangle, full}) {
    const TrajectoryFile file = read(pose + numbers(v) + "\n");
    EXPECT_EQ(file.format, "tum");
    EXPECT_LT((file.poses.covariances.at(0) - P).norm(), 1e-12);
  }
  const TrajectoryFile openvins = read(pose + numbers(blocks) + "\n");
  const Eigen::Matrix3d R = openvins.poses.rotations[0];
  EXPECT_LT((openvins.poses.covariances.at(0).topLeftCorner<3, 3>() - P.topLeftCorner<3, 3>()).norm(), 1e-12);
  const Eigen::Matrix3d turned = R * P.bottomRightCorner<3, 3>() * R.transpose();
  EXPECT_LT((openvins.poses.covariances.at(0).bottomRightCorner<3, 3>() - turned).norm(), 1e-12);
  const std::string header =
      "# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 Pt12 Pt13 Pt22 Pt23 Pt33\n";
  EXPECT_EQ(read(header + pose + numbers(blocks) + "\n").poses.covariances.at(0),
            openvins.poses.covariances[0]);
}

TEST_F(TrajectoryFiles, InvalidCovariancesAreErrors) {
  const std::string first = "1 1 2 3 0 0 0 1", second = "2 1 2 3 0 0 0 1";
  PoseCovariance P = covariance(), transposed = P;
  transposed.topRightCorner<3, 3>() = P.bottomLeftCorner<3, 3>();
  transposed.bottomLeftCorner<3, 3>() = P.topRightCorner<3, 3>();
  const auto lines = [&](const PoseCovariance& a, const PoseCovariance& b) {
    return first + numbers(Eigen::Map<const Eigen::VectorXd>(a.data(), 36)) + "\n" + second +
           numbers(Eigen::Map<const Eigen::VectorXd>(b.data(), 36)) + "\n";
  };
  EXPECT_THAT(error(lines(P, transposed), "tum"),
              HasSubstr(":2: the covariance of the pose is not positive"));
  transposed.topRightCorner<3, 3>() = P.topRightCorner<3, 3>();
  EXPECT_THAT(error(lines(P, transposed), "tum"),
              HasSubstr(":2: the covariance of the pose is not symmetric"));
  PoseCovariance negative = P;
  negative(4, 4) = -1e-3;
  EXPECT_THAT(error(lines(P, negative), "tum"), HasSubstr(":2: the covariance of the pose is not positive"));
  const PoseCovariance zero = PoseCovariance::Zero();
  EXPECT_THAT(error(lines(P, zero), "tum"), HasSubstr(":2: the covariance of the pose is all zeros"));
  EXPECT_TRUE(read(lines(zero, zero), "tum").poses.covariances.empty()) << "unknown, as ROS has it";
}

TEST_F(TrajectoryFiles, UnknownFormatsAreNotGuessed) {
  EXPECT_THAT(error("1 2 3\n", "auto"), HasSubstr("cannot determine the format"));
  EXPECT_THAT(error(tum, "kitty"), HasSubstr("did you mean 'kitti'"));
}

// A table of VSLAM-LAB: w last, although there are commas and nanoseconds as in EuRoC.
TEST_F(TrajectoryFiles, ColumnsAreThoseOfTheHeader) {
  const TrajectoryFile lab = read(
      "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw\n1403636579763555584,1,2,3,0,0,0.6,0.8\n"
      "1403636579863555584,1,2,3,0,0,0.6,0.8\n");
  EXPECT_NEAR(lab.poses.rotations[0](0, 0), 1 - 2 * 0.36, 1e-15);
  EXPECT_EQ(lab.poses.stamps_s[0], 1403636579763555584 / 1e9);
  const TrajectoryFile any = read("qw qx qy qz z y x time_ms more\n0.8 0.6 0 0 3 2 1 1500 7\n", "table");
  EXPECT_NEAR(any.poses.rotations[0](1, 1), 1 - 2 * 0.36, 1e-15);
  EXPECT_EQ(any.poses.positions_m[0], Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(any.poses.stamps_s, ElementsAre(1.5));
  EXPECT_EQ(read("# t(s) x y z qw qx qy qz\n1 1 2 3 0.8 0 0 0.6\n").format, "table") << "blanks, but w first";
  EXPECT_EQ(read("# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12 Pr13 Pr22\n1 1 2 3 0 0 0 1 1 2 3 4\n").format,
            "table")
      << "12 values, but no matrix";
}

TEST_F(TrajectoryFiles, AmbiguousFormatsAreErrors) {
  for (const char* text : {"1403636579763555584,1,2,3,0,0,0.6,0.8\n", "1.5,1,2,3,0,0,0.6,0.8\n",
                           "#timestamp,p_x\n1403636579763555584,1,2,3,1,0,0,0,9,9\n"}) {
    EXPECT_THAT(error(text, "auto"), AllOf(HasSubstr("euroc"), HasSubstr("tum"), HasSubstr("--format")))
        << text;
  }
  EXPECT_NEAR(read("1.5,1,2,3,0,0,0.6,0.8\n", "tum").poses.rotations[0](0, 0), 1 - 2 * 0.36, 1e-15);
  EXPECT_NEAR(read("1e18,1,2,3,0.8,0,0,0.6\n", "euroc").poses.rotations[0](0, 0), 1 - 2 * 0.36, 1e-15);
}

TEST_F(TrajectoryFiles, AFormatAgainstTheHeaderIsAnError) {
  const std::string w_last = "t [ns],x,y,z,qx,qy,qz,qw\n1e18,1,2,3,0,0,0,1\n";
  EXPECT_THAT(error(w_last, "euroc"), HasSubstr("the header names other columns than euroc"));
  EXPECT_THAT(error(w_last, "tum"), HasSubstr("another unit of time than tum"));
  EXPECT_THAT(error("t [s],x,y,z,qw,qx,qy,qz\n1e8,1,2,3,1,0,0,0\n", "euroc"),
              HasSubstr("another unit of time"));
  EXPECT_THAT(error("1 1 2 3 0 0 0 1\n", "table"), HasSubstr("expected a header that names"));
  EXPECT_THAT(error("t [s],x [cm],y,z,qw,qx,qy,qz\n1,1,2,3,1,0,0,0\n", "auto"),
              HasSubstr("convert them to metres"));
}

TEST_F(TrajectoryFiles, ColumnsThatAreNotReadMayContainText) {
  for (const char* text :
       {"timestamp [s],x,y,z,qx,qy,qz,qw,status\n5,1,2,3,0,0,0,1,OK\n6,2,2,3,0,0,0,1,\n",
        "status,timestamp [s],z,y,x,qx,qy,qz,qw\nOK,5,3,2,1,0,0,0,1\nnan,6,3,2,2,0,0,0,1\n",
        "# t x y z qx qy qz qw state\n5 1 2 3 0 0 0 1 LOST\n6 2 2 3 0 0 0 1 OK\n"}) {
    SCOPED_TRACE(text);
    const TrajectoryFile file = read(text);
    EXPECT_THAT(file.poses.stamps_s, ElementsAre(5, 6));
    EXPECT_EQ(file.poses.positions_m[1], Eigen::Vector3d(2, 2, 3));
  }
  EXPECT_THAT(error("t [s],x,y,z,qx,qy,qz,qw,status\n5,1,two,3,0,0,0,1,OK\n", "auto"),
              HasSubstr("expected a number for value 3, got 'two'"));
  EXPECT_THAT(error("t [s],x,y,z,qx,qy,qz,qw,status\n5,1,2,3,0,0,0,1,OK\n6,1,2,nan,0,0,0,1,OK\n", "auto"),
              HasSubstr(":3: value 4 is 'nan', which is not a finite number"));
  EXPECT_THAT(error("5,1,2,3,0,0,0,1,OK\n", "tum"), HasSubstr("got 'OK'")) << "no header";
}

TEST_F(TrajectoryFiles, CommasInsideQuotesAreNoSeparators) {
  const std::string first = "\"label, free\",\"t [s]\",x,y,z,qx,qy,qz,qw\n",
                    last = "t [s],x,y,z,qx,qy,qz,qw,note\n";
  for (const std::string& text : {first + "\"a, b\",1,2,3,4,0,0,0,1\n \"c \"\"d\"\", e\" ,2,2,3,5,0,0,0,1\n",
                                  last + "1,2,3,4,0,0,0,1,\"a, b\"\n2,2,3,5,0,0,0,1,\"one \"\"two\"\"\"\n"}) {
    SCOPED_TRACE(text);
    const TrajectoryFile file = read(text);
    EXPECT_THAT(file.poses.stamps_s, ElementsAre(1, 2));
    EXPECT_EQ(file.poses.positions_m[1], Eigen::Vector3d(2, 3, 5));
  }
  // A quote that is not closed or stands inside a cell has no meaning.
  const std::string header = "t [s],x,y,z,qx,qy,qz,qw,note,n\n";
  EXPECT_EQ(read(header + "1,2,3,4,0,0,0,1,\"a,5\n2,2,3,5,0,0,0,1,6\" lens,5\n").poses.size(), 2U);
}

TEST_F(TrajectoryFiles, HeadersThatDoNotNameEachColumnOnceAreExplained) {
  EXPECT_THAT(error("frame,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n", "auto"),
              AllOf(HasSubstr("its header names no column of time; known are names like time"),
                    testing::Not(HasSubstr("no header"))));
  EXPECT_THAT(error("t [s],x,y,z,x,qx,qy,qz,qw\n5,1,2,3,5,0,0,0,1\n", "auto"),
              HasSubstr("its header names x twice ('x', 'x')"));
  EXPECT_THAT(error("time,field.header.stamp,field.pose.pose.position.x,field.pose.pose.position.y,"
                    "field.pose.pose.position.z,field.pose.pose.orientation.x,field.pose.pose.orientation.y,"
                    "field.pose.pose.orientation.z,field.pose.pose.orientation.w\n5,5,1,2,3,0,0,0,1\n",
                    "auto"),
              HasSubstr("its header names time twice ('time', 'field.header.stamp')"));
  EXPECT_THAT(error("t [s],x,y,z,qx,qy,qz,qw\n5,1,2,3,0,0,0,1,7\n", "auto"),
              HasSubstr("its header has 8 names, but the first record has 9 values"));
  EXPECT_THAT(error("t [s],x,y,z,qx,qy,qz,r\n5,1,2,3,0,0,0,1\n", "table"),
              HasSubstr("its header names no column of qw"));
}

TEST_F(TrajectoryFiles, AHeaderWithBlanksMayHaveTheQuaternionInAnyOrder) {
  const TrajectoryFile file = read("# timestamp tx ty tz qw qx qy qz\n5 1 2 3 0.8 0 0 0.6\n");
  EXPECT_THAT(file.poses.stamps_s, ElementsAre(5));
  EXPECT_NEAR(file.poses.rotations[0](0, 0), 1 - 2 * 0.36, 1e-15);
}

TEST_F(TrajectoryFiles, DynosamInAnotherOrderIsAnError) {
  EXPECT_THAT(error("frame_id,tx,ty,tz,qw,qx,qy,qz,gt_tx,gt_ty,gt_tz,gt_qw,gt_qx,gt_qy,gt_qz\n"
                    "4,1,2,3,1,0,0,0,5,2,3,1,0,0,0\n",
                    "auto"),
              HasSubstr("the header names other columns than frame_id,tx"));
}

TEST_F(TrajectoryFiles, UnitsOfTimeAreNotGuessed) {
  EXPECT_THAT(error("time,x,y,z,qx,qy,qz,qw\n1500,1,2,3,0,0,0,1\n", "auto"),
              AllOf(HasSubstr("does not give the unit of time"), HasSubstr("--format tum")));
  EXPECT_THAT(error("time,x,y,z,qw,qx,qy,qz\n1500,1,2,3,1,0,0,0\n", "auto"), HasSubstr("--format euroc"));
  const std::string orb_slam3 =
      "1403636579763555584.000000 1 2 3 0 0 0 1\n1403636579863555584.000000 1 2 3 0 0 0 1\n";
  EXPECT_EQ(read(orb_slam3).format, "tum_ns");
  EXPECT_EQ(read(orb_slam3).poses.stamps_s[0], 1403636579763555584 / 1e9);
  EXPECT_THAT(error(orb_slam3, "tum"), HasSubstr("give --format tum_ns or euroc"));
  EXPECT_THAT(error("1403636579763.5 1 2 3 0 0 0 1\n", "auto"), HasSubstr("too large for seconds"))
      << "milliseconds";
  // Counted from the start of the recording: the steps decide.
  EXPECT_THAT(
      error("99900000000 1 2 3 0 0 0 1\n100000000000 1 2 3 0 0 0 1\n100100000000 1 2 3 0 0 0 1\n", "tum"),
      HasSubstr("it seems to be in ns"));
  EXPECT_THAT(error("100000000000 1 2 3 0 0 0 1\n100000100000 1 2 3 0 0 0 1\n", "tum"),
              HasSubstr("it seems to be in us"));
}

TEST_F(TrajectoryFiles, BlocksMayEndAnywhere) {
  std::string text;
  constexpr int n = 60000;  // several blocks of 1 MB
  for (int i = 0; i < n; ++i) text += fmt::format("{} {} 0.125 -3.25e-3 0 0 0 1\n", i, i * 0.001);
  const TrajectoryFile file = read(text);
  ASSERT_THAT(file.poses.positions_m, SizeIs(n));
  for (int i = 0; i < n; ++i) ASSERT_EQ(file.poses.positions_m[static_cast<size_t>(i)][0], i * 0.001) << i;
}

TEST_F(TrajectoryFiles, XmlThatIsCutOff) {
  EXPECT_THAT(error("<?xml version=\"1.0\"?>\n<val><item><frame_id>1</frame_id></item></val>", "vdo_xml"),
              HasSubstr(":2: frame 1 has no complete"));
  EXPECT_THAT(error("<?xml version=\"1.0\"?>\n<val><item>", "vdo_xml"),
              HasSubstr(":2: the file ends inside <item>: it is cut off"));
  EXPECT_THAT(error("<?xml version=\"1.0\"?>\n<val></wal>", "vdo_xml"), HasSubstr(":2: unexpected </wal>"));
}

TEST_F(TrajectoryFiles, TumRoundTrip) {
  const TrajectoryFile file = read(tum);
  const TrajectoryFile again = read(encode_tum(file.poses));
  EXPECT_EQ(again.poses.stamps_s, file.poses.stamps_s);
  EXPECT_EQ(again.poses.positions_m, file.poses.positions_m);
}

}  // namespace
}  // namespace sextant
