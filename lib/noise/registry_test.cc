// Properties of every noise model, tested by name.

#include <gtest/gtest.h>

#include "sextant/base/names.h"
#include "sextant/noise/noise_model.h"

namespace sextant {
namespace {

class EveryNoiseModel : public ::testing::TestWithParam<std::string> {
 protected:
  const NoiseModelEntry& entry() const { return find_entry(noise_models(), GetParam(), "noise model"); }
};

std::vector<std::string> names() {
  std::vector<std::string> names;
  for (const NoiseModelEntry& entry : noise_models()) names.push_back(entry.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryNoiseModel, ::testing::ValuesIn(names()),
                         [](const auto& entry) { return entry.param; });

TEST_P(EveryNoiseModel, DefaultsChangeNothing) {
  const std::unique_ptr<NoiseModel> model = entry().make(Json::object());
  EXPECT_EQ(model->name(), "");
  EXPECT_FALSE(model->changes_depth() || model->changes_flow() || model->changes_masks());
  const Draws draws(1, "a", "b");
  const NoiseContext context{draws, Correlation::independent, {{700, 700, 0, 0}, 350}};
  const std::vector<int> x = {1, 2}, y = {3, 4}, body = {0, 1};
  std::vector<double> depth = {10, 20}, u = {1, 2}, v = {3, 4};
  std::vector<unsigned char> outlier = {0, 0};
  Image<uint16_t> mask(3, 3);
  mask(1, 1) = 1;
  const Image<uint16_t> clean = mask;
  model->corrupt_depth(context, {0, x, y}, depth);
  model->corrupt_flow(context, {0, x, y}, {false, body, u, v, outlier});
  model->corrupt_mask(mask);
  EXPECT_EQ(depth, (std::vector<double>{10, 20}));
  EXPECT_EQ(u, (std::vector<double>{1, 2}));
  EXPECT_EQ(v, (std::vector<double>{3, 4}));
  EXPECT_EQ(outlier, (std::vector<unsigned char>{0, 0}));
  EXPECT_EQ(mask, clean);
}

TEST_P(EveryNoiseModel, OptionsRoundTripAndAreDescribed) {
  const Json options = entry().make(Json::object())->options();
  EXPECT_EQ(entry().make(options)->options(), options);
  EXPECT_FALSE(entry().description.empty());
  ASSERT_FALSE(entry().options().empty());
  for (const OptionHelp& line : entry().options()) {
    EXPECT_EQ(line.key.rfind("noise." + entry().name + ".", 0), 0U) << line.key;
    EXPECT_FALSE(line.meaning.empty()) << line.key;
  }
}

TEST_P(EveryNoiseModel, RefusesUnknownOptions) {
  EXPECT_THROW(entry().make(Json{{"no_such_option", 1}}), Error);
  EXPECT_THROW(entry().make(Json(3)), Error);
}

}  // namespace
}  // namespace sextant
