#include "sextant/eval/report/paper/paper_layout.h"

#include "sextant/base/testing.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/eval/report/latex.h"
#include "sextant/eval/report/tables/testing.h"
#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

std::vector<PublishedTable> long_tables(const Evidence& evidence) {
  std::vector<PublishedTable> tables;
  for (const PaperTable& entry : paper_tables())
    if (entry.published) tables.push_back(entry.published(evidence));
  return tables;
}

const std::vector<PaperLayout>& layouts() {
  static const std::vector<PaperLayout> layouts = paper_layouts(long_tables(test_evidence()));
  return layouts;
}

/// Every value of every version of a table.
template <typename Visit>
void for_each_value(const PaperLayout& layout, const Visit& visit) {
  for (const LayoutVersion& version : layout.versions)
    for (const LayoutRow& row : version.rows)
      for (const LayoutCell& cell : row.cells)
        for (const LayoutValue& value : cell) visit(row, value);
}

size_t count(const std::string& text, const std::string& word) {
  size_t n = 0;
  for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + word.size())) ++n;
  return n;
}

TEST(PaperLayout, EveryNumberIsThatOfTheLongTableToTheLastDigit) {
  const std::vector<PublishedTable> tables = long_tables(test_evidence());
  size_t n_measured = 0, n_published = 0;
  for (const PaperLayout& layout : layouts()) {
    const auto table = std::ranges::find(tables, layout.number, &PublishedTable::number);
    const Json rows = rows_to_json(table->table());
    for_each_value(layout, [&](const LayoutRow& row, const LayoutValue& value) {
      const auto is_in = [&](const char* key, double number, double factor) {
        return std::ranges::any_of(rows, [&](const Json& r) {
          return r.contains(key) && factor * r.at(key).get<double>() == number &&
                 (value.data.empty() || key == std::string("published") || r.at("data") == value.data);
        });
      };
      if (value.measured) {
        EXPECT_TRUE(is_in("reproduced", value.measured->value, value.factor))
            << layout.number << " " << row.name;
        ++n_measured;
      }
      if (value.published) {
        EXPECT_TRUE(is_in("published", *value.published, 1)) << layout.number << " " << row.name;
        ++n_published;
      }
    });
  }
  EXPECT_GT(n_measured, 20U);
  EXPECT_GE(n_published, 108U) << "with the rows that give values of the paper a second time";
}

TEST(PaperLayout, HasEveryNumberThatThePaperPrints) {
  // Cells of tables I to V, counted in the paper; a cell "117/1266" has two numbers. Two cells of table
  // II are dashes.
  const std::map<std::string, size_t> printed = {{"I", 25}, {"II", 14}, {"III", 20}, {"IV", 4}, {"V", 33}};
  for (const PaperLayout& layout : layouts()) {
    size_t n = 0;
    for (const LayoutRow& row : layout.versions.front().rows) {
      if (!row.in_terminal || row.name.find("std. dev.") != std::string::npos) continue;
      for (const LayoutCell& cell : row.cells)
        for (const LayoutValue& value : cell) n += value.published.has_value();
    }
    EXPECT_EQ(n, printed.at(layout.number)) << layout.number;
  }
}

TEST(PaperLayout, VerdictsNameTheDataAndWhatIsNotComparable) {
  std::set<std::string> verdicts;
  for (const PaperLayout& layout : layouts()) {
    for_each_value(layout, [&](const LayoutRow& row, const LayoutValue& value) {
      if (value.published) verdicts.insert(value.verdict);
      EXPECT_EQ(value.verdict == "not comparable", !value.reason.empty()) << layout.number << " " << row.name;
      if (row.name == "Total Detection" && value.measured) {
        EXPECT_EQ(value.verdict, "not comparable");
      }
      if (row.name == "Num. of Tracks" && value.measured) {
        EXPECT_EQ(value.verdict, "not comparable");
      }
    });
  }
  EXPECT_TRUE(verdicts.contains("outside, on a scenario"));
  EXPECT_TRUE(verdicts.contains("not measured here"));
}

