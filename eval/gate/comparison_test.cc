#include "sextant/eval/gate/comparison.h"

#include <set>

#include "sextant/base/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/gate/testing.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

TEST_F(ComparedRuns, IdenticalRunsAreOk) {
  write_run(fresh(), sweep_records());
  const Comparison c = compare();
  EXPECT_EQ(c.verdict, GateVerdict::ok) << headline(c);
  EXPECT_EQ(c.n_cases, 360);
  EXPECT_EQ(c.accuracy.size(), 2U * (2 + 3 + 3));
  EXPECT_TRUE(findings_table(c).rows.empty());
}

TEST_F(ComparedRuns, FivePercentWorseTranslationOfOneBodyIsRegressed) {
  const Comparison c = compare_changed([](Record& r) {
    if (is_target(r)) r.errors["Et_m"] *= 1.05;
  });
  EXPECT_EQ(c.verdict, GateVerdict::regressed) << headline(c);
  const Table table = accuracy_table(c, true);
  ASSERT_EQ(table.rows.size(), 1U);
  EXPECT_EQ(*table.rows[0][5].text(), "object:1");
}

TEST_F(ComparedRuns, FivePercentWorseInTheMeanIsRegressedWhereCasesGoBothWays) {
  int n_regressed = 0;
  for (uint64_t draw = 1; draw <= 20; ++draw) {
    PhiloxStream random(draw, 7);
    n_regressed += compare_changed([&](Record& r) {
                     if (is_target(r)) r.errors["Et_m"] *= 1.05 + 0.05 * standard_normal(random);
                   }).verdict == GateVerdict::regressed;
  }
  EXPECT_GE(n_regressed, 19);
}

TEST_F(ComparedRuns, ChangesBothWaysWithoutEvidenceAreNoRegression) {
  const Comparison c = compare_changed([](Record& r) {
    if (is_target(r)) r.errors["Et_m"] *= r.frame % 2 == 0 ? 1.05 : 1 / 1.05;
  });
  EXPECT_NE(c.verdict, GateVerdict::regressed) << headline(c);
}

TEST_F(ComparedRuns, AGainIsImproved) {
  const Comparison c = compare_changed([](Record& r) { r.errors["Et_m"] *= 0.9; });
  EXPECT_EQ(c.verdict, GateVerdict::improved) << headline(c);
  EXPECT_EQ(exit_code(c.verdict), 0);
}

TEST_F(ComparedRuns, AGainDoesNotHideARegression) {
  EXPECT_EQ(compare_changed([](Record& r) { r.errors["Et_m"] *= is_target(r) ? 1.05 : 0.9; }).verdict,
            GateVerdict::regressed);
}

TEST_F(ComparedRuns, DirectionAndMinimumEffectFollowThePolicy) {
  Policy policy;
  policy.accuracy.metrics["Et_m"].direction = Direction::higher;
  const auto worse = [](Record& r) { r.errors["Et_m"] *= 1.05; };
  const Comparison improved = compare_changed(worse, policy);
  EXPECT_EQ(improved.verdict, GateVerdict::improved);
  for (const AccuracyRow& row : improved.accuracy) {
    if (row.verdict != GateVerdict::improved) continue;
    EXPECT_GT(row.largest_change().fresh, row.largest_change().base) << row.metric;
  }
  policy.accuracy.metrics["Et_m"] = {.minimum_effect = 0.1};
  EXPECT_EQ(compare_changed(worse, policy).verdict, GateVerdict::ok);
  policy.accuracy.metrics["Et_m"].direction = Direction::ignore;
  EXPECT_EQ(compare_changed([](Record& r) { r.errors["Et_m"] *= 2; }, policy).verdict, GateVerdict::ok);
}

TEST_F(ComparedRuns, WithoutMinimumEffectAnySingleCaseCounts) {
  Policy exact;
  exact.accuracy.other.minimum_effect = 0;
  const auto one = [](Record& r) {
    if (is_target(r) && r.seed == 3 && r.frame == 2) r.errors["Et_m"] *= 1.001;
  };
  EXPECT_EQ(compare_changed(one, exact).verdict, GateVerdict::regressed);
  EXPECT_EQ(compare_changed([](Record& r) { r.errors["Et_m"] *= 1 + 1e-12; }, exact).verdict,
            GateVerdict::ok);
}

