#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <random>

#include "sextant/base/testing.h"
#include "sextant/eval/diagnosis/trajectory_hypotheses.h"
#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/logs/number_file.h"
#include "sextant/geometry/axes.h"

namespace sextant {
namespace {

using testing::Field;

Eigen::Matrix3d turn(double yaw, double pitch, double roll) {
  return (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

/// Smooth noise: sines with random phases.
class Wave {
 public:
  Wave(std::mt19937& rng, double slowest_hz, double fastest_hz) {
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < 5; ++i) {
      rates_.push_back(2 * M_PI * (slowest_hz + uniform(rng) * (fastest_hz - slowest_hz)));
      phases_.push_back(2 * M_PI * uniform(rng));
    }
  }
  double operator()(double t) const {
    double sum = 0;
    for (size_t i = 0; i < rates_.size(); ++i) sum += std::sin(rates_[i] * t + phases_[i]);
    return sum / std::sqrt(2.5);
  }

 private:
  std::vector<double> rates_, phases_;
};

enum class Scene { drive, reverse, walk, sideways, orbit, highway, pure_rotation, standing };
constexpr Scene scenes[] = {Scene::drive, Scene::reverse, Scene::walk,          Scene::sideways,
                            Scene::orbit, Scene::highway, Scene::pure_rotation, Scene::standing};

/// True poses of a camera in opencv axes, 10 Hz.
PoseSeries truth(Scene scene, unsigned seed, int n = 400) {
  std::mt19937 rng(seed);
  const Wave a(rng, 0.01, 0.05), b(rng, 0.02, 0.2), c(rng, 0.05, 0.3), d(rng, 0.05, 0.3), e(rng, 0.05, 0.3);
  PoseSeries out;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double yaw = 0;
  for (int i = 0; i < n; ++i) {
    const double t = 0.1 * i;
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    if (scene == Scene::drive || scene == Scene::reverse) {
      R = turn(yaw, 0.01 * c(t), 0.01 * d(t));
      const double speed = std::max(0.0, 8 + 4 * b(t));
      const double sign = scene == Scene::reverse && i > n / 2 ? -1 : 1;
      p += R * Eigen::Vector3d(0, 0, 0.1 * sign * speed);
      yaw += 0.1 * 0.25 * a(t);
    } else if (scene == Scene::walk) {
      R = turn(0.8 * a(t) + 0.3 * b(t), 0.2 * c(t), 0.15 * d(t));
      p = {2 * a(t + 7) + 0.2 * c(t), 0.3 * b(t), 2 * b(t + 3) + 0.2 * e(t)};
    } else if (scene == Scene::sideways) {
      R = turn(0.02 * c(t), 0.02 * d(t), 0.02 * e(t));
      p = {6 * a(t) + b(t), 1.5 * b(t + 5), 0.5 * c(t)};
    } else if (scene == Scene::orbit) {
      const double angle = 0.15 * t;
      R = turn(-angle, 0.03 * c(t), 0);
      p = R * Eigen::Vector3d(0, 0, -5 + 0.3 * b(t));
    } else if (scene == Scene::highway) {
      R = turn(0.004 * a(t), 0.001 * c(t), 0.001 * d(t));
      p += R * Eigen::Vector3d(0, 0, 1.5 + 0.3 * b(t));
    } else if (scene == Scene::pure_rotation) {
      R = turn(2 * a(t), 0.3 * b(t), 0.1 * c(t));
      p = {10, 2, -5};
    }
    out.add(R, p);
    out.stamps_s.push_back(100 + t);
  }
  return out;
}

/// Simulates odometry: adds noise to the steps of the truth and chains them.
PoseSeries estimate_of(const PoseSeries& truth, unsigned seed, double noise = 0.004) {
  std::mt19937 rng(seed + 1000);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Eigen::Vector3d(normal(rng), normal(rng), normal(rng)); };
  PoseSeries out = truth;
  for (size_t i = 1; i < out.size(); ++i) {
    const RelativePose step = relative_pose(truth, i - 1, i);
    const Eigen::Vector3d w = 0.05 * noise * vector();
    out.rotations[i] = out.rotations[i - 1] * step.rotation * so3_exp(w).toRotationMatrix();
    out.positions_m[i] =
        out.positions_m[i - 1] + out.rotations[i - 1] * (step.translation_m + noise * vector());
  }
  return out;
}

EgoResult evaluate_aligned(const PoseSeries& reference, const PoseSeries& estimate, Alignment alignment) {
  EgoReference r;
  r.poses = reference;
  r.side.name = "a.txt";
  TrajectoryFile file;
  file.poses = estimate;
  EgoOptions options;
  options.alignment = alignment;
  return evaluate_ego(r, std::move(file), "b.txt", options);
}

void scaled(PoseSeries& s, double factor) {
  for (Eigen::Vector3d& p : s.positions_m) p *= factor;
}
void turned(PoseSeries& s, const Eigen::Matrix3d& world, const Eigen::Matrix3d& body) {
  for (Eigen::Matrix3d& R : s.rotations) R = world * R * body;
  for (Eigen::Vector3d& p : s.positions_m) p = world * p;
}
void w_first(PoseSeries& s) {  // written as w x y z, read as x y z w
  for (Eigen::Matrix3d& R : s.rotations) {
    const Eigen::Quaterniond q(R);
    R = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
  }
}
void to_steps(PoseSeries& s, bool inverse) {
  const PoseSeries poses = s;
  for (size_t i = 0; i < s.size(); ++i) {
    RelativePose step =
        i == 0 ? RelativePose{poses.rotations[0], poses.positions_m[0]} : relative_pose(poses, i - 1, i);
    s.rotations[i] = inverse ? Eigen::Matrix3d(step.rotation.transpose()) : step.rotation;
    s.positions_m[i] = inverse ? Eigen::Vector3d(-s.rotations[i] * step.translation_m) : step.translation_m;
  }
}
void delayed(PoseSeries& s, int frames) {
  const std::vector<double> stamps = s.stamps_s;
  std::vector<int> kept;
  for (int i = 0; i < static_cast<int>(s.size()); ++i) {
    const int from = i - frames;
    if (from >= 0 && from < static_cast<int>(s.size())) kept.push_back(from);
  }
  const size_t first = frames > 0 ? static_cast<size_t>(frames) : 0;
  s.keep(kept);
  s.stamps_s.assign(stamps.begin() + static_cast<std::ptrdiff_t>(first),
                    stamps.begin() + static_cast<std::ptrdiff_t>(first + kept.size()));
}

/// Replaces east, north, up by latitude, longitude (degrees) and height.
void to_degrees(PoseSeries& s) {
  constexpr double m_per_degree = 6'371'000 * M_PI / 180, latitude_deg = 49;
  const Eigen::Matrix3d enu =
      turn(0, -M_PI / 2, 0);  // x right, y down, z forward to x right, y forward, z up
  turned(s, enu, Eigen::Matrix3d::Identity());
  for (Eigen::Vector3d& p : s.positions_m) {
    p = {latitude_deg + p.y() / m_per_degree,
         8.4 + p.x() / (m_per_degree * std::cos(latitude_deg * M_PI / 180)), p.z()};
  }
}
/// Multiplies the angles of the rotations, whose axes stay.
void multiply_angles(PoseSeries& s, double factor) {
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (Eigen::Matrix3d& R : s.rotations) {
    const Eigen::AngleAxisd turn(R);
    // The rotation vector that continues the one before: the angle exceeds pi in a long turn.
    Eigen::Vector3d best = turn.angle() * turn.axis();
    for (const int turns : {-2, -1, 1, 2}) {
      const Eigen::Vector3d other = (turn.angle() + 2 * M_PI * turns) * turn.axis();
      if ((other - last).norm() < (best - last).norm()) best = other;
    }
    last = best;
    R = so3_exp(factor * best).toRotationMatrix();
  }
}

struct PlantedMistake {
  const char* name;
  std::function<void(PoseSeries& reference, PoseSeries& estimate)> plant;
  const char* code;
  const char* remedy;
  std::vector<Alignment> alignments = {Alignment::none, Alignment::se3};
};

std::vector<PlantedMistake> plants() {
  const Eigen::Matrix3d flu = opencv_from_axes(Axes::flu), gl = opencv_from_axes(Axes::opengl),
                        ned = opencv_from_axes(Axes::ned);
  using S = PoseSeries;
  return {
      {"estimate inverse", [](S&, S& e) { invert(e); }, "inverse", "the estimate holds inverse poses"},
      {"estimate inverse, both named", [](S&, S& e) { invert(e); }, "inverse",
       "give --inverse; the other way round, the reference holds inverse poses"},
      {"reference inverse", [](S& r, S&) { invert(r); }, "inverse", "--ref-inverse"},
      {"both inverse", [](S& r, S& e) { invert(r), invert(e); }, "inverse", "both files"},
      {"estimate w first", [](S&, S& e) { w_first(e); }, "columns", "w first"},
      {"both w first", [](S& r, S& e) { w_first(r), w_first(e); }, "columns", "both files"},
      {"estimate transposed",
       [](S&, S& e) {
         for (Eigen::Matrix3d& R : e.rotations) R.transposeInPlace();
       },
       "transposed", "transpose the rotation"},
      {"estimate cm", [](S&, S& e) { scaled(e, 100); }, "unit", "centimetres"},
      {"reference mm", [](S& r, S&) { scaled(r, 1000); }, "unit",
       "the reference's positions are in millimetres: multiply them by 0.001 ("},
      {"estimate km", [](S&, S& e) { scaled(e, 0.001); }, "unit",
       "the estimate's positions are in kilometres: multiply them by 1000, or give --align sim3; the other "
       "way round, the reference's positions are in millimetres"},
      {"estimate mm", [](S&, S& e) { scaled(e, 1000); }, "unit", "millimetres"},
      {"estimate in degrees", [](S&, S& e) { to_degrees(e); }, "degrees",
       "the estimate's x and y look like latitude"},
      {"reference in degrees", [](S& r, S&) { to_degrees(r); }, "degrees",
       "the reference's x and y look like latitude"},
      {"angles doubled", [](S&, S& e) { multiply_angles(e, 2); }, "angles",
       "the estimate's rotations turn by twice"},
      {"angles halved", [](S&, S& e) { multiply_angles(e, 0.5); }, "angles",
       "the estimate's rotations turn by half"},
      {"estimate opengl", [=](S&, S& e) { turned(e, gl, gl.transpose()); }, "axes", "--axes opengl"},
      {"estimate ned", [=](S&, S& e) { turned(e, ned.transpose(), ned); }, "axes", "--axes ned"},
      {"estimate flu", [=](S&, S& e) { turned(e, flu.transpose(), flu); }, "axes", "--axes flu"},
      {"reference ned", [=](S& r, S&) { turned(r, ned.transpose(), ned); }, "axes", "--ref-axes ned"},
      {"body flu",
       [=](S&, S& e) { turned(e, Eigen::Matrix3d::Identity(), flu); },
       "body",
       "--body-from-camera \"0 0 1 0 -1 0 0 0 0 -1 0 0",
       {Alignment::none}},
      {"body oblique", [=](S&, S& e) { turned(e, Eigen::Matrix3d::Identity(), turn(0.4, 0.3, 0.2)); }, "body",
       "--body-from-camera"},
      {"world z up",
       [=](S&, S& e) { turned(e, flu.transpose(), Eigen::Matrix3d::Identity()); },
       "alignment",
       "se3 would leave",
       {Alignment::none}},
      {"world z up, named",
       [=](S&, S& e) { turned(e, flu.transpose(), Eigen::Matrix3d::Identity()); },
       "world",
       "x forward, y left, z up",
       {Alignment::none}},
      {"steps", [](S&, S& e) { to_steps(e, false); }, "steps", "T_k-1,k"},
      {"inverse steps", [](S&, S& e) { to_steps(e, true); }, "steps", "T_k,k-1"},
      {"one late", [](S&, S& e) { delayed(e, 1); }, "lag", "late"},
      {"two late", [](S&, S& e) { delayed(e, 2); }, "lag", "late"},
      {"three early", [](S&, S& e) { delayed(e, -3); }, "lag", "early"},
  };
}

std::string codes(const EgoResult& r) {
  std::string text;
  for (const DataWarning& w : r.warnings) text += "\n  " + w.code + ": " + w.text;
  return text;
}

/// Every mistake is planted in both kinds of path, with time stamps and with frame numbers.
TEST(TrajectoryDiagnosis, EveryPlantIsNamedWithItsRemedy) {
  for (const Scene scene : {Scene::drive, Scene::walk}) {
    for (const unsigned seed : {1U, 2U, 3U}) {
      for (const bool stamped : {true, false}) {
        for (const PlantedMistake& plant : plants()) {
          // A hand-held camera has no main direction of motion, so two files with the same mistake cannot be
          // detected.
          if (scene == Scene::walk && std::string(plant.name).starts_with("both")) continue;
          for (const Alignment alignment : plant.alignments) {
            SCOPED_TRACE(fmt::format("{}, scene {}, seed {}, {}, {}", plant.name, static_cast<int>(scene),
                                     seed, to_string(alignment), stamped ? "stamps" : "rows"));
            PoseSeries reference = truth(scene, seed), estimate = estimate_of(reference, seed);
            plant.plant(reference, estimate);
            if (!stamped) {
              const double t0 = reference.stamps_s[0];
              for (PoseSeries* s : {&reference, &estimate}) {
                for (const double t : s->stamps_s)
                  s->frames.push_back(static_cast<int>(std::lround((t - t0) * 10)));
                s->stamps_s.clear();
              }
            }
            const EgoResult r = evaluate_aligned(reference, estimate, alignment);
            EXPECT_THAT(r.warnings, Contains(testing::AllOf(
                                        Field("code", &DataWarning::code, plant.code),
                                        Field("text", &DataWarning::text, testing::HasSubstr(plant.remedy)))))
                << codes(r);
          }
        }
      }
    }
  }
}

/// Positions on a line leave the rotation about it undetermined; the rotations of the poses determine it.
TEST(TrajectoryDiagnosis, OrientationsAreJudgedOnAStraightRoad) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    for (const PlantedMistake& plant : plants()) {
      const std::string_view code = plant.code;
      if (std::string(plant.name).starts_with("both") ||
          (code != "inverse" && code != "columns" && code != "axes"))
        continue;
      SCOPED_TRACE(fmt::format("{}, seed {}", plant.name, seed));
      PoseSeries reference = truth(Scene::highway, seed), estimate = estimate_of(reference, seed);
      plant.plant(reference, estimate);
      const EgoResult r = evaluate_aligned(reference, estimate, Alignment::se3);
      EXPECT_THAT(r.warnings, Contains(Field("code", &DataWarning::code, plant.code))) << codes(r);
    }
  }
}

