#include <gtest/gtest.h>

#include <algorithm>

#include "sextant/eval/records/testing.h"
#include "sextant/eval/report/claims/testing.h"
#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

/// error of a body = slope x level, +-1 % by seed. Objects by distance: 5 (near), 9, 2 (far), 4 (not the
/// paper's).
NoiseSweep sweep_of(const std::string& parameter, const std::map<std::string, double>& slopes) {
  const std::map<std::string, double> distance_m = {
      {"ego", 0}, {"object:5", 8}, {"object:9", 17}, {"object:2", 25}, {"object:4", 40}};
  std::vector<Record> records;
  for (const auto& [body, slope] : slopes) {
    for (const double level : {0.1, 0.2, 0.4}) {
      for (uint64_t seed = 0; seed < 10; ++seed) {
        Record r = RecordOf{.body = body, .level = level, .seed = seed};
        r.values = {{"step_gt_m", 1}, {"distance_gt_m", distance_m.at(body)}};
        const double error = slope * level * (0.99 + 0.002 * static_cast<double>(seed));
        r.errors = {{"Et_m", error}, {"ER_deg", 2 * error}};
        records.push_back(r);
      }
    }
  }
  return noise_sweep_of(parameter, records);
}

/// Results of a claim on one sweep.
std::vector<ClaimResult> check(const char* claim, const NoiseSweep& sweep) {
  Evidence evidence;
  evidence.parts.push_back({"", PartRole::noise, sweep, {}});
  return check_claim(claim, evidence);
}

std::vector<Verdict> verdicts(const std::vector<ClaimResult>& results) {
  std::vector<Verdict> out;
  for (const ClaimResult& r : results) out.push_back(r.verdict);
  return out;
}

constexpr Verdict yes = Verdict::reproduced;
constexpr Verdict no = Verdict::not_reproduced;

TEST(NoiseClaims, DepthLimitsHoldWhereTheWholeIntervalDoes) {
  const NoiseSweep sweep = sweep_of("depth.delta_d_px", {{"ego", 0.01}, {"object:9", 0.08}});
  // E_t, E_R of each body at delta_d <= 0.2, then up to 0.4: 0.002 0.004 | 0.016 0.032.
  EXPECT_EQ(verdicts(check("depth_noise_low", sweep)),
            (std::vector<Verdict>{yes, yes, yes, yes, yes, no, yes, no}));
  EXPECT_EQ(verdicts(check("depth_noise_gradual", sweep)), (std::vector<Verdict>{yes, yes}));
  const NoiseSweep falling = sweep_of("depth.delta_d_px", {{"ego", -0.01}});
  EXPECT_EQ(check("depth_noise_gradual", falling).front().verdict, no);
  const NoiseSweep on_the_limit = sweep_of("depth.delta_d_px", {{"ego", 0.1}});
  EXPECT_EQ(check("depth_noise_low", on_the_limit).front().verdict, Verdict::undecided);
}

TEST(NoiseClaims, FlowBodiesAreCountedByDistance) {
  std::map<std::string, double> slopes = {
      {"ego", 0.01}, {"object:5", 0.01}, {"object:9", 0.1}, {"object:2", 0.22}, {"object:4", 9}};
  const auto sweep = [&] { return sweep_of("flow.scale", slopes); };
  EXPECT_EQ(verdicts(check("flow_noise_far_objects", sweep())), (std::vector<Verdict>{yes, yes}));
  const std::vector<ClaimResult> highest = check("flow_noise_highest", sweep());  // 0.088 m, 0.176 deg
  EXPECT_EQ(verdicts(highest), (std::vector<Verdict>{yes, yes}));
  EXPECT_NEAR(highest[0].value, 0.0878, 0.001);
  slopes["object:5"] = 0.2;  // now as sensitive as the far ones
  EXPECT_EQ(check("flow_noise_far_objects", sweep()).front().verdict, no);
  slopes["object:2"] = 1;
  EXPECT_EQ(check("flow_noise_highest", sweep()).front().verdict, no);
  slopes.erase("object:9");
  slopes.erase("object:4");
  EXPECT_TRUE(check("flow_noise_far_objects", sweep()).empty());  // two objects only
}

TEST(Claims, EachIsCheckedOrNamedAsNotTested) {
  const Table untested = claim_table(check_claims(Evidence{}));
  EXPECT_TRUE(untested.rows.empty());
  EXPECT_EQ(untested.notes.size(), claims().size());
  Evidence evidence;
  evidence.parts.push_back({"", PartRole::noise, sweep_of("depth.delta_d_px", {{"ego", 0.01}}), {}});
  EXPECT_EQ(claim_table(check_claims(evidence)).rows.size(), 5U);
}

}  // namespace
}  // namespace sextant
