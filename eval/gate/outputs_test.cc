#include "sextant/eval/gate/comparison.h"

#include <sys/wait.h>

#include <cstdlib>
#include <set>

#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/gate/testing.h"

namespace sextant {
namespace {

constexpr const char* noon = "2026-01-31T12:00:00";

Subject subject(const std::string& body) { return {"synthetic", "s18", body, "joint_flow", "depth", 0.1}; }

/// A row for every verdict, and names that must be escaped.
Comparison every_verdict() {
  Comparison c;
  c.base = "results/<base> & \"more\"";
  c.fresh = "new";
  c.findings = {{"data", "a.png\x01", "'aa'", "<bb>", true}, {"build", "git_commit", "1", "2", false}};
  c.accuracy = {{{"Et_m", 60, 0, 0, false, GateVerdict::ok},
                 {0, Interval{0, 0}, 0, 0, {}, {}, {}},
                 subject("ego"),
                 0.01},
                {{"Et_m", 60, 55, 5, false, GateVerdict::regressed},
                 {0.001, Interval{0.0005, 0.002}, 10, 10, 0.001, 0.002, 0.0004},
                 subject("object:1"),
                 0.01},
                {{"ER_deg", 60, 30, 25, false, GateVerdict::inconclusive},
                 {0.001, {}, 10, 10, 0.2, {}, {}},
                 subject("object:2"),
                 0.01}};
  c.statuses = {{subject("ego"), 60, 0, 2, 0, 0, 0, 0, "seed 0 frame 1: lost -> ok", GateVerdict::improved}};
  c.speed = {
      {"ransac/3000", 10, 10, 3e5, 1.2, Interval{1.15, 1.25}, 0.001, 1.0, 1.07, GateVerdict::regressed},
      {"total", 1, 1, 2e5, 1.01, std::nullopt, std::nullopt, 1.0, std::nullopt, GateVerdict::ok}};
  c.verdict = GateVerdict::invalid;
  return c;
}

/// Returns the first violation of Bencher's definition, or "": an object of benchmarks (names up to 1024
/// characters), each an object of measures (up to 64), each an object with a number "value" and, optionally,
/// numbers "lower_value" and "upper_value".
std::string bmf_problem(const Json& bmf) {
  if (!bmf.is_object()) return "not an object";
  for (const auto& [name, measures] : bmf.items()) {
    if (name.empty() || name.size() > 1024 || !measures.is_object() || measures.empty()) return name;
    for (const auto& [measure, metric] : measures.items()) {
      if (measure.empty() || measure.size() > 64) return "measure " + measure;
      if (measure.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") != std::string::npos)
        return "not a slug: " + measure;
      if (!metric.is_object() || !metric.contains("value")) return measure + " without value";
      for (const auto& [key, value] : metric.items()) {
        if (key != "value" && key != "lower_value" && key != "upper_value") return "key " + key;
        if (!value.is_number()) return key + " is no number";
      }
      if (metric.value("lower_value", -1e300) > metric["value"].get<double>()) return "lower above value";
      if (metric.value("upper_value", 1e300) < metric["value"].get<double>()) return "upper below value";
    }
  }
  return "";
}

/// Returns the first violation of customSmallerIsBetter, or "": a list of {"name", "unit", "value", optional
/// texts "range" and "extra"}.
std::string github_problem(const Json& list) {
  if (!list.is_array()) return "not a list";
  std::set<std::string> names;
  for (const Json& entry : list) {
    for (const char* key : {"name", "unit"}) {
      if (!entry.contains(key) || !entry[key].is_string() || entry[key].get<std::string>().empty())
        return key;
    }
    if (!entry.contains("value") || !entry["value"].is_number()) return "value";
    if (!names.insert(entry["name"].get<std::string>()).second)
      return "twice: " + entry["name"].get<std::string>();
    for (const auto& [key, value] : entry.items()) {
      if (key == "name" || key == "unit" || key == "value") continue;
      if ((key != "range" && key != "extra") || !value.is_string()) return "key " + key;
    }
  }
  return "";
}

TEST(Outputs, JUnitFollowsItsSchema) {
  const TempFolder temp;
  if (std::system("command -v xmllint > /dev/null") != 0)
    GTEST_SKIP() << "xmllint (libxml2-utils) is not here";
  const auto problem = [&](const std::string& xml) -> std::string {
    write_file(temp.path() / "junit.xml", xml);
    const std::string log = (temp.path() / "log").string();
    const int status = std::system(fmt::format("xmllint --noout --schema {} {} 2> {}", SEXTANT_JUNIT_XSD,
                                               (temp.path() / "junit.xml").string(), log)
                                       .c_str());
    return WEXITSTATUS(status) == 0 ? "" : read_file(log);
  };
  const std::string xml = comparison_junit(every_verdict(), noon);
  EXPECT_EQ(problem(xml), "");
  EXPECT_EQ(problem(comparison_junit(Comparison{}, utc_timestamp())), "");
  Comparison unprintable = every_verdict();
  unprintable.base = "\uFFFE\uFFFF\xff\xed\xa0\x80\x1b[2J";
  unprintable.findings[0].subject = unprintable.accuracy[0].subject.body = unprintable.base;
  EXPECT_EQ(problem(comparison_junit(unprintable, noon)), "");
  EXPECT_NE(problem(comparison_junit(every_verdict(), "yesterday")),
            "");  // checks that the schema refuses bad input
  EXPECT_THAT(xml, HasSubstr("tests=\"4\" failures=\"1\" errors=\"0\" skipped=\"1\""));
  EXPECT_THAT(xml, HasSubstr("<error message=\"data &#39;a.png\uFFFD&#39;"));
  EXPECT_THAT(xml, HasSubstr("<failure message=\"300.00 us -&gt; 360.00 us (+20.0 %)\" type=\"regressed\">"));
}

TEST(Outputs, MarkdownHoldsNoHtmlAndNoLinesOfStrangers) {
  Comparison c = every_verdict();
  c.base = "<img src=x>`\n\n# Heading";
  c.findings[0].base = "<script>\nalert(1)</script> &lt; | x";
  c.accuracy[1].subject.estimator = "a\n| b | <b>";
  const std::string text = comparison_markdown(c);
  for (const char* html : {"<img", "<script", "</script", "<b>", "\n# Heading", "&lt; |", "\nalert"})
    EXPECT_THAT(text, Not(HasSubstr(html)));
  EXPECT_THAT(text, HasSubstr("BASE &lt;img src=x>`  # Heading, NEW new"));
}

TEST(Outputs, BencherMetricFormatFollowsItsDocumentation) {
  const Json bmf = comparison_bmf(every_verdict());
  EXPECT_EQ(bmf_problem(bmf), "");
  EXPECT_EQ(bmf.size(), 5U);
  EXPECT_DOUBLE_EQ(bmf["synthetic s18 joint_flow level 0.1 object:1"]["et-m"]["value"], 0.011);
  EXPECT_DOUBLE_EQ(bmf["ransac/3000"]["latency"]["upper_value"], 3.75e5);
  EXPECT_NE(bmf_problem(Json::parse(R"({"a":{"b":{"value":"1"}}})")),
            "");  // checks that the checker refuses bad input
  EXPECT_NE(bmf_problem(Json::parse(R"({"a":{"b":{"lower_value":1}}})")), "");
}

TEST(Outputs, GithubActionBenchmarkFollowsItsDocumentation) {
  const Policy policy;
  const Json list = comparison_github(every_verdict(), policy);
  EXPECT_EQ(github_problem(list), "");
  ASSERT_EQ(list.size(), 5U);
  EXPECT_EQ(list[1]["unit"], "m");
  EXPECT_EQ(list[3], (Json{{"name", "ransac/3000"},
                           {"unit", "ns"},
                           {"value", 3.6e5},
                           {"range", "345000 .. 375000"},
                           {"extra", "regressed"}}));
  Policy higher;
  higher.accuracy.metrics["Et_m"].direction = Direction::higher;
  EXPECT_EQ(comparison_github(every_verdict(), higher).size(), 3U);
  EXPECT_NE(github_problem(Json::parse(R"([{"name":"a","unit":"m","value":null}])")), "");
}

TEST(Outputs, MarkdownAndJsonSayTheVerdict) {
  const Policy policy;
  const OutputFiles files = comparison_files(every_verdict(), policy, noon);
  EXPECT_EQ(files.size(), 5U);
  EXPECT_TRUE(files.at("comparison.md").starts_with("# sextant compare: invalid\n"));
  const Json json = Json::parse(files.at("comparison.json"));
  EXPECT_EQ(json["exit_code"], 2);
  EXPECT_EQ(json["accuracy"].size(), 3U);
  EXPECT_EQ(json["accuracy"][0]["verdict"], "regressed");  // worst first
  EXPECT_EQ(json["policy"], write_options(policy));
}

}  // namespace
}  // namespace sextant
