#include "sextant/eval/records/record.h"

#include <cmath>
#include <limits>
#include <map>

#include "sextant/base/testing.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

using testing::HasSubstr;

Record example() {
  Record r;
  r.dataset = "vdo";
  r.sequence = "kitti_03_demo";
  r.estimator = "joint_flow";
  r.frame = 7;
  r.body = object_body(3);
  r.n_points = 120;
  r.n_inliers = 100;
  r.flow_truth = "induced";
  r.errors = {{"Et_m", 0.1}, {"ER_deg", 1.0 / 3.0}};
  r.values = {{"v_kmh", 54.25}};
  r.time_ms = {{"total", 1.5}};
  return r;
}

void expect_refused(const std::string& text, const std::string& part) {
  expect_error([&] { parse_records(text, "records.jsonl"); }, part);
}

/// Expects that the example's line is rejected after `change`.
template <typename Change>
void expect_refused_after(Change change, const std::string& part) {
  Json json = to_json(example());
  change(json);
  expect_refused(json.dump() + "\n", part);
}

TEST(Record, IsWrittenInTheDocumentedKeyOrder) {
  EXPECT_EQ(
      write_records({example()}),
      R"({"schema":1,"dataset":"vdo","sequence":"kitti_03_demo","estimator":"joint_flow","noise":"none",)"
      R"("level":0.0,"seed":0,"frame":7,"body":"object:3","status":"ok","n_points":120,"n_inliers":100,)"
      R"("flow_truth":"induced","errors":{"ER_deg":0.3333333333333333,"Et_m":0.1},"values":{"v_kmh":54.25},)"
      R"("bound":{},"time_ms":{"total":1.5}})"
      "\n");
}

TEST(Record, RoundTripsBitForBit) {
  Record gated = example();
  gated.status = Status::gated;
  gated.gate = Gate::is_static;
  gated.flow_truth = "";
  gated.seed = std::numeric_limits<uint64_t>::max();
  gated.errors = {{"Et_m", std::nextafter(0.1, 1.0)}, {"ER_deg", 5e-324}};
  const std::vector<Record> records = {example(), gated};
  EXPECT_EQ(parse_records(write_records(records), "x"), records);
}

TEST(Record, LeavesOutNumbersThatAreNotFinite) {
  Record r = example();
  r.errors["Et_m"] = NAN;
  r.values["v_kmh"] = std::numeric_limits<double>::infinity();
  const std::string line = write_records({r});
  EXPECT_THAT(line, testing::Not(HasSubstr("Et_m")));
  EXPECT_THAT(line, testing::Not(HasSubstr("v_kmh")));
  EXPECT_THAT(line, testing::Not(HasSubstr("null")));
  const Record back = parse_records(line, "x").at(0);
  EXPECT_FALSE(back.errors.contains("Et_m"));
  EXPECT_TRUE(back.errors.contains("ER_deg"));
}

TEST(Record, ReaderNamesFileLineAndKey) {
  const std::string good = write_records({example()});
  expect_refused(good + "{\"schema\":1\n", "records.jsonl:2: not valid JSON");
  expect_refused(good + "[]\n", "records.jsonl:2: expected a JSON object");
  expect_refused(good + good.substr(0, good.size() - 1), "records.jsonl:2: the line is not finished");
  expect_refused(good + "\n", "records.jsonl:2: not valid JSON");
  expect_refused_after([](Json& j) { j.erase("status"); }, "key 'status' is missing");
  expect_refused_after([](Json& j) { j["eror"] = 1; }, "did you mean 'errors'");
  expect_refused_after([](Json& j) { j["schema"] = 2; }, "schema 2");
  expect_refused_after([](Json& j) { j["status"] = "fine"; }, "records.jsonl:1: ");
  expect_refused_after([](Json& j) { j["frame"] = "7"; }, "key 'frame': expected an integer");
  expect_refused_after([](Json& j) { j["frame"] = 7.5; }, "key 'frame': expected an integer");
  expect_refused_after([](Json& j) { j["n_points"] = -1; }, "key 'n_points'");
  expect_refused_after([](Json& j) { j["seed"] = -1; }, "key 'seed'");
  expect_refused_after([](Json& j) { j["body"] = "object:"; }, "key 'body'");
  expect_refused_after([](Json& j) { j["body"] = "object:2147483648"; }, "key 'body'");
  for (const double number : {1e101, -0.5, 1e308})
    expect_refused_after([&](Json& j) { j["errors"]["Et_m"] = number; },
                         "key 'errors.Et_m': expected error Et_m to be of a size");
  for (const double number : {-1e101, 1e308})
    expect_refused_after([&](Json& j) { j["values"]["nees"] = number; },
                         "key 'values.nees': expected number nees to be of a size");
  expect_refused_after([](Json& j) { j["level"] = 1e308; }, "key 'level'");
  expect_refused_after([](Json& j) { j["errors"]["Et_m"] = nullptr; }, "key 'errors.Et_m'");
  expect_refused_after([](Json& j) { j["gate"] = "distance"; }, "key 'gate'");
  expect_refused_after([](Json& j) { j["status"] = "gated"; }, "key 'gate'");
  expect_refused_after([](Json& j) { j["flow_truth"] = "guessed"; }, "key 'flow_truth'");
}

