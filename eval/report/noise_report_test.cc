// Comparisons, trends and the reading of sweeps, on records made by hand.

#include <cmath>
#include <map>

#include "sextant/base/philox.h"
#include "sextant/base/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/testing.h"
#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/noise_tables.h"
#include "sextant/eval/report/swept_parameter.h"
#include "sextant/eval/report/testing.h"
#include "sextant/eval/report/trends.h"
#include "sextant/noise/noise.h"

namespace sextant {
namespace {

Record record_of(const std::string& estimator, double level, uint64_t seed, int frame, double Et_m) {
  Record r = RecordOf{"d", "s", estimator, "ego", fmt::format("depth {}", level), level, seed, frame};
  r.errors = {{"Et_m", Et_m}, {"ER_deg", 2 * Et_m}};
  return r;
}

/// error = level (1 + gain) + 0.01 x noise of the seed, frame and level, which estimators share.
std::vector<Record> records_of(const std::vector<std::pair<std::string, double>>& gains, uint64_t n_seeds) {
  std::vector<Record> records;
  for (const auto& [estimator, gain] : gains) {
    for (const double level : {0.1, 0.2, 0.3}) {
      for (uint64_t seed = 0; seed < n_seeds; ++seed) {
        for (int frame = 1; frame <= 5; ++frame) {
          PhiloxStream random(seed, static_cast<uint64_t>(frame + 100 * level));
          const double noise = static_cast<double>(random.below(1000)) / 1000 - 0.5;
          records.push_back(record_of(estimator, level, seed, frame, level * (1 + gain) + 0.01 * noise));
        }
      }
    }
  }
  return records;
}

NoiseSweep sweep_of(const std::vector<Record>& records) {
  return noise_sweep_of("depth.delta_d_px", records);
}
NoiseSweep sweep_of(const std::vector<std::pair<std::string, double>>& gains, uint64_t n_seeds) {
  return sweep_of(records_of(gains, n_seeds));
}

TEST(NoiseLevel, KeepsTheBoundsOfAnyNumberOfErrors) {
  std::vector<Interned> names;
  for (int e = 0; e < 10; ++e) names.emplace_back(fmt::format("error_{}", e));
  NoiseLevel level(NoiseLevelKey::of(record_of("a", 0.1, 0, 1, 1)), names);
  for (int frame = 1; frame <= 20; ++frame) {
    Record r = record_of("a", 0.1, 0, 21 - frame, 1);
    r.errors.clear();
    for (size_t e = 0; e < names.size(); ++e) {
      r.errors[names[e]] = 3;
      if (frame > static_cast<int>(e)) r.bound[names[e]] = 1 + static_cast<double>(e);
    }
    level.add(r);
  }
  level.sort();
  for (size_t e = 0; e < names.size(); ++e) {
    const auto [errors, bounds] = level.bounded(e);
    EXPECT_EQ(total(errors).n, 20 - static_cast<double>(e)) << names[e];
    EXPECT_EQ(total(level.sums(e, ClusterBy::frames)).n, 20) << names[e];
    EXPECT_EQ(bounds.mean(), 1 + static_cast<double>(e)) << names[e];
  }
}

TEST(Comparisons, FindADifferenceOfTheSizeThatIsThere) {
  const std::vector<ComparisonRow> rows =
      compare_estimators({sweep_of({{"a", 0}, {"b", -0.1}, {"c", 0}}, 20)}, 2);
  ASSERT_EQ(rows.size(), 9U);  // 3 levels x (a b, a c, b c)
  const ComparisonRow& ab = rows[0];
  EXPECT_EQ(ab.first + ab.second, "ab");
  EXPECT_EQ(ab.n_pairs, 100);
  EXPECT_NEAR(ab.errors.at("Et_m").difference, -0.01, 1e-12);
  EXPECT_NEAR(ab.errors.at("ER_deg").difference, -0.02, 1e-12);
  EXPECT_EQ(verdict(ab.errors.at("Et_m"), ab), "b lower");
  // 18 p-values at once; the smallest one possible of 20 signed ranks is 2 / 2^20.
  EXPECT_NEAR(*ab.errors.at("Et_m").p, std::pow(2.0, -19), 1e-9);
  EXPECT_GT(*ab.errors.at("Et_m").p_corrected, *ab.errors.at("Et_m").p);
  EXPECT_EQ(verdict(rows[1].errors.at("Et_m"), rows[1]), "identical");
  EXPECT_EQ(verdict(rows[2].errors.at("Et_m"), rows[2]), "b lower");  // of b and c
}

TEST(Comparisons, FewSeedsThatAgreeAreTooFewForATest) {
  for (const auto& [n_seeds, expected] : {std::pair(5, "too few clusters"), std::pair(20, "a lower")}) {
    for (const ComparisonRow& row :
         compare_estimators({sweep_of(records_of({{"a", 0}, {"b", 0.01}}, n_seeds))}))
      EXPECT_EQ(verdict(row.errors.at("Et_m"), row), expected) << n_seeds;
  }
}

TEST(Comparisons, CopiesOfASeedAreNoFurtherData) {
  // Without noise all seeds have the same errors; they differ between the estimators in single frames.
  const auto rows_of = [](uint64_t n_seeds) {
    std::vector<Record> records;
    for (uint64_t seed = 0; seed < n_seeds; ++seed) {
      for (int frame = 1; frame <= 5; ++frame) {
        records.push_back(record_of("a", 0, seed, frame, 1 + 0.1 * frame));
        records.push_back(record_of("b", 0, seed, frame, 1 + 0.1 * frame + (frame % 2 == 0 ? 0.01 : -0.02)));
      }
    }
    EXPECT_EQ(sweep_of(records).levels.front()->clusters(), ClusterBy::frames);
    return compare_estimators({sweep_of(records)});
  };
  const ComparisonRow one = rows_of(1).front(), twenty = rows_of(20).front();
  const ErrorComparison &once = one.errors.at("Et_m"), &often = twenty.errors.at("Et_m");
  EXPECT_NEAR(often.interval->low, once.interval->low, 1e-12);
  EXPECT_NEAR(often.interval->high, once.interval->high, 1e-12);
  EXPECT_EQ(*often.p, *once.p);
  EXPECT_EQ(verdict(often, twenty), "no difference seen");
}

TEST(Comparisons, IdenticalEstimatorsAreNoFurtherTests) {
  const std::vector<ComparisonRow> two = compare_estimators({sweep_of({{"a", 0}, {"b", -0.1}}, 20)});
  const std::vector<ComparisonRow> three =
      compare_estimators({sweep_of({{"a", 0}, {"b", -0.1}, {"c", -0.1}}, 20)});
  EXPECT_EQ(verdict(three[2].errors.at("Et_m"), three[2]), "identical");
  // a against b and a against c: twice the tests, not three times.
  EXPECT_NEAR(*three[0].errors.at("Et_m").p_corrected, 2 * *two[0].errors.at("Et_m").p_corrected, 1e-12);
}

TEST(Comparisons, NoiseAloneIsNoDifference) {
  std::vector<Record> records = records_of({{"a", 0}}, 30);
  const size_t n = records.size();
  for (size_t i = 0; i < n; ++i) {
    Record other = records[i];
    PhiloxStream random(77, i);
    other.estimator = "b";
    other.errors["Et_m"] += 0.001 * (static_cast<double>(random.below(2001)) / 1000 - 1);
    records.push_back(other);
  }
  for (const ComparisonRow& row : compare_estimators({sweep_of(records)})) {
    EXPECT_EQ(verdict(row.errors.at("Et_m"), row), "no difference seen") << row.level;
    EXPECT_GT(*row.errors.at("Et_m").detectable, 0);
    EXPECT_LT(*row.errors.at("Et_m").detectable, 1e-3);
  }
}

TEST(Comparisons, CountWhatOnlyOneHasEstimated) {
  std::vector<Record> records = records_of({{"a", 0}, {"b", 0}}, 4);
  for (Record& r : records) {
    if (r.estimator == "b" && r.frame <= 2) r.status = Status::lost;
    if (r.estimator == "a" && r.frame == 5) r.status = Status::lost;
  }
  const ComparisonRow row = compare_estimators({sweep_of(records)}).front();
  EXPECT_EQ(row.n_pairs, 8);
  EXPECT_EQ(row.n_only_first, 8);
  EXPECT_EQ(row.n_only_second, 4);
  const NoiseSweep one_seed = sweep_of({{"a", 0}, {"b", -0.5}}, 1);  // frames are the clusters
  EXPECT_TRUE(compare_estimators({one_seed}).front().errors.at("Et_m").p);
}

TEST(Trends, SlopeRisesAndTest) {
  const std::vector<TrendRow> rows = noise_trends({sweep_of({{"a", 0}, {"b", 1}}, 20)}, 2);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].n_levels, 3);
  EXPECT_EQ(rows[0].n_clusters, 20);
  EXPECT_EQ(rows[0].errors.at("Et_m").n_rises, 2);
  EXPECT_NEAR(rows[0].errors.at("Et_m").slope.slope, 1, 0.01);
  EXPECT_LE(rows[0].errors.at("Et_m").slope.interval->low, rows[0].errors.at("Et_m").slope.slope);
  EXPECT_NEAR(rows[1].errors.at("Et_m").slope.slope, 2, 0.01);
  EXPECT_LT(*rows[0].errors.at("Et_m").p_corrected, 0.001);
  EXPECT_TRUE(noise_trends({noise_sweep_of("", {record_of("a", 1, 0, 1, 1)})}).empty());
}

