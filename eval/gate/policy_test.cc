#include "sextant/eval/gate/policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

using ::testing::HasSubstr;

Policy policy_of(const std::string& text) {
  const TempFolder temp;
  const std::string file = (temp.path() / "policy.json").string();
  write_file(file, text);
  return read_policy(file);
}

TEST(Policy, IsReadStrictly) {
  const auto message = [](const std::string& text) { return error_of([&] { policy_of(text); }); };
  EXPECT_EQ(message(write_options(Policy()).dump()), "no error");
  EXPECT_EQ(message(R"({"accuracy":{"metrics":{"Et_m":{"minimum_effect":0.02}}}})"), "no error");
  EXPECT_THAT(message(R"({"accuracy":{"default":{"minimum_efect":1}}})"), HasSubstr("minimum_effect"));
  EXPECT_THAT(message(R"({"accuracy":{"default":{"direction":"up"}}})"),
              HasSubstr("known: lower, higher, ignore"));
  EXPECT_THAT(message(R"({"same":{"machine":"maybe"}})"), HasSubstr("known: must, note"));
  EXPECT_THAT(message(R"({"speed":{"alpha":2}})"), HasSubstr("alpha"));
  EXPECT_THAT(message("{"), HasSubstr("not valid JSON"));
  for (const char* percent :
       {R"({"accuracy":{"default":{"minimum_effect":5}}})",
        R"({"accuracy":{"metrics":{"Et_m":{"minimum_effect":5}}}})", R"({"speed":{"minimum_effect":5}})"})
    EXPECT_THAT(message(percent), HasSubstr("minimum_effect = 5: must be a share from 0 to 1")) << percent;
}

TEST(Policy, AnEntryOfMetricsStartsFromTheDefault) {
  const AccuracyPolicy policy =
      policy_of(R"({"accuracy": {"metrics": {"Et_m": {"absolute": 1e-7}, "epe_initial_px": {"relative": 0}},
                                 "default": {"minimum_effect": 0, "relative": 1e-3}}})")
          .accuracy;
  EXPECT_EQ(policy.of("Et_m").absolute, 1e-7);
  EXPECT_EQ(policy.of("Et_m").minimum_effect, 0);
  EXPECT_EQ(policy.of("Et_m").relative, 1e-3);
  // Errors of the measurements are not judged, unless an entry says so.
  EXPECT_EQ(policy.of("epe_initial_px").relative, 0);
  EXPECT_EQ(policy.of("epe_initial_px").direction, Direction::ignore);
}

TEST(Policy, AMisspeltErrorIsRefusedButNotAnErrorOfThirdPartyRecords) {
  try {
    policy_of(R"({"accuracy": {"metrics": {"Et": {"minimum_effect": 0}}}})");
    ADD_FAILURE() << "read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("policy.json: option accuracy.metrics: unknown error 'Et': did you mean 'Et_m'"));
  }
  const Policy policy =
      policy_of(R"({"accuracy": {"metrics": {"altitude_drift_m": {"minimum_effect": 0.5}}}})");
  EXPECT_EQ(policy.accuracy.of("altitude_drift_m").minimum_effect, 0.5);
}

}  // namespace
}  // namespace sextant
