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

TEST_F(ComparedRuns, OtherCovariancesWithTheSameErrorsAreNoted) {
  std::vector<Record> records = sweep_records();
  for (Record& r : records) r.values["nees"] = r.is_ego() ? 6.0 : 8.0;
  write_run(base(), records);
  for (Record& r : records) {
    if (!r.is_ego()) r.values["nees"] = r.seed % 2 == 0 ? 8.0 : 24.0;
  }
  write_run(fresh(), records);
  const Comparison c = compare();
  EXPECT_EQ(c.verdict, GateVerdict::ok);
  ASSERT_EQ(c.findings.size(), 1U);
  EXPECT_EQ(c.findings[0].what, "covariances");
  EXPECT_EQ(c.findings[0].subject, "joint_flow, objects: mean NEES (6 is consistent)");
  EXPECT_EQ(c.findings[0].base, "8");
  EXPECT_EQ(c.findings[0].fresh, "16");
  EXPECT_FALSE(c.findings[0].invalidates);
  Policy policy;
  policy.accuracy.metrics["nees"].minimum_effect = 1.1;
  EXPECT_TRUE(compare(policy).findings.empty());
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

TEST_F(ComparedRuns, AFewLossesOfAnEstimatorWithRandomNumbersAreOnlyListed) {
  std::vector<Record> base_records = sweep_records(10, 1), fresh_records = sweep_records(10, 2);
  const auto lose = [&](uint64_t n_seeds) {
    for (Record& r : fresh_records) {
      if (!is_target(r) || r.seed >= n_seeds || r.frame != 2) continue;
      r.status = Status::lost;
      r.errors.clear();
    }
    write_run(fresh(), fresh_records);
  };
  write_run(base(), base_records);
  lose(1);
  const Comparison one = compare();
  ASSERT_EQ(one.statuses.size(), 1U);
  EXPECT_EQ(one.statuses[0].n_lost, 1);
  EXPECT_EQ(one.statuses[0].verdict, GateVerdict::ok);
  lose(10);  // ten of ten seeds are evidence
  EXPECT_EQ(compare().statuses.at(0).verdict, GateVerdict::regressed);
}

TEST_F(ComparedRuns, TwoFramesThatGotALittleWorseInAllSeedsAlikeAreNoProof) {
  const auto worsen = [&](int first, int last, double factor) {
    return compare_changed([=](Record& r) {
      if (r.is_ego() && r.sequence == "s18" && first <= r.frame && r.frame <= last)
        r.errors["Et_m"] *= factor;
    });
  };
  const auto verdict_of = [](const Comparison& c) {
    for (const FamilyRow& row : c.families)
      if (row.body == "camera" && row.metric == "Et_m") return row.verdict;
    return GateVerdict::invalid;
  };
  EXPECT_EQ(verdict_of(worsen(3, 4, 1.3)), GateVerdict::ok);
  EXPECT_EQ(verdict_of(worsen(3, 4, 20)), GateVerdict::regressed);  // more than 50 % in the mean
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

TEST_F(ComparedRuns, ABodyThatIsStaticByTruthIsJudgedByItsDecisionsOnly) {
  std::vector<Record> records = sweep_records();
  for (Record& r : records) {
    if (is_target(r)) r.values["dynamic_gt"] = 0;
    if (!r.is_ego()) r.values["dynamic"] = 1;
  }
  write_run(base(), records);
  for (Record& r : records) {
    if (!is_target(r)) continue;
    r.status = Status::gated;
    r.gate = sextant::Gate::is_static;
    r.values["dynamic"] = 0;
    r.errors.clear();
  }
  write_run(fresh(), records);
  const Comparison corrected = compare();
  EXPECT_EQ(corrected.verdict, GateVerdict::improved) << headline(corrected);
  EXPECT_EQ(corrected.statuses.at(0).n_lost, 0);
  EXPECT_EQ(corrected.statuses.at(0).n_corrected, 60);
  const Comparison wrong = compare_paths(fresh(), base(), defaults(), 1);
  EXPECT_EQ(wrong.verdict, GateVerdict::regressed);
  EXPECT_EQ(wrong.statuses.at(0).n_wrong, 60);
}

TEST_F(ComparedRuns, AnOutlierInBaseHidesNoWorseningOfAllOtherRecords) {
  const auto is_outlier = [](const Record& r) { return r.is_ego() && r.seed == 3 && r.frame == 2; };
  for (const double size : {10.0, 20.0, 200.0}) {
    std::vector<Record> records = sweep_records();
    std::vector<Record> worse = records;
    for (size_t i = 0; i < records.size(); ++i) {
      if (is_outlier(records[i])) records[i].errors["Et_m"] *= size;
      if (records[i].is_ego() && !is_outlier(records[i])) worse[i].errors["Et_m"] *= 2;
    }
    write_run(base(), records);
    write_run(fresh(), worse);
    EXPECT_THAT(compare().verdict, testing::AnyOf(GateVerdict::inconclusive, GateVerdict::regressed)) << size;
  }
}

TEST_F(ComparedRuns, ASingleFrameProvesNothing) {
  const auto compare_frames = [&](int last, double change) {
    std::vector<Record> records = sweep_records(20);
    std::erase_if(records, [&](const Record& r) { return r.sequence != "s18" || r.frame > last; });
    write_run(base(), records);
    for (Record& r : records) {
      if (r.is_ego()) r.errors["Et_m"] *= change;
    }
    write_run(fresh(), records);
    return compare();
  };
  EXPECT_EQ(compare_frames(1, 1.05).verdict, GateVerdict::inconclusive);
  EXPECT_EQ(compare_frames(1, 3).verdict, GateVerdict::regressed);
  EXPECT_EQ(compare_frames(6, 1.05).verdict, GateVerdict::regressed);

  // A body that was estimated in one frame, in which a neutral change made it worse in all seeds.
  std::vector<Record> records = sweep_records(20);
  std::erase_if(records, [](const Record& r) { return is_target(r) && r.frame > 1; });
  write_run(base(), records);
  for (Record& r : records) {
    if (is_target(r)) r.errors["Et_m"] *= 1.05;
  }
  write_run(fresh(), records);
  EXPECT_EQ(compare().verdict, GateVerdict::ok) << headline(compare());
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

void lose(Record& r) {
  r.status = Status::lost;
  r.errors.clear();
}

TEST_F(ComparedRuns, AGainedRecordWithAGrossErrorCountsAsLost) {
  std::vector<Record> records = sweep_records();
  for (Record& r : records) {
    if (is_target(r) && r.frame == 2) lose(r);
  }
  write_run(base(), records);
  const auto gain = [&](double Et_m, bool swap) {
    return compare_changed([&](Record& r) {
      if (!is_target(r)) return;
      if (r.frame == 2) r.errors["Et_m"] = Et_m;
      if (swap && r.frame == 3) lose(r);
    });
  };
  EXPECT_EQ(gain(0.02, false).verdict, GateVerdict::improved);
  const Comparison gross = gain(100, false);
  EXPECT_EQ(gross.verdict, GateVerdict::regressed);
  EXPECT_EQ(gross.statuses.at(0).n_bad, 10);
  EXPECT_EQ(gross.statuses.at(0).example, "seed 0 frame 2: lost -> ok, with a gross error");
  EXPECT_EQ(gain(0.02, true).verdict, GateVerdict::ok);
  EXPECT_EQ(gain(100, true).verdict, GateVerdict::regressed);
}

TEST_F(ComparedRuns, AnEstimatorThatLosesOtherRecordsEveryTimeIsNotRegressed) {
  PhiloxStream random(5, 0);
  const auto drop = [&](std::vector<Record> records, double share) {
    for (Record& r : records) {
      if (random.uniform() < share) lose(r);
    }
    return records;
  };
  int n_ok = 0;
  constexpr int n_trials = 20;
  for (int trial = 0; trial < n_trials; ++trial) {
    write_run(base(), drop(sweep_records(), 0.05));
    write_run(fresh(), drop(sweep_records(), 0.05));
    n_ok += exit_code(compare().verdict) == 0;
  }
  EXPECT_GE(n_ok, n_trials - 2);
  // An estimator that loses three times as many is regressed, and so is one that loses one body in place of
  // another.
  write_run(base(), drop(sweep_records(), 0.05));
  write_run(fresh(), drop(sweep_records(), 0.15));
  EXPECT_EQ(compare().verdict, GateVerdict::regressed);
  std::vector<Record> one = sweep_records(), other = one;
  for (size_t i = 0; i < one.size(); ++i) {
    if (one[i].frame != 4) continue;
    if (one[i].body == "object:1") lose(one[i]);
    if (other[i].body == "object:2") lose(other[i]);
  }
  write_run(base(), one);
  write_run(fresh(), other);
  EXPECT_EQ(compare().verdict, GateVerdict::regressed);
}

TEST_F(ComparedRuns, ALevelWithoutNoiseIsJudgedBesideNoisyOnes) {
  std::vector<Record> records = sweep_records();
  for (Record r : sweep_records()) {
    r.level = 0;
    r.noise = "none";
    r.errors = {{"Et_m", 0.001 * r.frame}, {"ER_deg", 0.002}};
    records.push_back(r);
  }
  write_run(base(), records);
  const auto compare_with = [&](double factor, int last_frame) {
    std::vector<Record> changed = records;
    for (Record& r : changed) {
      if (r.level == 0 && r.is_ego() && r.frame <= last_frame) r.errors["Et_m"] *= factor;
    }
    write_run(fresh(), changed);
    return compare();
  };
  EXPECT_EQ(compare_with(1, 6).verdict, GateVerdict::ok);
  const Comparison worse = compare_with(100, 6);
  EXPECT_EQ(worse.verdict, GateVerdict::regressed);
  EXPECT_EQ(worse.families.at(0).body, "camera with few seeds");
  EXPECT_EQ(exit_code(compare_with(0.5, 6).verdict), 0);
}

}  // namespace
}  // namespace sextant
