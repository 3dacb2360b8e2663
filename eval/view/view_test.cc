#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/base/json.h"
#include "sextant/base/testing.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/view/page.h"

namespace sextant {
namespace {

using testing::HasSubstr;
using testing::Not;

/// A run of a scene with noise, in a folder.
RunConfig config_of(const std::string& source, const std::string& estimator, int n_seeds = 1) {
  RunConfig config;
  config.sources = {SourceSpec::parse(source)};
  config.estimator = estimator;
  config.noise = Noise::parse(R"({"flow": {"epe_px": 0.5}, "depth": {"delta_d_px": 0.2}})");
  config.level = 0.5;
  config.n_seeds = n_seeds;
  config.quiet = true;
  return config;
}

std::string run_into(const TempFolder& folder, const std::string& name, const RunConfig& config) {
  write_output_folder(folder / name, run_files(run(config)));
  return folder / name;
}

ViewedRun viewed(const std::string& folder, const CaseChoice& choice = {}) {
  return view_run(folder, choice, "", 1, true);
}

/// Content of the page.
Json data_of(const std::string& html) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const size_t from = html.find(begin) + begin.size();
  return parse_json(html.substr(from, html.find("</script>", from) - from), "page");
}

TEST(LengthQuantile, IsExactForEqualAxesAndForOne) {
  EXPECT_NEAR(length_quantile(Eigen::Matrix3d::Identity() * 4, 0.95), 2 * 2.7955, 1e-3);  // chi, 3 dof
  Eigen::Matrix3d one = Eigen::Matrix3d::Zero();
  one(1, 1) = 9;
  EXPECT_NEAR(length_quantile(one, 0.95), 3 * 1.95996, 1e-4);
  EXPECT_EQ(length_quantile(Eigen::Matrix3d::Zero(), 0.95), 0);
}

TEST(ErrorBand, HoldsNineteenOfTwentyErrorsWhereTheCovarianceIsRight) {
  TempFolder folder;
  const std::string run_folder = run_into(folder, "run", config_of("synthetic:s18", "joint_flow_depth", 8));
  int n = 0, n_inside = 0, n_speeds = 0, n_speeds_inside = 0;
  for (uint64_t seed = 0; seed < 8; ++seed) {
    const ViewedRun view = viewed(run_folder, {.seed = seed});
    for (const Record& record : view.records) {
      const ErrorBand& band = view.pairs.at(record.frame).at(record.body.str()).band;
      if (record.errors.contains("Et_m")) {
        n += 2;
        n_inside += record.errors.at("Et_m") <= band.Et_m;
        n_inside += record.errors.at("ER_deg") <= band.ER_deg;
      }
      if (record.errors.contains("Ev_kmh")) {
        ++n_speeds;
        n_speeds_inside += record.errors.at("Ev_kmh") <= band.Ev_kmh;
      }
    }
  }
  ASSERT_GT(n, 200);
  ASSERT_GT(n_speeds, 60);
  EXPECT_NEAR(1.0 * n_inside / n, 0.95, 0.04) << n;
  EXPECT_NEAR(1.0 * n_speeds_inside / n_speeds, 0.95, 0.06) << n_speeds;
}

TEST(View, HasTheRecordsOfTheFolderAndPointsOfEveryEstimatedBody) {
  TempFolder folder;
  const std::string run_folder = run_into(folder, "run", config_of("synthetic:s18", "joint_flow"));
  const std::vector<ViewedRun> runs = {viewed(run_folder)};
  EXPECT_THAT(runs.front().notes, testing::IsEmpty());
  const OutputFiles files = view_page(runs, {.quiet = true});
  ASSERT_EQ(files.size(), 1);
  const Json data = data_of(files.at("index.html"));
  const std::vector<Record> records = read_records(folder / "run/records.jsonl");
  size_t n = 0;
  for (const Json& frame : data["runs"][0]["records"]) n += frame.size();
  EXPECT_EQ(n, records.size());
  for (const Record& record : records) {
    const Json& entry = data["runs"][0]["records"][std::to_string(record.frame)][record.body.str()];
    EXPECT_EQ(entry["errors"], to_json(record)["errors"]);
    EXPECT_EQ(entry["values"], to_json(record)["values"]);
    if (record.status != Status::ok) continue;
    const Json& pair = data["runs"][0]["pairs"][std::to_string(record.frame)][record.body.str()];
    EXPECT_EQ(pair["n"], record.n_points);
    EXPECT_FALSE(pair["points"].get<std::string>().empty());
  }
  EXPECT_EQ(data["images"].size(),
            static_cast<size_t>(data["last"].get<int>() - data["first"].get<int>() + 1));
}

TEST(View, TextsOfStrangersStayText) {
  TempFolder folder;
  const std::string name = "</script><script>alert(1)</script> @SCRIPT@ @STYLE@ 'q' \"q\"";
  std::vector<ViewedRun> runs = {
      viewed(run_into(folder, "run", config_of("synthetic:s18@0-2", "motion_only")))};
  runs.front().folder = name;
  runs.front().notes = {name};
  const std::string html = view_page(runs, {.quiet = true}).at("index.html");
  EXPECT_THAT(html, Not(HasSubstr("alert(1)</script>")));
  EXPECT_EQ(data_of(html)["runs"][0]["name"], name);
}

TEST(View, PutsImagesBesideAPageThatWouldBeTooLarge) {
  TempFolder folder;
  const std::vector<ViewedRun> runs = {
      viewed(run_into(folder, "run", config_of("synthetic:s18@0-2", "motion_only")))};
  const OutputFiles files = view_page(runs, {.quiet = true, .one_file_bytes = 1000});
  EXPECT_THAT(files, testing::SizeIs(4));
  EXPECT_TRUE(files.at("frames/000001.jpg").starts_with("\xff\xd8"));
  EXPECT_EQ(write_view(folder / "page", files), (folder.path() / "page" / "index.html").string());
  EXPECT_THAT(error_of([&] { write_view(folder / "page.html", files); }),
              HasSubstr("give a folder to --out"));
  EXPECT_FALSE(std::filesystem::exists(folder / "page.html"));
}

TEST(View, NamesWhatIsNotThere) {
  TempFolder folder;
  const std::string run_folder = run_into(folder, "run", config_of("synthetic:s18@0-2", "motion_only"));
  EXPECT_THAT(error_of([&] { viewed(run_folder, {.estimator = "joint_flow"}); }),
              HasSubstr("has no estimator 'joint_flow': it has motion_only"));
  EXPECT_THAT(error_of([&] { viewed(run_folder, {.seed = 7}); }), HasSubstr("has no seed '7': it has 0"));
  EXPECT_THAT(error_of([&] { viewed(run_folder, {.source = "synthetic:city"}); }),
              HasSubstr("has no source 'synthetic:city': it has synthetic:s18@0-2"));
  const Json run_json = read_json(folder / "run/run.json");
  Json moved = run_json;
  moved["configuration"]["sources"] = {"vdo:/nowhere/at/all"};
  folder.write("run/run.json", json_text(moved));
  EXPECT_THAT(error_of([&] { viewed(run_folder); }),
              HasSubstr("its source 'vdo:/nowhere/at/all' cannot be opened"));
  Json other = run_json;
  other.erase("configuration");
  folder.write("run/run.json", json_text(other));
  EXPECT_THAT(error_of([&] { viewed(run_folder); }), HasSubstr("has no 'configuration'"));
}

TEST(View, OneLevelOfTwoNoisesNeedsItsNoise) {
  TempFolder folder;
  const std::string run_folder = run_into(folder, "run", config_of("synthetic:s18@0-2", "motion_only"));
  Json run = read_json(folder / "run/run.json");
  const Json of_run = run["configuration"];
  const Noise other = Noise::parse(R"({"flow": {"epe_px": 1}})");
  run["configuration"] = {
      {"sources", {{{"source", "synthetic:s18@0-2"}}}},
      {"estimators",
       {{{"name", "motion_only"}, {"label", "motion_only"}, {"options", of_run["options"]["estimator"]}}}},
      {"noise", {{{"level", 0.5}, {"noise", other.options()}}, {{"level", 0.5}, {"noise", of_run["noise"]}}}},
      {"seeds", {0}}};
  folder.write("run/run.json", json_text(run));
  expect_error([&] { viewed(run_folder, {.level = 0.5}); },
               "level 0.5 stands for several cases, with the noise flow 1 px, depth 0.2 px + flow 0.5 px");
  expect_error([&] { viewed(run_folder, {.level = 0.5, .noise = "none"}); }, "has no noise 'none'");
  EXPECT_EQ(viewed(run_folder, {.level = 0.5, .noise = "depth 0.2 px + flow 0.5 px"}).records.size(),
            viewed(run_folder, {.noise = "depth 0.2 px + flow 0.5 px"}).records.size());
}

TEST(View, SaysWhenTheProgramMakesOtherRecordsNow) {
  TempFolder folder;
  const std::string run_folder = run_into(folder, "run", config_of("synthetic:s18@0-2", "motion_only"));
  std::vector<Record> records = read_records(folder / "run/records.jsonl");
  records.front().errors["Et_m"] += 1e-9;
  folder.write("run/records.jsonl", write_records(records));
  EXPECT_THAT(viewed(run_folder).notes,
              testing::ElementsAre(HasSubstr("differ from those of the current program")));
}

/// An external program whose CONFIG is gone. It gives the results of motion_only.
class GoneProgram final : public CaseEstimator {
 public:
  std::vector<NamedEstimator> begin(const CaseContext& context) const override {
    EXPECT_TRUE(context.rescore);
    case_folder = context.folder.string();
    return make_case_estimator("motion_only")->begin(context);
  }
  Json options() const override { return Json::object(); }
  std::string label() const override { return "gone"; }

