#include "sextant/base/options.h"

#include <limits>

#include "sextant/base/testing.h"

namespace sextant {
namespace {

struct InnerOptions {
  SEXTANT_OPTIONS((int, max_iterations, 500, "count", "upper limit"),
                  (double, threshold_px, 0.4, "px", "largest error of an inlier"))
  void check() const { check_option(max_iterations > 0, "max_iterations", max_iterations, "> 0"); }
};

enum class Kernel { huber, tukey, none };
constexpr Names<3> names_of(Kernel) { return {"huber", "tukey", "none"}; }

struct OuterOptions {
  SEXTANT_OPTIONS((bool, robust, true, "", "use a kernel"), (uint64_t, seed, 7, "", "base seed"),
                  (Kernel, kernel, Kernel::huber, "", "of residuals"),
                  (InnerOptions, ransac, {}, "", "robust start"))
};

std::string error_with(const Json& json, const std::string& where = "") {
  OuterOptions options;
  return error_of([&] { read_options(json, options, where); });
}

TEST(ReadOptions, OverwritesOnlyNamedFields) {
  OuterOptions options;
  read_options(Json{{"robust", false}, {"ransac", {{"max_iterations", 10}}}}, options);
  EXPECT_FALSE(options.robust);
  EXPECT_EQ(options.ransac.max_iterations, 10);
  EXPECT_EQ(options.ransac.threshold_px, 0.4);
  EXPECT_EQ(options.seed, 7U);
  EXPECT_EQ(options.kernel, Kernel::huber);
}

TEST(ReadOptions, AnUnknownKeyNamesTheNearestAndItsPath) {
  EXPECT_THAT(error_with({{"kernal", "huber"}}),
              AllOf(HasSubstr("'kernal'"), HasSubstr("did you mean 'kernel'?")));
  EXPECT_THAT(error_with({{"ransac", {{"max_iteration", 3}}}}),
              AllOf(HasSubstr("'ransac.max_iteration'"), HasSubstr("did you mean 'max_iterations'?")));
  EXPECT_THAT(error_with({{"ransac", {{"max_iteration", 3}}}}, "pipeline"),
              HasSubstr("'pipeline.ransac.max_iteration'"));
}

TEST(ReadOptions, AnUnlikelyKeyListsTheKnownOnesOnly) {
  EXPECT_THAT(error_with({{"zzzzzz", 1}}),
              AllOf(HasSubstr("known: robust, seed, kernel, ransac"), Not(HasSubstr("did you mean"))));
}

TEST(ReadOptions, WrongTypesNamePathAndExpectation) {
  EXPECT_THAT(error_with({{"robust", 1}}),
              AllOf(HasSubstr("robust"), HasSubstr("true or false"), HasSubstr("got 1")));
  EXPECT_THAT(error_with({{"kernel", true}}), HasSubstr("a text"));
  EXPECT_THAT(error_with({{"seed", -1}}), HasSubstr("a non-negative integer"));
  EXPECT_THAT(error_with({{"seed", 1.5}}), HasSubstr("a non-negative integer"));
  EXPECT_THAT(error_with({{"ransac", 3}}), AllOf(HasSubstr("ransac"), HasSubstr("an object")));
  EXPECT_THAT(error_with({{"ransac", {{"max_iterations", 2.5}}}}),
              AllOf(HasSubstr("ransac.max_iterations"), HasSubstr("an integer")));
  EXPECT_THAT(error_with({{"ransac", {{"threshold_px", "0.4"}}}}), HasSubstr("a finite number"));
  EXPECT_THAT(error_with(Json::array()), HasSubstr("an object"));
  EXPECT_THAT(error_with({{"robust", nullptr}}), HasSubstr("true or false"));
}

TEST(ReadOptions, RefusesIntegersThatDoNotFit) {
  const auto with = [](const Json& n) { return error_with({{"ransac", {{"max_iterations", n}}}}); };
  EXPECT_THAT(with(int64_t{1} << 31), HasSubstr("a 32-bit integer"));
  EXPECT_THAT(with(-(int64_t{1} << 31) - 1), HasSubstr("a 32-bit integer"));
  // Above INT64_MAX a conversion to int64_t would wrap to a small negative number.
  EXPECT_THAT(with(std::numeric_limits<uint64_t>::max()), HasSubstr("a 32-bit integer"));
  EXPECT_THAT(with(std::numeric_limits<uint64_t>::max() - 4294967295U + 5), HasSubstr("a 32-bit integer"));
  EXPECT_EQ(with((int64_t{1} << 31) - 1), "no error");
}

TEST(ReadOptions, KeepsLargeSeedsExactly) {
  OuterOptions options;
  read_options(Json::parse(R"({"seed": 18446744073709551615})"), options);
  EXPECT_EQ(options.seed, std::numeric_limits<uint64_t>::max());
}

TEST(ReadOptions, RefusesNumbersThatAreNotFinite) {
  const auto with = [](double x) { return error_with({{"ransac", {{"threshold_px", x}}}}); };
  EXPECT_THAT(with(std::numeric_limits<double>::quiet_NaN()), HasSubstr("a finite number"));
  EXPECT_THAT(with(std::numeric_limits<double>::infinity()), HasSubstr("a finite number"));
  EXPECT_EQ(with(3.0), "no error");
}

TEST(ReadOptions, AcceptsAnIntegerForADouble) {
  OuterOptions options;
  read_options(Json::parse(R"({"ransac": {"threshold_px": 2}})"), options);
  EXPECT_EQ(options.ransac.threshold_px, 2.0);
}

TEST(ReadOptions, EnumerationsAreReadByName) {
  OuterOptions options;
  read_options(Json{{"kernel", "tukey"}}, options);
  EXPECT_EQ(options.kernel, Kernel::tukey);
  EXPECT_EQ(write_options(options)["kernel"], "tukey");
  EXPECT_EQ(error_with({{"kernel", "hubr"}}, "solver"),
            "option solver.kernel = hubr: did you mean 'huber'? known: huber, tukey, none");
}

TEST(ReadOptions, RunsTheStructsOwnCheck) {
  EXPECT_THAT(error_with({{"ransac", {{"max_iterations", 0}}}}),
              HasSubstr("max_iterations = 0: must be > 0"));
}

TEST(WriteOptions, RoundTripsThroughText) {
  OuterOptions options{.seed = std::numeric_limits<uint64_t>::max(), .kernel = Kernel::none};
  options.ransac.threshold_px = 0.1 + 0.2;
  OuterOptions read;
  read_options(Json::parse(write_options(options).dump()), read);
  EXPECT_EQ(write_options(read), write_options(options));
  EXPECT_EQ(read.ransac.threshold_px, options.ransac.threshold_px);
}

struct MapOptions {
  std::map<std::string, InnerOptions> stages;
  void visit(auto& v) { v("stages", stages, "", "by name"); }
};

TEST(OptionMaps, ReadWriteAndDescribeEveryEntryStrictly) {
  MapOptions options;
  options.stages["old"] = {};
  read_options(Json::parse(R"({"stages": {"a": {"max_iterations": 3}, "b": {}}})"), options);
  ASSERT_EQ(options.stages.size(), 2U);
  EXPECT_EQ(options.stages.at("a").max_iterations, 3);
  EXPECT_EQ(options.stages.at("b").max_iterations, 500);
  EXPECT_EQ(write_options(options)["stages"]["a"]["threshold_px"], 0.4);
  MapOptions again;
  read_options(write_options(options), again);
  EXPECT_EQ(write_options(again), write_options(options));
  EXPECT_EQ(describe_options(MapOptions{})[0].key, "stages.NAME.max_iterations");
}

TEST(OptionMaps, ErrorsNameThePath) {
  const auto message = [](const char* text) {
    MapOptions options;
    return error_of([&] { read_options(Json::parse(text), options, "x"); });
  };
  EXPECT_THAT(message(R"({"stages": {"a": {"max_iteration": 3}}})"), HasSubstr("'x.stages.a.max_iteration'"));
  EXPECT_THAT(message(R"({"stages": {"a": 1}})"), AllOf(HasSubstr("x.stages.a"), HasSubstr("an object")));
  EXPECT_THAT(message(R"({"stages": []})"), AllOf(HasSubstr("x.stages"), HasSubstr("an object")));
  EXPECT_THAT(message(R"({"stages": {"a": {"max_iterations": 0}}})"),
              HasSubstr("option x.stages.a.max_iterations = 0: must be > 0"));
}

TEST(DescribeOptions, ListsEveryLeafWithItsPathDefaultAndUnit) {
  const std::vector<OptionHelp> lines = describe_options(OuterOptions{});
  ASSERT_EQ(lines.size(), 5U);
  EXPECT_EQ(lines[0].key, "robust");
  EXPECT_EQ(lines[0].default_value, "true");
  EXPECT_EQ(lines[2].default_value, "\"huber\"");
  EXPECT_EQ(lines[2].meaning, "of residuals: huber, tukey or none");
  EXPECT_EQ(lines[4].key, "ransac.threshold_px");
  EXPECT_EQ(lines[4].default_value, "0.4");
  EXPECT_EQ(lines[4].unit, "px");
  EXPECT_EQ(lines[4].meaning, "largest error of an inlier");
  EXPECT_EQ(describe_options(InnerOptions{}, "a.b")[0].key, "a.b.max_iterations");
}

}  // namespace
}  // namespace sextant