TEST_F(ComparedRuns, AnOutlierThatIsGoneDoesNotProveThatTheOthersImproved) {
  Policy exact;
  exact.accuracy.other.minimum_effect = 0;
  std::vector<Record> records = sweep_records();
  const auto is_outlier = [](const Record& r) { return is_target(r) && r.seed == 3 && r.frame == 2; };
  std::ranges::find_if(records, is_outlier)->errors["Et_m"] = 50;
  write_run(base(), records);
  const Comparison c = compare_changed(
      [&](Record& r) {
        if (is_target(r) && !is_outlier(r)) r.errors["Et_m"] *= 1.3;
      },
      exact);
  EXPECT_EQ(c.verdict, GateVerdict::inconclusive) << headline(c);
}

TEST_F(ComparedRuns, ShardsThatAreNotMergedAreInvalid) {
  const Comparison c = compare_provenance([](Json& run) { run["shard"] = {1, 2}; });
  EXPECT_EQ(c.verdict, GateVerdict::invalid);
  EXPECT_THAT(c.findings.at(0).subject, HasSubstr("shard 1 of 2"));
  EXPECT_EQ(compare_provenance([](Json& run) { run["shard"] = {0, 1}; }).verdict, GateVerdict::ok);
}

TEST_F(ComparedRuns, RecordsThatAreMissingAreNotedAndNoBaseline) {
  const Comparison c = compare_provenance([](Json& run) { run["records"] = 500; });
  EXPECT_EQ(c.verdict, GateVerdict::ok) << headline(c);
  EXPECT_THAT(c.findings.at(0).subject, HasSubstr("holds 360 records, but run.json states 500"));
  expect_error([&] { baseline_files(fresh()); }, "holds 360 records");
}

TEST_F(ComparedRuns, NamesOfSubjectsAreDistinctWhereLevelsOfTwoNoisesAreEqual) {
  std::vector<Record> records = sweep_records();
  for (Record& record : sweep_records()) {
    record.noise = "flow 0.1 px";
    records.push_back(std::move(record));
  }
  write_run(base(), records);
  write_run(fresh(), records);
  const Comparison c = compare();
  EXPECT_TRUE(c.findings.empty());
  std::set<std::string> names;
  const Json entries = comparison_github(c, defaults());
  for (const Json& entry : entries) names.insert(entry["name"].get<std::string>());
  EXPECT_EQ(names.size(), entries.size());
  EXPECT_TRUE(names.contains("synthetic s18 joint_flow level 0.1 (flow 0.1 px) ego Et_m"));
}

TEST_F(ComparedRuns, NoisesThatOnlyOneSideHasAreTheFirstFinding) {
  const Comparison c = compare_changed([](Record& r) { r.noise = "depth 0.4 px"; });
  EXPECT_EQ(c.verdict, GateVerdict::invalid);
  EXPECT_EQ(c.findings.at(0).what, "cases");
  EXPECT_EQ(c.findings[0].subject, "noises that only one side has");
  EXPECT_EQ(c.findings[0].base, "depth 0.1 px (level 0.1)");
  EXPECT_EQ(c.findings[0].fresh, "depth 0.4 px (level 0.1)");
  EXPECT_EQ(c.findings[1].subject, "synthetic city joint_flow level 0.1 (depth 0.1 px) ego seed 0 frame 1");
  // A body that NEW lacks is no difference of the noises.
  std::vector<Record> records = sweep_records();
  std::erase_if(records, is_target);
  write_run(fresh(), records);
  EXPECT_EQ(compare().findings.at(0).subject, "synthetic s18 joint_flow level 0.1 object:1 seed 0 frame 1");
}

TEST_F(ComparedRuns, AMissingOrNewCaseIsInvalidUnlessAllowed) {
  std::vector<Record> records = sweep_records();
  records.erase(records.begin() + 17);
  write_run(fresh(), records);
  const Comparison c = compare();
  EXPECT_EQ(c.verdict, GateVerdict::invalid);
  EXPECT_EQ(c.findings.at(0).what, "cases");
  EXPECT_THAT(c.findings.at(0).subject, HasSubstr("object:2 seed 0 frame 6"));
  EXPECT_EQ(compare_paths(fresh(), base(), defaults(), 1).verdict, GateVerdict::invalid);
  Policy policy;
  policy.same.cases = Strictness::note;
  EXPECT_EQ(compare(policy).verdict, GateVerdict::ok);
  EXPECT_EQ(compare(policy).findings.size(), 1U);  // still reported
}