bool is_diagnosis(const DataWarning& w) {
  for (const char* code : {"inverse", "axes", "columns", "transposed", "unit", "steps", "body", "world",
                           "lag", "alignment", "lever_arm", "yaw", "scale"}) {
    if (w.code == code) return true;
  }
  return false;
}

TEST(TrajectoryDiagnosis, RightTrajectoriesAreNotQuestioned) {
  int n = 0, alarms = 0;
  for (const Scene scene : scenes) {
    for (unsigned seed = 1; seed <= 4; ++seed) {
      for (const Alignment alignment :
           {Alignment::none, Alignment::origin, Alignment::se3, Alignment::sim3}) {
        for (const double noise : {0.0005, 0.004, 0.02}) {
          const PoseSeries reference = truth(scene, seed), estimate = estimate_of(reference, seed, noise);
          const bool moves = scene != Scene::standing && scene != Scene::pure_rotation;
          if (!moves && alignment != Alignment::none && alignment != Alignment::origin) continue;
          const EgoResult r = evaluate_aligned(reference, estimate, alignment);
          ++n;
          // On a straight road drift bends the whole path, so it is true that an alignment removes most of
          // it.
          const bool is_alarm = std::ranges::any_of(r.warnings, [&](const DataWarning& w) {
            return is_diagnosis(w) && !(scene == Scene::highway && std::string_view(w.code) == "alignment");
          });
          alarms += is_alarm;
          if (is_alarm)
            ADD_FAILURE() << "scene " << static_cast<int>(scene) << " seed " << seed << " "
                          << to_string(alignment) << " noise " << noise << codes(r);
        }
      }
    }
  }
  fmt::print("{} of {} right trajectories have a diagnosis\n", alarms, n);
  EXPECT_EQ(alarms, 0);
}

