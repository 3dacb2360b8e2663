#include "sextant/eval/logs/number_file.h"

#include <gmock/gmock.h>

#include "sextant/base/error.h"

namespace sextant {
namespace {

std::optional<PoseColumns> columns(std::string_view header, size_t n = 8) {
  return columns_of(header, n, "f:1");
}

TEST(PoseColumns, HeadersOfKnownPrograms) {
  const auto vslam_lab = columns("ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw");
  ASSERT_TRUE(vslam_lab);
  EXPECT_TRUE(vslam_lab->in_order(false));
  EXPECT_EQ(vslam_lab->seconds_per_unit, 1e-9);

  const auto euroc = columns(
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z "
      "[], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y "
      "[rad s^-1], b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]",
      17);
  ASSERT_TRUE(euroc);
  EXPECT_TRUE(euroc->in_order(true));
  EXPECT_EQ(euroc->seconds_per_unit, 0) << "the data set's own header does not say";
  EXPECT_EQ(
      columns(
          "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []")
          ->seconds_per_unit,
      1e-9);

  const auto tum = columns("# timestamp tx ty tz qx qy qz qw");
  ASSERT_TRUE(tum);
  EXPECT_TRUE(tum->in_order(false));
  const auto openvins = columns("# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12", 10);
  ASSERT_TRUE(openvins);
  EXPECT_EQ(openvins->seconds_per_unit, 1);
}

TEST(PoseColumns, AnyOrderAndOtherColumns) {
  const auto c = columns("qw,qx,qy,qz,cov_x,pose.position.x,pose.position.y,pose.position.z,stamp_us,", 9);
  ASSERT_TRUE(c);
  EXPECT_EQ(c->quaternion, (std::array<size_t, 4>{1, 2, 3, 0}));
  EXPECT_EQ(c->position, (std::array<size_t, 3>{5, 6, 7}));
  EXPECT_EQ(c->time, 8);
  EXPECT_EQ(c->seconds_per_unit, 1e-6);
}

TEST(PoseColumns, CommasInsideQuotesSeparateNoNames) {
  const auto c =
      columns("\"label, \"\"free\"\", text\",\"t [s]\",x,\"y\",z,qx,qy,qz,qw,\"\",\"remark, last\"", 11);
  ASSERT_TRUE(c);
  EXPECT_EQ(c->time, 1);
  EXPECT_EQ(c->seconds_per_unit, 1);
  EXPECT_EQ(c->position, (std::array<size_t, 3>{2, 3, 4}));
  EXPECT_EQ(c->quaternion, (std::array<size_t, 4>{5, 6, 7, 8}));
  EXPECT_TRUE(columns("t [s],x,y,z,qx,qy,qz,qw,5\" lens", 9))
      << "a quote inside a name begins no quoted name";
}

TEST(PoseColumns, RotationsUnderOtherNamesAreListed) {
  EXPECT_EQ(columns("t [s],x,y,z,roll,pitch,yaw", 7)->unread_rotation, "roll, pitch, yaw");
  EXPECT_EQ(columns("t [s],x,y,z,q0,q1,q2,q3")->unread_rotation, "q0, q1, q2, q3");
  EXPECT_EQ(columns("t [s],x,y,z,rx,ry,rz,rw")->unread_rotation, "rx, ry, rz, rw");
  EXPECT_EQ(columns("t [s],x,y,z,w,i,j,k")->unread_rotation, "w, i, j, k");
  EXPECT_EQ(columns("t [s],x,y,z,qx,qy,qz,qw")->unread_rotation, "");
  EXPECT_EQ(columns("t [s],x,y,z,vx,vy,vz,heading")->unread_rotation, "");
  EXPECT_EQ(columns("t [s],x,y,z,std_roll,std_pitch,std_yaw", 7)->unread_rotation, "");
}

TEST(PoseColumns, AmbiguousHeadersGiveNoResult) {
  EXPECT_FALSE(columns("")) << "no header";
  EXPECT_FALSE(columns("# ground truth trajectory of a drive"));
  EXPECT_FALSE(columns("#timestamp,p_x", 8)) << "fewer names than columns";
  EXPECT_FALSE(columns("t,x,y,z,qx,qy,qz", 7)) << "no w";
  EXPECT_FALSE(columns("t,tx,ty,tz,qx,qy,qz,qw,px,py,pz", 11)) << "two positions";
  EXPECT_FALSE(columns("frame_id,tx,ty,tz,qx,qy,qz,qw")) << "no time";
  EXPECT_TRUE(columns("t,x,y,z,qx,qy,qz,qw,gt_x,gt_y,gt_z,gt_qx,gt_qy,gt_qz,gt_qw", 15));
  EXPECT_THROW(columns("t,x [mm],y [mm],z [mm],qx,qy,qz,qw"), Error);
}

TEST(PoseColumns, HeadersOfOneOrder) {
  EXPECT_FALSE(header_contradicts(" Frame_id, \"tx\",ty,\r", "frame_id,tx,ty"));
  EXPECT_TRUE(header_contradicts("frame_id,ty,tx", "frame_id,tx,ty"));
  EXPECT_FALSE(header_contradicts("", "frame_id,tx,ty"));
}

}  // namespace
}  // namespace sextant