TEST(NoiseReport, TablesShowLevelsThatDifferAsDifferent) {
  std::vector<Record> records;
  for (const double level : {1e-5, 1e-4, 0.01}) {
    for (uint64_t seed = 0; seed < 3; ++seed) {
      for (const std::string estimator : {"a", "b"})
        records.push_back(record_of(estimator, level, seed, 1, 1 + level));
    }
  }
  const NoiseSweep sweep = noise_sweep_of("flow.epe_px", records);
  const auto decimals = [](const Table& table, const char* key) {
    return table.columns[table.place(key)].decimals;
  };
  EXPECT_EQ(decimals(noise_level_table(noise_levels(sweep)), "level"), 5);
  EXPECT_EQ(decimals(comparison_table(compare_estimators({sweep})), "level"), 5);
  EXPECT_EQ(decimals(trend_table(noise_trends({sweep}, 1)), "lowest"), 5);
  EXPECT_EQ(decimals(trend_table(noise_trends({sweep}, 1)), "highest"), 5);
  AchievedNoiseRow row;
  row.level = 1e-5;
  EXPECT_EQ(decimals(achieved_noise_table({row}), "level"), 5);
  row.level = 0.25;
  EXPECT_EQ(decimals(achieved_noise_table({row}), "level"), 3);
}

