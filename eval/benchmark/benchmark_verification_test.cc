// A small suite, run, verified, and refused after each kind of edit.

#include <cmath>
#include <limits>

#include "sextant/eval/benchmark/benchmark_testing.h"
#include "sextant/eval/benchmark/card_document.h"
#include "sextant/eval/records/testing.h"

namespace sextant {
namespace {

using ::testing::HasSubstr;

TEST_F(Benchmark, AnHonestFolderIsVerified) {
  const fs::path folder = run("joint_flow");
  const std::vector<std::string> lines = verify_benchmark(folder, options_);
  EXPECT_THAT(lines.back(), HasSubstr("gives the same records"));
}

TEST_F(Benchmark, CardsAreTheSameForAnyJobsAndShards) {
  const fs::path folder = run("joint_flow");
  EXPECT_EQ(without_costs(folder), without_costs(run("joint_flow", "jobs", 2)));
  std::vector<fs::path> shards;
  for (uint64_t i = 1; i <= 3; ++i) {
    BenchmarkRequest shard = request("joint_flow", fmt::format("shard{}", i));
    shard.sweep.shard = i;
    shard.sweep.n_shards = 3;
    fs::create_directories(shard.out);
    const Suite suite = find_suite(shard.suite);
    run_benchmark(shard, suite, plan_benchmark(shard, suite).front());
    shards.push_back(shard.out);
  }
  const fs::path merged = folder_.path() / "merged";
  fs::create_directories(merged);
  merge_benchmarks(shards, merged, false);
  write_card(find_suite(suite_file()), merged / "joint_flow", 1);
  EXPECT_EQ(without_costs(folder), without_costs(merged / "joint_flow"));
}

TEST_F(Benchmark, NumbersAreThoseOfAPlainSweep) {
  const fs::path folder = run("joint_flow");
  const Suite suite = find_suite(suite_file());
  SweepConfig plain = options_.sweep;
  plain.plan =
      parse_plan(plan_text(suite, suite.tracks[0], suite.tracks[0].sweeps[0], "joint_flow", false), "p", "");
  plain.out = folder_.path() / "plain";
  sweep(plain);
  const std::vector<Record> records = untimed(read_records(plain.out / "records.jsonl"));
  EXPECT_EQ(records, untimed(read_records(folder / "depth" / "records.jsonl")));
  double sum = 0;
  int n = 0;
  for (const Record& record : records) {
    if (!record.is_ego() || record.level != 0.2) continue;
    sum += record.errors.at("Et_m");
    ++n;
  }
  const Card card = parse_card(read_file(folder / "card.json"), "card");
  const auto point = std::ranges::find_if(card.curves, [](const CurvePoint& p) {
    return p.estimator == "joint_flow" && p.track == "depth" && p.body == "camera" && p.level == 0.2;
  });
  ASSERT_NE(point, card.curves.end());
  EXPECT_EQ(point->n_truth, n);
  EXPECT_DOUBLE_EQ(point->Et_m->value, sum / n);
}

TEST_F(Benchmark, AbstainingInTheWorstPairsGainsNothingInTheProfile) {
  std::string suite = small_suite;
  const std::string coverage = "\"min_coverage\": 0.9";
  write_file(suite_file(), suite.replace(suite.find(coverage), coverage.size(), "\"min_coverage\": 0.6"));
  const fs::path folder = run("joint_flow");
  const auto camera = [&] {
    const Card card = make_card(find_suite(suite_file()), folder);
    return *std::ranges::find(card.curves, "camera", &CurvePoint::body);
  };
  const CurvePoint whole = camera();
  ASSERT_EQ(whole.n_truth, 6);
  std::vector<double> errors;
  const auto abstain_in_the_worst = [&](std::vector<Record>& records) {
    Record* worst = nullptr;
    for (Record& record : records) {
      if (!record.is_ego() || record.level != whole.level || record.status != Status::ok) continue;
      if (errors.size() < 6) errors.push_back(record.errors.at("Et_m"));
      if (worst == nullptr || record.errors.at("Et_m") > worst->errors.at("Et_m")) worst = &record;
    }
    worst->status = Status::diverged;
    worst->errors = {};
  };
  const fs::path file = folder / "depth" / "records.jsonl";
  for (int n = 1; n <= 2; ++n) {
    edit(file, abstain_in_the_worst);
    const CurvePoint left = camera();
    EXPECT_EQ(left.n_estimated, 6 - n);
    EXPECT_LT(left.Et_m->value, whole.Et_m->value);
    EXPECT_EQ(left.best_Et_m, whole.best_Et_m);
  }
  std::ranges::sort(errors);
  EXPECT_DOUBLE_EQ(*whole.best_Et_m, (errors[0] + errors[1] + errors[2] + errors[3]) / 4);
  edit(file, abstain_in_the_worst);
  EXPECT_FALSE(camera().best_Et_m);
}

TEST_F(Benchmark, RefusesAnErrorWithOneDigitChanged) {
  const fs::path folder = run("joint_flow");
  edit(folder / "depth" / "records.jsonl", [](auto& records) { records[0].errors["Et_m"] *= 1 + 1e-9; });
  EXPECT_THAT(refusal(folder), HasSubstr("does not agree with the records"));
}

TEST_F(Benchmark, RefusesAnEditedCardToo) {
  const fs::path folder = run("joint_flow");
  edit(folder / "depth" / "records.jsonl", [](auto& records) {
    for (Record& record : records)
      record.errors.contains("Et_m") ? void(record.errors["Et_m"] *= 0.9) : void();
  });
  write_card(find_suite(suite_file()), folder, 1);
  EXPECT_THAT(refusal(folder), HasSubstr("other records when it is run again"));
}

TEST_F(Benchmark, RefusesAMissingCase) {
  const fs::path folder = run("joint_flow");
  edit(folder / "depth" / "records.jsonl", [](auto& records) {
    std::erase_if(records, [](const Record& r) { return r.seed == 1 && r.level == 0.8; });
  });
  EXPECT_THAT(refusal(folder), HasSubstr("one of the files was cut off or changed"));
  std::string cases = read_file(folder / "depth" / "cases.jsonl");
  cases.resize(cases.rfind('\n', cases.size() - 2) + 1);
  write_file(folder / "depth" / "cases.jsonl", cases);
  EXPECT_THAT(refusal(folder), HasSubstr("holds 3 cases, the suite has 4"));
}

TEST_F(Benchmark, RefusesDeletedDuplicatedAndInventedRecords) {
  const fs::path folder = run("joint_flow");
  const fs::path file = folder / "depth" / "records.jsonl", cases = folder / "depth" / "cases.jsonl";
  const std::string honest = read_file(file);
  // Changes the records, keeps cases.jsonl and the card consistent with them, and verifies.
  const auto refusal_after = [&](const std::function<void(std::vector<Record>&)>& change) {
    write_file(file, honest);
    edit(file, change);
    std::map<std::pair<double, uint64_t>, int> counts;  // by level and seed, the order of the cases
    for (const Record& record : read_records(file)) ++counts[{record.level, record.seed}];
    std::string lines;
    for (const auto& [key, n] : counts)
      lines += json_line({{"case", std::ranges::count(lines, '\n')}, {"records", n}}) + "\n";
    write_file(cases, lines);
    write_card(find_suite(suite_file()), folder, 1);
    return refusal(folder);
  };
  const auto find = [](std::vector<Record>& records, std::string_view body) {
    return std::ranges::find_if(records, [&](const Record& r) { return r.frame == 2 && r.body == body; });
  };
  EXPECT_EQ(refusal_after([](auto&) {}), "verified");
  EXPECT_THAT(refusal_after([&](auto& records) { records.erase(find(records, "object:1")); }),
              HasSubstr("case 0 ends without a record of frame 2, body object:1, estimator 'joint_flow'"));
  EXPECT_THAT(refusal_after([&](auto& records) { find(records, "object:1")->values["dynamic_gt"] = 0; }),
              HasSubstr("frame 2, body object:1: values.dynamic_gt is 0, but the data have 1"));
  EXPECT_THAT(refusal_after([&](auto& records) { find(records, "ego")->frame = 1; }),
              HasSubstr("a second record of frame 1, body ego"));
  // Objects that do not count may be left out, as in results/benchmark.
  EXPECT_EQ(refusal_after([&](auto& records) { records.erase(find(records, "object:2")); }), "verified");
}

TEST_F(Benchmark, RefusesRecordsOfObjectsThatTheDataDoNotHave) {
  std::string every_object = small_suite;
  const std::string listed = "\"objects\": {\"s18\": [1]},";
  every_object.replace(every_object.find(listed), listed.size(), "");
  write_file(suite_file(), every_object);
  const fs::path folder = run("joint_flow");
  EXPECT_EQ(refusal(folder), "verified");
  edit(folder / "depth" / "records.jsonl",
       [](auto& records) { std::ranges::find(records, "object:3", &Record::body)->body = "object:99"; });
  EXPECT_THAT(refusal(folder), HasSubstr("frame 1, body object:99: has no truth in the data"));
}

TEST_F(Benchmark, RefusesARelabelledLevel) {
  const fs::path folder = run("joint_flow");
  edit(folder / "depth" / "records.jsonl", [](auto& records) {
    for (Record& record : records) {
      if (record.level == 0.2) record.level = 0.8;
    }
  });
  EXPECT_THAT(refusal(folder), HasSubstr("level 0.8, expected 0.2"));
}

TEST_F(Benchmark, RefusesRecordsOfOtherData) {
  const fs::path folder = run("joint_flow");
  const fs::path file = folder / "depth" / "records.jsonl";
  const std::string honest = read_file(file);
  edit(file, [](auto& records) { records[1].sequence = "s01-turn"; });
  EXPECT_THAT(refusal(folder), HasSubstr("data 'synthetic s01-turn', expected 'synthetic s18'"));
  write_file(file, honest);
  edit(file, [](auto& records) { records[1].dataset = "kitti"; });
  EXPECT_THAT(refusal(folder), HasSubstr("data 'kitti s18', expected 'synthetic s18'"));
  write_file(file, honest);
  edit(file, [](auto& records) { records[1].frame = 7; });
  EXPECT_THAT(refusal(folder), HasSubstr("frame 7, expected 1 to 3"));
}

TEST_F(Benchmark, RefusesARelabelledPlan) {
  const fs::path folder = run("joint_flow");
  Json plan = read_json(folder / "depth" / "plan.json");
  plan["plan"]["noise"][1]["noise"]["depth"]["delta_d_px"] = 0.4;
  write_file(folder / "depth" / "plan.json", json_text(plan));
  EXPECT_THAT(refusal(folder), HasSubstr("are not those of small-1"));
}

TEST_F(Benchmark, RefusesAnotherSuite) {
  const fs::path folder = run("joint_flow");
  std::string other = small_suite;
  other.replace(other.find("A small suite"), 13, "Another suite");
  write_file(suite_file(), other);
  EXPECT_THAT(refusal(folder), HasSubstr("belongs to another suite"));
}

TEST_F(Benchmark, RefusesRecordsOfAnotherEstimator) {
  const fs::path folder = run("joint_flow"), other = run("motion_only", "other");
  write_file(folder / "depth" / "records.jsonl", read_file(other / "depth" / "records.jsonl"));
  EXPECT_THAT(refusal(folder), HasSubstr("estimator 'motion_only', the card is of 'joint_flow'"));
}

TEST_F(Benchmark, APageHasEveryCardAndAComparisonPairsTheirRecords) {
  const fs::path ours = run("joint_flow"), other = run("motion_only", "other");
  const std::vector<CardComparison> rows = compare_benchmarks(find_suite(suite_file()), ours, other);
  ASSERT_EQ(rows.size(), 4U);  // camera and objects at two levels
  EXPECT_EQ(rows[0].n_pairs, 6);
  const Suite suite = find_suite(suite_file());
  std::vector<PlacedCard> cards;
  for (const fs::path& folder : {ours, other})
    cards.push_back({parse_card(read_file(folder / "card.json"), "card"), folder.filename().string()});
  const std::string page = to_markdown(page_document(cards, suite));
  EXPECT_THAT(page, HasSubstr("joint_flow"));
  EXPECT_THAT(page, HasSubstr("motion_only"));
  const std::vector<ProfileRow> profile = performance_profile(cards);
  ASSERT_EQ(profile.size(), 2U);
  EXPECT_EQ(profile[0].n_cases, 4);
  EXPECT_DOUBLE_EQ(profile[0].share_within(1) + profile[1].share_within(1), 1);
}

/// Two cards of estimators a and b with E_t of the camera at the levels 1, 2, ..; NaN: not estimated.
std::vector<PlacedCard> two_cards(const std::vector<std::pair<double, double>>& errors) {
  std::vector<PlacedCard> cards(2);
  for (size_t i = 0; i < 2; ++i) {
    const std::string name(1, i == 0 ? 'a' : 'b');
    cards[i].folder = "of_" + name;
    cards[i].card.estimator = name;
    cards[i].card.results = {name};
    for (size_t level = 0; level < errors.size(); ++level) {
      CurvePoint point{.estimator = name, .track = "depth", .body = "camera"};
      point.level = static_cast<double>(level + 1);
      point.n_truth = 10;
      const double error = i == 0 ? errors[level].first : errors[level].second;
      if (std::isfinite(error)) {
        point.n_estimated = 10;
        point.Et_m = IntervalEstimate{.value = error};
        point.best_Et_m = error;
      }
      cards[i].card.curves.push_back(point);
    }
  }
  return cards;
}

TEST_F(Benchmark, TheProfileCountsCasesThatNobodySolvesAndExactSolutions) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  const std::vector<PlacedCard> cards = two_cards({{1e-12, 1e-8}, {none, none}, {0.1, 0.2}, {none, 0.2}});
  const std::vector<ProfileRow> profile = performance_profile(cards);
  ASSERT_EQ(profile.size(), 2U);
  for (const ProfileRow& row : profile) {
    EXPECT_EQ(row.n_cases, 4) << row.estimator;
    const std::vector<double> ratios =
        row.estimator == "a" ? std::vector<double>{1, 1} : std::vector<double>{1, 1, 2};
    EXPECT_EQ(row.ratios, ratios) << row.estimator;
  }
}

TEST_F(Benchmark, CardsWithTheSameNameStayApart) {
  std::vector<PlacedCard> cards = two_cards({{0.1, 0.2}});
  cards[1].card.estimator = cards[1].card.results[0] = cards[1].card.curves[0].estimator = "a";
  const std::string page = to_markdown(page_document(cards, find_suite(suite_file())));
  EXPECT_THAT(page, HasSubstr("a (of_a)"));
  EXPECT_THAT(page, HasSubstr("a (of_b)"));
  EXPECT_THROW(performance_profile(cards), Error);
  const fs::path folder = run("joint_flow");
  EXPECT_THROW(page_files({folder, folder}, suite_file(), folder_.path(), 1), Error);
}

TEST_F(Benchmark, AQuickRunIsNotComparedWithACompleteOneAndVerifySaysThatItIsQuick) {
  const Suite suite = find_suite(suite_file());
  const fs::path complete = run("joint_flow"), quick = run("joint_flow", "quick", 1, /*quick=*/true);
  for (const auto& [one, other] : {std::pair(quick, complete), std::pair(complete, quick)}) {
    try {
      compare_benchmarks(suite, one, other);
      ADD_FAILURE() << "compared";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(quick.string() + " is of a quick run, " + complete.string()));
    }
  }
  EXPECT_EQ(compare_benchmarks(suite, quick, quick).size(), 2U);
  EXPECT_THAT(verify_benchmark(quick, options_), ::testing::Contains(HasSubstr("a quick run")));
  EXPECT_THAT(verify_benchmark(complete, options_),
              ::testing::Not(::testing::Contains(HasSubstr("a quick run"))));
}

