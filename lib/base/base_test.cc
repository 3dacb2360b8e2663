// Tests of the small headers of this folder: error, names, text.

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/names.h"
#include "sextant/base/status.h"
#include "sextant/base/testing.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

TEST(Fail, ThrowsAFormattedError) {
  EXPECT_EQ(error_of([] { fail("{}:{}: expected {}", "poses.txt", 3, "16 numbers"); }),
            "poses.txt:3: expected 16 numbers");
}

TEST(Check, NamesConditionAndPlace) {
  try {
    SEXTANT_CHECK(1 + 1 == 3);
    FAIL() << "not thrown";
  } catch (const InternalError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("1 + 1 == 3"), HasSubstr("base_test.cc:")));
  }
  EXPECT_NO_THROW(SEXTANT_CHECK(true));
}

struct Entry {
  std::string name;
  int value;
};
const std::array<Entry, 2> table = {Entry{"motion_only", 1}, Entry{"joint_flow", 2}};

TEST(Registry, FindsByName) { EXPECT_EQ(find_entry<Entry>(table, "joint_flow", "estimator").value, 2); }

TEST(Registry, AnUnknownNameListsTheNearestAndAll) {
  EXPECT_EQ(error_of([] { find_entry<Entry>(table, "join_flow", "estimator"); }),
            "unknown estimator 'join_flow': did you mean 'joint_flow'? known: motion_only, joint_flow");
}

TEST(NumberIn, TakesTheWholeTextOrNothing) {
  EXPECT_EQ(number_in("+2.5"), 2.5);
  EXPECT_EQ(number_in("-3e2"), -300);
  for (const char* none : {"", "+", "1x", " 1", "0x10", "++1", "+-1", "-+1"})
    EXPECT_FALSE(number_in(none)) << none;
  EXPECT_EQ(number_in("1e-400"), 0);
  EXPECT_EQ(number_in("0." + std::string(400, '0') + "1"), 0);
  EXPECT_EQ(number_in("-1e400"), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(number_in(std::string(400, '9') + ".5"), std::numeric_limits<double>::infinity());
}

TEST(Trimmed, TakesBlanksFromTheEnds) {
  EXPECT_EQ(trimmed(" \t a b\r"), "a b");
  EXPECT_EQ(trimmed(" \r"), "");
  EXPECT_TRUE(is_digits("0012"));
  EXPECT_FALSE(is_digits("") || is_digits("-1"));
}

TEST(Names, EveryNameRoundTrips) {
  for (const Status status :
       {Status::ok, Status::no_truth, Status::not_detected, Status::lost, Status::diverged,
        Status::too_few_points, Status::gated, Status::collinear, Status::at_infinity, Status::no_parallax}) {
    EXPECT_EQ(from_name<Status>(to_string(status), "status"), status);
  }
  EXPECT_EQ(to_string(Status::no_parallax), "no_parallax");
  EXPECT_EQ(to_string(Gate::is_static), "static");
}

TEST(Names, AnUnknownOneListsTheNearestAndAll) {
  EXPECT_EQ(error_of([] { from_name<Gate>("distence", "gate"); }),
            "unknown gate 'distence': did you mean 'distance'? known: none, distance, area, static");
  EXPECT_EQ(find_name<Gate>("Area"), std::nullopt);
}

TEST(EditDistance, KnownValues) {
  EXPECT_EQ(edit_distance("", ""), 0);
  EXPECT_EQ(edit_distance("abc", ""), 3);
  EXPECT_EQ(edit_distance("", "abc"), 3);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("flaw", "lawn"), 2);
  EXPECT_EQ(edit_distance("same", "same"), 0);
}

TEST(EditDistance, IsSymmetric) {
  EXPECT_EQ(edit_distance("intention", "execution"), 5);
  EXPECT_EQ(edit_distance("execution", "intention"), 5);
}

