#include "sextant/datasets/sceneflow2015.h"

#include <iostream>

#include "sextant/base/testing.h"
#include "sextant/datasets/kitti_testing.h"
#include "sextant/datasets/testing.h"
#include "sextant/metrics/dense_errors.h"

namespace sextant {
namespace {

class SceneFlow : public FolderTest {
 protected:
  SceneFlow() { write_sceneflow_pair(root_); }
  std::string source(const std::string& rest = "#000007") const {
    return "sceneflow:" + root_.string() + rest;
  }
  void error(const std::string& rest, const std::string& part, const Json& options = Json::object()) {
    expect_error([&] { open_with(source(rest), options)->check_files(); }, part);
  }
};

TEST_F(SceneFlow, InfoSaysWhatIsThere) {
  const auto sequence = open_with(source());
  const SequenceInfo& info = sequence->info();
  EXPECT_EQ(text_of(info),
            fmt::format("sceneflow 000007@10-11, {}x{} px, 10 Hz", sceneflow_width, sceneflow_height));
  EXPECT_EQ(info.camera.left.fx, 700);
  EXPECT_EQ(info.camera.left.fy, 701);
  EXPECT_EQ(info.camera.left.cx, 24);
  EXPECT_EQ(info.camera.left.cy, 16);
  EXPECT_EQ(info.camera.bf, 380);
  EXPECT_FALSE(info.channels.mask);
  EXPECT_EQ(info.provenance, (std::vector<std::string>{"depth: sgbm, bf = 380", "flow: dis", "masks: none"}));
  EXPECT_EQ(open_with(source(""))->info().sequence, "000007");  // the only pair
  sequence->check_files();
}

TEST_F(SceneFlow, TruthIsThatOfTheFiles) {
  for (const auto& options : {Json::object(), Json{{"depth", "truth"}, {"flow", "truth"}}}) {
    const auto sequence = open_with(source(), options);
    const Image<float> first = *sequence->true_depth(10), second = *sequence->true_depth(11);
    EXPECT_FLOAT_EQ(first(4, 4), 20);
    EXPECT_TRUE(std::isnan(first(5, 5)));
    EXPECT_FLOAT_EQ(second(4, 4), 19);
    EXPECT_TRUE(std::isnan(second(2, 4)));                     // no pixel moves here
    EXPECT_TRUE(std::isnan(second(4, sceneflow_height - 1)));  // no pixel moves here either
    EXPECT_EQ((*sequence->true_flow(10))(0, 0).u, 3);
    EXPECT_EQ((*sequence->true_flow(10))(0, 0).v, -1);
    EXPECT_FALSE(sequence->true_flow(11).has_value());
    if (options.empty()) continue;
    sequence->check_files();
    const Frame frame = sequence->read(10, {.depth = true, .flow = true});
    EXPECT_FLOAT_EQ(frame.depth_m(4, 4), 20);
    EXPECT_EQ(frame.flow(7, 7).u, 3);
    EXPECT_FLOAT_EQ(sequence->read(11, {.depth = true}).depth_m(4, 4), 19);
    EXPECT_TRUE(sequence->read(11, {.flow = true}).flow.empty());
  }
}

TEST(CarryDepthAlongFlow, TheNearestIsInFront) {
  Image<float> depth(4, 1, NAN);
  Image<Flow> flow(4, 1);
  depth(0, 0) = 5;
  flow(0, 0) = {2.4f, 0};
  depth(1, 0) = 9;
  flow(1, 0) = {1, 0};
  depth(3, 0) = 7;  // no valid flow
  flow(2, 0) = {1, 0};
  const Image<float> carried = carry_depth_along_flow(depth, flow);
  EXPECT_EQ(carried(2, 0), 5);
  for (const int x : {0, 1, 3}) EXPECT_TRUE(std::isnan(carried(x, 0))) << x;
}

TEST_F(SceneFlow, Errors) {
  error("#000008", "no pair '000008': it has 1 pairs, 000007 to 000007");
  error("#000007@9-10", "frames 9-10 are requested, but it has frames 10-11");
  error("", "did you mean 'sgbm'?", {{"depth", "sgm"}});
  put("image_2/000009_10.png", encode_png(Image<Rgb>(sceneflow_width, sceneflow_height)));
  error("", "choose a pair with #: it has 2 pairs, 000007 to 000009");
  error("#000009", file("calib_cam_to_cam/000009.txt") + ": no such file");
  put("calib_cam/000009.txt", sceneflow_calibration);
  error("#000009", file("image_2/000009_11.png") + ": missing file: frame 11 needs its image");
  remove("disp_occ_1/000007_10.png");
  EXPECT_FALSE(open_with(source())->true_depth(11).has_value());
  error("#000007", file("disp_occ_1/000007_10.png") + ": missing file: frame 11 needs its true depth",
        {{"depth", "truth"}});
  remove("image_3/000007_11.png");
  error("#000007", file("image_3/000007_11.png") + ": missing file: frame 11 needs its right image");
}

TEST_F(SceneFlow, CalibrationErrors) {
  const auto calibration_error = [&](const char* text, const std::string& part) {
    put("calib_cam_to_cam/000007.txt", text);
    error("#000007", part);
  };
  const std::string path = file("calib_cam_to_cam/000007.txt");
  calibration_error("P_rect_02: 1 2 3\n", path + ":1: expected P_rect_02: and 12 numbers (13 values), got 4");
  calibration_error("P2: 1 2 3\n", path + ": no line 'P_rect_02:'");
  calibration_error(
      "P_rect_03: 700 0 24 40 0 701 16 0.2 0 0 1 0\n"
      "P_rect_02: 700 0 24 -340 0 701 16 2 0 0 1 0\n",
      path + ": P_rect_02 and P_rect_03 give bf = -380, expected > 0");
  calibration_error("P_rect_02: 0 0 24 40 0 701 16 0.2 0 0 1 0\n",
                    path + ":1: P_rect_02: focal lengths must be");
  std::filesystem::remove(path);
  error("#000007", path + ": no such file");
}

// Accuracy of the computed channels on real images; the bounds are 1.2 times the values measured at first.
class RealSceneFlow : public testing::TestWithParam<std::tuple<const char*, double, double, double, double>> {
};

TEST_P(RealSceneFlow, ErrorsOfSgbmAndDis) {
  SEXTANT_NEEDS_DATA("kitti_sceneflow_2015");
  const auto& [pair, mean_px, d1, epe_px, fl] = GetParam();
  const auto sequence =
      open_with(fmt::format("sceneflow:{}#{}", real_data("kitti_sceneflow_2015").string(), pair));
  sequence->check_files();
  const double bf = sequence->info().camera.bf;
  EXPECT_NEAR(bf, 384.3815, 1e-3);
  for (const int frame : {10, 11}) {
    const DenseDisparityError e = dense_disparity_error(sequence->read(frame, {.depth = true}).depth_m,
                                                        *sequence->true_depth(frame), bf);
    std::cout << fmt::format(
        "{} frame {}: disparity error of sgbm: mean {:.2f} px, D1 {:.2f} %, coverage {:.1f} %\n", pair, frame,
        e.mean_px, 100 * e.outlier_share, 100 * e.coverage);
    RecordProperty(fmt::format("sgbm_mean_px_{}", frame), fmt::format("{:.3f}", e.mean_px));
    RecordProperty(fmt::format("sgbm_d1_percent_{}", frame), fmt::format("{:.2f}", 100 * e.outlier_share));
    EXPECT_LT(e.mean_px, mean_px);
    EXPECT_LT(e.outlier_share, d1);
    EXPECT_GT(e.coverage, 0.75);
  }
  const DenseFlowError e =
      dense_flow_error(sequence->read(10, {.flow = true}).flow, *sequence->true_flow(10));
  std::cout << fmt::format("{}: EPE of dis: {:.2f} px (x {:.2f}, y {:.2f}), Fl {:.2f} %, coverage {:.1f} %\n",
                           pair, e.epe_px, e.x_px, e.y_px, 100 * e.outlier_share, 100 * e.coverage);
  RecordProperty("dis_epe_px", fmt::format("{:.3f}", e.epe_px));
  RecordProperty("dis_fl_percent", fmt::format("{:.2f}", 100 * e.outlier_share));
  EXPECT_LT(e.epe_px, epe_px);
  EXPECT_LT(e.outlier_share, fl);
  EXPECT_GT(e.coverage, 0.99);
}

INSTANTIATE_TEST_SUITE_P(Pairs, RealSceneFlow,
                         testing::Values(std::tuple{"000002", 1.6, 0.09, 1.2, 0.08},
                                         std::tuple{"000007", 0.95, 0.03, 5.0, 0.26}));

}  // namespace
}  // namespace sextant
