#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/object_drive_testing.h"
#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/logs/object_association.h"

namespace sextant {
namespace {

/// Exchanges the motions and poses of two objects from the frame `from` on.
void exchange_objects(ObjectLog& log, int a, int b, int from) {
  const ObjectLog right = log;
  for (auto& [key, pose] : log.poses) {
    const auto [id, k] = key;
    const auto other = right.poses.find({id == a ? b : a, k});
    if ((id == a || id == b) && k >= from && other != right.poses.end()) pose = other->second;
  }
  for (auto& [key, motion] : log.motions) {
    const auto [id, k] = key;
    const auto other = right.motions.find({id == a ? b : a, k});
    if ((id == a || id == b) && k >= from && other != right.motions.end())
      motion.estimate = other->second.estimate;
  }
}

/// The log of a drive, whose poses are 0.3 m off the true ones.
ObjectLog log_of_drive() {
  const Drive drive;
  ObjectLog log{.estimator = "m"};
  for (const auto& [key, H] : drive.estimate) log.motions[key] = {H, drive.truth(key)};
  log.true_poses = drive.L;
  for (const auto& [key, L] : drive.L) log.poses[key] = about_y(0, {0.3, 0, 0}) * L;
  log.camera = log.true_camera = drive.camera;
  return log;
}

TEST(ObjectIdentities, ExchangedObjectsAreNamedByTheirPoses) {
  EXPECT_THAT(diagnose_identities(log_of_drive()), IsEmpty());
  for (const int from : {0, 12}) {
    ObjectLog log = log_of_drive();
    exchange_objects(log, 1, 4, from);
    const std::vector<DataWarning> found = diagnose_identities(log);
    ASSERT_EQ(found.size(), 1u) << from;
    EXPECT_EQ(found[0].code, "ids");
    EXPECT_THAT(found[0].text,
                HasSubstr(from == 0 ? "look exchanged: what" : "look exchanged from frame 12 on: what"));
    EXPECT_THAT(found[0].text,
                HasSubstr(fmt::format("object 1 follows true object 4 in frames {}-29", from)));
    EXPECT_THAT(found[0].text,
                HasSubstr(fmt::format("object 4 follows true object 1 in frames {}-29", from)));
  }
}

TEST(ObjectIdentities, RealObjectsAreTheirOwnUntilTheyAreExchanged) {
  SEXTANT_NEEDS_DATA("dynosam_kitti_0000");
  for (ObjectLog& log : read_object_logs(real_data("dynosam_kitti_0000").string(), {LogFormat::dynosam})) {
    EXPECT_THAT(diagnose_identities(log), IsEmpty()) << log.estimator;
    EXPECT_THAT(diagnose_frames(log, log.true_camera), IsEmpty()) << log.estimator;
    if (log.estimator != "frontend") continue;
    exchange_objects(log, 1, 2, 46);
    const std::vector<DataWarning> found = diagnose_identities(log);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_THAT(found[0].text, HasSubstr("look exchanged from frame 46 on"));
  }
}

TEST(ObjectIdentities, ObjectsWithoutAFrameOfTheCameraAreNamed) {
  ObjectLog log = log_of_drive();
  EXPECT_THAT(diagnose_frames(log, log.true_camera), IsEmpty());
  Trajectory later;
  for (const auto& [k, pose] : log.camera.poses()) later.set(k + 1000, pose);
  EXPECT_THAT(diagnose_frames(log, later).at(0).text,
              HasSubstr("frames 0-29 and the true camera has frames 1000-1029"));
  log.camera = later;
  EXPECT_THAT(diagnose_frames(log, log.true_camera).at(0).text,
              HasSubstr("frames 0-29 and the camera has frames 1000-1029, so they have no common frame"));
  log.camera = {};
  EXPECT_THAT(diagnose_frames(log, {}), IsEmpty());
}

}  // namespace
}  // namespace sextant
