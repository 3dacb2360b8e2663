#include "sextant/eval/reproduce/reproduce.h"
#include "sextant/eval/records/record_stream.h"

#include <iterator>
#include <regex>
#include <sstream>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/records/testing.h"
#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/tables/published_rows.h"
#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

/// Two small experiments that can run, and one whose data are missing.
class ReproduceTest : public testing::Test {
 protected:
  ReproduceTest() {
    source_ = make_vdo_fixture(folder_.path() / "kitti_03_demo", {.n_frames = 4, .width = 160, .height = 48})
                  .source();
    config_.out = folder_.path() / "out";
    config_.cache = PackCache(folder_.path() / "cache");
    config_.parts = {sweep_part("demo", PartRole::real, "1"), sweep_part("noise", PartRole::noise, "3"),
                     sweep_part("absent", PartRole::sets, "1")};
    config_.parts.back().needs = "no_such_folder";
    config_.parts.back().fetch = "scripts/fetch_it";
    config_.data_root = folder_.path().string();
    config_.quiet = true;
  }

  Part sweep_part(const std::string& name, PartRole role, const std::string& seeds) const {
    Part part{name, role, "part " + name, "", "", ""};
    part.plan =
        "{\"sources\":[\"" + source_ + "\"],\"estimators\":[\"joint_flow\"],\"seeds\":" + seeds +
        (role == PartRole::noise ? R"(,"noise":{"parameter":"depth.delta_d_px","levels":[0.1,0.2]}})" : "}");
    return part;
  }

  fs::path part_file(const std::string& part, const std::string& name = "records.jsonl") const {
    return config_.out / "parts" / part / name;
  }
  OutputFiles report() const { return report_folder(reproduction_report(config_).document, {false, 1}); }

  TempFolder folder_;
  std::string source_;
  ReproduceConfig config_;
};

TEST_F(ReproduceTest, ReportsWhatWasMeasuredAndWhatIsMissing) {
  run_parts(config_);
  const OutputFiles files = report();
  EXPECT_THAT(files.at("tables/data.md"), HasSubstr("ROOT has no folder no_such_folder"));
  EXPECT_THAT(files.at("tables/data.md"), HasSubstr("scripts/fetch_it"));
  EXPECT_THAT(files.at("tables/table_4_ego_motion.csv"), HasSubstr("parts/demo/records.jsonl"));
  EXPECT_THAT(files.at("tables/table_3_sets.csv"), HasSubstr("not measured here"));
  EXPECT_THAT(files.at("tables/claims.csv"), HasSubstr("parts/noise/records.jsonl"));
}

TEST_F(ReproduceTest, OpensWithTheAnswerAndTheTablesOfThePaper) {
  run_parts(config_);
  const ReproductionReport report = reproduction_report(config_);
  size_t n_claims = 0;
  for (const VerdictLine& line : report.document.verdicts) n_claims += line.group == "Claims";
  EXPECT_EQ(n_claims, claims().size());
  const OutputFiles files = report_folder(report.document, {true, 1});
  const std::string& html = files.at("report.html");
  EXPECT_LT(html.find(report.document.abstract.substr(0, 12)), html.find("id=\"paper_table_1\""));
  EXPECT_LT(html.find("id=\"paper_table_1\""), html.find("id=\"paper_table_2\""));
  EXPECT_LT(html.find("id=\"paper_table_5\""), html.find("<h3>Claims</h3>"));
  EXPECT_EQ(html.find("id=\"claims\""), std::string::npos);
  EXPECT_THAT(html, HasSubstr("href=\"details.html#claims-1\""));
  EXPECT_EQ(html.find("id=\"table_1_classification\""), std::string::npos);
  EXPECT_THAT(html, HasSubstr("href=\"details.html#table_1_classification\""));
  EXPECT_THAT(html, HasSubstr("run: scripts/fetch vkitti1 --rgb --depth --flow --masks &amp;&amp; "
                              "sextant reproduce"));
  const std::string& details = files.at("details.html");
  EXPECT_LT(details.find("id=\"table_1_classification\""), details.find("id=\"table_2_flow_error\""));
  EXPECT_THAT(details, HasSubstr("<div id=\"claims-1\">"));
  EXPECT_THAT(details, HasSubstr("answer_table_4_ego_motion"));
  EXPECT_THAT(details, HasSubstr("<a href=\"../parts/demo/records.jsonl\">"));
  EXPECT_THAT(paper_page("t", "a", report.tables, report.figures, files), HasSubstr("<figcaption>Fig. 4"));
}