TEST(Record, ReadingNamesAMissingFile) { EXPECT_THROW(read_records("/nonexistent/records.jsonl"), Error); }

TEST(Record, AnEndPointErrorAloneIsNoTruthOfTheMotion) {
  Record record;
  record.body = "object:3";
  record.status = Status::no_truth;
  record.errors["epe_measured_px"] = 0.5;  // relative to the true flow of the data set
  EXPECT_FALSE(has_truth(record));
  record.errors["Et_m"] = 0.1;  // as in records of logs of other systems
  EXPECT_TRUE(has_truth(record));
  record.values["dynamic_gt"] = 0;
  EXPECT_FALSE(has_truth(record));
}

TEST(Record, StripTimesLeavesTheRest) {
  Record expected = example();
  expected.time_ms.clear();
  EXPECT_EQ(strip_times(example()), expected);
}

TEST(Record, TheFastReaderAgreesWithTheStrictOne) {
  std::vector<Record> records(3, example());
  records[0].errors = {{"ER_deg", 1e-300}, {"Et_m", -0.0}, {"Ev_kmh", 123456789.0}};
  records[1].status = Status::gated;
  records[1].gate = Gate::area;
  records[1].flow_truth = "";
  records[2].seed = 18446744073709551615ULL;
  records[2].level = 1e22;
  records[2].values.clear();
  Record scanned;  // the same object for all lines: nothing of a previous line may remain
  for (const Record& record : records) {
    std::string line = write_records({record});
    line.pop_back();
    ASSERT_TRUE(scan_record(line, scanned)) << line;
    EXPECT_EQ(scanned, record_from_json(Json::parse(line), "line"));
    EXPECT_EQ(scanned, record);
  }
}

TEST(Record, TheFastReaderLeavesEveryOtherLineToTheStrictOne) {
  std::string line = write_records({example()});
  line.pop_back();
  Record scanned;
  ASSERT_TRUE(scan_record(line, scanned));
  for (size_t i = 0; i < line.size(); ++i) EXPECT_FALSE(scan_record(line.substr(0, i), scanned)) << i;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = line;
    const size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return changed.replace(at, from.size(), to);
  };
  const std::map<std::string, std::vector<std::string>> changes = {
      {"0.1}", {"NaN}", "nan}", "inf}", "1e999}", "01}", "1.}", ".1}", "+1}", "null}", "0.1 }"}},
      {"\"schema\":1", {"\"schema\":2"}},
      {"object:3", {"object:", "object:x"}},
      {"\"ok\"", {"\"gated\"", "\"fine\""}},
      {":120", {":-120"}},
      {"induced", {"guessed"}},
      {"vdo", {"v\\u0064o", "v\xc3\xa4o"}},
      {"\"Et_m\"", {"\"ER_deg\""}},
      {"}}", {"}} "}}};
  for (const auto& [from, all] : changes) {
    for (const std::string& to : all) EXPECT_FALSE(scan_record(with(from, to), scanned)) << to;
  }
}

}  // namespace
}  // namespace sextant
