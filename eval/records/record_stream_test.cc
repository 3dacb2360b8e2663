#include "sextant/eval/records/record_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/eval/records/testing.h"

namespace sextant {
namespace {

using testing::HasSubstr;

/// Alternating records of two bodies with different numbers.
std::vector<Record> many_records(int n) {
  std::vector<Record> records;
  for (int i = 0; i < n; ++i) {
    Record r = RecordOf{
        .body = i % 2 == 0 ? "ego" : "object:7", .seed = static_cast<uint64_t>(i / 10), .frame = i % 10};
    r.errors["Et_m"] = 0.1 * i;
    if (i % 2 == 1) r.errors["Ev_kmh"] = 1.0 / (i + 1);
    if (i % 3 == 0) r.flow_truth = "given";
    if (i % 5 == 0) {
      r.status = Status::gated;
      r.gate = Gate::area;
    }
    records.push_back(r);
  }
  return records;
}

void expect_file_refused(const std::filesystem::path& path, const std::string& part) {
  expect_error([&] { for_each_record(path, [](Record&) {}); }, part);
}

TEST(RecordStream, ReadsAFileOfManyBlocksAsAWhole) {
  const TempFolder folder;
  const std::vector<Record> records = many_records(30000);
  const std::string text = write_records(records);
  ASSERT_GT(text.size(), 6U << 20U) << "more than a block";
  write_file(folder.path() / "records.jsonl", text);
  EXPECT_EQ(read_records(folder.path() / "records.jsonl"), records);
  EXPECT_EQ(parse_records(text, "x"), records);
}

TEST(RecordStream, NothingOfALineStaysForTheNext) {
  const TempFolder folder;
  Record last;
  write_file(folder.path() / "records.jsonl", write_records(many_records(2)));
  for_each_record(folder.path() / "records.jsonl", [&](Record& record) { last = record; });
  EXPECT_EQ(last, many_records(2).back());
}

TEST(RecordStream, NamesTheLineBehindTheFirstBlock) {
  const TempFolder folder;
  const std::filesystem::path path = folder.path() / "records.jsonl";
  std::string text = write_records(many_records(30000));
  text.pop_back();
  write_file(path, text);
  expect_file_refused(path, "records.jsonl:30000: the line is not finished");
  write_file(path, text + "\n{}\n");
  expect_file_refused(path, "records.jsonl:30001: key");
}

TEST(RecordStream, RefusesALineThatIsNoRecord) {
  const TempFolder folder;
  const std::filesystem::path path = folder.path() / "records.jsonl";
  const std::string good = write_records(many_records(1));
  for (const char* end : {"", "\n"}) {  // also if no line end follows
    write_file(path, good + std::string(2 * max_record_bytes, 'x') + end);
    expect_file_refused(path, "records.jsonl:2: the line has more than 1048576 bytes");
  }
  write_file(path, good + std::string(40 * max_record_bytes, '{'));
  expect_file_refused(path, "records.jsonl:2: the line has more than");
  write_file(path, "");
  EXPECT_NO_THROW(for_each_record(path, [](Record&) {}));
}

}  // namespace
}  // namespace sextant
