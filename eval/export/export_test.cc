#include "sextant/eval/export/export.h"

#include <gmock/gmock.h>
#include <sqlite3.h>

#include <algorithm>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

constexpr const char* hostile = "a,\"b\"\n'); DROP TABLE records; --";

class Export : public testing::Test {
 protected:
  Export() {
    Record plain;
    plain.dataset = "d";
    plain.body = "ego";
    plain.errors["Et_m"] = 0.1;
    Record strange = plain;
    strange.dataset = hostile;
    strange.body = "object:2";
    strange.status = Status::gated;
    strange.gate = Gate::area;
    strange.seed = UINT64_MAX;
    strange.errors = {{"x\"y,../z", 0.5}};
    write_file(folder() / "records.jsonl", write_records({plain, strange}));
  }
  const fs::path& folder() const { return temp_.path(); }
  fs::path exported(ExportFormat format) const {
    const fs::path out = folder() / "out";
    const ExportOutcome outcome = export_records(folder(), format, out);
    EXPECT_EQ(outcome.n_records, 2U);
    EXPECT_EQ(outcome.n_columns, 15U);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder()), {}), 2) << "no temporary file stays";
    return out;
  }

  TempFolder temp_;
};

TEST_F(Export, CsvQuotesUntrustedTexts) {
  EXPECT_EQ(
      read_file(exported(ExportFormat::csv)),
      "dataset,sequence,estimator,noise,level,seed,frame,body,status,gate,n_points,n_inliers,flow_truth,"
      "errors_Et_m,"
      "\"errors_x\"\"y,../z\"\n"
      "d,,,none,0,0,0,ego,ok,,0,0,,0.1,\n"
      "\"a,\"\"b\"\"\n'); DROP TABLE records; "
      "--\",,,none,0,18446744073709551615,0,object:2,gated,area,0,0,,,0.5\n");
}

TEST_F(Export, ColumnsAreTheFieldsOfARecord) {
  std::vector<std::string> names = {"schema"};
  const RecordColumns records(folder());
  for (const RecordColumn& column : records.columns()) {
    if (!column.name.starts_with("errors_")) names.push_back(column.name);
  }
  names.insert(names.end(), {"errors", "values", "bound", "time_ms"});
  EXPECT_EQ(names, record_field_names());
}

TEST_F(Export, SqliteHoldsTheSame) {
  sqlite3* base = nullptr;
  ASSERT_EQ(sqlite3_open(exported(ExportFormat::sqlite).c_str(), &base), SQLITE_OK);
  sqlite3_stmt* rows = nullptr;
  ASSERT_EQ(
      sqlite3_prepare_v2(base, "SELECT dataset, seed, errors_Et_m, \"errors_x\"\"y,../z\", gate FROM records",
                         -1, &rows, nullptr),
      SQLITE_OK);
  const auto text = [&](int column) {
    return std::string(reinterpret_cast<const char*>(sqlite3_column_text(rows, column)));
  };
  ASSERT_EQ(sqlite3_step(rows), SQLITE_ROW);
  EXPECT_EQ(text(0), "d");
  EXPECT_EQ(sqlite3_column_type(rows, 1), SQLITE_INTEGER);
  EXPECT_EQ(sqlite3_column_double(rows, 2), 0.1);
  EXPECT_EQ(sqlite3_column_type(rows, 3), SQLITE_NULL);
  ASSERT_EQ(sqlite3_step(rows), SQLITE_ROW);
  EXPECT_EQ(text(0), hostile);
  EXPECT_EQ(text(1), "18446744073709551615");
  EXPECT_EQ(sqlite3_column_type(rows, 2), SQLITE_NULL);
  EXPECT_EQ(sqlite3_column_double(rows, 3), 0.5);
  EXPECT_EQ(text(4), "area");
  EXPECT_EQ(sqlite3_step(rows), SQLITE_DONE);
  sqlite3_finalize(rows);
  sqlite3_close(base);
}

TEST_F(Export, NpzNamesNoFolder) {
  const std::string bytes = read_file(exported(ExportFormat::npz));
  EXPECT_EQ(bytes.substr(0, 2), "PK");
  EXPECT_THAT(bytes, HasSubstr("errors_x%22y%2C..%2Fz.npy"));
  EXPECT_THAT(bytes, HasSubstr("dataset_names.npy"));
  EXPECT_EQ(bytes.find("../"), std::string::npos);
}

TEST_F(Export, RefusesRecordsThatWereCutOffOrRepeated) {
  for (const int stated : {1, 3}) {
    write_file(folder() / "run.json", json_text({{"records", stated}}));
    expect_error([&] { export_records(folder(), ExportFormat::csv, folder() / "out"); },
                 "records.jsonl holds 2 records, but run.json states");
    EXPECT_FALSE(fs::exists(folder() / "out"));
  }
}

TEST_F(Export, AnErrorKeepsTheExistingFile) {
  const fs::path out = exported(ExportFormat::csv);
  const std::string before = read_file(out);
  write_file(folder() / "records.jsonl", "{}\n");
  for (const ExportFormat format : {ExportFormat::csv, ExportFormat::npz, ExportFormat::sqlite}) {
    EXPECT_THROW(export_records(folder(), format, out), Error);
    EXPECT_EQ(read_file(out), before);
  }
  EXPECT_THROW(export_records(folder(), ExportFormat::csv, folder()), Error);
  EXPECT_THROW(export_records(folder(), ExportFormat::csv, folder() / "no" / "file"), Error);
  EXPECT_THROW(export_records(folder() / "no", ExportFormat::csv, out), Error);
}

}  // namespace
}  // namespace sextant