  static inline std::string case_folder;
};

TEST(View, OpensNoEstimatorThatExistsElsewhereOnly) {
  add_estimator_kind("external", "external:CONFIG.json", [](const std::string& config, const Json& options) {
    if (!options.contains("recorded")) fail("{}: cannot be read", config);
    return std::make_shared<const GoneProgram>();
  });
  TempFolder folder;
  const std::string run_folder = run_into(folder, "run", config_of("synthetic:s18@0-2", "motion_only"));
  Json run = read_json(folder / "run/run.json");
  const Json of_run = run["configuration"];
  const auto entry = [](const char* name, const char* label, const Json& options) {
    return Json{{"name", name}, {"label", label}, {"options", options}};
  };
  run["configuration"] = {{"sources", {{{"source", "synthetic:s18@0-2"}}}},
                          {"estimators",
                           {entry("python:rigid_fit", "rigid_fit", Json::object()),
                            entry("external:gone.json", "gone", {{"command", "gone"}}),
                            entry("motion_only", "motion_only", of_run["options"]["estimator"])}},
                          {"noise", {{{"level", 0.5}, {"noise", of_run["noise"]}}}},
                          {"seeds", {0}}};
  folder.write("run/run.json", json_text(run));
  const std::vector<Record> own = read_records(folder / "run/records.jsonl");
  std::vector<Record> records = own;
  for (const char* label : {"rigid_fit", "gone"})
    for (Record record : own) {
      record.estimator = label;
      records.push_back(record);
    }
  folder.write("run/records.jsonl", write_records(records));

  for (const char* label : {"motion_only", "gone"}) {
    const ViewedRun view = viewed(run_folder, {.estimator = label});
    EXPECT_EQ(view.estimator, label);
    EXPECT_EQ(view.n_cases, 3U);
    EXPECT_THAT(view.notes, testing::IsEmpty());
    EXPECT_FALSE(view.pairs.empty());
  }
  EXPECT_EQ(GoneProgram::case_folder, run_folder + "/external/case_000001");
  const ViewedRun python = viewed(run_folder, {.estimator = "rigid_fit"});
  EXPECT_EQ(python.records.size(), own.size());
  EXPECT_THAT(python.notes, testing::ElementsAre(HasSubstr("python:rigid_fit cannot be computed again")));
  EXPECT_FALSE(view_page(std::span(&python, 1), {.quiet = true}).at("index.html").empty());
  expect_error([&] { viewed(run_folder, {.estimator = "joint_flow"}); },
               "has no estimator 'joint_flow': it has rigid_fit, gone, motion_only");

  run["configuration"] = of_run;  // that of a run instead of a sweep
  run["configuration"]["estimator"] = "python:rigid_fit";
  folder.write("run/run.json", json_text(run));
  EXPECT_EQ(viewed(run_folder).estimator, "rigid_fit");
}

TEST(View, TwoRunsMustBeOfTheSameFrames) {
  TempFolder folder;
  std::vector<ViewedRun> runs = {
      viewed(run_into(folder, "a", config_of("synthetic:s18@0-2", "motion_only"))),
      viewed(run_into(folder, "b", config_of("synthetic:s18@0-3", "motion_only")))};
  EXPECT_THAT(error_of([&] { view_page(runs, {.quiet = true}); }),
              HasSubstr("must have the same frames and image size"));
}

TEST(View, OfRecordsAloneNeedsOnlyTheImages) {
  TempFolder folder;
  const std::string run_folder = run_into(folder, "run", config_of("synthetic:s18@0-2", "motion_only"));
  std::filesystem::remove(folder / "run/run.json");
  const ViewedRun view = view_folder(run_folder, {}, "synthetic:s18@0-2", "", 1, true);
  EXPECT_EQ(view.records.size(), read_records(folder / "run/records.jsonl").size());
  EXPECT_THAT(view_page(std::span(&view, 1), {.quiet = true}).at("index.html"),
              HasSubstr("data:image/jpeg;base64,"));
}

TEST(View, LogsHaveThePathsAndTheAxesOfTheirTracks) {
  TempFolder folder;
  const std::string logs = run_into(folder, "logs", config_of("synthetic:s18@0-2", "motion_only"));
  const ViewedRun of_run = viewed(logs);
  std::filesystem::remove(folder / "logs/run.json");
  const std::string file = tracks_file(of_run.estimator, of_run.seed);
  std::filesystem::create_directories(folder / "logs/tracks");
  folder.write("logs/" + file, write_tracks(of_run.tracks, true));

  const ViewedRun with_truth = view_folder(logs, {}, "synthetic:s18@0-2", "", 1, true);
  EXPECT_EQ(with_truth.tracks.size(), of_run.tracks.size());
  const Json data = data_of(view_page(std::span(&with_truth, 1), {.quiet = true}).at("index.html"));
  EXPECT_FALSE(data["boxes"]["1"].empty());
  EXPECT_FALSE(data["runs"][0]["axes"]["1"].empty());
  EXPECT_EQ(data["runs"][0]["axes"],
            data_of(view_page(std::span(&of_run, 1), {.quiet = true}).at("index.html"))["runs"][0]["axes"]);

  const ViewedRun alone = view_folder(logs, {}, "", "", 1, true);
  const Json bare = data_of(view_page(std::span(&alone, 1), {.quiet = true}).at("index.html"));
  EXPECT_EQ(bare["first"], 0);
  EXPECT_EQ(bare["last"], 2);
  EXPECT_EQ(bare["width"], 0);
  EXPECT_TRUE(bare["images"].empty());
  EXPECT_EQ(bare["runs"][0]["tracks"], data["runs"][0]["tracks"]);
}

TEST(View, LogsBesideARunAreOfItsSource) {
  TempFolder folder;
  const std::string run_folder = run_into(folder, "run", config_of("synthetic:s18@0-2", "motion_only"));
  const std::string logs = run_into(folder, "logs", config_of("synthetic:s18@0-2", "motion_only"));
  std::filesystem::remove(folder / "logs/run.json");
  const View view = make_view({.folders = {logs, run_folder},
                               .choice = {},
                               .images = "",
                               .data_root = "",
                               .out = folder / "both.html",
                               .page = {.quiet = true}});
  ASSERT_EQ(view.runs.size(), 2U);
  EXPECT_EQ(view.runs[0].folder, logs);
  EXPECT_EQ(view.runs[0].source, view.runs[1].source);
  EXPECT_TRUE(view.runs[0].pairs.empty());
  EXPECT_FALSE(view.runs[1].pairs.empty());
}

}  // namespace
}  // namespace sextant
