// Folders of several runs that are read as one sweep: which are refused, and which are named.

#include "sextant/base/testing.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/testing.h"
#include "sextant/eval/report/noise_sweep.h"
#include "sextant/noise/noise.h"

namespace sextant {
namespace {

/// A folder of one case, like that of a run.
fs::path write_case(const TempFolder& temp, const std::string& name, uint64_t seed, const Json& configuration,
                    const Json& more = Json::object()) {
  Record record = RecordOf{"d", "s", "a", "ego", "", 1, seed, 1};
  record.errors = {{"Et_m", 0.1}, {"ER_deg", 0.2}};
  record.noise = Noise(configuration.at("noise")).name();
  fs::create_directories(temp.path() / name);
  write_file(temp.path() / name / "records.jsonl", write_records({record}));
  Json run = more;
  run["configuration"] = configuration;
  write_file(temp.path() / name / "run.json", run.dump());
  return temp.path() / name;
}

TEST(PooledFolders, OneLabelStandsForOneSetOfOptions) {
  const TempFolder temp;
  const auto configured = [](double share, int least_points) {
    const Json noise = {{"flow", {{"epe_px", 0.5}}},
                        {"correlation", {{"model", "spatial"}, {"lengths_px", {60}}, {"shares", {share}}}}};
    return Json{{"estimator", "a"},
                {"level", 1},
                {"noise", Noise(noise).options()},
                {"options", {{"pipeline", {{"min_object_points", least_points}}}}}};
  };
  const fs::path first = write_case(temp, "first", 0, configured(0.1, 30));
  EXPECT_EQ(read_noise_sweeps({first, write_case(temp, "same", 1, configured(0.1, 30))}).size(), 1U);
  expect_error(
      [&] {
        read_noise_sweeps({first, write_case(temp, "share", 1, configured(1, 30))});
      },
      "noise 'flow 0.5 px (spatial 60 px)' has correlation.shares = [1.0], but [0.1]");
  expect_error(
      [&] {
        read_noise_sweeps({first, write_case(temp, "points", 1, configured(0.1, 460))});
      },
      "estimator 'a' has pipeline.min_object_points = 460, but 30");
  Json older = configured(0.1, 30);
  older["options"]["pipeline"] = {{"min_object_area", 0.005}};
  EXPECT_EQ(read_noise_sweeps({first, write_case(temp, "older", 1, older)}).size(), 1U)
      << "an option that only one of the versions has";
}

TEST(PooledFolders, OneLabelStandsForOneProgramAndSetOfData) {
  const TempFolder temp;
  const Json none = Json::object();
  const auto configured = [&](const Json& source_options) {
    return Json{{"estimators", {{{"name", "external:a.json"}, {"label", "a"}, {"options", none}}}},
                {"sources", {{{"source", "vdo:/data/s18"}, {"options", source_options}}}},
                {"noise", none}};
  };
  const auto made_of = [](const std::string& script, const std::string& depth, const char* folder = "/data") {
    const std::string file = fmt::format("{}/s18/depth/0.png", folder);
    return Json{
        {fingerprints_key, fingerprints_json({{"a", {Fingerprint{{{"a.py", script}}, {}}}}})},
        {"sources",
         {{{"source", fmt::format("vdo:{}/s18", folder)}, {"inputs", {{file, {{"sha256", depth}}}}}}}}};
  };
  uint64_t seed = 0;
  const auto folder = [&](const Json& source_options, const Json& more) {
    ++seed;
    return write_case(temp, fmt::format("{}", seed), seed, configured(source_options), more);
  };
  const fs::path first = folder(none, made_of("v1", "d1"));
  const auto refusal = [&](const Json& source_options, const Json& more) {
    const fs::path other = folder(source_options, more);
    const std::string message = error_of([&] { read_noise_sweeps({first, other}); });
    if (message != "no error") {
      EXPECT_THAT(message, HasSubstr((first / "run.json").string()));
      EXPECT_THAT(message, HasSubstr((other / "run.json").string()));
      EXPECT_THAT(message, HasSubstr("compare the folders (sextant compare), or report them apart"));
    }
    return message;
  };
  EXPECT_EQ(refusal(none, made_of("v1", "d1", "/moved")), "no error");
  EXPECT_EQ(refusal(none, none), "no error") << "a folder that does not state them";
  EXPECT_THAT(refusal(none, made_of("v2", "d1")), HasSubstr("another version of 'a' ran than in"));
  EXPECT_THAT(refusal(none, made_of("v2", "d1")), HasSubstr("(a.py changed)"));
  EXPECT_THAT(refusal(none, made_of("v1", "d2")), HasSubstr("(vdo:s18 depth/0.png)"));
  EXPECT_THAT(refusal({{"flow", "dis"}}, made_of("v1", "d1")),
              HasSubstr(R"(source 'vdo:s18' has the options {"flow":"dis"}, but {} in)"));
}

TEST(PooledFolders, VersionsOfSextantAreNamed) {
  const TempFolder temp;
  const Json configuration = {{"noise", Json::object()}};
  const auto folder = [&](uint64_t seed, const Json& more) {
    return write_case(temp, fmt::format("{}", seed), seed, configuration, more);
  };
  const auto warnings_of = [](const std::vector<fs::path>& folders) {
    std::vector<std::string> warnings;
    read_noise_sweeps(folders, &warnings);
    return warnings;
  };
  const Json old = {{"version", "0.0.9"}, {"git_commit", "abc"}}, now = {{"version", "0.1.0"}};
  const fs::path a = folder(1, old), b = folder(2, now), c = folder(3, now), d = folder(4, Json::object());
  EXPECT_THAT(warnings_of({b, c, d}), testing::IsEmpty());
  EXPECT_THAT(warnings_of({a, b}),
              testing::ElementsAre(testing::AllOf(HasSubstr("different versions of Sextant"),
                                                  HasSubstr("0.0.9 (commit abc) (" + a.string() + ")"),
                                                  HasSubstr("0.1.0 (commit ?) (" + b.string() + ")"))));
  EXPECT_THAT(warnings_of({folder(5, {{"version", "0.1.0"}, {"programs", {old, now}}})}),
              testing::ElementsAre(HasSubstr("different versions of Sextant")));
}

TEST(PooledFolders, MissingShardsAreNamed) {
  const TempFolder temp;
  const Json configuration = {{"noise", Json::object()}};
  std::vector<fs::path> shards;
  std::vector<std::string> warnings;
  for (size_t i = 1; i <= 3; ++i) {
    shards.push_back(write_case(temp, fmt::format("{}", i), i, configuration, {{"shard", {i, 3}}}));
    warnings.clear();
    read_noise_sweeps(shards, &warnings);
    EXPECT_EQ(warnings.size(), i < 3 ? 1U : 0U);
    if (i == 2) {
      EXPECT_THAT(warnings.at(0), HasSubstr("shards 1, 2 of 3"));
    }
  }
}

}  // namespace
}  // namespace sextant