TEST_F(ComparedRuns, AMissingErrorIsInvalid) {
  EXPECT_EQ(compare_changed([](Record& r) {
              if (is_target(r) && r.seed == 3 && r.frame == 2) r.errors.erase("ER_deg");
            }).verdict,
            GateVerdict::invalid);
}

TEST_F(ComparedRuns, NaNAndDamageAreInvalid) {
  const std::string good = write_records(sweep_records());
  write_run(fresh(), sweep_records());
  const size_t at = good.find("\"Et_m\":") + 7, end = good.find_first_of(",}", at);
  for (const std::string number : {"NaN", "null", "1e999", "\"x\""}) {
    write_file(fresh() / "records.jsonl", good.substr(0, at) + number + good.substr(end));
    const Comparison c = compare();
    EXPECT_EQ(c.verdict, GateVerdict::invalid) << number;
    EXPECT_THAT(c.findings.at(0).subject, HasSubstr("records.jsonl:1")) << number;
  }
  for (const std::string& text : {std::string(), good.substr(0, good.size() - 9), good + good}) {
    write_file(fresh() / "records.jsonl", text);
    EXPECT_EQ(compare().verdict, GateVerdict::invalid);
  }
  fs::remove(fresh() / "records.jsonl");
  EXPECT_EQ(compare().verdict, GateVerdict::invalid);
  fs::remove_all(fresh());
  EXPECT_EQ(compare().verdict, GateVerdict::invalid);
}

TEST_F(ComparedRuns, WhatMustBeTheSameIsNeverSilentlyAccepted) {
  struct Case {
    const char* what;
    std::function<void(Json&)> change;
    Strictness SamenessPolicy::*rule;
  };
  const std::vector<Case> cases = {
      {"definitions", [](Json& run) { run["metric_definitions"]["Et_m"] = "2: another"; },
       &SamenessPolicy::definitions},
      {"definitions", [](Json& run) { run.erase("metric_definitions"); }, &SamenessPolicy::definitions},
      {"definitions", [](Json& run) { run["metric_presets"]["paper"] = "x"; }, &SamenessPolicy::definitions},
      {"definitions", [](Json& run) { run["schema"] = 2; }, &SamenessPolicy::definitions},
      {"data", [](Json& run) { run["sources"][0]["inputs"]["/data/s18/a.png"]["sha256"] = "bb"; },
       &SamenessPolicy::data},
      {"data", [](Json& run) { run["sources"][0]["packs"] = {"cd"}; }, &SamenessPolicy::data},
      {"configuration", [](Json& run) { run["configuration"]["options"]["sigma_px"] = 2; },
       &SamenessPolicy::configuration},
      {"machine", [](Json& run) { run["machine"]["cpu"] = "another"; }, &SamenessPolicy::machine}};
  for (const Case& c : cases) {
    const Comparison strict = compare_provenance(c.change);
    EXPECT_EQ(strict.verdict, GateVerdict::invalid) << c.what;
    EXPECT_EQ(strict.findings.at(0).what, c.what);
    Policy lenient;
    lenient.same.*c.rule = Strictness::note;
    const Comparison noted = compare_provenance(c.change, lenient);
    EXPECT_EQ(noted.verdict, GateVerdict::ok) << c.what;
    EXPECT_FALSE(noted.findings.empty()) << c.what;
  }
}