TEST(NoiseSweep, ReadsFoldersAndRefusesTheSameCaseTwice) {
  const TempFolder folder;
  const auto write = [&](const std::string& name, const std::vector<Record>& records) {
    std::filesystem::create_directories(folder.path() / name);
    write_file(folder.path() / name / "records.jsonl", write_records(records));
    Json run;
    run["configuration"]["noise"] = Json::array();
    run["noise"] = Json::array();
    for (const double level : {0.1, 0.2, 0.3}) {
      run["configuration"]["noise"].push_back(
          {{"level", level}, {"noise", {{"depth", {{"delta_d_px", level}, {"baseline_m", 0.5}}}}}});
      run["noise"].push_back({{"source", "x"},
                              {"level", level},
                              {"noise",
                               {{"requested", {{"depth", {{"delta_d_px", level}}}}},
                                {"depth", {{"n", 10}, {"normalised_sigma", 1.01}}}}}});
    }
    write_file(folder.path() / name / "run.json", run.dump());
    return folder.path() / name;
  };
  const auto a = write("a", records_of({{"a", 0}}, 2));
  const auto b = write("b", records_of({{"b", 0}}, 2));
  const std::vector<NoiseSweep> sweeps = read_noise_sweeps({a, b});
  ASSERT_EQ(sweeps.size(), 1U);
  EXPECT_EQ(sweeps[0].parameter, "depth.delta_d_px");
  EXPECT_EQ(sweeps[0].estimators.size(), 2U);
  const std::vector<AchievedNoiseRow> achieved = achieved_noise_rows(sweeps[0]);
  ASSERT_EQ(achieved.size(), 6U);
  EXPECT_DOUBLE_EQ(achieved[1].achieved_px.value(), 0.2 * 1.01);
  expect_error([&] { read_noise_sweeps({a, b, a}); }, "give each case once");
  for (const auto& [name, definition] : {std::pair(a, "1: m"), std::pair(b, "2: mm")}) {
    Json run = read_json(name / "run.json");
    run["metric_definitions"] = {{"Et_m", definition}};
    write_file(name / "run.json", run.dump());
  }
  expect_error([&] { read_noise_sweeps({a, b}); }, "Et_m is defined as \"2: mm\"");
  expect_error([&] { read_noise_sweeps({folder.path() / "none"}); }, "no records.jsonl");
  Json run = read_json(b / "run.json");
  run["records"] = 1000;
  write_file(b / "run.json", run.dump());
  std::vector<std::string> warnings;
  read_noise_sweeps({b}, &warnings);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_THAT(warnings[0], HasSubstr("but run.json states 1000"));
}