TEST(NearestName, IsEmptyWhenNothingIsNear) {
  const std::vector<std::string> names = {"alpha", "beta"};
  EXPECT_EQ(nearest_name("alpa", names), "alpha");
  EXPECT_EQ(nearest_name("gamma-ray", names), "");
  EXPECT_EQ(nearest_name("x", {}), "");
}

TEST(NearestName, MayLackItsUnit) {
  const std::vector<std::string> names = {"delta_d_px", "epe_px"};
  EXPECT_EQ(nearest_name("epe", names), "epe_px");
  EXPECT_EQ(nearest_name("delta_d", names), "delta_d_px");
  EXPECT_EQ(nearest_name("", names), "");
}

TEST(Suggest, ListsTheKnownNames) {
  const std::vector<std::string> names = {"alpha", "beta"};
  EXPECT_EQ(suggest("btea", names), "did you mean 'beta'? known: alpha, beta");
  EXPECT_EQ(suggest("nothing-like-it", names), "known: alpha, beta");
}

TEST(Split, KeepsEmptyPieces) {
  EXPECT_THAT(split("a,b,,c,", ','), ElementsAre("a", "b", "", "c", ""));
  EXPECT_THAT(split("", ','), ElementsAre(""));
  EXPECT_THAT(split("abc", ','), ElementsAre("abc"));
}

TEST(Replaced, ReplacesEveryOccurrenceOnce) {
  EXPECT_EQ(replaced("a|b||", "|", "\\|"), "a\\|b\\|\\|");
  EXPECT_EQ(replaced("]]]>", "]]>", "]] >"), "]]] >");
  EXPECT_EQ(replaced("none", "x", "y"), "none");
}

TEST(AddDistinct, KeepsTheOrderOfFirstAppearance) {
  std::vector<std::string> list;
  for (const char* text : {"b", "a", "b", "c", "a"}) add_distinct(text, list);
  EXPECT_THAT(list, ElementsAre("b", "a", "c"));
}

TEST(Text, Utf8IsTheShortestForm) {
  EXPECT_TRUE(is_utf8(""));
  EXPECT_TRUE(is_utf8("a\u00e9\u0394\U0001F600"));
  for (const char* text :
       {"\xff", "a\x80", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe2\x82"})
    EXPECT_FALSE(is_utf8(text)) << text;
}

TEST(Text, PageTextIsValidXml) {
  EXPECT_EQ(page_text("a\n\t\u0394"), "a\n\t\u0394");
  EXPECT_EQ(page_text("a\x01\uFFFE\uFFFF\xff"), "a\uFFFD\uFFFD\uFFFD\uFFFD");
}

TEST(Text, DirectionsAreShownAsCodePoints) {
  EXPECT_EQ(one_line("a\u202eb\u2069"), "aU+202EbU+2069");
  EXPECT_EQ(page_text("\u202a\u2066"), "U+202AU+2066");
  EXPECT_EQ(with_directions_shown("\u2029\u202f\u2065\u206a\xe2"), "\u2029\u202f\u2065\u206a\xe2");
}

TEST(Text, SpreadsheetFieldsAreNoFormulas) {
  for (const char* formula : {"=1+2", "+a", "-a", "@SUM(1)", "\t1", "\r1"})
    EXPECT_EQ(spreadsheet_field(formula), fmt::format("\"'{}\"", formula));
  EXPECT_EQ(spreadsheet_field("=a,\"b\""), "\"'=a,\"\"b\"\"\"");
  for (const char* plain : {"-1.5", "+2", "a=b", "-1e-3", ""}) EXPECT_EQ(spreadsheet_field(plain), plain);
  EXPECT_EQ(spreadsheet_field("a,b"), "\"a,b\"");
}

TEST(Text, OneLineHasNoControlCharacters) {
  EXPECT_EQ(one_line("a\nb\r\tc\x1b[2J\x7f\u0085"), "a b  c [2J  ");
  EXPECT_EQ(one_line("\u0394\xe2\x82"), "\u0394\uFFFD\uFFFD");
}

}  // namespace
}  // namespace sextant