TEST_F(Benchmark, TheCardShowsTheTracksThatAnEarlierCommandFinished) {
  Json two = parse_json(small_suite, "suite"), more = two["tracks"][0];
  more["name"] = "other";
  more["plans"] = {{"other", more["plans"]["depth"]}};
  two["tracks"].push_back(more);
  write_file(suite_file(), two.dump());
  const Suite suite = find_suite(suite_file());
  SweepOutcome outcome;
  const auto run_tracks = [&](const std::vector<std::string>& tracks, bool force = false) {
    BenchmarkRequest of = request("motion_only", "out");
    of.tracks = tracks;
    of.sweep.force = force;
    fs::create_directories(of.out);
    const BenchmarkPlan plan = plan_benchmark(of, suite).front();
    outcome = run_benchmark(of, suite, plan);
    return make_card(suite, of.out / plan.folder);
  };
  using LeftOut = std::map<std::string, std::string>;
  const Card first = run_tracks({"other"});
  EXPECT_EQ(first.left_out, (LeftOut{{"depth", "not requested"}}));
  const fs::path left_out = folder_.path() / "out" / "motion_only" / left_out_name;
  write_file(left_out, R"({"depth": "a reason of the user"})");
  EXPECT_EQ(run_tracks({"other"}).left_out, (LeftOut{{"depth", "a reason of the user"}}));
  const Card second = run_tracks({"depth"});
  EXPECT_TRUE(second.left_out.empty());
  EXPECT_FALSE(fs::exists(left_out));
  EXPECT_EQ(second.sweeps.size(), 2U);
  EXPECT_EQ(outcome.n_before, 4U) << "the finished track is not run again";
  EXPECT_EQ(run_tracks({"depth"}, /*force=*/true).sweeps.size(), 2U);
  EXPECT_EQ(outcome.n_before, 4U);
  EXPECT_EQ(run_tracks({}).sweeps.size(), 2U);
  EXPECT_EQ(outcome.n_before, 8U);
  write_file(left_out, R"({"other": "a reason of the user"})");
  EXPECT_EQ(run_tracks({}).left_out, (LeftOut{{"other", "a reason of the user"}}));
}

TEST_F(Benchmark, CardsAreReadBack) {
  const fs::path folder = run("joint_flow");
  const Json json = read_json(folder / "card.json");
  EXPECT_EQ(to_json(parse_card(json_text(json), "card")), json);
}

}  // namespace
}  // namespace sextant