TEST_F(ReproduceTest, TheAnswerHasAtMost120Words) {
  run_parts(config_);
  const ReproductionReport report = reproduction_report(config_);
  std::vector<CheckedClaim> checked;
  for (const Claim& claim : claims()) checked.push_back({&claim, {}});
  const auto n_words = [&] {
    std::istringstream words(answer_paragraph(checked, report.tables));
    return std::distance(std::istream_iterator<std::string>(words), {});
  };
  EXPECT_THAT(answer_paragraph(checked, report.tables), HasSubstr("Not measured: tables I"));
  for (CheckedClaim& claim : checked) claim.results.emplace_back().verdict = Verdict::reproduced;
  EXPECT_THAT(answer_paragraph(checked, report.tables), HasSubstr("choice of points"));
  EXPECT_LE(n_words(), 120);
  for (size_t i = 0; i < checked.size(); ++i)
    if (!checked[i].claim->brief.empty()) checked[i].results.front().verdict = static_cast<Verdict>(i % 3);
  EXPECT_LE(n_words(), 120) << answer_paragraph(checked, report.tables);
}

/// Number of pages when Chromium prints a page to PDF; empty without Chromium.
std::optional<size_t> printed_pages(const std::string& html, const fs::path& folder) {
  if (std::system("command -v chromium > /dev/null 2>&1") != 0) return std::nullopt;
  write_file(folder / "paper.html", html);
  const std::string command = fmt::format(
      "chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
      "--disable-background-networking "
      "--user-data-dir='{0}/profile' --no-pdf-header-footer --print-to-pdf='{0}/paper.pdf' "
      "'file://{0}/paper.html' "
      "> '{0}/out.txt' 2>&1",
      folder.string());
  EXPECT_EQ(std::system(command.c_str()), 0) << read_file(folder / "out.txt");
  const std::string pdf = read_file(folder / "paper.pdf");
  static const std::regex page(R"(/Type\s*/Page\b)");
  return std::distance(std::sregex_iterator(pdf.begin(), pdf.end(), page), {});
}

TEST_F(ReproduceTest, PrintsOnAtMostFourPages) {
  run_parts(config_);
  const ReproductionReport report = reproduction_report(config_);
  const OutputFiles files = report_folder(report.document, {true, 1});
  const std::string html = paper_page("t", report.document.abstract, report.tables, report.figures, files);
  const std::optional<size_t> n = printed_pages(html, folder_.path());
  if (!n) GTEST_SKIP() << "no chromium: install it to run this test";
  EXPECT_GE(*n, 1U);
  EXPECT_LE(*n, 4U);
}

TEST(AnswerFigure, DrawsEveryPublishedValueOnce) {
  PublishedTable table{.number = "III"};
  const auto row = [&](const std::string& estimator, const std::string& data, double published,
                       double measured) {
    Measured m;
    m.value = measured;
    m.interval = Interval{0.9 * measured, 1.1 * measured};
    m.one_run = Interval{0.5 * measured, 1.5 * measured};
    table.rows.push_back(
        {.estimator = estimator, .quantity = "E_t [m]", .published = published, .measured = m, .data = data});
  };
  row("joint_flow", "scenario", 0.01, 0.05);
  row("joint_flow", "replay", 0.01, 0.012);  // nearer to the paper's: instead of the scenario
  row("joint_flow, release", "replay", 0.01, 0.04);
  row("joint_flow, text", "replay", 0.01, 9);  // another procedure
  row("motion_only", "replay", 0, 0.04);       // no place on the axis
  const std::optional<Figure> figure = answer_figure("x", table);
  ASSERT_TRUE(figure);
  const std::string csv = to_csv(figure->data);
  EXPECT_EQ(figure->data.rows.size(), 2U) << csv;
  EXPECT_THAT(csv, HasSubstr(",1.2,"));
  EXPECT_THAT(csv, HasSubstr("within"));
  EXPECT_THAT(csv, HasSubstr("outside"));
  EXPECT_FALSE(draw(*figure).empty());
  std::vector<std::string> verdicts;
  for (const PaperRow& each : table.rows) verdicts.push_back(each.verdict());
  EXPECT_THAT(answer_text(verdicts), HasSubstr("within our single runs in 1 of 5 comparisons"));
  EXPECT_FALSE(answer_figure("y", PublishedTable{.number = "III"}));
}

TEST_F(ReproduceTest, SaysByWhatAndFromWhatTheRecordsWereMade) {
  run_parts(config_);
  std::map<std::string, std::string> provenance;
  for (const auto& [key, value] : reproduction_report(config_).document.provenance) provenance[key] = value;
  EXPECT_THAT(provenance.at("libraries"), HasSubstr("OpenCV"));
  EXPECT_THAT(provenance.at("machine"), HasSubstr("cores"));
  EXPECT_THAT(provenance.at("part noise"), HasSubstr("3 seeds; "));
  EXPECT_THAT(provenance.at("part noise"), HasSubstr(" files, SHA-256 "));
  EXPECT_FALSE(provenance.contains("part absent"));
}

