#include "sextant/eval/gate/comparison.h"

#include <fmt/chrono.h>
#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/metrics/definitions.h"

namespace sextant {

namespace {

std::string unit_of_metric(const std::string& metric) {
  const MetricDefinition* definition = find_metric(NumberMap::errors, metric);
  return definition == nullptr ? metric.substr(metric.rfind('_') + 1) : definition->unit;
}

/// Returns the slug of a measure: at most 64 characters, in lower case, with '-' for each character that is
/// neither a letter nor a digit.
std::string slug(const std::string& metric) {
  std::string text;
  for (const char c : metric.substr(0, 64)) {
    text += std::isalnum(static_cast<unsigned char>(c)) != 0
                ? static_cast<char>(std::tolower(static_cast<unsigned char>(c)))
                : '-';
  }
  return text;
}

/// Limits the name of a benchmark to 1024 characters.
std::string bounded(const std::string& name) { return name.substr(0, 1024); }

Json bmf_metric(double value, const std::optional<Interval>& interval) {
  Json json = {{"value", value}};
  if (interval) {
    json["lower_value"] = interval->low;
    json["upper_value"] = interval->high;
  }
  return json;
}

/// Returns the interval of NEW's mean, from the interval of its difference to BASE.
std::optional<Interval> around_base(const AccuracyRow& row) {
  if (!row.interval) return std::nullopt;
  return Interval{row.base + row.interval->low, row.base + row.interval->high};
}

std::optional<Interval> in_ns(const SpeedRow& row) {
  if (!row.interval) return std::nullopt;
  return Interval{row.base_ns * row.interval->low, row.base_ns * row.interval->high};
}

Json github_entry(std::string name, std::string unit, double value, const std::optional<Interval>& interval,
                  GateVerdict verdict) {
  Json json = {{"name", std::move(name)}, {"unit", std::move(unit)}, {"value", value}};
  if (interval) json["range"] = fmt::format("{} .. {}", interval->low, interval->high);
  json["extra"] = std::string(to_string(verdict));
  return json;
}

SubjectNames names_of(const Comparison& c) {
  SubjectNames names;
  for (const StatusRow& row : c.statuses) names.add(row.subject);
  for (const AccuracyRow& row : c.accuracy) names.add(row.subject);
  return names;
}

}  // namespace

std::string comparison_markdown(const Comparison& c) {
  const std::string largest = largest_change(c);
  std::string text = fmt::format("# sextant compare: {}\n\n{}{}\n\nBASE {}, NEW {}\n", to_string(c.verdict),
                                 largest.empty() ? "" : "**" + markdown_text(largest) + "**\n\n",
                                 markdown_text(headline(c)), markdown_text(c.base), markdown_text(c.fresh));
  const auto add = [&](const Table& table) {
    if (!table.rows.empty()) text += "\n" + to_markdown(table);
  };
  add(findings_table(c));
  add(status_table(c));
  add(family_table(c, /*changed_only=*/true));
  add(accuracy_table(c, /*changed_only=*/true));
  add(speed_table(c, /*changed_only=*/false));
  return text;
}

Json comparison_json(const Comparison& c, const Policy& policy) {
  Json json;
  json["schema"] = 1;
  json["verdict"] = std::string(to_string(c.verdict));
  json["exit_code"] = exit_code(c.verdict);
  json["headline"] = headline(c);
  json["base"] = c.base;
  json["new"] = c.fresh;
  json["cases"] = c.n_cases;
  json["findings"] = rows_to_json(findings_table(c));
  json["statuses"] = rows_to_json(status_table(c));
  json["largest_change"] = largest_change(c);
  json["families"] = rows_to_json(family_table(c, /*changed_only=*/false));
  json["accuracy"] = rows_to_json(accuracy_table(c, /*changed_only=*/false));
  json["speed"] = rows_to_json(speed_table(c, /*changed_only=*/false));
  json["policy"] = write_options(policy);
  return json;
}

Json comparison_bmf(const Comparison& c) {
  const SubjectNames names = names_of(c);
  Json json = Json::object();
  for (const AccuracyRow& row : c.accuracy) {
    json[bounded(names(row.subject))][slug(row.metric)] =
        bmf_metric(row.base + row.difference, around_base(row));
  }
  for (const SpeedRow& row : c.speed)
    json[bounded(row.name)]["latency"] = bmf_metric(row.base_ns * row.ratio, in_ns(row));
  return json;
}

Json comparison_github(const Comparison& c, const Policy& policy) {
  const SubjectNames names = names_of(c);
  Json json = Json::array();
  for (const AccuracyRow& row : c.accuracy) {
    if (policy.accuracy.of(row.metric).direction != Direction::lower) continue;
    json.push_back(github_entry(fmt::format("{} {}", names(row.subject), row.metric),
                                unit_of_metric(row.metric), row.base + row.difference, around_base(row),
                                row.verdict));
  }
  for (const SpeedRow& row : c.speed)
    json.push_back(github_entry(row.name, "ns", row.base_ns * row.ratio, in_ns(row), row.verdict));
  return json;
}

OutputFiles comparison_files(const Comparison& c, const Policy& policy, const std::string& timestamp) {
  return {{"comparison.md", comparison_markdown(c)},
          {"comparison.json", json_text(comparison_json(c, policy))},
          {"junit.xml", comparison_junit(c, timestamp)},
          {"bmf.json", json_text(comparison_bmf(c))},
          {"github.json", json_text(comparison_github(c, policy))}};
}

std::string utc_timestamp() {
  const char* epoch = std::getenv("SOURCE_DATE_EPOCH");
  std::time_t now = std::time(nullptr);
  if (epoch != nullptr) {
    constexpr std::time_t last = 253'402'300'799;  // end of the year 9999
    const std::string_view text = epoch;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), now);
    if (error != std::errc() || end != text.data() + text.size() || now < 0 || now > last)
      fail("SOURCE_DATE_EPOCH is '{}': expected seconds since 1970, from 0 to {}", one_line(text), last);
  }
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}", fmt::gmtime(now));
}