/// Trajectories of ORB-SLAM3 and VDO-SLAM on nine sequences, DynOSAM's camera logs, and the true poses of
/// TartanAir and Virtual KITTI.
TEST(TrajectoryDiagnosis, RecordingsAreNotQuestioned) {
  const char* root = std::getenv("SEXTANT_DATA");
  if (!root) GTEST_SKIP() << "SEXTANT_DATA is not set: it holds the recordings";
  namespace fs = std::filesystem;
  const fs::path data = root;
  int n = 0, alarms = 0;
  const auto count = [&](const std::string& what, const EgoResult& r, const std::vector<std::string>& known) {
    ++n;
    for (const DataWarning& w : r.warnings) {
      const bool is_known = std::ranges::find(known, w.code) != known.end();
      if (is_known || !is_diagnosis(w)) continue;
      ++alarms;
      ADD_FAILURE() << what << codes(r);
    }
  };
  const auto files = [&](const EgoFiles& given, Alignment alignment,
                         const std::vector<std::string>& known = {}) {
    EgoOptions options;
    options.alignment = alignment;
    for (const EgoResult& r : evaluate_ego_files(given, options).runs)
      count(given.reference + " " + std::string(to_string(alignment)), r, known);
  };
  for (const auto& entry : fs::directory_iterator(data / "kitti_tracking_peers" / "orbslam3_camera")) {
    const std::string sequence = entry.path().stem().string();
    for (const Alignment alignment : {Alignment::none, Alignment::se3, Alignment::sim3}) {
      EgoFiles given{.reference = "kitti:" + (data / "kitti_tracking").string() + "#" + sequence,
                     .estimates = {entry.path().string()},
                     .estimate_format = "kitti"};
      files(given, alignment);
    }
  }
  for (const auto& entry : fs::directory_iterator(data / "kitti_tracking_peers" / "vdo_slam_frontend")) {
    for (const Alignment alignment : {Alignment::none, Alignment::se3})
      files({.reference = entry.path().string()}, alignment);
  }
  for (const char* name : {"frontend_camera_pose_log.csv", "rgbd_motion_world_backend_camera_pose_log.csv"}) {
    for (const Alignment alignment : {Alignment::none, Alignment::se3})
      files({.reference = (data / "dynosam_kitti_0000" / name).string()}, alignment);
  }
  for (const char* world : {"0001", "0002", "0018"}) {
    const fs::path path = data / "vkitti_1.3.1_text" / (std::string(world) + "_camera.txt");
    NumberFile file(path.string(), ' ');
    PoseSeries poses;
    while (file.next()) {
      const auto v = file.values();
      Eigen::Matrix4d T;
      for (int i = 0; i < 16; ++i) T(i / 4, i % 4) = v[static_cast<size_t>(i) + 1];
      const Eigen::Matrix4d inverse = T.inverse();
      poses.add(inverse.topLeftCorner<3, 3>(), inverse.topRightCorner<3, 1>());
      poses.frames.push_back(static_cast<int>(v[0]));
    }
    for (const Alignment alignment : {Alignment::none, Alignment::se3})
      count(world, evaluate_aligned(poses, estimate_of(poses, 1), alignment), {});
  }
  {
    NumberFile file((data / "tartanair2_abs_P000" / "pose_lcam_front.txt").string(), ' ');
    PoseSeries poses;
    while (file.next()) {
      const auto v = file.values();
      poses.add(Eigen::Quaterniond(v[6], v[3], v[4], v[5]).normalized().toRotationMatrix(),
                {v[0], v[1], v[2]});
      poses.stamps_s.push_back(0.1 * static_cast<double>(poses.size()));
    }
    for (const Alignment alignment : {Alignment::none, Alignment::se3, Alignment::sim3})
      count("TartanAir", evaluate_aligned(poses, estimate_of(poses, 1), alignment), {});
  }
  fmt::print("{} diagnoses of {} evaluations of recordings\n", alarms, n);
}

}  // namespace
}  // namespace sextant