using NoiseByParameter = std::map<std::string, std::vector<std::string>>;

/// A sweep of noise on depth and flow, with one case for each level.
struct SweepOfTwoChannels {
  Json run{};
  std::vector<Record> records{};

  void add(double level, double delta_d_px, double epe_px) {
    add(level, Noise(Json{{"depth", {{"delta_d_px", delta_d_px}}}, {"flow", {{"epe_px", epe_px}}}}));
  }
  void add(double level, const Noise& noise) {
    run["configuration"]["noise"].push_back({{"level", level}, {"noise", noise.options()}});
    run["noise"].push_back({{"source", "x"},
                            {"level", level},
                            {"noise", {{"requested", noise.options()}, {"depth", {{"n", 1}}}}}});
    Record record = record_of("a", level, 0, 1, 1);
    record.noise = noise.name();
    records.push_back(std::move(record));
  }
  void add_depth_grid(const std::vector<double>& levels, double epe_px) {
    for (const double level : levels) add(level, level, epe_px);
  }
  void add_flow_grid(const std::vector<double>& levels, double delta_d_px) {
    for (const double level : levels) add(level, delta_d_px, level);
  }
  /// Writes the sweep and reads it; returns the noise of the levels of each parameter.
  NoiseByParameter read() const {
    const TempFolder folder;
    write_file(folder.path() / "records.jsonl", write_records(records));
    write_file(folder.path() / "run.json", run.dump());
    NoiseByParameter noise;
    for (const NoiseSweep& sweep : read_noise_sweeps({folder.path()})) {
      for (const NoiseLevelRef& level : sweep.levels)
        noise[sweep.parameter].push_back(level->key().noise.str());
      EXPECT_EQ(sweep.achieved.size(), sweep.levels.size()) << sweep.parameter;
    }
    return noise;
  }
};

