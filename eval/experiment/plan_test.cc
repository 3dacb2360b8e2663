#include "sextant/eval/experiment/plan.h"

#include <algorithm>
#include <map>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/experiment/plan_testing.h"
#include "sextant/eval/experiment/run.h"

namespace sextant {
namespace {

class PlanTest : public SmallPlan {};

TEST_F(PlanTest, CasesAreAGrid) {
  const Plan plan = parse_plan(plan_text(), "plan.json", "");
  EXPECT_EQ(plan.n_cases(), 12U);
  const PlanCase c = plan.at(10);  // seeds fastest: 10 = ((0 * 2 + 1) * 2 + 1) * 3 + 1
  EXPECT_EQ(c.estimator, 1U);
  EXPECT_EQ(c.level, 1U);
  EXPECT_EQ(c.seed, 1U);
}

TEST_F(PlanTest, SharesAreEqualWithFewSourcesAndAllEstimators) {
  std::string sources;
  for (const char* scene : {"s18", "s01-turn", "city", "highway"}) {
    for (const char* frames : {"0-2", "3-5"})
      sources += fmt::format("{}\"synthetic:{}@{}\"", sources.empty() ? "" : ",", scene, frames);
  }
  const Plan plan =
      parse_plan("{\"sources\":[" + sources +
                     "],\"estimators\":[\"motion_only\",\"joint_flow\",\"joint_flow_depth\"],\"seeds\":40}",
                 "plan.json", "");
  ASSERT_EQ(plan.n_cases(), 960U);
  for (const uint64_t n : {1, 3, 7, 16, 959, 960}) {
    std::set<uint64_t> all;
    for (uint64_t shard = 0; shard < n; ++shard) {
      const std::vector<uint64_t> numbers = cases_of_shard(plan, shard, n);
      EXPECT_TRUE(std::ranges::is_sorted(numbers));
      EXPECT_NEAR(static_cast<double>(numbers.size()), 960.0 / static_cast<double>(n), 1);
      std::set<size_t> of_sources;
      std::map<size_t, int> of_estimators;
      for (const uint64_t number : numbers) {
        of_sources.insert(plan.at(number).source);
        ++of_estimators[plan.at(number).estimator];
        EXPECT_TRUE(all.insert(number).second) << number;
      }
      EXPECT_LE(of_sources.size(), 8 / n + 2);
      if (n > 16) continue;
      for (size_t e = 0; e < 3; ++e)  // nearly a third each
        EXPECT_NEAR(of_estimators[e], static_cast<double>(numbers.size()) / 3, 4) << n << " " << shard;
    }
    EXPECT_EQ(all.size(), 960U);
  }
  EXPECT_TRUE(cases_of_shard(plan, 5, 2000).size() <= 1);
}

TEST_F(PlanTest, BadPlansNameLineAndKey) {
  const auto parse = [&](const std::string& text) { parse_plan(text, "p.json", ""); };
  const auto noisy = [&](const std::string& noise) { parse(plan_text(noise)); };
  expect_error([&] { parse("{\"sources\":\n[}"); }, "p.json:2: not valid JSON");
  expect_error([&] { parse("[]"); }, "p.json:1: expected an object");
  expect_error([&] { parse("{\"sources\":[],\n\"estimators\":[\"joint_flow\"]}"); }, "p.json:1: sources");
  expect_error([&] { parse("{\n\"estimators\":[\"joint_flow\"]}"); }, "key 'sources' is missing");
  expect_error([&] { parse("{\"sources\":[\"vdo:/no/such\"],\n\"estimators\":[\"joint_flow\"]}"); },
               "'vdo:/no/such'");
  expect_error([&] { noisy(R"({"parameter":"depth.delta","levels":[1]})"); }, "p.json:3: noise");
  expect_error([&] { noisy(R"({"parameter":"depth.delta_px","levels":[1]})"); }, "did you mean 'delta_d_px'");
  expect_error([&] { noisy(R"({"parameter":"depth.delta_d_px","levels":[]})"); }, "list that is not empty");
  expect_error([&] { noisy(R"({"level":1})"); }, "key 'noise' is missing");
  expect_error([&] { noisy(R"({"noise":{"flow":{"epe_px":1}}})"); }, "key 'level' is missing");
  expect_error([&] { noisy(R"({"parameter":"depth.delta_d_px","levels":[0.1,-0.2]})"); }, "got -0.2");
  expect_error([&] { noisy(R"({"parameter":"depth.delta_d_px","levels":[0.1,0.1]})"); }, "is repeated");
  expect_error([&] { noisy(R"({"parameter":"flow.scale","levels":[1]})"); }, "does not change the noise");
  expect_error(
      [&] { noisy(R"({"parameter":"flow.scale","levels":[0.5,1],"base":{"depth":{"delta_d_px":1}}})"); },
      "'flow.scale' does not change the noise, which is 'depth 1 px' at level 1: give the noise");
  expect_error(
      [&] {
        noisy(R"({"parameter":"flow.epe_px","levels":[0.1,0.3],)"
              R"("base":{"flow":{"bodies":{"background":{"epe_px":1},"objects":{"epe_px":1}}}}})");
      },
      "because flow.bodies sets that of the background and of all objects");
  const auto correlated = [](const char* shares) {
    return fmt::format(R"({{"level":1,"noise":{{"flow":{{"epe_px":1}},"correlation":)"
                       R"({{"model":"spatial","lengths_px":[5,40],"shares":{}}}}}}})",
                       shares);
  };
  expect_error(
      [&] {
        parse(plan_text(fmt::format("[{},{}]", correlated("[0.4,0.5]"), correlated("[0.5,0.4]")), "1"));
      },
      "give them different levels");
  expect_error([&] { parse(plan_text("{\"level\":0}", "1000000000")); }, "more than the 10000000 cases");
  expect_error([&] { parse(plan_text("{\"level\":0}", "[1,1]")); }, "p.json:4: seeds");
  expect_error([&] { parse(plan_text("{\"level\":0}", "0")); }, "expected at least one seed");
  expect_error([&] { parse(plan_text("{\"level\":0}", R"({"first":18446744073709551610,"count":7})")); },
               "p.json:4: seeds: key 'first': 18446744073709551610 and the 6 seeds after it go beyond");
  EXPECT_EQ(parse_plan(plan_text("{\"level\":0}", R"({"first":18446744073709551610,"count":6})"), "p", "")
                .seeds.back(),
            18446744073709551615U);
  expect_error([&] { parse(plan_text("{\"level\":1e400}")); }, "p.json:3: the number 1e400");
  expect_error([&] { parse(plan_text("[[[[\"" + std::string(20, 'x') + "\"]]]]")); }, "p.json:3: noise");
  expect_error(
      [&] { parse("{\"sources\":[{\"source\":\"synthetic:s18\",\"options\":3}],\n\"estimators\":[]}"); },
      "option source: expected an object");
  expect_error([&] { parse(plan_text("{\"level\":0}", "1,\"options\":{\"pipeline\":[]}")); },
               "expected an object");
  std::string text = plan_text();
  text.insert(1, "\"optoins\":{},");
  expect_error([&] { parse(text); }, "p.json:1: unknown key 'optoins': did you mean 'options'");
  text = plan_text();
  text.insert(text.size() - 1, ",\n\"options\":{\"pipeline\":{\n\"min_object_aera\":1}}");
  expect_error([&] { parse(text); }, "p.json:6: options: unknown option key 'pipeline.min_object_aera'");
}

TEST_F(PlanTest, AProcedureSuppliesMissingKeys) {
  const auto plan = [&](const std::string& more) {
    return parse_plan("{\"sources\":[\"" + source_ + "\"],\"procedure\":\"paper_release\"" + more + "}",
                      "plan.json", "");
  };
  const Plan as_published = plan("");
  ASSERT_EQ(as_published.estimators.size(), 2U);
  EXPECT_EQ(as_published.estimators[0].label, "motion_only, release");
  EXPECT_EQ(as_published.estimators[0].pipeline.refine_on, RefineOn::inliers);
  EXPECT_EQ(as_published.estimators[1].pipeline.refine_objects_on, RefineObjectsOn::inliers);
  EXPECT_EQ(as_published.pipeline.start.inlier_threshold_px, 0.3);
  EXPECT_EQ(as_published.levels.front().level, 0.15);
  const Plan wider = plan(R"(,"options":{"pipeline":{"start":{"inlier_threshold_px":2}}})");
  EXPECT_EQ(wider.pipeline.start.inlier_threshold_px, 2);
  EXPECT_EQ(wider.pipeline.start.confidence, 0.98);
  EXPECT_THROW(
      parse_plan("{\"sources\":[\"" + source_ + "\"],\"procedure\":\"paper_relase\"}", "plan.json", ""),
      Error);
}

TEST(Procedures, EachIsAPlanWithADescription) {
  ASSERT_FALSE(procedure_names().empty());
  for (const std::string& name : procedure_names()) {
    EXPECT_GT(find_procedure(name).at("description").get<std::string>().size(), 40U) << name;
    for (const char* estimator : {"motion_only", "joint_flow"}) {
      const ResolvedOptions options = resolve_options(procedure_options(name, estimator));
      make_case_estimator(estimator, options.estimator);
      EXPECT_EQ(options.pipeline.start.inlier_threshold_px, 0.3) << name;
    }
    EXPECT_THROW(procedure_options(name, "joint_flow_depth"), Error);
  }
}

}  // namespace
}  // namespace sextant
