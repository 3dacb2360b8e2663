#include "sextant/eval/diagnosis/hypothesis.h"

#include <gtest/gtest.h>

#include <limits>

namespace sextant {
namespace {

Reading reading(const std::string& code, double residual, double price = 0) {
  return {code, "it is " + code, "", residual, price};
}

TEST(HypothesisTexts, FactorsAreAboveOne) {
  EXPECT_EQ(factor_text(1.593), "too large by a factor 1.593");
  EXPECT_EQ(factor_text(0.6278), "too small by a factor 1.593");
  EXPECT_EQ(cause_text("depth is {factor}: wrong baseline?", 0.002762),
            "depth is too small by a factor 362.1: wrong baseline?");
  EXPECT_EQ(cause_text("about {:.4g} times the truth", 0.5), "about 0.5 times the truth");
}

TEST(Hypothesis, IsReportedFromFiveTimesOn) {
  EXPECT_FALSE(explain(1, {reading("a", 0.21)}));
  const auto found = explain(1, {reading("a", 0.2), reading("b", 0.9)});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->best.code, "a");
  EXPECT_DOUBLE_EQ(found->declared / found->best.residual, 5);
}

TEST(Hypothesis, MustAlsoBeatTheNullReading) {
  EXPECT_FALSE(explain(1, {reading("centimetres", 0.1)}, {.null = 0.1}));
  EXPECT_TRUE(explain(1, {reading("centimetres", 0.1)}, {.null = 0.6}));
}

TEST(Hypothesis, NegligibleResidualsNeedNone) {
  EXPECT_FALSE(explain(1e-9, {reading("a", 0)}, {.negligible = 1e-8}));
  EXPECT_FALSE(explain(0, {reading("a", 0)}));
  EXPECT_FALSE(explain(1, {}));
}

TEST(Hypothesis, ResidualsThatOverflowHaveNone) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(explain(infinity, {reading("a", infinity)}));
  EXPECT_FALSE(explain(infinity, {reading("a", 1)}));
}

TEST(Hypothesis, TheCheaperOfTwoThatExplainAlikeIsFirst) {
  const auto found = explain(1, {reading("a", 0.01, 1), reading("b", 0.015), reading("c", 0.1)});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->best.code, "b");
  ASSERT_EQ(found->alike.size(), 1u);
  EXPECT_EQ(message(*found, "log", "m"),
            "log: it is b (RMS residual 0.122 m read so, 1 m as declared); or: it is a");
}

TEST(Hypothesis, UndoChangesACopy) {
  const std::vector<Hypothesis<double>> hypotheses = {
      {"inverse", "the sign is wrong", "turn it", [](double& x, double&) { return x = -x, true; }},
      {"factor", "a factor of {:.0f}", "", [](double& x, double& f) { return f = x, x = 1, true; }, 0.5,
       true},
      {"never", "", "", [](double&, double&) { return false; }}};
  const double x = -1;
  const auto residual = [](double v) { return std::optional((v - 1) * (v - 1)); };
  const auto readings = read_as(hypotheses, x, residual);
  ASSERT_EQ(readings.size(), 2u);
  EXPECT_EQ(readings[0].residual, 0);
  EXPECT_EQ(readings[1].cause, "a factor of -1");
  EXPECT_EQ(x, -1);
  EXPECT_EQ(message(*explain(*residual(x), readings), "x", "m"),
            "x: the sign is wrong (RMS residual 0 m read so, 2 m as declared): turn it; or: a factor of -1");
}

}  // namespace
}  // namespace sextant