TEST_F(ComparedRuns, AnOptionThatOneVersionKnowsIsANoteAGroupOrListItemIsNot) {
  write_run(fresh(), sweep_records());
  const auto verdict = [&](const std::function<void(Json&)>& change) {
    const Comparison c = compare_provenance([&](Json& run) { change(run["configuration"]); });
    EXPECT_FALSE(c.findings.empty());
    return c.verdict;
  };
  EXPECT_EQ(verdict([](Json& c) { c["options"]["gate"] = 0.9; }), GateVerdict::ok);
  EXPECT_EQ(verdict([](Json& c) {
              for (int i = 0; i < 9; ++i) c["options"][fmt::format("option_{}", i)] = i;
            }),
            GateVerdict::ok);
  EXPECT_EQ(verdict([](Json& c) { c["options"]["solver"] = {{"huber", 1.0}}; }), GateVerdict::invalid);
  EXPECT_EQ(verdict([](Json& c) { c["options"] = Json::object(); }), GateVerdict::invalid);
  EXPECT_EQ(verdict([](Json& c) { c["sources"].push_back("synthetic:city"); }), GateVerdict::invalid);
}

TEST_F(ComparedRuns, AnErrorBelowZeroOrBeyondReasonIsInvalid) {
  for (const double value : {-1e-3, 1e300}) {
    const Comparison c = compare_changed([&](Record& r) {
      if (is_target(r) && r.seed == 3 && r.frame == 2) r.errors["Et_m"] = value;
    });
    EXPECT_EQ(c.verdict, GateVerdict::invalid);
    EXPECT_THAT(c.findings.at(0).subject, HasSubstr("error Et_m"));
  }
}

TEST_F(ComparedRuns, FewSeedsAreTooFewToJudgeUnlessEveryCaseIsWorse) {
  write_run(base(), sweep_records(2));
  const auto compare_two_seeds = [&](const std::function<double(const Record&)>& factor) {
    std::vector<Record> records = sweep_records(2);
    for (Record& r : records) r.errors["Et_m"] *= factor(r);
    write_run(fresh(), records);
    return compare();
  };
  // 10 of 12 cases of one body are worse by 10 %: the row is listed, but does not decide the verdict.
  const Comparison most = compare_two_seeds([](const Record& r) {
    return !is_target(r) ? 1 : r.frame == 6 ? 0.999 : 1.1;
  });
  EXPECT_EQ(most.verdict, GateVerdict::ok) << headline(most);
  EXPECT_THAT(to_text(accuracy_table(most, true)), HasSubstr("too few to judge"));
  EXPECT_THAT(to_text(accuracy_table(most, true)), Not(HasSubstr("regressed")));
  // All 24 cases of the camera change in the same direction.
  EXPECT_EQ(compare_two_seeds([](const Record& r) { return r.is_ego() ? 1.1 : 1; }).verdict,
            GateVerdict::regressed);
  EXPECT_EQ(compare_two_seeds([](const Record& r) { return r.is_ego() ? 0.9 : 1; }).verdict,
            GateVerdict::improved);
}

TEST_F(ComparedRuns, OneCaseNeverDecides) {
  std::vector<Record> records = sweep_records(6);
  // One body that is seen once, and one that is seen once per seed.
  std::erase_if(records, [](const Record& r) {
    return r.body == "object:2" && (r.sequence == "s18" ? r.seed != 3 || r.frame != 2 : r.frame != 2);
  });
  write_run(base(), records);
  for (Record& r : records) {
    if (r.body == "object:2") r.errors["Et_m"] *= 3;
  }
  write_run(fresh(), records);
  const Comparison c = compare();
  for (const AccuracyRow& row : c.accuracy) {
    EXPECT_EQ(row.verdict, GateVerdict::ok) << to_string(row.subject);
    EXPECT_EQ(row.too_few, row.subject.body == "object:2" && row.metric == "Et_m") << to_string(row.subject);
  }
  EXPECT_THAT(comparison_junit(c, "2026-01-31T12:00:00"), HasSubstr("<skipped message=\"too few to judge"));
  // A single case of many, however wrong, is listed but proves nothing.
  write_run(base(), sweep_records());
  const Comparison once = compare_changed([](Record& r) {
    if (is_target(r) && r.seed == 3 && r.frame == 2) r.errors["Et_m"] *= 1e6;
  });
  EXPECT_EQ(once.verdict, GateVerdict::inconclusive) << headline(once);
}

