#include "sextant/eval/report/html/html.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/base/error.h"

namespace sextant {
namespace {

using testing::HasSubstr;
using testing::Not;

ReportDocument document_of(Table table) {
  ReportDocument document{.title = "Errors <of> \"everything\" & more", .abstract = "One paragraph."};
  document.verdicts = {{"Table III", "not reproduced", "0.005 against 0.012 m", "#mot_all"},
                       {"5 < 6", "reproduced", "5", ""}};
  Figure figure{.name = "line", .caption = "A 'line'"};
  figure.data.columns = {{"x", "x"}};
  figure.data.rows = {{1.0}, {2.0}};
  figure.script = "plot data using (column(\"x\")):(column(\"x\")) with lines notitle\n";
  document.sections = {{"first",
                        "First",
                        {"Text."},
                        {{"mot_all", std::move(table)}},
                        {figure},
                        {{"overlay", "A picture", "two cars", "\x89PNG"}}}};
  document.provenance = {{"version", "1"}};
  document.citation = citation();
  return document;
}

Table small_table() {
  Table table{"Errors", "", {Column::text("set").folded(), {"Et_m", "E_t [m]"}, Column::text("verdict")}};
  table.rows = {{"s18", 0.12345, "within"}, {"s18", Cell(), "outside"}};
  return table;
}

size_t count(const std::string& text, const std::string& part) {
  size_t n = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(Html, HasEveryPartOfTheDocumentEscaped) {
  const OutputFiles files = report_folder(document_of(small_table()), {});
  const std::string& html = files.at("report.html");
  for (const char* part :
       {"<h1>Errors &lt;of&gt; &quot;everything&quot; &amp; more</h1>", "<html lang=\"en\">",
        "1 not reproduced, 1 reproduced", "class=\"verdict differs\"", "<a href=\"#mot_all\">Table III</a>",
        "5 &lt; 6", "<p class=\"folded\">set s18</p>",
        "<td class=\"number\" data-value=\"0.12345\">0.123</td>", "<td class=\"number\">-</td>",
        "<th scope=\"col\" class=\"number\">E_t [m]</th>",
        "alt=\"two cars\" src=\"data:image/png;base64,iVBORw==\""})
    EXPECT_THAT(html, HasSubstr(part));
  EXPECT_THAT(html, HasSubstr("data:image/svg+xml;base64," + base64(files.at("figures/line.svg"))));
  EXPECT_THAT(html, HasSubstr("@inproceedings{zhang2020robust,"));
  EXPECT_EQ(report_folder(document_of(small_table()), {true, 2}), files);
}

TEST(Html, AVerdictLeadsToItsPartOfATableOnTheDetailsPage) {
  ReportDocument document = document_of(small_table());
  document.verdicts[0].group = "Claims";
  document.verdicts[0].link = "#mot_all-1";
  ReportSection& section = document.sections.front();
  section.tables.front().split_by = {"set"};
  section.is_detail = true;
  section.commands = {"sextant view 'a<b'"};
  const OutputFiles files = report_folder(document, {});
  EXPECT_THAT(files.at("report.html"), HasSubstr("<h3>Claims</h3>"));
  EXPECT_THAT(files.at("report.html"), HasSubstr("<a href=\"details.html#mot_all-1\">"));
  EXPECT_THAT(files.at("report.html"), Not(HasSubstr("data-value=\"0.12345\"")));
  EXPECT_EQ(count(files.at("details.html"), "<div id=\"mot_all-1\">"), 1U);
  EXPECT_THAT(files.at("details.html"), HasSubstr("<pre tabindex=\"0\">sextant view &#39;a&lt;b&#39;</pre>"));
}

TEST(Html, FiguresOfTheSameNameAreRenamed) {
  ReportDocument document = document_of(small_table());
  ReportSection& section = document.sections.front();
  section.figures.push_back(section.figures.front());
  const OutputFiles files = report_folder(document, {});
  EXPECT_TRUE(files.contains("figures/line.svg"));
  EXPECT_TRUE(files.contains("figures/line-2.svg"));
  EXPECT_EQ(report_page(document, 1), files.at("report.html"));
}

TEST(Html, AsksNothingOfTheNetwork) {
  const std::string html = report_folder(document_of(small_table()), {}).at("report.html");
  EXPECT_THAT(html, Not(HasSubstr("http:")));
  EXPECT_THAT(html, Not(HasSubstr("https:")));
  EXPECT_EQ(count(html, " src=\""), count(html, " src=\"data:"));
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
}

TEST(Html, TagsAreClosedInOrder) {
  const std::string html = report_folder(document_of(small_table()), {}).at("report.html");
  for (const char* tag : {"section", "table", "thead", "tbody", "tr",      "td",      "th",     "figure",
                          "ul",      "li",    "dl",    "main",  "header",  "nav",     "div",    "span",
                          "p",       "h1",    "h2",    "h3",    "details", "summary", "article"}) {
    const std::string name = tag;
    EXPECT_EQ(count(html, "<" + name + ">") + count(html, "<" + name + " "), count(html, "</" + name + ">"))
        << tag;
  }
}

TEST(Html, SplitTablesSayOnceInWhatTheirPartsAgree) {
  Table table = small_table();
  table.add_row({"vk", 1.0, "within"});
  ReportDocument document = document_of(table);
  document.sections.front().tables.front().split_by = {"set"};
  const OutputFiles files = report_folder(document, {});
  EXPECT_THAT(files.at("report.html"), HasSubstr("<p class=\"folded\">set vk</p>"));
  EXPECT_EQ(count(files.at("report.html"), "<table>"), 2U);
  EXPECT_EQ(count(files.at("tables/mot_all.csv"), "\n"), 4U);
}

TEST(Html, RecordsAreLinkedFromTheReportsFolder) {
  Table table;
  table.columns = {Column::text("records")};
  table.add_row({"parts/sets_replay/records.jsonl"});
  EXPECT_THAT(
      report_folder(document_of(table), {}).at("report.html"),
      HasSubstr("<td class=\"long\"><a "
                "href=\"../parts/sets_replay/records.jsonl\">parts/sets_replay/records.jsonl</a></td>"));
}

TEST(Html, Base64IsThatOfRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64(std::string("\0\xff\x80", 3)), "AP+A");
}

TEST(ReportFolder, HoldsTablesInFourFormatsAndFiguresInFive) {
  const OutputFiles files = report_folder(document_of(small_table()), {});
  for (const char* name :
       {"report.html", "report.md", "tables/mot_all.md", "tables/mot_all.tex", "tables/mot_all.csv",
        "tables/mot_all.json", "figures/line.svg", "figures/line.pdf", "figures/line.png", "figures/line.gp",
        "figures/line.csv", "pictures/overlay.png"}) {
    EXPECT_TRUE(files.contains(name)) << name;
  }
  EXPECT_EQ(report_folder(document_of(small_table()), {false, 1}).size(), 5U);
}

TEST(ReportFolder, RefusesANameTwiceAndOneThatIsNoFile) {
  ReportDocument document = document_of(small_table());
  document.sections.front().pictures.front().name = "mot_all";
  EXPECT_THROW(report_folder(document, {}), InternalError);
  document.sections.front().pictures.front().name = "../x";
  EXPECT_THROW(report_folder(document, {}), InternalError);
}

// Sequences "a b" and "a-b" have the same stem.
TEST(ReportFolder, FiguresOfTheSameStemAreBothThere) {
  ReportDocument document = document_of(small_table());
  std::vector<Figure>& figures = document.sections.front().figures;
  figures.push_back(figures.front());
  figures.back().data.rows.pop_back();
  const OutputFiles files = report_folder(document, {});
  ASSERT_TRUE(files.contains("figures/line-2.svg"));
  EXPECT_NE(files.at("figures/line-2.csv"), files.at("figures/line.csv"));
  EXPECT_NE(files.at("report.html").find("id=\"line-2\""), std::string::npos);
}

}  // namespace
}  // namespace sextant
