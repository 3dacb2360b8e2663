#include "sextant/datasets/dataset.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

TEST(SourceSpec, AllParts) {
  const SourceSpec spec = SourceSpec::parse("kitti:/data/kitti#0003@20-54");
  EXPECT_EQ(spec.text, "kitti:/data/kitti#0003@20-54");
  EXPECT_EQ(spec.adapter, "kitti");
  EXPECT_EQ(spec.path, "/data/kitti");
  EXPECT_EQ(spec.sequence, "0003");
  EXPECT_EQ(spec.first, 20);
  EXPECT_EQ(spec.last, 54);
}

TEST(SourceSpec, PathWithoutSequenceOrFrames) {
  const SourceSpec spec = SourceSpec::parse("vdo:demo");
  EXPECT_EQ(spec.path, "demo");
  EXPECT_EQ(spec.sequence, "");
  EXPECT_FALSE(spec.first.has_value());
  EXPECT_FALSE(spec.last.has_value());
}

TEST(SourceSpec, SequenceWithASlashAndPathWithSigns) {
  const SourceSpec spec = SourceSpec::parse("vkitti:/data@home/c:x#0018/clone@124-134");
  EXPECT_EQ(spec.path, "/data@home/c:x");
  EXPECT_EQ(spec.sequence, "0018/clone");
  EXPECT_EQ(spec.last, 134);
  EXPECT_EQ(SourceSpec::parse("vdo:/data@home/demo").path, "/data@home/demo");
  EXPECT_EQ(SourceSpec::parse("vdo:demo@home#2/").path, "demo@home#2/");
}

TEST(SourceSpec, OptionsOfOtherAdaptersAreCheckedToo) {
  SourceSpec spec = SourceSpec::parse("synthetic:s18");
  spec.add_options({{"rate_hz", 20}, {"kitti", {{"flow", "dis"}}}, {"synthetic", {{"every", 2}}}});
  EXPECT_EQ(spec.options, (Json{{"rate_hz", 20}, {"every", 2}}));
  expect_error(
      [&] {
        spec.add_options({{"kitti", {{"flwo", "dis"}}}});
      },
      "unknown option key 'source.kitti.flwo': did you mean 'flow'");
  expect_error([&] { spec.add_options({{"kitti", 1}}); }, "option source.kitti: expected an object");
}

TEST(SourceSpecErrors, ShowTheExpectedForm) {
  for (const char* text : {"", "demo", "/data/demo", ":demo", "vdo:", "vdo:demo#", "vdo:demo@", "vdo:demo@5",
                           "vdo:demo@-", "vdo:demo@3-", "vdo:demo@-3", "vdo:demo@a-b", "vdo:demo@1-2-3",
                           "vdo:demo@9-3", "vdo:demo@1.5-3", "vdo:demo@99999999999-3"}) {
    expect_error([&] { SourceSpec::parse(text); }, fmt::format("source '{}': ", text));
    expect_error([&] { SourceSpec::parse(text); }, "expected adapter:path[#sequence][@first-last]");
  }
}

}  // namespace

}  // namespace sextant
