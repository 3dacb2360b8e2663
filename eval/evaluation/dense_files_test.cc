#include "sextant/eval/evaluation/dense_files.h"

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/datasets/codec/dense_maps.h"

namespace sextant {
namespace {

Json row(const Table& table, const std::string& subset) {
  for (const Json& r : rows_to_json(table)) {
    if (r["subset"] == subset) return r;
  }
  return {};
}

/// 4x1 px: flow (2, 0) everywhere, without truth in the last pixel.
Image<Flow> true_flow() {
  Image<Flow> flow(4, 1, Flow{2, 0});
  flow(3, 0) = Flow{};
  return flow;
}

TEST(DenseFiles, FlowOverMasksAndOcclusion) {
  const TempFolder folder;
  Image<Flow> estimate(4, 1, Flow{2, 0});
  estimate(0, 0) = Flow{5, 4};  // off by 5 px
  estimate(1, 0) = Flow{};      // no estimate
  Image<Flow> visible = true_flow();
  visible(0, 0) = Flow{};
  Image<uint16_t> mask(4, 1);
  mask(0, 0) = mask(1, 0) = 7;
  DenseFiles<FlowFormat> o;
  o.estimate = folder.write("est.flo", encode_flo(estimate));
  o.truth = folder.write("gt.png", encode_png(kitti_from_flow(true_flow())));
  o.truth_format = FlowFormat::kitti;
  o.visible_truth = folder.write("noc.png", encode_png(kitti_from_flow(visible)));
  o.mask = folder.write("mask.png", encode_png(mask));
  const Table table = evaluate_flow(o);
  const Json all = row(table, "all"), noc = row(table, "noc"), occ = row(table, "occ"),
             object = row(table, "mask 7");
  EXPECT_EQ(all["n"], 2);
  EXPECT_EQ(all["n_truth"], 3);
  EXPECT_EQ(all["epe_px"], 2.5);
  EXPECT_EQ(all["epe_x_px"], 1.5);
  EXPECT_EQ(all["epe_y_px"], 2);
  EXPECT_EQ(all["fl_percent"], 50);
  EXPECT_EQ(noc["epe_px"], 0);
  EXPECT_EQ(occ["epe_px"], 5);
  EXPECT_EQ(object["n"], 1);
  EXPECT_EQ(object["coverage_percent"], 50);
}

TEST(DenseFiles, FoldersArePooledOverPixels) {
  const TempFolder folder;
  DenseFiles<FlowFormat> o;
  for (int i = 0; i < 2; ++i) {
    Image<Flow> estimate(4, 3, Flow{2, 0});
    if (i == 1) estimate = Image<Flow>(4, 3, Flow{2, 3});
    folder.write(fmt::format("est/{}.flo", i), encode_flo(estimate));
    folder.write(fmt::format("gt/{}.png", i), encode_png(vkitti_from_flow(Image<Flow>(4, 3, Flow{2, 0}))));
  }
  o.estimate = folder.path() / "est";
  o.truth = folder.path() / "gt";
  o.truth_format = FlowFormat::vkitti;
  EXPECT_NEAR(row(evaluate_flow(o), "all")["epe_px"], 1.5, 1e-4);
  std::filesystem::remove(folder.path() / "gt" / "1.png");
  expect_error([&] { evaluate_flow(o); }, "has no 1.png");
}

TEST(DenseFiles, AnImageInTwoFormatsIsNotCountedTwice) {
  const TempFolder folder;
  DenseFiles<FlowFormat> o;
  const Image<Flow> estimate(4, 1, Flow{2, 1}), other(4, 1, Flow{2, 8});
  folder.write("est/0.flo", encode_flo(estimate));
  folder.write("est/0.png", encode_png(kitti_from_flow(other)));
  folder.write("gt/0.flo", encode_flo(true_flow()));
  folder.write("gt/1.flo", encode_flo(true_flow()));
  o.estimate = folder.path() / "est";
  o.truth = folder.path() / "gt";
  expect_error([&] { evaluate_flow(o); }, "holds both 0.png and 0.flo: choose with --est-format");
  o.estimate_format = FlowFormat::flo;
  EXPECT_EQ(row(evaluate_flow(o), "all")["epe_px"], 1);
  EXPECT_EQ(row(evaluate_flow(o), "all")["n"], 3);
  o.estimate_format = FlowFormat::kitti;
  EXPECT_EQ(row(evaluate_flow(o), "all")["epe_px"], 8);
  EXPECT_THAT(evaluate_flow(o).notes, ElementsAre(HasSubstr("1 of 2 images of the truth")));
  folder.write("gt/0.png", encode_png(kitti_from_flow(other)));
  expect_error([&] { evaluate_flow(o); }, "choose with --gt-format");
}

TEST(DenseFiles, Depth) {
  const TempFolder folder;
  Image<float> truth(2, 1, 10.0F), estimate(2, 1, 10.0F);
  estimate(1, 0) = 8;
  DenseFiles<DepthFormat> o;
  o.estimate = folder.write("est.png", encode_png(depth256_from_depth(estimate)));
  o.truth = folder.write("gt.png", encode_png(cm_from_depth(truth)));
  o.estimate_format = DepthFormat::depth256;
  o.truth_format = DepthFormat::cm;
  const Json all = row(evaluate_depth(o, 400), "all");
  EXPECT_EQ(all["mean_m"], 1);
  EXPECT_NEAR(all["rmse_m"], std::sqrt(2), 1e-12);
  EXPECT_EQ(all["relative_percent"], 10);
  EXPECT_EQ(all["bias_percent"], -10);
  EXPECT_EQ(all["within_125_percent"], 50);  // 10 / 8 is not below 1.25
  EXPECT_EQ(all["disparity_px"], 5);         // 400 / 8 - 400 / 10, halved
  EXPECT_EQ(all["d1_percent"], 50);
}

TEST(DenseFiles, OtherReadingsOfTheFilesAreNamed) {
  const TempFolder folder;
  const auto truth = image_of(40, 30, [](int x, int y) {
    return Flow{static_cast<float>(x - 20), static_cast<float>(y) / 4};
  });
  const auto flow_warnings = [&](const std::string& estimate, FlowFormat format) {
    DenseFiles<FlowFormat> o;
    o.estimate = estimate;
    o.truth = folder.write("gt.flo", encode_flo(truth));
    o.estimate_format = format;
    std::vector<std::string> warnings;
    evaluate_flow(o, &warnings);
    return warnings;
  };
  const auto changed = [&](auto change) {
    const auto estimate = image_of(40, 30, [&](int x, int y) -> Flow {
      return change(truth(x, y), 0.3F * static_cast<float>((x * 7 + y * 3) % 5 - 2));
    });
    return flow_warnings(folder.write("est.flo", encode_flo(estimate)), FlowFormat::flo);
  };
  EXPECT_THAT(changed([](Flow f, float e) { return Flow{f.u + e, f.v - e}; }), IsEmpty());
  EXPECT_THAT(changed([](Flow, float e) {
                return Flow{e, e};
              }),
              ElementsAre(HasSubstr("hardly better than no flow at all")));
  EXPECT_THAT(changed([](Flow f, float e) {
                return Flow{-f.u + e, -f.v};
              }),
              ElementsAre(HasSubstr("in the estimate, flow is backward")));
  EXPECT_THAT(changed([](Flow f, float e) {
                return Flow{f.v + e, f.u};
              }),
              ElementsAre(HasSubstr("u and v swapped")));
  EXPECT_THAT(changed([](Flow f, float e) {
                return Flow{64 * (f.u + e), 64 * f.v};
              }),
              ElementsAre(HasSubstr("64 times too large")));
  const auto target = image_of(40, 30, [&](int x, int y) {
    return Flow{truth(x, y).u + static_cast<float>(x), truth(x, y).v + static_cast<float>(y)};
  });
  EXPECT_THAT(flow_warnings(folder.write("est.flo", encode_flo(target)), FlowFormat::flo),
              ElementsAre(HasSubstr("flow holds the target (x + u, y + v) of each pixel")));
  for (const float factor : {0.05F, 50.0F}) {
    EXPECT_THAT(changed([&](Flow f, float e) {
                  return Flow{factor * (f.u + e), factor * f.v};
                }),
                ElementsAre(HasSubstr(fmt::format("the estimate is about {} times the truth", factor))));
  }
  EXPECT_THAT(changed([](Flow f, float) {
                return Flow{1.2F * f.u, 1.2F * f.v};  // an error of the estimate
              }),
              IsEmpty());
  EXPECT_THAT(changed([](Flow f, float e) {
                return Flow{0.8F * f.u + e, 1.2F * f.v - e};
              }),
              ElementsAre(HasSubstr("the estimate has v / u about 1.5 times that of the truth")));
  // Pixels without an estimate that are not marked; a part of the scene that stands still.
  const auto partly = [&](bool in_truth) {
    const auto half = image_of(40, 30, [&](int x, int y) { return y % 2 == 0 ? Flow{0, 0} : truth(x, y); });
    DenseFiles<FlowFormat> o;
    o.estimate = folder.write("half.flo", encode_flo(half));
    o.truth = folder.write("gt.flo", encode_flo(in_truth ? half : truth));
    std::vector<std::string> warnings;
    evaluate_flow(o, &warnings);
    return warnings;
  };
  EXPECT_THAT(partly(false), ElementsAre(HasSubstr("is exactly (0, 0) in 50 % of the pixels")));
  EXPECT_THAT(partly(true), IsEmpty());
  Image<Rgb16> channels = kitti_from_flow(truth);
  EXPECT_THAT(flow_warnings(folder.write("est.png", encode_png(channels)), FlowFormat::kitti), IsEmpty());
  for (size_t i = 0; i < channels.size(); ++i) std::swap(channels.data()[i].r, channels.data()[i].b);
  EXPECT_THAT(flow_warnings(folder.write("est.png", encode_png(channels)), FlowFormat::kitti),
              ElementsAre(HasSubstr("seem to be in the order B, G, R")));
  EXPECT_THAT(flow_warnings(folder.write("est.png", encode_png(kitti_from_flow(truth))), FlowFormat::vkitti),
              ElementsAre(HasSubstr(": --est-format kitti")));

  const auto true_z = image_of(40, 30, [](int x, int y) { return 5 + static_cast<float>(x + y) / 2; });
  const auto depth_warnings = [&](const std::string& bytes, DepthFormat format) {
    DenseFiles<DepthFormat> o;
    o.estimate = folder.write("z.png", bytes);
    o.truth = folder.write("true_z.png", encode_png(depth256_from_depth(true_z)));
    o.estimate_format = format;
    o.truth_format = DepthFormat::depth256;
    std::vector<std::string> warnings;
    evaluate_depth(o, 400, &warnings);
    return warnings;
  };
  EXPECT_THAT(depth_warnings(encode_png(cm_from_depth(true_z)), DepthFormat::cm), IsEmpty());
  EXPECT_THAT(depth_warnings(encode_png(cm_from_depth(true_z)), DepthFormat::depth256),
              ElementsAre(HasSubstr(
                  "in the estimate, depth looks like centimetres: the files are read as depth * 256")));
  const auto scaled = [&](float factor) {
    const auto z = image_of(40, 30, [&](int x, int y) { return factor * true_z(x, y); });
    return depth_warnings(encode_png(depth256_from_depth(z)), DepthFormat::depth256);
  };
  EXPECT_THAT(scaled(0.5F), ElementsAre(HasSubstr("the estimate is about 0.5 times the truth")));
  EXPECT_THAT(scaled(1.1F), IsEmpty());
  const auto along_rays = image_of(40, 30, [&](int x, int y) {
    const double secant = std::sqrt(1 + (std::pow(x - 20, 2) + std::pow(y - 15, 2)) / std::pow(24, 2));
    return static_cast<float>(secant) * true_z(x, y);
  });
  EXPECT_THAT(
      depth_warnings(encode_png(depth256_from_depth(along_rays)), DepthFormat::depth256),
      ElementsAre(HasSubstr("the distance along the viewing ray instead of z, for a focal length of")));
  const auto clipped = image_of(
      40, 30, [&](int x, int y) { return static_cast<uint16_t>(std::min(65535.0F, 5000 * true_z(x, y))); });
  EXPECT_THAT(depth_warnings(encode_png(clipped), DepthFormat::depth256),
              ElementsAre(HasSubstr("depth looks like depth * 5000 (TUM)")));
  EXPECT_THAT(depth_warnings(encode_png(depth256_from_depth(true_z)), DepthFormat::disparity256),
              ElementsAre(HasSubstr(": --est-format depth256")));
}

TEST(DenseFiles, BadInputIsReported) {
  const TempFolder folder;
  const std::string flow = folder.write("a.flo", encode_flo(true_flow()));
  const std::string wide = folder.write("b.flo", encode_flo(Image<Flow>(5, 1, Flow{1, 1})));
  const std::string none = folder.write("c.flo", encode_flo(Image<Flow>(4, 1)));
  const auto error = [](const std::string& estimate, const std::string& truth) {
    DenseFiles<FlowFormat> o;
    o.estimate = estimate;
    o.truth = truth;
    return error_of([&] { evaluate_flow(o); });
  };
  EXPECT_THAT(error(flow, wide), HasSubstr("is 4x1 px, the truth 5x1"));
  EXPECT_THAT(error(none, flow), HasSubstr("no pixel has both"));
  EXPECT_THAT(error(folder.write("d.png", "x"), flow), HasSubstr("may be of kitti or vkitti"));
  EXPECT_THAT(error("/nowhere.flo", flow), HasSubstr("/nowhere.flo"));
}

}  // namespace
}  // namespace sextant