TEST_F(ReproduceTest, ItsTablesCompileUnderPdflatex) {
  run_parts(config_);
  std::string body;
  for (const auto& [name, text] : report()) {
    if (name.ends_with(".tex")) body += text + "\\clearpage\n";
  }
  const std::optional<Compiled> page = compile_latex(body);
  if (!page) GTEST_SKIP() << no_pdflatex;
  EXPECT_TRUE(page->ok) << page->words;
  EXPECT_THAT(page->words, Not(HasSubstr("undefined")));
  EXPECT_THAT(page->words, Not(HasSubstr("Float too large")));
}

TEST_F(ReproduceTest, FinishedPartsStayAsTheyAreAndGiveTheSameReport) {
  run_parts(config_);
  const std::string demo = read_file(part_file("demo"));  // holds times, which a second run would not repeat
  const OutputFiles first = report();
  fs::remove(part_file("noise"));  // as after an interruption
  run_parts(config_);
  EXPECT_EQ(read_file(part_file("demo")), demo);
  EXPECT_TRUE(fs::exists(part_file("noise")));
  EXPECT_EQ(report(), first);
}

TEST_F(ReproduceTest, AnUnfinishedPartIsNotReported) {
  run_parts(config_);
  write_file(part_file("demo", "journal.jsonl"), "");
  EXPECT_THAT(report().at("tables/data.md"), HasSubstr("not finished"));
  run_parts(config_);  // resumes
  EXPECT_FALSE(fs::exists(part_file("demo", "journal.jsonl")));
  EXPECT_THAT(report().at("tables/data.md"), Not(HasSubstr("not finished")));
}

TEST_F(ReproduceTest, AnotherPlanProgramOrInputRunsAgain) {
  run_parts(config_);
  const std::string demo = read_file(part_file("demo"));
  config_.parts[1] = sweep_part("noise", PartRole::noise, "1");
  const auto n_before = std::ranges::count(read_file(part_file("noise")), '\n');
  run_parts(config_);
  EXPECT_LT(std::ranges::count(read_file(part_file("noise")), '\n'), n_before);
  EXPECT_EQ(read_file(part_file("demo")), demo);

  write_file(part_file("demo", "part.json"), R"({"program":"another"})");
  run_parts(config_);
  EXPECT_NE(read_file(part_file("demo")), demo);

  const std::string noise = read_file(part_file("noise"));
  const fs::path depth = folder_.path() / "kitti_03_demo" / "depth" / "000002.png";
  write_file(depth, read_file(folder_.path() / "kitti_03_demo" / "depth" / "000001.png"));
  run_parts(config_);
  EXPECT_NE(read_file(part_file("noise")), noise);
}

TEST_F(ReproduceTest, AFolderWithoutRecordsIsRefused) {
  EXPECT_THROW(reproduction_report(config_).document, Error);
  config_.parts.erase(config_.parts.begin(), config_.parts.begin() + 2);
  run_parts(config_);
  EXPECT_THROW(reproduction_report(config_).document, Error);
}

TEST(ReproductionParts, HavePlansThatAreRead) {
  std::set<std::string> names;
  for (const Part& part : reproduction_parts("")) {
    EXPECT_TRUE(names.insert(part.name).second) << part.name;
    EXPECT_FALSE(part.title.empty());
    EXPECT_EQ(part.needs.empty(), part.fetch.empty()) << part.name;
    if (part.plan.empty() || !part.needs.empty()) continue;
    EXPECT_GT(parse_plan(part.plan, part.name, "").n_cases(), 0U);
    EXPECT_EQ(what_is_missing(part, ""), "");
  }
}

TEST(ReproductionParts, RunOnTheRealTextAndSample) {
  const char* root = std::getenv("SEXTANT_DATA");
  if (root == nullptr) GTEST_SKIP() << "SEXTANT_DATA is not set";
  for (const Part& part : reproduction_parts(root)) {
    if (!fs::is_directory(fs::path(root) / part.needs) || part.name.starts_with("kitti_")) continue;
    EXPECT_EQ(what_is_missing(part, root), "") << part.name;
  }
}

