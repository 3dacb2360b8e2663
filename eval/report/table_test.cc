#include "sextant/eval/report/table.h"

#include <gtest/gtest.h>

namespace sextant {
namespace {

Table example_table() {
  Table table{"T", "C", {Column::text("name"), Column::number("x_m", "x [m]", 2)}};
  table.add_row({std::string("a,\"b|"), 1.0 / 3.0});
  table.add_row({std::string("é"), Cell()});
  table.notes = {"n"};
  return table;
}

TEST(Table, TextIsAligned) {
  EXPECT_EQ(to_text(example_table()),
            "T\nC\n\n"
            "name   x [m]\n"
            "-----  -----\n"
            "a,\"b|   0.33\n"
            "é          -\n"
            "\nn\n");
}

TEST(Table, LongTextsAreBrokenSoThatTheTableFits) {
  Table table;
  table.columns = {Column::text("key"), Column::number("x", "x", 1), Column::text("meaning")};
  table.add_row({std::string("largest"), 12.5, std::string("so many of them at most")});
  table.add_row({std::string("unbreakable"), 1.0, std::string("é")});
  EXPECT_EQ(to_text(table, 32),
            "key             x  meaning\n"
            "-----------  ----  -------------\n"
            "largest      12.5  so many of\n"
            "                   them at most\n"
            "unbreakable   1.0  é\n");
  EXPECT_EQ(to_text(table, 100), to_text(table));
  EXPECT_EQ(to_text(table, 1), to_text(table, 25));  // no narrower than the longest words
}

TEST(Table, TextSaysOnceWhatAllRowsShare) {
  Table table = example_table();
  table.columns.insert(table.columns.begin(), Column::text("set").folded());
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
  EXPECT_EQ(to_markdown(example_table()),
            "## T\n\nC\n\n"
            "| name  | x [m] |\n"
            "| :---- | ----: |\n"
            "| a,\"b\\| |  0.33 |\n"
            "| é     |     - |\n"
            "\nn\n");
}

TEST(Table, TextsOfStrangersAreOneLineWithoutControlCharacters) {
  Table table = example_table();
  table.rows[0][0] = std::string("a\nb\x1b[2J\xff<i>&amp;");
  EXPECT_NE(to_text(table).find("a b [2J\uFFFD<i>&amp;"), std::string::npos);
  EXPECT_NE(to_markdown(table).find("| a b [2J\uFFFD&lt;i>&amp;amp; |"), std::string::npos);
  EXPECT_EQ(markdown_text("p < 0.05 & q <3, A&B &#1; <!-- -->"),
            "p < 0.05 & q <3, A&amp;B &amp;#1; &lt;!-- -->");
  EXPECT_EQ(markdown_text("![x](http://x) $\\input$ [1, 2] (3) [own](#place)"),
            "![x&#93;(http://x) &#36;\\input&#36; [1, 2] (3) [own](#place)");
}

TEST(Table, CsvKeepsEveryDigitAndQuotes) {
  EXPECT_EQ(to_csv(example_table()), "name,x_m\n\"a,\"\"b|\",0.3333333333333333\né,\n");
}

TEST(Table, JsonLeavesOutEmptyCells) {
  EXPECT_EQ(rows_to_json_text(example_table()), json_text(rows_to_json(example_table())));
  EXPECT_EQ(rows_to_json_text(Table()), json_text(rows_to_json(Table())));
  EXPECT_EQ(rows_to_json(example_table()).dump(),
            R"([{"name":"a,\"b|","x_m":0.3333333333333333},{"name":"é"}])");
}

TEST(Table, RefusesWrongRows) {
  Table table = example_table();
  EXPECT_THROW(table.add_row({1.0}), InternalError);
  EXPECT_THROW(table.add_row({std::string("x"), NAN}), InternalError);
}

TEST(Table, FoldedColumnsAreStatedOnceAndEmptyOnesNotAtAll) {
  Table table;
  table.columns = {Column::text("set").folded(), Column::number("none", 1).folded(),
                   Column::number("some", 1).folded(), Column::number("x", 1)};
  table.add_row({"a", Cell(), 1.0, 1.0});
  table.add_row({"a", Cell(), Cell(), 1.0});
  const std::string text = to_text(table);
  EXPECT_TRUE(text.starts_with("set a\n")) << text;
  EXPECT_EQ(text.find("none"), std::string::npos);
  EXPECT_NE(text.find("some"), std::string::npos);
  EXPECT_NE(to_csv(table).find("none"), std::string::npos);
}

TEST(Table, ForPeopleARangeIsOneColumnAndFilesKeepBoth) {
  Table table;
  table.columns = {{"a", "a"}, {.key = "low", .title = "low", .range = "95 % interval"}, {"high", "high"}};
  table.add_row({1.0, 0.5, 1.5});
  table.add_row({2.0, Cell(), Cell()});
  EXPECT_EQ(to_text(table),
            "    a   95 % interval\n"
            "-----  --------------\n"
            "1.000  [0.500, 1.500]\n"
            "2.000               -\n");
  EXPECT_EQ(to_csv(table), "a,low,high\n1,0.5,1.5\n2,,\n");
}

TEST(Table, SignificantDigitsInsteadOfDecimals) {
  const Column column{.key = "x", .title = "x", .significant = 3};
  EXPECT_EQ(shown(Cell(0.00017812), column), "0.000178");
  EXPECT_EQ(shown(Cell(-51.227), column), "-51.2");
  EXPECT_EQ(shown(Cell(195.31), column), "195");
  EXPECT_EQ(shown(Cell(2431.0), column), "2431");
  EXPECT_EQ(shown(Cell(3.14159e-5), column), "0.0000314");
  EXPECT_EQ(shown(Cell(-1e-6), column), "0");  // rounding
  EXPECT_EQ(shown(Cell(-4.4e-14), column), "0");
  EXPECT_EQ(shown(Cell(0.0), column), "0");
}

TEST(Table, NumbersThatDifferLookDifferent) {
  const auto shown_levels = [](const std::vector<double>& levels) {
    Table table;
    table.columns = {Column::number("level", 3), Column::number("x", 1)};
    for (const double level : levels) table.add_row({level, level});
    const Table distinct = with_distinct(table, {"level"});
    EXPECT_EQ(distinct.columns[1].decimals, 1);
    std::vector<std::string> texts;
    for (const auto& row : distinct.rows) texts.push_back(shown(row[0], distinct.columns[0]));
    return texts;
  };
  using Texts = std::vector<std::string>;
  EXPECT_EQ(shown_levels({0.1, 0.2, 0.2}), (Texts{"0.100", "0.200", "0.200"}));
  EXPECT_EQ(shown_levels({0.1, 0.12345}), (Texts{"0.100", "0.123"}));
  EXPECT_EQ(shown_levels({1e-5, 1e-4, 0.01}), (Texts{"0.00001", "0.00010", "0.01000"}));
  EXPECT_EQ(shown_levels({1e-5, 0.01}), (Texts{"0.00001", "0.01000"})) << "not as 0";
  EXPECT_EQ(shown_levels({1, 1.0004}), (Texts{"1.0000", "1.0004"}));
  EXPECT_EQ(shown_levels({1, 1 + 1e-15}).front().size(), 14U) << "at most 12 decimals";
}

}  // namespace
}  // namespace sextant