TEST(NoiseSweep, GridsOfOnePlanWithTheSameLevelsAreApart) {
  SweepOfTwoChannels sweep;
  sweep.add_depth_grid({0.1, 0.2}, 0.5);
  sweep.add_flow_grid({0.1, 0.2}, 0.5);
  EXPECT_EQ(
      sweep.read(),
      (NoiseByParameter{{"depth.delta_d_px", {"depth 0.1 px + flow 0.5 px", "depth 0.2 px + flow 0.5 px"}},
                        {"flow.epe_px", {"depth 0.5 px + flow 0.1 px", "depth 0.5 px + flow 0.2 px"}}}));
}

TEST(NoiseSweep, AGridEndsWhereTheOtherNoiseChanges) {
  SweepOfTwoChannels sweep;
  sweep.add_depth_grid({0.25, 0.5}, 0);
  sweep.add_flow_grid({0.5, 1}, 0.5);  // at its first level delta_d is the level, too
  EXPECT_EQ(sweep.read(),
            (NoiseByParameter{{"depth.delta_d_px", {"depth 0.25 px", "depth 0.5 px"}},
                              {"flow.epe_px", {"depth 0.5 px + flow 0.5 px", "depth 0.5 px + flow 1 px"}}}));
}

TEST(NoiseSweep, GridsOfOneParameterUnderDifferentNoiseAreApart) {
  SweepOfTwoChannels sweep;
  sweep.add_depth_grid({0.1, 0.2}, 0.5);
  sweep.add_depth_grid({0.1, 0.2}, 0);
  EXPECT_EQ(sweep.read(),
            (NoiseByParameter{{"depth.delta_d_px with flow 0.5 px",
                               {"depth 0.1 px + flow 0.5 px", "depth 0.2 px + flow 0.5 px"}},
                              {"depth.delta_d_px with none", {"depth 0.1 px", "depth 0.2 px"}}}));
  EXPECT_EQ(parameter_title("flow.epe_px with depth 0.5 px", ""), parameter_title("flow.epe_px", ""));
  EXPECT_THAT(parameter_title("flow.epe_px", "flow 1 px"), HasSubstr("standard deviation"));
  EXPECT_THAT(parameter_title("flow.epe_px",
                              noise_name({{"flow", {{"epe_px", 1}, {"reading", "epe_is_mean_error"}}}})),
              HasSubstr("mean end-point error"));
}

TEST(NoiseSweep, GridsThatDifferInTheModelOfTheirParameterAreApart) {
  SweepOfTwoChannels sweep;
  for (const double baseline_m : {0.5, 0.6}) {
    for (const double level : {0.1, 0.2})
      sweep.add(level + baseline_m,
                Noise(Json{{"depth", {{"delta_d_px", level + baseline_m}, {"baseline_m", baseline_m}}}}));
  }
  const NoiseByParameter noise = sweep.read();
  EXPECT_EQ(noise.size(), 2U);
  for (const auto& [parameter, names] : noise) EXPECT_EQ(names.size(), 2U) << parameter;
}

TEST(NoiseSweep, LevelZeroBelongsToItsGrid) {
  SweepOfTwoChannels sweep;
  sweep.add_depth_grid({0, 0.2}, 0.5);
  sweep.add_flow_grid({0, 0.2}, 0.5);
  EXPECT_EQ(sweep.read(),
            (NoiseByParameter{{"depth.delta_d_px", {"flow 0.5 px", "depth 0.2 px + flow 0.5 px"}},
                              {"flow.epe_px", {"depth 0.5 px", "depth 0.5 px + flow 0.2 px"}}}));
  SweepOfTwoChannels without_base;
  without_base.add_depth_grid({0.1, 0.2}, 0);
  without_base.add_flow_grid({0, 0.1}, 0);
  EXPECT_EQ(without_base.read(), (NoiseByParameter{{"depth.delta_d_px", {"depth 0.1 px", "depth 0.2 px"}},
                                                   {"flow.epe_px", {"none", "flow 0.1 px"}}}));
}