/// The stored experiments, and the data that they were measured on.
class StoredParts : public testing::TestWithParam<const char*> {
 protected:
  /// One camera and one object in frames 1..3, with truth.
  std::vector<Record> measured(const std::string& dataset, const std::string& sequence) const {
    std::vector<Record> records;
    for (int frame = 1; frame <= 3; ++frame) {
      for (const char* body : {"ego", "object:1"}) {
        Record r = RecordOf{.dataset = dataset,
                            .sequence = sequence,
                            .estimator = "joint_flow",
                            .body = body,
                            .frame = frame};
        r.values = {{r.is_ego() ? "step_gt_m" : "distance_gt_m", 0.5 * frame}, {"step_m", 7}};
        records.push_back(r);
      }
    }
    return records;
  }
  std::vector<Record> stored(std::vector<Record> beside) const {
    write_file(folder_.path() / "records.jsonl", write_records(beside));
    return parse_records(stored_files(GetParam(), folder_.path()).at("records.jsonl"), "stored");
  }
  bool is_real() const { return GetParam() == std::string("systems_demo"); }
  std::vector<Record> measured() const {
    return is_real() ? measured("vdo", "kitti_03_demo") : measured("synthetic", "s18");
  }
  TempFolder folder_;
};

TEST_P(StoredParts, TakeTheTruthFromTheFramesThatWereMeasuredHere) {
  const std::vector<Record> records = stored(measured());
  ASSERT_FALSE(records.empty());
  for (const Record& r : records) {
    EXPECT_LE(r.frame, 3);
    EXPECT_NE(r.estimator, "");
    EXPECT_EQ(r.values.at(r.is_ego() ? "step_gt_m" : "distance_gt_m"), 0.5 * r.frame);
    EXPECT_NE(find_number(r.values, "step_m"), 7);
  }
}

TEST_P(StoredParts, HoldNoTruthOfTheirOwn) {
  std::vector<Record> beside = measured();
  for (Record& r : beside) r.values.clear();
  const std::vector<Record> records = stored(beside);
  ASSERT_FALSE(records.empty());
  for (const Record& r : records) {
    for (const auto& [key, value] : r.values) EXPECT_EQ(key.str().find("_gt"), std::string::npos) << key;
    EXPECT_TRUE(r.bound.empty());
  }
}

TEST_P(StoredParts, DescribeEverySystemTheyHold) {
  for (const Record& r : stored(measured())) {
    const Json descriptions = system_descriptions();
    const bool ours = r.estimator == "joint_flow" || r.estimator == "joint_flow_depth";
    EXPECT_TRUE(ours ||
                std::ranges::any_of(descriptions,
                                    [&](const Json& d) { return d.at("estimator") == r.estimator.str(); }))
        << r.estimator;
  }
}

TEST_P(StoredParts, NeedThePartThatHasTheTruth) {
  EXPECT_THROW(stored_files(GetParam(), folder_.path() / "none"), Error);
}

INSTANTIATE_TEST_SUITE_P(All, StoredParts,
                         testing::Values("systems_sets", "systems_depth", "systems_demo", "systems_run"));

TEST_F(ReproduceTest, ShowsPublishedSystemsBesideOurs) {
  Part part{"systems_demo", PartRole::real, "published systems", "", "", "", "demo"};
  config_.parts.insert(config_.parts.begin() + 1, part);
  run_parts(config_);
  const OutputFiles files = report();
  EXPECT_THAT(files.at("tables/table_4_ego_motion.csv"), HasSubstr("VDO_SLAM 9d33024.front"));
  EXPECT_THAT(files.at("tables/table_4_ego_motion.csv"), HasSubstr("parts/systems_demo/records.jsonl"));
}

TEST_F(ReproduceTest, FollowsTheTruthOfThePartBesideAStoredOne) {
  Part part{"systems_demo", PartRole::real, "published systems", "", "", "", "demo"};
  config_.parts.insert(config_.parts.begin() + 1, part);
  run_parts(config_);
  const std::string before = read_file(part_file("systems_demo"));
  std::vector<Record> records = read_records(part_file("demo"));
  for (Record& r : records) {
    if (r.is_ego()) r.values["step_gt_m"] = 123;
  }
  write_file(part_file("demo"), write_records(records));
  run_parts(config_);
  EXPECT_NE(before, read_file(part_file("systems_demo")));
  EXPECT_THAT(read_file(part_file("systems_demo")), HasSubstr("123"));
}

TEST_F(ReproduceTest, ShowsPublishedSystemsInTheNoiseFigure) {
  source_ = "synthetic:s18@0-2";
  config_.parts = {sweep_part("depth", PartRole::noise, "2"),
                   {"systems_depth", PartRole::systems_noise, "", "", "", "", "depth"}};
  run_parts(config_);
  const OutputFiles files = report();
  EXPECT_THAT(files.at("tables/fig_4_depth.csv"), HasSubstr("VDO_SLAM 9d33024.front"));
  EXPECT_THAT(files.at("tables/fig_4_depth.csv"), HasSubstr("joint_flow"));
  // The stored systems are no evidence for the paper's claims.
  EXPECT_THAT(files.at("tables/claims.csv"), Not(HasSubstr("VDO_SLAM")));
}

}  // namespace
}  // namespace sextant
