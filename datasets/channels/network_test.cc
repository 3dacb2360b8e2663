#include "sextant/datasets/channels/network.h"

#include <opencv2/core/version.hpp>

#include "sextant/base/machine.h"
#include "sextant/base/testing.h"
#include "sextant/datasets/channels/testing.h"

namespace sextant {
namespace {

constexpr int network_width = 12;
constexpr int network_height = 8;

Image<Rgb> image(int frame) {
  return image_of(network_width, network_height, [=](int x, int y) {
    return Rgb{static_cast<uint8_t>(10 * x + frame), static_cast<uint8_t>(20 * y),
               static_cast<uint8_t>(x == y ? 255 : frame)};
  });
}

class Networks : public testing::Test {
 protected:
  ChannelInputs inputs() {
    return {
        .left = image, .inputs = &log_, .width = network_width, .height = network_height, .last_frame = 3};
  }
  std::string file(const OnnxModel& model) { return "onnx:" + folder_.write("net.onnx", model.bytes()); }

  TempFolder folder_;
  InputLog log_;
};

// u = 0.5 R(previous) - 2 B(current) + 3, v = G(current) - 4.
const std::vector<std::vector<float>> flow_weights{{0.5f, 0, 0, 0, 0, -2}, {0, 0, 0, 0, 1, 0}};
const std::vector<float> flow_bias{3, -4};

void expect_flow(const FlowSource& source) {
  for (const int frame : {0, 2}) {
    const Image<Rgb> prev = image(frame), curr = image(frame + 1);
    const Image<Flow> flow = source.read(frame);
    ASSERT_EQ(flow.width(), network_width);
    ASSERT_EQ(flow.height(), network_height);
    for (const auto [x, y] : PixelRange(network_width, network_height)) {
      EXPECT_EQ(flow(x, y).u, 0.5f * prev(x, y).r - 2.0f * curr(x, y).b + 3.0f);
      EXPECT_EQ(flow(x, y).v, curr(x, y).g - 4.0f);
    }
  }
  EXPECT_TRUE(source.read(3).empty());
}

TEST_F(Networks, FlowFromOneInputOfSixChannels) {
  OnnxModel model;
  model.input("images", {1, 6, network_height, network_width}).mix("images", "flow", flow_weights, flow_bias);
  const auto source =
      make_flow_source(file(model.output("flow", {1, 2, network_height, network_width})), inputs());
  expect_flow(*source);
  EXPECT_EQ(source->provenance(), "flow: onnx:" + (folder_ / "net.onnx"));
  EXPECT_TRUE(log_.entries().contains(folder_ / "net.onnx"));
}

TEST_F(Networks, FlowFromTwoInputsWithOpenSize) {
#if CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR < 6
  GTEST_SKIP() << "OpenCV " << CV_VERSION << " cannot concatenate inputs of open size";
#endif
  OnnxModel model;
  model.input("first", {1, 3, -1, -1}).input("second", {1, 3, -1, -1}).concat({"first", "second"}, "both");
  model.mix("both", "flow", flow_weights, flow_bias).output("flow", {1, 2, -1, -1});
  expect_flow(*make_flow_source(file(model), inputs()));
}

TEST_F(Networks, FlowIsScaledFromTheNetworksSize) {
  OnnxModel model;  // a constant (1, -3) px at half the width and a quarter of the height
  model.input("images", {1, 6, network_height / 4, network_width / 2});
  model.mix("images", "flow", {std::vector<float>(6), std::vector<float>(6)}, {1, -3});
  const auto source =
      make_flow_source(file(model.output("flow", {1, 2, network_height / 4, network_width / 2})), inputs());
  const Image<Flow> flow = source->read(1);
  EXPECT_FLOAT_EQ(flow(5, 5).u, 2.0f);
  EXPECT_FLOAT_EQ(flow(5, 5).v, -12.0f);
}

TEST_F(Networks, FlowOfASmallerOutputIsInPixelsOfTheInput) {
  OnnxModel model;
  model.input("images", {1, 6, network_height, network_width}).halve("images", "small");
  model.mix("small", "flow", {std::vector<float>(6), std::vector<float>(6)}, {1, -3});
  const auto source =
      make_flow_source(file(model.output("flow", {1, 2, network_height / 2, network_width / 2})), inputs());
  EXPECT_EQ(source->read(1).width(), network_width);
  EXPECT_FLOAT_EQ(source->read(1)(5, 5).u, 1.0f);
}

TEST_F(Networks, FlowThatIsNotFiniteIsInvalid) {
  OnnxModel model;
  model.input("images", {1, 6, network_height, network_width});
  model.mix("images", "flow", {std::vector<float>(6), std::vector<float>(6)}, {INFINITY, 0});
  const auto source =
      make_flow_source(file(model.output("flow", {1, 2, network_height, network_width})), inputs());
  EXPECT_FALSE(source->read(0)(3, 3).valid());
}

TEST_F(Networks, SameFlowFromManyThreads) {
  OnnxModel model;
  model.input("images", {1, 6, network_height, network_width}).mix("images", "flow", flow_weights, flow_bias);
  const auto source =
      make_flow_source(file(model.output("flow", {1, 2, network_height, network_width})), inputs());
  parallel_for(40, 4, [&](int i) {
    const Image<Flow> flow = source->read(i % 3);
    EXPECT_EQ(flow(4, 4).v, image(i % 3 + 1)(4, 4).g - 4.0f);
  });
}

TEST_F(Networks, MasksOfIds) {
  for (const bool squeezed : {false, true}) {
    OnnxModel model;
    model.input("image", {1, 3, network_height, network_width})
        .mix("image", squeezed ? "wide" : "ids", {{2, 0, 0}}, {1});
    if (squeezed) model.squeeze("wide", "ids", 1);
    model.output("ids", squeezed ? std::vector{1, network_height, network_width}
                                 : std::vector{1, 1, network_height, network_width});
    const auto source = make_mask_source(file(model), inputs());
    const Image<uint16_t> mask = source->read(2);
    for (int x = 0; x < network_width; ++x) EXPECT_EQ(mask(x, 3), 2 * (10 * x + 2) + 1);
  }
}

TEST_F(Networks, MasksOfClassScores) {
  OnnxModel model;  // background 100, class 1 = G, class 2 = B
  model.input("image", {1, 3, network_height, network_width});
  model.mix("image", "scores", {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {100, 0, 0});
  const auto source =
      make_mask_source(file(model.output("scores", {1, 3, network_height, network_width})), inputs());
  const Image<uint16_t> mask = source->read(0);
  // B = 255 on the diagonal (class 2), G > 100 from row 6 on (class 1); (7, 6) and
  // (6, 7) touch across it.
  EXPECT_EQ(mask(0, 0), 1);
  EXPECT_EQ(mask(5, 5), 1);
  EXPECT_EQ(mask(4, 5), 0);
  EXPECT_EQ(mask(0, 6), 2);
  EXPECT_EQ(mask(6, 7), 2);
  EXPECT_EQ(mask(7, 6), 2);
  EXPECT_EQ(mask(11, 7), 2);
}

TEST_F(Networks, MasksOfAnotherSizeTakeTheNearestPixel) {
  OnnxModel model;
  model.input("image", {1, 3, network_height, network_width})
      .halve("image", "small")
      .mix("small", "ids", {{0, 0.1f, 0}});
  const auto source =
      make_mask_source(file(model.output("ids", {1, 1, network_height / 2, network_width / 2})), inputs());
  const Image<uint16_t> mask = source->read(0);
  for (int y = 0; y < network_height; ++y) EXPECT_EQ(mask(3, y), y / 2 * 4 + 1);  // mean of 2 y and 2 y + 2
}

TEST(ConnectedInstances, AreNumberedByTheirFirstPixel) {
  Image<uint16_t> classes(5, 2);
  classes(4, 0) = 1;
  classes(0, 0) = classes(1, 1) = 2;
  classes(2, 1) = 1;
  const Image<uint16_t> ids = connected_instances(classes, "x");
  EXPECT_EQ(ids(0, 0), 1);
  EXPECT_EQ(ids(1, 1), 1);
  EXPECT_EQ(ids(4, 0), 2);
  EXPECT_EQ(ids(2, 1), 3);
  EXPECT_EQ(ids(3, 0), 0);
}

TEST_F(Networks, Errors) {
  const auto flow_error = [&](const std::string& choice, const std::string& part) {
    expect_error([&] { make_flow_source(choice, inputs())->read(0); }, part);
  };
  const auto mask_error = [&](const std::string& choice, const std::string& part) {
    expect_error([&] { make_mask_source(choice, inputs())->read(0); }, part);
  };
  const std::string path = folder_ / "net.onnx";
  flow_error("onnx:" + (folder_ / "no.onnx"), "no.onnx: cannot open");
  for (const std::string& bytes : {std::string(), std::string("not a network\n"), std::string(200, '\x42')}) {
    flow_error("onnx:" + folder_.write("net.onnx", bytes), path + ": not an ONNX model");
  }
  OnnxModel good;
  good.input("images", {1, 6, network_height, network_width}).mix("images", "flow", flow_weights, flow_bias);
  const std::string bytes = OnnxModel(good).output("flow", {1, 2, network_height, network_width}).bytes();
  flow_error("onnx:" + folder_.write("net.onnx", bytes.substr(0, bytes.size() / 2)),
             path + ": not an ONNX model");
  mask_error(file(OnnxModel(good).output("flow", {1, 2, network_height, network_width})),
             path + ": its input is images 1x6x8x12, expected one of 1x3xHxW");
  flow_error(
      file(OnnxModel().input("a", {1, 3, 8, -1}).mix("a", "b", {{1, 0, 0}}).output("b", {1, 1, 8, 12})),
      path + ": its input is a 1x3x8x?, expected one of 1x6xHxW or two of 1x3xHxW");
  flow_error(file(OnnxModel(good).output("flow", {1, 2, 8, 12}).output("other", {1, 2, 8, 12})),
             path + ": it has 2 outputs (flow first), expected one");
  OnnxModel three;
  three.input("images", {1, 6, 8, 12}).mix("images", "out", std::vector(3, std::vector<float>(6)));
  flow_error(file(three.output("out", {1, 3, 8, 12})),
             path + ": its output out has shape 1x3x8x12, expected 1x2xHxW (flow u, v)");
  OnnxModel flat;
  flat.input("a", {1, 3, 8, 12})
      .node("Flatten", {"a"}, "out", Proto().bytes(1, "axis").number(3, 1).number(20, 2));
  mask_error(file(flat.output("out", {1, 288})), path + ": its output out has shape 1x288, expected 1x1xHxW");
  mask_error(
      file(OnnxModel().input("a", {1, 3, 8, 12}).mix("a", "b", {{0.25f, 0, 0}}).output("b", {1, 1, 8, 12})),
      path + ": frame 0: its output has the value 2.5 at column 1, row 0: expected whole numbers");
  mask_error(file(OnnxModel()
                      .input("a", {1, 3, 8, 12})
                      .node("NoSuchLayer", {"a"}, "b", Proto().bytes(1, "axis").number(3, 1).number(20, 2))
                      .output("b", {1, 1, 8, 12})),
             path + ": OpenCV cannot read this network: ");
  ChannelInputs blind = inputs();
  blind.left = nullptr;
  expect_error([&] { make_flow_source("onnx:x", blind); }, "flow: a network needs images");
  expect_error([&] { make_mask_source("onnx:x", blind); }, "masks: a network needs images");
}

}  // namespace

}  // namespace sextant
