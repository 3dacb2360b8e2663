#include "sextant/eval/report/words.h"

#include <algorithm>

#include "sextant/base/status.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

std::string called(const std::vector<const Word*>& words) {
  std::string names;
  for (const Word* word : words) names += word->word + " ";
  return names;
}

TEST(Words, TheirTablesInTheDocumentationAreThoseOfTheList) {
  for (const auto& [kind, file] : {std::pair("word", "glossary.md"), std::pair("status", "metrics.md")}) {
    const std::string page = read_file(fs::path(SEXTANT_SOURCE) / "docs" / file);
    std::string table = fmt::format("| {} | meaning |\n|---|---|\n", kind);
    for (const Word& word : all_words()) {
      if (word.kind != kind) continue;
      const std::string name = word.kind == "status" ? "`" + word.word + "`" : word.word;
      table += fmt::format("| {} | {} |\n", name, word.meaning);
    }
    EXPECT_NE(page.find(table), std::string::npos) << "docs/" << file << ": its table has to be\n\n" << table;
  }
}

TEST(Words, HaveEveryStatusAndAMeaning) {
  for (const Word& word : all_words()) EXPECT_FALSE(word.word.empty() || word.meaning.empty()) << word.word;
  for (const std::string_view status : names_of(Status{})) {
    const auto found = explain(status);
    EXPECT_TRUE(std::ranges::any_of(found, [](const Word* w) { return w->kind == "status"; })) << status;
  }
}

TEST(Words, AreFoundByEveryNameThatTablesUse) {
  EXPECT_EQ(called(explain("E_t")), "errors.Et_m bound.Et_m ");
  EXPECT_THAT(called(explain("Et_m")), AllOf(HasSubstr("errors.Et_m"), HasSubstr("bound.Et_m")));
  EXPECT_EQ(called(explain("SPLIT NEES")), "values.split_nees ");
  for (const char* word :
       {"pair", "gated", "coverage", "preset", "E_R", "E_v", "NEES", "split_nees", "EPE", "paper", "floor"})
    EXPECT_FALSE(explain(word).empty()) << word;
}

TEST(Words, UnknownOnesNameTheNearest) {
  expect_error([] { explain("coverge"); }, "similar terms: coverage");
  expect_error([] { explain("split_nes"); }, "values.split_nees");
  expect_error([] { explain("<script>\n"); }, "is an unknown term");
}

}  // namespace
}  // namespace sextant