TEST(PaperLayout, LongTablesAgreeOnWhatIsNotComparable) {
  const std::vector<PublishedTable> tables = long_tables(test_evidence());
  std::set<std::string> found;
  for (const PaperLayout& layout : layouts()) {
    const PublishedTable& table = *std::ranges::find(tables, layout.number, &PublishedTable::number);
    const std::vector<std::string> notes = table.table().notes;
    for_each_value(layout, [&](const LayoutRow&, const LayoutValue& value) {
      if (!value.measured || !value.published || value.factor != 1) return;
      for (const PaperRow& row : table.rows) {
        const bool is_shown = row.measured && row.published == value.published && row.data == value.data &&
                              row.measured->value == value.measured->value;
        if (!is_shown) continue;
        const bool is_share = !value.rate_of.empty();
        EXPECT_EQ(row.verdict() == "not comparable", is_share || value.verdict == "not comparable")
            << layout.number << " " << row.quantity;
        if (row.verdict() != "not comparable") continue;
        EXPECT_THAT(notes, testing::Contains(HasSubstr(is_share ? "share" : value.reason)));
        found.insert(layout.number);
      }
    });
  }
  EXPECT_THAT(found, testing::IsSupersetOf({"I", "II", "V"}));
}

TEST(PaperLayout, RatesOfCountsAreJudged) {
  const PaperLayout& table = layouts().front();
  const LayoutRow& row = table.versions.front().rows.at(3);  // false negative
  ASSERT_EQ(row.name, "False Negative");
  const LayoutValue& value = row.cells.at(1).front();  // sequence 02
  ASSERT_TRUE(value.measured && value.rate && value.published_rate);
  EXPECT_EQ(*value.rate, 0);  // the test's records are all right
  EXPECT_EQ(*value.published_rate, 0);
  EXPECT_EQ(value.verdict, "within, on a replay of the true motions");
}

TEST(PaperLayout, BothReadingsOfTheFlowErrorStandInTheTable) {
  const LayoutVersion& version = layouts().at(1).versions.front();
  const LayoutValue& mean_error = version.rows.at(2).cells.at(1).front();
  const LayoutValue& deviation = version.rows.at(4).cells.at(1).front();
  ASSERT_TRUE(mean_error.measured && deviation.measured);
  EXPECT_EQ(mean_error.verdict, "not comparable");
  EXPECT_NEAR(deviation.measured->value, mean_error.measured->value * std::sqrt(M_PI / 2), 1e-12);
  EXPECT_THAT(deviation.verdict, HasSubstr("on a scenario"));
}

TEST(PaperLayout, FitsATerminal) {
  std::string all;
  for (const PaperLayout& layout : layouts()) all += to_text(layout, false);
  all += text_legend();
  EXPECT_LE(std::ranges::count(all, '\n'), 70);
  std::istringstream lines(all);
  for (std::string line; std::getline(lines, line);)
    EXPECT_LE(std::ranges::count_if(line, [](char c) { return (c & 0xC0) != 0x80; }), 100) << line;
}

TEST(PaperLayout, JsonIsFoundByTheNamesOfThePaper) {
  const Json table = to_json(layouts().at(2));
  const Json& value = table.at("rows").at("S18-F124-134 Ego").at("Joint E_t (m)");
  EXPECT_EQ(value.at("published"), 0.0052);
  EXPECT_TRUE(value.contains("measured"));
  EXPECT_EQ(to_json(layouts().front()).at("rows").at("Dynamic/Static").at("01").at("Static").at("published"),
            1266);
}

TEST(PaperLayout, LatexCompilesAlone) {
  for (const PaperLayout& layout : layouts()) {
    const std::optional<Compiled> page = compile_latex_document(to_latex(layout));
    if (!page) GTEST_SKIP() << no_pdflatex;
    EXPECT_TRUE(page->ok) << layout.number << "\n" << page->words;
    EXPECT_EQ(page->words.find("Overfull"), std::string::npos) << layout.number << "\n" << page->words;
  }
}

TEST(PaperLayout, PagesHaveEveryTableAndEscapeTexts) {
  PaperLayout hostile = layouts().front();
  hostile.title = "<script>alert(1)</script>";
  const Fragment fragment = paper_fragment({hostile, layouts().at(1)});
  EXPECT_EQ(fragment.html.find("<script>"), std::string::npos);
  EXPECT_EQ(count(fragment.html, "<section class=\"paper-table"), 2U);
  const std::string page = paper_page("title", "answer", layouts(), {}, {});
  EXPECT_EQ(count(page, "<table>"), 5U);
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_LT(page.find("Table I:"), page.find("Table II:"));
}

}  // namespace
}  // namespace sextant
