#include <algorithm>
#include <set>

#include "sextant/datasets/codec/testing.h"
#include "sextant/datasets/dataset.h"

namespace sextant {
namespace {

class Adapters : public testing::TestWithParam<Adapter> {};

TEST_P(Adapters, IsDescribed) {
  const Adapter& adapter = GetParam();
  EXPECT_FALSE(adapter.name.empty());
  EXPECT_FALSE(adapter.description.empty());
  EXPECT_EQ(adapter.description.find('\n'), std::string::npos);
  EXPECT_FALSE(adapter.example.empty());
  for (const OptionHelp& option : adapter.options()) {
    EXPECT_FALSE(option.key.empty());
    EXPECT_FALSE(option.meaning.empty()) << option.key;
  }
}

TEST_P(Adapters, ExampleParses) {
  const SourceSpec spec = SourceSpec::parse(GetParam().example);
  EXPECT_EQ(spec.adapter, GetParam().name);
  EXPECT_FALSE(spec.path.empty());
}

TEST_P(Adapters, MissingPathIsAnErrorThatNamesIt) {
  SourceSpec spec = SourceSpec::parse(GetParam().example);
  spec.path = "/no/such/folder";
  expect_error([&] { open_source(spec); }, "/no/such/folder");
}

TEST_P(Adapters, UnknownOptionIsAnError) {
  SourceSpec spec = SourceSpec::parse(GetParam().example);
  spec.options["no_such_option"] = 1;
  expect_error([&] { open_source(spec); }, "no_such_option");
}

INSTANTIATE_TEST_SUITE_P(All, Adapters, testing::ValuesIn(adapters().begin(), adapters().end()),
                         [](const auto& test) {
                           std::string name = test.param.name;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(Registry, NamesAreUnique) {
  std::set<std::string> names;
  for (const Adapter& adapter : adapters()) EXPECT_TRUE(names.insert(adapter.name).second) << adapter.name;
}

TEST(Registry, UnknownAdapterSuggestsTheNearest) {
  expect_error([] { open_source(SourceSpec::parse("vod:demo")); },
               "unknown adapter 'vod': did you mean 'vdo'");
}

}  // namespace
}  // namespace sextant
