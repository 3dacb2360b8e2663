#include "sextant/noise/stored_profiles.h"

#include <gmock/gmock.h>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/noise/noise.h"

namespace sextant {
namespace {

void expect_refused(const Json& options, const std::string& part) {
  expect_error([&] { without_profile(options); }, part);
}

TEST(StoredProfiles, EveryOneIsNoise) {
  ASSERT_FALSE(noise_profile_names().empty());
  for (const std::string& name : noise_profile_names()) {
    const Noise noise(Json{{"profile", name}});
    EXPECT_FALSE(noise.none()) << name;
    EXPECT_FALSE(noise.options().contains("profile"));
    // the options stored with a run are complete
    EXPECT_EQ(noise.options(), Noise(noise.options()).options()) << name;
  }
}

TEST(StoredProfiles, ScaleMultipliesSizes) {
  TempFolder temp;
  const std::string path = (temp.path() / "p.json").string();
  write_file(path, R"({"noise": {"flow": {"epe_x_px": 1, "epe_y_px": 0.5}, "depth": {"delta_d_px": 0.2},
    "outliers": {"share": 0.1, "radius_px": 20}, "correlation": {"model": "spatial", "lengths_px": [5],
    "shares": [0.5]}}})");
  const Json whole = without_profile({{"profile", path}}),
             half = without_profile({{"profile", path}, {"scale", 0.5}});
  EXPECT_EQ(whole.at("flow").at("epe_x_px"), 1);
  EXPECT_DOUBLE_EQ(half.at("flow").at("epe_x_px").get<double>(), 0.5);
  EXPECT_DOUBLE_EQ(half.at("flow").at("epe_y_px").get<double>(), 0.25);
  EXPECT_DOUBLE_EQ(half.at("depth").at("delta_d_px").get<double>(), 0.1);
  EXPECT_DOUBLE_EQ(half.at("outliers").at("radius_px").get<double>(), 10);
  EXPECT_EQ(half.at("outliers").at("share"), 0.1);
  EXPECT_EQ(half.at("correlation"), whole.at("correlation"));
  EXPECT_TRUE(Noise(without_profile({{"profile", path}, {"scale", 0}})).none());
  EXPECT_EQ(without_profile({{"profile", path}, {"correlation", "independent"}}).at("correlation"),
            "independent");
}

TEST(StoredProfiles, ScaleMultipliesTheErrorsOfBodiesAndTheDisparityStep) {
  TempFolder temp;
  const std::string path = (temp.path() / "p.json").string();
  write_file(path, R"({"noise": {"quantisation": {"step_px": 0.25}, "flow": {"scale": 3,
    "bodies": {"background": {"epe_px": 1}, "object:2": {"epe_x_px": 2, "epe_y_px": 4}}}}})");
  const Noise half(Json{{"profile", path}, {"scale", 0.5}});
  EXPECT_EQ(half.flow_sigma(0).x_px, 1.5);
  EXPECT_EQ(half.flow_sigma(2).x_px, 3);
  EXPECT_EQ(half.flow_sigma(2).y_px, 6);
  EXPECT_EQ(half.options().at("quantisation").at("step_px"), 0.125);
  EXPECT_TRUE(Noise(Json{{"profile", path}, {"scale", 0}}).none());
}

TEST(StoredProfiles, RefusesInvalidProfiles) {
  const std::string known = noise_profile_names().front();
  expect_refused({{"profile", known.substr(1)}}, "did you mean '" + known + "'");
  expect_refused({{"profile", 3}}, "expected a name or a file");
  expect_refused({{"profile", known}, {"scale", -1}}, "noise.scale: expected a number >= 0");
  expect_refused({{"scale", 2}}, "requires option noise.profile");
  TempFolder temp;
  for (const char* text : {"[]", "{}", R"({"noise": 1})", R"({"noise": {"profile": "a"}})"}) {
    const std::string path = (temp.path() / "p.json").string();
    write_file(path, text);
    SCOPED_TRACE(text);
    expect_refused({{"profile", path}}, "not a noise profile");
  }
  const std::string path = (temp.path() / "p.json").string();
  write_file(path, R"({"noise": {"flow": {"epe_x_px": -1}}})");
  expect_refused({{"profile", path}}, path + ": option noise.flow.epe_x_px = -1: must be >= 0");
}

}  // namespace
}  // namespace sextant
