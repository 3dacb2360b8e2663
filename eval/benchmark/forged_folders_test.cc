// Folders that were changed so that their card shows another result than the estimator has, and right folders
// that must be accepted all the same.

#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/benchmark/benchmark_testing.h"
#include "sextant/eval/benchmark/card_document.h"
#include "sextant/eval/experiment/case_estimator.h"

namespace sextant {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// Results called r0 (joint_flow) and r1 (motion_only) of one run, like those of an external program.
class TwoResults final : public CaseEstimator {
 public:
  explicit TwoResults(Json options) : options_(std::move(options)) {}
  std::vector<NamedEstimator> begin(const CaseContext& context) const override {
    ++n_begun;
    std::vector<NamedEstimator> all;
    for (const char* name : {"joint_flow", "motion_only"}) {
      std::vector<NamedEstimator> one = make_case_estimator(name)->begin(context);
      all.push_back({fmt::format("r{}", all.size()), std::move(one.front().estimator)});
    }
    return all;
  }
  Json options() const override { return options_; }
  std::string label() const override { return "program"; }
  std::optional<Fingerprint> fingerprint() const override {
    return Fingerprint{.parts = {{"program", version}}, .not_seen = {}};
  }

  static inline int n_begun = 0;
  static inline std::string version = "1";

 private:
  Json options_;
};

class ForgedFolder : public Benchmark {
 protected:
  static void SetUpTestSuite() {
    add_estimator_kind("two", "two:NAME", [](const std::string&, const Json& options) {
      return std::make_shared<const TwoResults>(options);
    });
  }
  void SetUp() override {
    Benchmark::SetUp();
    options_.sample_seed = 1;
    options_.all = true;
  }