TEST_F(ComparedRuns, ACameraThatIsTenPercentWorseIsProvenByTenSeeds) {
  const Comparison c = compare_changed([](Record& r) {
    if (r.is_ego()) r.errors["Et_m"] *= 1.1;
  });
  EXPECT_EQ(c.verdict, GateVerdict::regressed);
  ASSERT_EQ(c.families.size(), 5U);
  const FamilyRow& first = c.families.front();
  EXPECT_EQ(first.body + " " + first.metric, "camera Et_m");
  EXPECT_NEAR(first.change, 0.1, 1e-12);
  EXPECT_NEAR(first.interval.value().low, 0.1, 1e-9);
  EXPECT_EQ(first.n_seeds, 10);
  EXPECT_EQ(first.n_sources, 2);
  EXPECT_EQ(largest_change(c),
            "camera Et_m of joint_flow: +10.0 % [+10.0, +10.0], 120 of 120 records worse, 10 seeds, "
            "2 sources: regressed");
  EXPECT_EQ(compare_paths(fresh(), base(), defaults(), 1).verdict, GateVerdict::improved);
}

TEST_F(ComparedRuns, SeedsWithTheSameErrorsCountOnce) {
  // Without noise a deterministic estimator gives every seed the same errors.
  std::vector<Record> records = sweep_records(10);
  for (Record& r : records) r.errors["Et_m"] = 0.01 * r.frame;
  write_run(base(), records);
  for (Record& r : records) r.errors["Et_m"] *= r.is_ego() && r.frame == 2 ? 1.3 : 1;
  write_run(fresh(), records);
  const Comparison c = compare();
  EXPECT_EQ(c.families.front().n_seeds, 1);
  EXPECT_TRUE(c.families.front().too_few);
  for (const AccuracyRow& row : c.accuracy) EXPECT_NE(row.verdict, GateVerdict::regressed);
}

TEST_F(ComparedRuns, NoPContradictsAVerdict) {
  Policy exact;
  exact.accuracy.other.minimum_effect = 0;
  for (const Policy& policy : {defaults(), exact}) {
    for (uint64_t draw = 1; draw <= 30; ++draw) {
      PhiloxStream random(draw, 9);
      const double shift = 0.1 * standard_normal(random), spread = 0.2 * random.uniform(),
                   share = random.uniform();
      const Comparison c = compare_changed(
          [&](Record& r) {
            if (random.uniform() < share)
              r.errors["Et_m"] *= std::exp(shift + spread * standard_normal(random));
          },
          policy);
      const auto check = [&](const auto& row, double change) {
        const bool decided = row.verdict == GateVerdict::regressed || row.verdict == GateVerdict::improved;
        if (!decided) return;
        if (!row.p_corrected) return;
        EXPECT_LE(*row.p_corrected, policy.accuracy.alpha);
        if (!row.interval || &policy == &exact) return;
        const bool is_worse = row.verdict == GateVerdict::regressed;
        EXPECT_GT(is_worse ? row.interval->low : -row.interval->high, 0)
            << change;  // on the verdict's side of 0
      };
      for (const FamilyRow& row : c.families) check(row, row.change);
      for (const AccuracyRow& row : c.accuracy) check(row, row.difference);
    }
  }
}

TEST_F(ComparedRuns, AnotherMachineIsANoteWhereTimesAreNotJudged) {
  Policy policy;
  policy.speed.judge = false;
  const Comparison c = compare_provenance([](Json& run) { run["machine"]["cpu"] = "another"; }, policy);
  EXPECT_EQ(c.verdict, GateVerdict::ok);
  EXPECT_EQ(c.findings.at(0).what, "machine");
}

TEST_F(ComparedRuns, WhereDataLieAndAnotherBuildAreNoDifference) {
  const Comparison c = compare_provenance([](Json& run) {
    run["git_commit"] = "abc";
    run["sources"][0]["inputs"] = {{"/mnt/s18/a.png", {{"bytes", 3}, {"sha256", "aa"}}}};
  });
  EXPECT_EQ(c.verdict, GateVerdict::ok);
  ASSERT_EQ(c.findings.size(), 1U);
  EXPECT_EQ(c.findings[0].what, "build");
}

TEST_F(ComparedRuns, ChangedTruthIsInvalid) {
  EXPECT_EQ(compare_changed([](Record& r) {
              if (is_target(r) && r.seed == 3 && r.frame == 2) r.values["distance_gt_m"] += 0.01;
            }).verdict,
            GateVerdict::invalid);
}

}  // namespace
}  // namespace sextant
