// JUnit XML in the form that Ant defined and that Jenkins, GitLab and GitHub's actions read: suites with
// properties, cases, system-out and system-err, in this order.

#include <algorithm>
#include <vector>

#include "sextant/eval/gate/outputs.h"
#include "sextant/eval/report/html/html.h"

namespace sextant {
namespace {

struct TestCase {
  std::string name;
  GateVerdict verdict = GateVerdict::ok;
  std::string message;
};

struct Suite {
  std::string name;
  std::vector<TestCase> cases;
};

std::string test_case(const Suite& suite, const TestCase& test) {
  const char* element = test.verdict == GateVerdict::regressed      ? "failure"
                        : test.verdict == GateVerdict::invalid      ? "error"
                        : test.verdict == GateVerdict::inconclusive ? "skipped"
                                                                    : nullptr;
  const std::string head = fmt::format(R"(    <testcase name="{}" classname="sextant.{}" time="0")",
                                       html_escaped(test.name), html_escaped(suite.name));
  if (element == nullptr) return head + "/>\n";
  const std::string message = html_escaped(test.message);
  if (test.verdict == GateVerdict::inconclusive)
    return fmt::format("{}>\n      <skipped message=\"{}\"/>\n    </testcase>\n", head, message);
  return fmt::format("{0}>\n      <{1} message=\"{2}\" type=\"{3}\">{2}</{1}>\n    </testcase>\n", head,
                     element, message, to_string(test.verdict));
}

std::string suite_text(const Suite& suite, size_t id, const Comparison& c, const std::string& timestamp) {
  const auto count = [&](GateVerdict verdict) {
    return std::ranges::count(suite.cases, verdict, &TestCase::verdict);
  };
  std::string text = fmt::format(
      "  <testsuite name=\"{}\" package=\"sextant\" id=\"{}\" timestamp=\"{}\" hostname=\"localhost\" "
      "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"0\">\n",
      suite.name, id, timestamp, suite.cases.size(), count(GateVerdict::regressed),
      count(GateVerdict::invalid), count(GateVerdict::inconclusive));
  text += fmt::format(
      "    <properties>\n      <property name=\"base\" value=\"{}\"/>\n      <property name=\"new\" "
      "value=\"{}\"/>\n    </properties>\n",
      html_escaped(c.base), html_escaped(c.fresh));
  for (const TestCase& test : suite.cases) text += test_case(suite, test);
  return text + "    <system-out/>\n    <system-err/>\n  </testsuite>\n";
}

Suite comparable(const Comparison& c) {
  Suite suite{"comparable", {}};
  for (const Mismatch& f : c.findings) {
    if (!f.invalidates) continue;
    suite.cases.push_back({fmt::format("{}: {}", f.what, f.subject), GateVerdict::invalid,
                           fmt::format("{} '{}': BASE '{}', NEW '{}'", f.what, f.subject, f.base, f.fresh)});
  }
  if (suite.cases.empty()) suite.cases.push_back({"both sides may be compared", GateVerdict::ok, ""});
  return suite;
}

Suite accuracy(const Comparison& c) {
  Suite suite{"accuracy", {}};
  for (const StatusRow& row : c.statuses) {
    suite.cases.push_back(
        {to_string(row.subject) + " coverage", row.verdict,
         fmt::format("{} of {} cases lost, {} gained; {}", row.n_lost, row.n, row.n_gained, row.example)});
  }
  for (const FamilyRow& row : c.families) {
    const std::string interval =
        row.interval ? fmt::format(" [{:+.2f}, {:+.2f}]", 100 * row.interval->low, 100 * row.interval->high) : "";
    suite.cases.push_back({fmt::format("{} {} {}", row.estimator, row.body, row.metric), row.verdict,
                           fmt::format("{:+.2f} %{}; {} of {} cases worse, {} better, {} seeds", 100 * row.change,
                                       interval, row.n_worse, row.n, row.n_better, row.n_seeds)});
  }
  for (const AccuracyRow& row : c.accuracy) {
    if (row.too_few) {
      suite.cases.push_back({fmt::format("{} {}", to_string(row.subject), row.metric), GateVerdict::inconclusive,
                             fmt::format("too few to judge: mean {} -> {}, {} cases", row.base,
                                         row.base + row.difference, row.n)});
      continue;
    }
    suite.cases.push_back({fmt::format("{} {}", to_string(row.subject), row.metric), row.verdict,
                           fmt::format("mean {} -> {}; {} of {} cases worse, {} better", row.base,
                                       row.base + row.difference, row.n_worse, row.n, row.n_better)});
  }
  return suite;
}

Suite speed(const Comparison& c) {
  Suite suite{"speed", {}};
  for (const SpeedRow& row : c.speed) {
    suite.cases.push_back({row.name, row.verdict,
                           fmt::format("{:.2f} us -> {:.2f} us ({:+.1f} %)", row.base_ns / 1e3,
                                       row.base_ns * row.ratio / 1e3, 100 * (row.ratio - 1))});
  }
  return suite;
}

}  // namespace

std::string comparison_junit(const Comparison& c, const std::string& timestamp) {
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n";
  size_t id = 0;
  for (const Suite& suite : {comparable(c), accuracy(c), speed(c)}) {
    if (!suite.cases.empty()) text += suite_text(suite, id++, c, timestamp);
  }
  return text + "</testsuites>\n";
}

}  // namespace sextant