// JUnit XML in the form that Ant defined and that Jenkins, GitLab and GitHub's actions read: suites with
// properties, cases, system-out and system-err, in this order.

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
  const SubjectNames names = names_of(c);
  Suite suite{"accuracy", {}};
  for (const StatusRow& row : c.statuses) {
    suite.cases.push_back(
        {names(row.subject) + " coverage", row.verdict,
         fmt::format("{} of {} records lost, {} gained, {} with gross errors; {} decisions wrong, {} "
                     "corrected; {}",
                     row.n_lost, row.n, row.n_gained, row.n_bad, row.n_wrong, row.n_corrected, row.example)});
  }
  for (const FamilyRow& row : c.families) {
    const std::string interval =
        row.interval ? fmt::format(" [{:+.2f}, {:+.2f}]", 100 * row.interval->low, 100 * row.interval->high)
                     : "";
    suite.cases.push_back(
        {fmt::format("{} {} {}", row.estimator, row.body, row.metric), row.verdict,
         fmt::format("{:+.2f} %{}; {} of {} records worse, {} better, {} seeds", 100 * row.change, interval,
                     row.n_worse, row.n, row.n_better, row.n_seeds)});
  }
  for (const AccuracyRow& row : c.accuracy) {
    if (row.too_few) {
      suite.cases.push_back({fmt::format("{} {}", names(row.subject), row.metric), GateVerdict::inconclusive,
                             fmt::format("too few to judge: mean {} -> {}, {} records", row.base,
                                         row.base + row.difference, row.n)});
      continue;
    }
    suite.cases.push_back({fmt::format("{} {}", names(row.subject), row.metric), row.verdict,
                           fmt::format("mean {} -> {}; {} of {} records worse, {} better", row.base,
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
