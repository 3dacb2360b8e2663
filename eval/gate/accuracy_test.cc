#include "sextant/eval/gate/accuracy.h"

#include "sextant/base/testing.h"
#include "sextant/eval/gate/testing.h"

namespace sextant {
namespace {

TEST_F(ComparedRuns, OtherMeasurementsOfTheSameConfigurationAreNoted) {
  std::vector<Record> records = sweep_records();
  for (Record& r : records) r.errors["epe_measured_px"] = r.errors["epe_initial_px"] = 0.4;
  write_run(base(), records);
  write_run(fresh(), records);
  EXPECT_TRUE(compare().findings.empty());
  // The errors over the inliers depend on the estimator.
  for (Record& r : records) r.errors["epe_initial_px"] = 0.3;
  write_run(fresh(), records);
  EXPECT_TRUE(compare().findings.empty());
  for (Record& r : records) r.errors["epe_measured_px"] = 0.8;
  write_run(fresh(), records);
  const Comparison c = compare();
  EXPECT_EQ(c.verdict, GateVerdict::ok);
  ASSERT_EQ(c.findings.size(), 6U);
  EXPECT_EQ(c.findings[0].what, "measurements");
  EXPECT_EQ(c.findings[0].subject, "synthetic city joint_flow level 0.1 ego seed 0 frame 1 epe_measured_px");
  EXPECT_EQ(c.findings[0].base, "0.4");
  EXPECT_EQ(c.findings[0].fresh, "0.8");
  // Other noise measures other flow.
  Policy policy;
  policy.same.configuration = Strictness::note;
  Json run = sweep_provenance();
  run["configuration"]["noise"] = "another";
  write_run(fresh(), records, run);
  for (const Mismatch& f : compare(policy).findings) EXPECT_EQ(f.what, "configuration");
}

TEST_F(ComparedRuns, ALostCaseIsRegressedAndAGainedOneImproved) {
  const auto lose = [](Record& r) {
    if (!is_target(r) || r.seed != 3 || r.frame != 2) return;
    r.status = Status::lost;
    r.errors.clear();
  };
  const Comparison lost = compare_changed(lose);
  EXPECT_EQ(lost.verdict, GateVerdict::regressed) << headline(lost);
  EXPECT_EQ(lost.statuses.at(0).example, "seed 3 frame 2: ok -> lost");
  EXPECT_EQ(compare_paths(fresh(), base(), defaults(), 1).verdict, GateVerdict::improved);
  Policy policy;
  policy.accuracy.max_lost = 1;
  const Comparison accepted = compare_changed(lose, policy);
  EXPECT_EQ(accepted.verdict, GateVerdict::ok);
  EXPECT_THAT(headline(accepted), HasSubstr("no change that counts"));
}

TEST_F(ComparedRuns, DecisionsThatBecomeWrongAreRegressedAndCorrectedOnesImproved) {
  std::vector<Record> records = sweep_records();
  for (Record& r : records) {
    if (!r.is_ego()) r.values["dynamic"] = 1;
  }
  const auto compare_decisions = [&](const std::function<void(Record&)>& change) {
    std::vector<Record> changed = records;
    std::ranges::for_each(changed, change);
    write_run(base(), records);
    write_run(fresh(), changed);
    return compare();
  };
  EXPECT_EQ(compare_decisions([](Record&) {}).verdict, GateVerdict::ok);
  EXPECT_TRUE(compare().statuses.empty());
  EXPECT_THAT(headline(compare()), HasSubstr("nothing changed"));
  const Comparison all = compare_decisions([](Record& r) {
    if (!r.is_ego()) r.values["dynamic"] = 0;
  });
  EXPECT_EQ(all.verdict, GateVerdict::regressed);
  EXPECT_THAT(headline(all), HasSubstr("4 coverages or decisions regressed"));
  ASSERT_EQ(all.statuses.size(), 4U);
  EXPECT_EQ(all.statuses[0].n_wrong, 60);
  EXPECT_EQ(all.statuses[0].n_lost, 0);
  EXPECT_EQ(all.statuses[0].example, "seed 0 frame 1: dynamic -> static, truly dynamic");
  Policy exact;
  exact.accuracy.other.minimum_effect = 0;
  EXPECT_EQ(compare(exact).verdict, GateVerdict::regressed);
  exact.accuracy.max_lost = 60;
  EXPECT_EQ(compare(exact).verdict, GateVerdict::ok);
  const Comparison corrected = compare_paths(fresh(), base(), defaults(), 1);
  EXPECT_EQ(corrected.verdict, GateVerdict::improved);
  EXPECT_EQ(corrected.statuses[0].n_corrected, 60);

  // As many decisions became wrong as were corrected, or there is no truth: the change is listed only.
  for (Record& r : records) {
    if (is_target(r) && r.seed == 0) r.values["dynamic"] = 0;
  }
  const Comparison swapped = compare_decisions([](Record& r) {
    if (is_target(r) && r.seed < 2) r.values["dynamic"] = r.seed == 0 ? 1 : 0;
  });
  EXPECT_EQ(swapped.verdict, GateVerdict::ok);
  EXPECT_THAT(headline(swapped), HasSubstr("no change that counts"));
  EXPECT_EQ(swapped.statuses.at(0).n_wrong, 6);
  EXPECT_EQ(swapped.statuses.at(0).n_corrected, 6);
  // The decision about a body that is gated by its area has no effect.
  const Comparison gated = [&] {
    for (Record& r : records) {
      if (!is_target(r)) continue;
      r.status = Status::gated;
      r.gate = sextant::Gate::area;
      r.errors.clear();
    }
    return compare_decisions([](Record& r) {
      if (is_target(r) && r.seed == 1) r.values["dynamic"] = 0;
    });
  }();
  EXPECT_EQ(gated.verdict, GateVerdict::ok);
  EXPECT_EQ(gated.statuses.at(0).n_other, 6);
  for (Record& r : records) r.values.erase("dynamic_gt");
  const Comparison unknown = compare_decisions([](Record& r) {
    if (is_target(r)) r.values["dynamic"] = 1;
  });
  EXPECT_EQ(unknown.verdict, GateVerdict::ok);
  EXPECT_EQ(unknown.statuses.at(0).n_other, 6);
}

TEST_F(ComparedRuns, ABodyWithoutACommonCaseIsInconclusive) {
  const auto lose = [](bool first_seeds) {
    return [first_seeds](Record& r) {
      if (!is_target(r) || (r.seed < 5) != first_seeds) return;
      r.status = Status::lost;
      r.errors.clear();
    };
  };
  std::vector<Record> records = sweep_records();
  std::ranges::for_each(records, lose(true));
  write_run(base(), records);
  const Comparison c = compare_changed(lose(false));
  EXPECT_EQ(c.verdict, GateVerdict::inconclusive);
  EXPECT_THAT(headline(c), HasSubstr("1 coverages or decisions inconclusive"));
  EXPECT_EQ(c.statuses.at(0).n_lost, 30);
  EXPECT_EQ(c.statuses.at(0).n_gained, 30);
  // With one common case the coverage is that of before, but something has changed.
  const Comparison swapped = compare_changed([](Record& r) {
    if (!is_target(r) || (r.seed > 3 && r.seed != 5)) return;
    r.status = Status::lost;
    r.errors.clear();
  });
  EXPECT_THAT(headline(swapped), Not(HasSubstr("nothing changed")));
}

}  // namespace
}  // namespace sextant