TEST(NoiseSweep, LevelsThatScaleAProfileAreASweepOfItsScale) {
  const auto add_profile = [](const std::vector<double>& scales, SweepOfTwoChannels& sweep) {
    for (const double scale : scales)
      sweep.add(scale, Noise(Json{{"profile", "pwc_net_kitti03"}, {"scale", scale}}));
  };
  SweepOfTwoChannels sweep;
  add_profile({0.3, 0.7, 1.9}, sweep);
  sweep.add_depth_grid({0.1, 0.2}, 0.5);
  add_profile({0, 0.6, 1.1}, sweep);
  NoiseByParameter noise = sweep.read();
  EXPECT_EQ(noise["scale"].size(), 6U);
  EXPECT_EQ(noise["depth.delta_d_px"].size(), 2U);
  EXPECT_EQ(noise.size(), 2U);
  EXPECT_THAT(parameter_title("scale", ""), HasSubstr("profile"));
  SweepOfTwoChannels others;  // neither of one profile nor of one parameter
  others.add(1, 0.1, 0.5);
  others.add(2, 0.2, 0.6);
  EXPECT_EQ(others.read().begin()->first, "");
}

TEST(NoiseSweep, KeysWithDotsAreNoParameters) {
  SweepOfTwoChannels sweep;
  sweep.add_depth_grid({1, 2}, 0);
  for (Json& level : sweep.run["configuration"]["noise"])
    level["noise"] = {{"a", level["level"]}, {"a.b", level["level"]}};
  EXPECT_EQ(sweep.read(), (NoiseByParameter{{"", {"depth 1 px", "depth 2 px"}}}));
}

TEST(NoiseSweep, LevelsThatAShardLacksDoNotShiftTheOthers) {
  SweepOfTwoChannels sweep;
  sweep.add_depth_grid({0.1, 0.2}, 0.5);
  sweep.add_flow_grid({0.1, 0.2}, 0.5);
  sweep.records.erase(sweep.records.begin() + 1);
  sweep.run["noise"].erase(1);
  EXPECT_EQ(
      sweep.read(),
      (NoiseByParameter{{"depth.delta_d_px", {"depth 0.1 px + flow 0.5 px"}},
                        {"flow.epe_px", {"depth 0.5 px + flow 0.1 px", "depth 0.5 px + flow 0.2 px"}}}));
}

TEST(NoiseSweep, OneLevelOfTwoNoisesIsTwoSweeps) {
  SweepOfTwoChannels sweep;
  sweep.add(1, 0, 0.2);
  sweep.add(1, 0.4, 0);
  sweep.add(2, 0, 1);
  EXPECT_EQ(sweep.read(), (NoiseByParameter{{"noise depth 0.4 px", {"depth 0.4 px"}},
                                            {"noise flow 0.2 px", {"flow 0.2 px"}},
                                            {"noise flow 1 px", {"flow 1 px"}}}));
  EXPECT_THAT(parameter_title("noise flow 1 px", "flow 1 px"), HasSubstr("flow 1 px"));
}

TEST(AchievedNoise, SharesAreShownWhereNothingElseIsMeasured) {
  NoiseSweep sweep;
  const auto rows_of = [&](const Json& noise) {
    sweep.achieved = {{"x", 1, noise}};
    return achieved_noise_rows(sweep);
  };
  const auto quantised = rows_of({{"depth", {{"n", 100}, {"share_invalidated", 0.164}}}});
  ASSERT_EQ(quantised.size(), 1U);
  EXPECT_EQ(quantised[0].share_invalidated, 0.164);
  EXPECT_FALSE(quantised[0].requested_px || quantised[0].achieved_px);
  const auto outliers = rows_of({{"flow", {{"background", {{"n", 100}, {"outlier_share", 1.0}}}}}});
  ASSERT_EQ(outliers.size(), 1U);
  EXPECT_EQ(outliers[0].outlier_share, 1.0);
  EXPECT_EQ(achieved_noise_table(outliers).rows.size(), 1U);
}

}  // namespace
}  // namespace sextant