  /// Adds tracks to the suite that are copies of the first one but for `changes`.
  void add_track(const std::string& name, const Json& changes) const {
    Json json = read_json(suite_file()), track = json["tracks"][0];
    Json plan = track["plans"]["depth"];
    track["name"] = name;
    plan.merge_patch(changes.value("plan", Json::object()));
    if (plan["noise"].contains("noise")) plan["noise"] = Json{{"level", 0.2}, {"noise", Json::object()}};
    track["plans"] = {{name, plan}};
    if (changes.contains("needs_data")) track["needs_data"] = true;
    json["tracks"].push_back(track);
    write_file(suite_file(), json_text(json));
  }
  Suite suite() const { return find_suite(suite_file()); }
  void write_card_again(const fs::path& folder) const { write_card(suite(), folder, 1); }
  std::string card_refusal(const fs::path& folder) const {
    try {
      write_card_again(folder);
    } catch (const Error& error) {
      return error.what();
    }
    return "written";
  }
  /// Changes records of the track, writes the card of them and verifies.
  std::string refusal_after(const fs::path& folder, const std::function<void(std::vector<Record>&)>& change,
                            const std::string& track = "depth") {
    const std::string honest = read_file(folder / track / "records.jsonl");
    edit(folder / track / "records.jsonl", change);
    write_card_again(folder);
    const std::string text = refusal(folder);
    write_file(folder / track / "records.jsonl", honest);
    return text;
  }
  static void edit_plan(const fs::path& folder, const std::function<void(Json&)>& change) {
    Json plan = read_json(folder / "plan.json");
    change(plan);
    write_file(folder / "plan.json", json_text(plan));
  }
};

TEST_F(ForgedFolder, RunsNoProgramOfTheFolderUnlessThisIsRequested) {
  add_track("other", Json::object());
  const fs::path folder = run("joint_flow");
  const auto plant = [](Json& plan) {
    plan["plan"]["estimators"][0]["name"] = "two:program";
    plan["plan"]["estimators"][0]["options"] = {{"recorded", true}, {"command", "touch planted"}};
  };
  TwoResults::n_begun = 0;
  edit_plan(folder / "other", plant);
  EXPECT_THAT(card_refusal(folder), HasSubstr("the name of its estimator 'joint_flow' differs from that in"));
  EXPECT_THAT(refusal(folder), HasSubstr("differs from that in"));
  edit_plan(folder / "depth", plant);
  write_card_again(folder);
  EXPECT_THAT(verify_benchmark(folder, options_), Contains(HasSubstr("no case was run again: two:program")));
  EXPECT_EQ(TwoResults::n_begun, 0);
}

TEST_F(ForgedFolder, IsOfOneEstimatorWithTheSameOptionsAndVersion) {
  add_track("other", Json::object());
  const fs::path folder = run("joint_flow"), plan = folder / "other" / "plan.json";
  const std::string honest = read_file(plan);
  const auto refusal_of = [&](const std::function<void(Json & estimator)>& change) {
    write_file(plan, honest);
    edit_plan(folder / "other", [&](Json& json) { change(json["plan"]["estimators"][0]); });
    return card_refusal(folder);
  };
  EXPECT_THAT(refusal_of([](Json& e) { e["label"] = "other"; }), HasSubstr("the label of its estimator"));
  EXPECT_THAT(refusal_of([](Json& e) { e["name"] = "motion_only"; }), HasSubstr("the name of its"));
  EXPECT_THAT(refusal_of([](Json& e) { e["options"]["huber_flow"] = 2; }), HasSubstr("the options of its"));
  EXPECT_THAT(refusal_of([](Json& e) { e["pipeline"] = Json::object(); }),
              HasSubstr("has its own 'pipeline': expected that of the suite"));
  EXPECT_EQ(refusal_of([](Json&) {}), "written");

  const fs::path program = run("two:program", "programs");
  const Card first = stored_card(program);
  EXPECT_EQ(first.fingerprint.size(), 64U);
  EXPECT_THAT(read_file(program / "card.md"), HasSubstr(first.fingerprint));
  TwoResults::version = "2";
  fs::copy(run("two:program", "later") / "other", program / "other",
           fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  TwoResults::version = "1";
  EXPECT_THAT(card_refusal(program), HasSubstr("the version of its estimator 'program' differs"));
}

TEST_F(ForgedFolder, StatesOptionsThatAreNotTheDefaults) {
  const fs::path folder = run("joint_flow");
  EXPECT_THAT(read_file(folder / "card.md"), Not(HasSubstr("**options**")));
  edit_plan(folder / "depth", [](Json& plan) { plan["plan"]["estimators"][0]["options"]["huber_flow"] = 2; });
  write_card_again(folder);
  EXPECT_THAT(read_file(folder / "card.md"), HasSubstr("**options**: {\"huber_flow\":2}"));
  EXPECT_THAT(refusal(folder), HasSubstr("gives other records when it is run again"));
}

TEST_F(ForgedFolder, LacksNoErrorsBoundsAndNormalisedErrors) {
  const fs::path folder = run("joint_flow");
  const auto without = [&](Record::Numbers Record::*map, const char* name) {
    return refusal_after(folder, [&](auto& records) {
      for (Record& record : records)
        if (record.frame == 2) (record.*map).erase(name);
    });
  };
  EXPECT_THAT(without(&Record::errors, "Et_m"), HasSubstr("status ok, but the error Et_m is missing"));
  EXPECT_THAT(without(&Record::errors, "ER_deg"), HasSubstr("status ok, but the error ER_deg is missing"));
  EXPECT_THAT(without(&Record::errors, "Ev_kmh"), HasSubstr("status ok, but the error Ev_kmh is missing"));
  const auto without_speeds = [](auto& records) {
    for (Record& record : records) {
      if (!record.is_ego()) record.errors.erase("Ev_kmh");
      record.values.erase("v_kmh");
    }
  };
  EXPECT_THAT(refusal_after(folder, without_speeds), HasSubstr("the error Ev_kmh is missing"));
  EXPECT_THAT(without(&Record::bound, "Et_m"), HasSubstr("bound.Et_m: stored is nothing, the rerun gives"));
  EXPECT_THAT(without(&Record::values, "nees"), HasSubstr("values.nees: stored is nothing, the rerun gives"));
  EXPECT_THAT(refusal_after(folder, [](auto& records) { ++records[0].n_inliers; }),
              HasSubstr("frame 1, body ego, estimator 'joint_flow': n_inliers: stored is"));
  const std::string text = refusal_after(folder, [](auto& records) { records[0].errors["Et_m"] *= 2; });
  EXPECT_THAT(text, HasSubstr("case 0 gives other records when it is run again: frame 1, body ego"));
  EXPECT_THAT(text, HasSubstr("; it was run by Sextant "));
  EXPECT_EQ(refusal_after(folder, [](auto&) {}), "verified");
}

TEST_F(ForgedFolder, HasTheBoundsOfTheDataAlsoIfItsProgramIsNotRun) {
  const fs::path folder = run("two:program");
  EXPECT_EQ(refusal(folder), "verified");
  const auto larger_bounds = [](auto& records) {
    for (Record& record : records) {
      const Record::Numbers bounds = record.bound;
      for (const auto& [name, bound] : bounds) record.bound[name] = 1.6 * bound;
    }
  };
  EXPECT_THAT(refusal_after(folder, larger_bounds), HasSubstr("bounds do not follow from the data: frame 1"));
  const auto without_bounds = [](auto& records) {
    for (Record& record : records)
      if (record.frame == 2) record.bound.clear();
  };
  EXPECT_THAT(refusal_after(folder, without_bounds), HasSubstr(": stored is nothing, the rerun gives"));
}

TEST_F(ForgedFolder, HasNoBoundsWhereTheErrorsOfTheDataHaveNone) {
  add_track("outliers", {{"plan", {{"noise", {{"base", {{"outliers", {{"share", 0.1}}}}}}}}}});
  const fs::path folder = run("two:program");
  EXPECT_EQ(refusal(folder), "verified");
  const auto invented = [](auto& records) {
    for (Record& record : records) record.bound["Et_m"] = record.errors["Et_m"];
  };
  EXPECT_THAT(refusal_after(folder, invented, "outliers"), HasSubstr("the rerun gives nothing"));
}

TEST_F(ForgedFolder, HasTheTrueValuesOfTheDataInEveryRecord) {
  const fs::path folder = run("joint_flow");
  options_.all = false;
  for (const char* name : {"step_gt_m", "rotation_gt_deg", "distance_gt_m", "v_gt_origin_kmh"}) {
    const auto change = [&](auto& records) {
      for (Record& record : records)
        if (record.values.contains(name)) record.values[name] *= 3;
    };
    EXPECT_THAT(refusal_after(folder, change), HasSubstr(fmt::format("values.{} is ", name)));
  }
}

TEST_F(ForgedFolder, OfAnExternalProgramHasNoCovariances) {
  const fs::path folder = run("joint_flow");
  edit_plan(folder / "depth", [](Json& plan) {
    plan["plan"]["estimators"][0]["name"] = "external:program.json";
    plan["plan"]["estimators"][0]["options"] = Json::object();
  });
  const auto keep = [](const std::string& kept) {
    return [kept](std::vector<Record>& records) {
      for (Record& record : records)
        for (const char* name : {"nees", "condition"})
          if (name != kept) record.values.erase(name);
    };
  };
  EXPECT_THAT(refusal_after(folder, keep("nees")),
              HasSubstr("frame 1, body ego: has values.nees, but an external program gives no covariances"));
  EXPECT_THAT(refusal_after(folder, keep("condition")), HasSubstr("body ego: has values.condition"));
  EXPECT_EQ(refusal_after(folder, keep("")), "verified");
}

TEST_F(ForgedFolder, HasEveryResultOfTheProgram) {
  const fs::path folder = run("two:program");
  options_.run_external = true;
  EXPECT_EQ(refusal(folder), "verified");
  edit(folder / "depth" / "records.jsonl", [](auto& records) {  // the better one of each motion
    std::vector<Record> kept;
    for (const Record& record : records) {
      if (record.estimator != "program.r0") continue;
      for (const Record& other : records) {
        const bool is_same = other.estimator == "program.r1" && other.frame == record.frame &&
                             other.body == record.body && other.level == record.level &&
                             other.seed == record.seed;
        if (!is_same) continue;
        const double error = find_number(record.errors, "Et_m").value_or(0);
        kept.push_back(error <= find_number(other.errors, "Et_m").value_or(0) ? record : other);
        kept.back().estimator = "program.r0";
      }
    }
    records = kept;
  });
  const size_t n = read_records(folder / "depth" / "records.jsonl").size() / 4;
  std::string cases;
  for (int number = 0; number < 4; ++number) cases += json_line({{"case", number}, {"records", n}}) + "\n";
  write_file(folder / "depth" / "cases.jsonl", cases);
  write_card_again(folder);
  EXPECT_THAT(refusal(folder), HasSubstr("gives other records when it is run again"));
}

TEST_F(ForgedFolder, StatesThatTheProgramWasGivenTheTruth) {
  const fs::path folder = run("two:program"), honest = run("joint_flow");
  EXPECT_TRUE(card_notes(stored_card(folder)).empty());
  edit_plan(folder / "depth", [](Json& plan) {
    plan["plan"]["estimators"][0]["options"] = {{"write_truth", true},
                                                {"results", {{"r0", {{"objects", {{"ids", "overlap"}}}}}}}};
  });
  write_card_again(folder);
  const Card card = stored_card(folder);
  const std::string page = to_markdown(page_document({{card, "a"}, {stored_card(honest), "b"}}, suite()));
  for (const std::string& text : {read_file(folder / "card.md"), page}) {
    EXPECT_THAT(text, HasSubstr("was given the truth"));
    EXPECT_THAT(text, HasSubstr("were matched by their true motions"));
  }
  EXPECT_THAT(verify_benchmark(folder, options_), Contains(HasSubstr("was given the truth")));
}

TEST_F(ForgedFolder, StatesThatErrorsAreSmallerThanTheNoiseAllows) {
  Card card = stored_card(run("joint_flow"));
  EXPECT_TRUE(card_notes(card).empty());
  for (CurvePoint& point : card.curves) {
    point.n_estimated = 75;
    if (point.body == "camera" && point.level == 0.8) point.efficiency->value = 1000;
  }
  ASSERT_EQ(card_notes(card).size(), 1U);
  EXPECT_THAT(card_notes(card)[0], HasSubstr("Efficiency 1e+03 (track depth, camera, level 0.8)"));
}

TEST_F(ForgedFolder, RoundingOfExactDataIsNoDifference) {
  add_track("exact", {{"plan", {{"noise", {{"noise", 0}}}}}});
  const fs::path folder = run("joint_flow");
  const auto scaled = [](double factor) {
    return [factor](std::vector<Record>& records) {
      for (Record& record : records)
        for (const char* name : {"Et_m", "ER_deg"})
          if (record.errors.contains(name)) record.errors[name] *= factor;
    };
  };
  EXPECT_LT(read_records(folder / "exact" / "records.jsonl")[0].errors.at("Et_m"), 1e-7);
  EXPECT_EQ(refusal_after(folder, scaled(1.5), "exact"), "verified");
  EXPECT_THAT(refusal_after(folder, scaled(1e6), "exact"), HasSubstr("errors."));
}

TEST_F(ForgedFolder, ThatHasLostRecordsHasNoCardAndNoComparison) {
  const fs::path folder = run("joint_flow"), whole = run("motion_only", "other");
  const fs::path file = folder / "depth" / "records.jsonl";
  std::string text = read_file(file);
  const auto n = std::ranges::count(text, '\n');
  text.resize(text.rfind('\n', text.size() - 2) + 1);
  write_file(file, text);
  const std::string expected =
      fmt::format("records.jsonl: holds {} complete records, but {} states {}: one of the files was cut off",
                  n - 1, (folder / "depth" / "cases.jsonl").string(), n);
  EXPECT_THAT(card_refusal(folder), HasSubstr(expected));
  EXPECT_THAT([&] { compare_benchmarks(suite(), folder, whole); },
              ::testing::ThrowsMessage<Error>(HasSubstr(expected)));
}

TEST_F(ForgedFolder, IsComparedWithinOneSuiteAndResultByResult) {
  const fs::path folder = run("joint_flow"), two = run("two:program");
  const std::vector<CardComparison> rows = compare_benchmarks(suite(), two, folder);
  ASSERT_EQ(rows.size(), 8U);
  EXPECT_EQ(rows[0].estimator, "program.r0");
  EXPECT_EQ(rows[0].change_percent, 0);
  EXPECT_EQ(rows[4].estimator, "program.r1");
  EXPECT_THAT(
      [&] { compare_benchmarks(suite(), folder, two); },
      ::testing::ThrowsMessage<Error>(HasSubstr("has the results program.r0, program.r1: expected a")));
  Json other = read_json(suite_file());
  other["title"] = "Another suite";
  write_file(suite_file(), json_text(other));
  EXPECT_THAT([&] { compare_benchmarks(suite(), folder, folder); },
              ::testing::ThrowsMessage<Error>(HasSubstr("belongs to another suite 'small-1'")));
  EXPECT_THAT([&] { page_files({folder}, suite_file(), folder_.path(), 1); },
              ::testing::ThrowsMessage<Error>(HasSubstr("belongs to another suite 'small-1'")));
}

TEST_F(ForgedFolder, TheSampleIsOfTheVerifierAndHasEverySweep) {
  add_track("other", Json::object());
  add_track("third", Json::object());
  const fs::path folder = run("joint_flow");
  const auto sample = [&](std::optional<uint64_t> seed, bool all) {
    options_.sample_seed = seed;
    options_.all = all;
    std::set<std::string> cases;
    for (const std::string& line : verify_benchmark(folder, options_)) {
      const bool is_rerun = line.ends_with("gives the same records");
      EXPECT_TRUE(!is_rerun || cases.insert(line).second) << line;
    }
    return cases;
  };
  const std::set<std::string> first = sample(1, false);
  EXPECT_EQ(first.size(), 5U);
  for (const char* sweep : {"depth: ", "other: ", "third: "}) EXPECT_THAT(first, Contains(HasSubstr(sweep)));
  EXPECT_EQ(sample(1, false), first);
  EXPECT_NE(sample(2, false), first);
  EXPECT_EQ(sample({}, true).size(), 12U);
  options_.all = false;
  EXPECT_THAT(verify_benchmark(folder, options_), Contains(HasSubstr("--sample-seed")));
}

TEST_F(ForgedFolder, HasTheCostsOfItsRecordsAndTheTextOfItsCard) {
  const fs::path folder = run("joint_flow");
  const std::string json = read_file(folder / "card.json"), text = read_file(folder / "card.md");
  Json card = parse_json(json, "card");
  card["costs"][0]["median_ms"] = 1e-3;
  write_file(folder / "card.json", json_text(card));
  EXPECT_THAT(refusal(folder), HasSubstr("the value of 'costs.0.median_ms' does not agree with the records"));
  card = parse_json(json, "card");
  card.erase("options");
  write_file(folder / "card.json", json_text(card));
  EXPECT_THAT(refusal(folder), HasSubstr("the value of 'options' does not agree with the records: if the"));
  write_file(folder / "card.json", json);
  write_file(folder / "card.md", text + "The best of all.\n");
  EXPECT_THAT(refusal(folder), HasSubstr("card.md: does not agree with card.json"));
  write_file(folder / "card.md", text);
  card = parse_json(json, "card");
  card["program"]["git_commit"] = "an-older-one";
  write_file(folder / "card.json", json_text(card));
  EXPECT_THAT(verify_benchmark(folder, options_), Contains(HasSubstr("(commit an-older-one), this is")));
}

TEST_F(ForgedFolder, TracksWhoseDataAreMissingAreNotChecked) {
  make_vdo_fixture(folder_.path() / "root" / "drive");
  add_track("real",
            {{"needs_data", true}, {"plan", {{"sources", {"vdo:drive"}}, {"noise", {{"noise", 0}}}}}});
  BenchmarkRequest of = request("joint_flow", "out");
  of.data_root = (folder_.path() / "root").string();
  fs::create_directories(of.out);
  const BenchmarkPlan plan = plan_benchmark(of, suite()).front();
  run_benchmark(of, suite(), plan);
  const fs::path folder = of.out / plan.folder;
  write_card_again(folder);
  EXPECT_THAT(verify_benchmark(folder, options_),
              Contains(HasSubstr("real: not checked, because its data are missing here: ")));
  options_.data_root = of.data_root;
  EXPECT_THAT(verify_benchmark(folder, options_),
              Contains("real: case 0 was run again and gives the same records"));
}

TEST_F(ForgedFolder, WritesNoLinesAndNoControlCharactersOfItsOwn) {
  add_track("other", Json::object());
  const fs::path folder = run("joint_flow");
  write_file(folder / left_out_name, json_text(Json{{"other", "no time\n\u001b[32mdepth: verified"}}));
  write_card_again(folder);
  EXPECT_THAT(verify_benchmark(folder, options_),
              Contains("track other: left out by the card: no time  [32mdepth: verified"));
}

TEST_F(ForgedFolder, BringsNoSuiteOfItsOwn) {
  Json own = read_json(suite_file());
  own["name"] = "small-1.json";
  EXPECT_THAT([&] { parse_suite(json_text(own), "own"); },
              ::testing::ThrowsMessage<Error>(HasSubstr("does not end like that of a file")));
  const fs::path folder = run("joint_flow");
  Json card = read_json(folder / "card.json");
  card["suite"] = suite_file();
  write_file(folder / "card.json", json_text(card));
  options_.suite.clear();
  EXPECT_THAT(refusal(folder), HasSubstr("unknown suite '" + suite_file()));
}

TEST_F(ForgedFolder, FunctionsOfPythonHavePlansButAreNotRun) {
  BenchmarkRequest of = request("python:mine", "out");
  EXPECT_THROW(plan_benchmark(of, suite()), Error);
  of.only_plans = true;
  const BenchmarkPlan plan = plan_benchmark(of, suite()).front();
  EXPECT_EQ(plan.folder, "mine");
  EXPECT_EQ(parse_json(plan.sweeps[0].text, "plan")["estimators"], Json({"python:mine"}));
  const fs::path folder = run("joint_flow");
  edit_plan(folder / "depth", [](Json& json) {
    json["plan"]["estimators"][0]["name"] = "python:mine";
    json["plan"]["estimators"][0]["options"] = Json::object();
  });
  write_card_again(folder);
  for (const bool run_external : {false, true}) {
    options_.run_external = run_external;
    EXPECT_THAT(verify_benchmark(folder, options_),
                Contains(HasSubstr("python:mine is a function of a Python process")));
  }
}

}  // namespace
}  // namespace sextant
