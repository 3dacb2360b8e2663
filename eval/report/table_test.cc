#include "sextant/eval/report/table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sextant/base/error.h"

namespace sextant {
namespace {

Table example() {
  Table table;
  table.title = "T";
  table.caption = "C";
  table.columns = {{"name", "name", Align::left}, {"x_m", "x [m]", Align::right, 2}};
  table.add_row({std::string("a,\"b|"), 1.0 / 3.0});
  table.add_row({std::string("é"), Cell()});
  table.notes = {"n"};
  return table;
}

TEST(Table, TextIsAligned) {
  EXPECT_EQ(to_text(example()),
            "T\nC\n\n"
            "name   x [m]\n"
            "-----  -----\n"
            "a,\"b|   0.33\n"
            "é          -\n"
            "\nn\n");
}

TEST(Table, TextSaysOnceWhatAllRowsShare) {
  Table table = example();
  table.columns.insert(table.columns.begin(), {"set", "set", Align::left, 0, true});
  for (auto& row : table.rows) row.insert(row.begin(), std::string("kitti"));
  EXPECT_EQ(to_text(table),
            "T\nC\nset kitti\n\n"
            "name   x [m]\n"
            "-----  -----\n"
            "a,\"b|   0.33\n"
            "é          -\n"
            "\nn\n");
  EXPECT_EQ(to_csv(table).substr(0, 12), "set,name,x_m");
  table.rows.back().front() = std::string("vkitti");
  EXPECT_NE(to_text(table).find("set     name"), std::string::npos);
}

TEST(Table, MarkdownEscapesBars) {
  EXPECT_EQ(to_markdown(example()),
            "## T\n\nC\n\n"
            "| name  | x [m] |\n"
            "| :---- | ----: |\n"
            "| a,\"b\\| |  0.33 |\n"
            "| é     |     - |\n"
            "\nn\n");
}

TEST(Table, CsvKeepsEveryDigitAndQuotes) {
  EXPECT_EQ(to_csv(example()), "name,x_m\n\"a,\"\"b|\",0.3333333333333333\né,\n");
}

TEST(Table, JsonLeavesOutEmptyCells) {
  EXPECT_EQ(rows_to_json(example()).dump(), R"([{"name":"a,\"b|","x_m":0.3333333333333333},{"name":"é"}])");
}

TEST(Table, RefusesWrongRows) {
  Table table = example();
  EXPECT_THROW(table.add_row({1.0}), InternalError);
  EXPECT_THROW(table.add_row({std::string("x"), NAN}), InternalError);
}

TEST(Table, FoldedColumnsAreSaidOnceAndEmptyOnesNotAtAll) {
  Table table;
  table.columns = {{"set", "set", Align::left, 0, true},
                   {"none", "none", Align::right, 1, true},
                   {"some", "some", Align::right, 1, true},
                   {"x", "x", Align::right, 1}};
  table.add_row({"a", Cell(), 1.0, 1.0});
  table.add_row({"a", Cell(), Cell(), 1.0});
  const std::string text = to_text(table);
  EXPECT_TRUE(text.starts_with("set a\n")) << text;
  EXPECT_EQ(text.find("none"), std::string::npos);
  EXPECT_NE(text.find("some"), std::string::npos);
  EXPECT_NE(to_csv(table).find("none"), std::string::npos);
}

}  // namespace
}  // namespace sextant
