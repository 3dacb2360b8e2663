#include "sextant/eval/report/document.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sextant {
namespace {

using testing::HasSubstr;

TEST(Document, WordsOfVerdictsHaveATone) {
  EXPECT_EQ(tone_of("reproduced"), Tone::agrees);
  EXPECT_EQ(tone_of("within"), Tone::agrees);
  EXPECT_EQ(tone_of("not reproduced"), Tone::differs);
  EXPECT_EQ(tone_of("outside"), Tone::differs);
  EXPECT_EQ(tone_of("undecided"), Tone::open);
  EXPECT_EQ(tone_of("not measured here"), Tone::open);
}

TEST(Document, SeveralVerdictsAreOneOnlyWhereAllAgree) {
  EXPECT_EQ(joint_verdict({"within", "within"}), "within");
  EXPECT_EQ(joint_verdict({"within", "outside"}), "partly");
  EXPECT_EQ(joint_verdict({}), "not measured here");
}

TEST(Document, MarkdownHasSummarySectionsAndCitation) {
  ReportDocument document{.title = "T", .abstract = "A."};
  document.verdicts = {{"claim", "reproduced", "5 | 6", "#x"}};
  document.sections = {{"x", "Heading", {"Words."}, {}, {}, {{"p", "caption", "alt", ""}}}};
  document.provenance = {{"version", "1"}};
  document.citation = "@misc{x}\n";
  const std::string text = to_markdown(document);
  for (const char* part : {"# T\n\nA.\n\n## Summary\n\n1 reproduced.\n", "[claim](#x)", "5 \\| 6",
                           "## Heading\n\nWords.\n\n![alt](pictures/p.png)\n\n*caption*\n",
                           "- **version**: 1\n", "```bibtex\n@misc{x}\n```\n"})
    EXPECT_THAT(text, HasSubstr(part));
}

TEST(Document, MarkdownHoldsNoHtmlAndNoLinesOfStrangers) {
  ReportDocument document;
  document.title = document.abstract = "<img src=x>\n\n# Heading";
  document.provenance = {{"<b>", "x\n- **y**: <script>"}};
  ReportSection section{"section", "<i>\nheading", {"<u>\nparagraph"}, {}, {}, {}};
  section.pictures = {{"picture", "</a>\ncaption", "](javascript:1) ![", "png"}};
  document.sections = {section};
  const std::string text = to_markdown(document);
  for (const char* html :
       {"<img", "<b>", "<script", "<i>", "<u>", "</a>\ncaption", "\n# Heading", "\n- **y**", "[](java"})
    EXPECT_EQ(text.find(html), std::string::npos) << html << "\n" << text;
  EXPECT_NE(text.find("![&#93;(javascript:1) !\\[](pictures/picture.png)"), std::string::npos) << text;
}

TEST(Document, ShellWordsAreOneWord) {
  EXPECT_EQ(shell_word("vdo:kitti_03_demo@0-19"), "vdo:kitti_03_demo@0-19");
  EXPECT_EQ(shell_word("kitti:ROOT#0003"), "kitti:ROOT#0003");
  EXPECT_EQ(shell_word(""), "''");
  EXPECT_EQ(shell_word("#0"), "'#0'");
  EXPECT_EQ(shell_word("a b"), "'a b'");
  EXPECT_EQ(shell_word("it's $(x)"), "'it'\\''s $(x)'");
}

}  // namespace
}  // namespace sextant
