// Hostile names (data sets, sequences, labels of estimators, noise, folders) pass through every writer (HTML,
// Markdown, LaTeX, gnuplot, JUnit, JSON, the terminal) and remain plain text.

#include <cstdlib>

#include "sextant/base/text.h"
#include "sextant/eval/cli/testing.h"
#include "sextant/eval/gate/comparison.h"
#include "sextant/eval/gate/testing.h"
#include "sextant/eval/report/figures/record_figures.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/eval/report/run_summary.h"
#include "sextant/eval/report/testing.h"
#include "sextant/eval/workflow/workflow.h"

namespace sextant {
namespace {

const std::string hostile =
    "x<script>alert(1)</script>&amp;'q'\"d\"|$\\input{/etc/passwd}`touch planted`\n]]>%s^_{y}";

size_t count(const std::string& text, const std::string& part) {
  size_t n = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

std::vector<Record> hostile_records(double factor = 1) {
  std::vector<Record> records = sweep_records(3);
  for (Record& r : records) {
    r.sequence = r.sequence.str() + hostile;
    r.dataset = hostile;
    r.estimator = hostile;
    r.noise = hostile;
    r.errors["Et_m"] *= factor;
  }
  return records;
}

/// The page contains no element with that name except its own script, which is the last one; no attribute
/// ends early.
void expect_page(const std::string& html, const std::string& name) {
  EXPECT_EQ(count(html, "<script"), 1U) << name;
  EXPECT_EQ(count(html, "</script>"), 1U) << name;
  EXPECT_EQ(count(html, "alert(1)</"), 0U) << name;
  EXPECT_NE(html.find("x&lt;script&gt;alert(1)"), std::string::npos) << name;
}

/// Rows of tables have as many cells as their heads, and nothing is HTML.
void expect_markdown(const std::string& text, const std::string& name) {
  EXPECT_EQ(text.find("<script"), std::string::npos) << name;
  EXPECT_EQ(text.find("</script"), std::string::npos) << name;
  size_t expected = 0;
  for (const std::string& line : split(text, '\n')) {
    if (!line.starts_with("|")) {
      expected = 0;
      continue;
    }
    const size_t n_bars = count(line, "|") - count(line, "\\|");
    if (expected == 0) expected = n_bars;
    EXPECT_EQ(n_bars, expected) << name << ": " << line;
  }
}

/// Every file of a folder, by its kind.
void expect_files(const OutputFiles& files) {
  for (const auto& [name, bytes] : files) {
    if (name.ends_with(".html")) expect_page(bytes, name);
    if (name.ends_with(".md")) expect_markdown(bytes, name);
    if (name.ends_with(".tex")) {
      EXPECT_EQ(bytes.find("\\input"), std::string::npos) << name;
    }
    if (name.ends_with(".json")) {
      EXPECT_TRUE(Json::accept(bytes)) << name;
    }
    EXPECT_EQ(name.find_first_of("<>'\"|$\\`\n"), std::string::npos) << name;
  }
}

class HostileNames : public ::testing::Test {
 protected:
  HostileNames() {
    previous_ = fs::current_path();
    fs::current_path(temp_.path());  // where a command in a name would plant its file
  }
  ~HostileNames() override {
    EXPECT_FALSE(fs::exists("planted"));
    fs::current_path(previous_);
  }
  TempFolder temp_;
  fs::path previous_;
};

TEST_F(HostileNames, InASummary) {
  const std::vector<Record> records = hostile_records();
  const Table summary = summary_table(records, find_preset("paper"));
  expect_markdown(to_markdown(summary), "summary.md");
  for (const std::string& line : split(summary_text(records, find_preset("paper"), false), '\n'))
    EXPECT_EQ(line, one_line(line)) << line;
  OutputFiles drawn = draw(timeline_figures(records, find_preset("paper")), 1);
  EXPECT_FALSE(drawn.empty());
  expect_files(drawn);
}

TEST_F(HostileNames, InTheReportOfASweep) {
  const fs::path folder = temp_.path() / "a'b<script>|$";
  write_run(folder, hostile_records());
  const OutputFiles files = report_folder(noise_document({folder}, 1, true, temp_.path() / "out"), {});
  ASSERT_TRUE(files.contains("report.html"));
  expect_files(files);
  std::string body;
  for (const auto& [name, text] : files) {
    if (name.ends_with(".tex")) body += text + "\\clearpage\n";
  }
  if (const std::optional<Compiled> page = compile_latex(body)) {
    EXPECT_TRUE(page->ok) << page->words;
  }
}

TEST_F(HostileNames, InAComparison) {
  // A name of a folder cannot have '/'.
  const fs::path base = temp_.path() / "b<script>alert(1)'\"|$\\input{x}",
                 fresh = temp_.path() / "n`touch planted`\n<b>";
  write_run(base, hostile_records());
  write_run(fresh, hostile_records(1.2));
  const Comparison comparison = compare_paths(base, fresh, Policy(), 1);
  ASSERT_EQ(comparison.verdict, GateVerdict::regressed);
  OutputFiles files = comparison_files(comparison, Policy(), "2026-01-31T12:00:00");
  files["report.html"] = report_page(comparison_document(comparison, temp_.path() / "out"), 1);
  expect_files(files);
  EXPECT_NE(files.at("report.html").find("Frames with the largest changes"), std::string::npos);
  write_file("junit.xml", files.at("junit.xml"));
  if (std::system("command -v xmllint > /dev/null") == 0) {
    EXPECT_EQ(std::system("test \"$(xmllint --xpath 'count(//script)' junit.xml)\" = 0"), 0);
    EXPECT_EQ(std::system("test \"$(xmllint --xpath 'count(//testcase) > 0' junit.xml)\" = true"), 0);
  }
}

}  // namespace
}  // namespace sextant
