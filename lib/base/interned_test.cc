#include "sextant/base/interned.h"

#include <gtest/gtest.h>

#include <set>

#include "sextant/base/machine.h"

namespace sextant {
namespace {

TEST(Interned, EqualTextsAreStoredOnce) {
  const Interned a = "Et_m", b = std::string("Et_m"), other = "Et_body_m";
  EXPECT_EQ(a, b);
  EXPECT_EQ(&a.str(), &b.str());
  EXPECT_FALSE(a == other);
  EXPECT_EQ(a, "Et_m");
  EXPECT_EQ(fmt::format("{:>6}", a), "  Et_m");
  EXPECT_TRUE(Interned().empty());
  EXPECT_EQ(Interned(), "");
  EXPECT_EQ(sizeof(Interned), sizeof(void*));
}

TEST(Interned, IsOrderedLikeTheTexts) {
  EXPECT_TRUE(Interned("ER_deg") < Interned("Et_m"));
  EXPECT_FALSE(Interned("Et_m") < Interned("Et_m"));
}

/// Several threads intern more texts than the cache of a thread can contain; all texts have the same
/// beginning, end and length.
TEST(Interned, ManyTextsOfManyThreads) {
  constexpr int n = 5000;
  std::vector<std::set<const std::string*>> of_thread(4);
  parallel_for(4, 4, [&](int t) {
    for (int i = 0; i < n; ++i) {
      const std::string text = fmt::format("beginning {:06} the same end", i);
      const Interned interned = text;
      EXPECT_EQ(interned.str(), text);
      of_thread[static_cast<size_t>(t)].insert(&interned.str());
    }
  });
  for (const auto& texts : of_thread) {
    EXPECT_EQ(texts.size(), static_cast<size_t>(n));
    EXPECT_EQ(texts, of_thread.front());
  }
}

}  // namespace
}  // namespace sextant
