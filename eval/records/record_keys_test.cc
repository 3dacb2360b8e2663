// The list of metrics is consistent with the committed documentation and results.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

const fs::path source = SEXTANT_SOURCE;

std::string metrics_page() { return read_file(source / "docs" / "metrics.md"); }

std::string table_of(NumberMap map) {
  std::string text = "| key | unit | body | definition |\n|---|---|---|---|\n";
  for (const MetricDefinition& d : metric_definitions()) {
    if (d.map == map) text += fmt::format("| `{}` | {} | {} | {} |\n", d.name, d.unit, d.body, d.definition);
  }
  return text;
}

TEST(RecordKeys, TheirTablesInTheDocumentationAreThoseOfTheList) {
  const std::string page = metrics_page();
  for (const NumberMap map : {NumberMap::errors, NumberMap::values, NumberMap::bound, NumberMap::time_ms}) {
    const std::string table = table_of(map);
    EXPECT_NE(page.find(table), std::string::npos)
        << "docs/metrics.md: its table of `" << to_string(map) << "` has to be\n\n"
        << table;
  }
}

TEST(RecordKeys, EveryFieldIsDocumented) {
  const std::string page = metrics_page();
  const std::string fields =
      page.substr(page.find("## Fields"), page.find("### Status") - page.find("## Fields"));
  for (const std::string& name : record_field_names())
    EXPECT_THAT(fields, testing::HasSubstr("`" + name + "`"));
}

TEST(RecordKeys, AreEachInTheListOnce) {
  for (const MetricDefinition& d : metric_definitions()) {
    EXPECT_EQ(find_metric(d.map, d.name), &d) << d.name;
    EXPECT_FALSE(d.symbol.empty() || d.unit.empty() || d.definition.empty()) << d.name;
    EXPECT_TRUE(d.body == "ego" || d.body == "object" || d.body == "both") << d.name;
    EXPECT_TRUE(!d.is(compared) || (d.map == NumberMap::errors && d.name != d.stem())) << d.name;
  }
}

TEST(RecordKeys, OfCommittedRecordsAreInTheList) {
  int n_files = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(source / "results")) {
    if (entry.path().filename() != "records.jsonl") continue;
    EXPECT_THAT(unlisted_keys(read_records(entry.path())), testing::IsEmpty()) << entry.path();
    ++n_files;
  }
  EXPECT_GE(n_files, 5);
}

TEST(RecordKeys, NamesMapAndKeyOfWhatIsNotListed) {
  Record r;
  r.errors["Et_m"] = r.values["Et_m"] = r.time_ms["lunch"] = 1;
  EXPECT_THAT(unlisted_keys({r}), testing::ElementsAre("time_ms.lunch", "values.Et_m"));
  try {
    check_listed({r});
    ADD_FAILURE() << "taken";
  } catch (const InternalError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("time_ms.lunch, values.Et_m"));
  }
}

}  // namespace
}  // namespace sextant
