#include "sextant/eval/experiment/run.h"

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/check/check_source.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/testing.h"

namespace sextant {
namespace {

RunConfig config_of(const std::string& source, int jobs = 1) {
  RunConfig config;
  config.sources = {SourceSpec::parse(source)};
  config.jobs = jobs;
  config.quiet = true;
  return config;
}

/// Returns the records' bytes without times.
std::string untimed_bytes(const RunResult& result) { return write_records(untimed(result.records)); }

/// 20 frames: more than one window of the runner. Written once.
const VdoFixture& twenty_frames() {
  static const TempFolder folder;
  static const VdoFixture fixture =
      make_vdo_fixture(folder.path() / "vdo", {.n_frames = 20, .width = 160, .height = 48});
  return fixture;
}

class RunFixture : public testing::Test {
 protected:
  const VdoFixture* fixture_ = &twenty_frames();
};

TEST_F(RunFixture, GivesTheSameBytesForAnyJobs) {
  const RunResult one = run(config_of(fixture_->source(), 1));
  const RunResult three = run(config_of(fixture_->source(), 3));
  EXPECT_EQ(untimed_bytes(one), untimed_bytes(three));
  OutputFiles a = run_files(one);
  OutputFiles b = run_files(three);
  for (const char* timed : {"records.jsonl", "run.json"}) {
    a.erase(timed);
    b.erase(timed);
  }
  EXPECT_EQ(a, b);
}

TEST_F(RunFixture, HasARecordOfEgoPerPairInOrder) {
  const RunResult result = run(config_of(fixture_->source(), 2));
  int frame = 0;
  for (const Record& record : result.records) {
    frame += record.is_ego() ? 1 : 0;
    EXPECT_EQ(record.frame, frame);
    EXPECT_TRUE(!record.is_ego() || record.time_ms.contains("extraction"));
    EXPECT_TRUE(!record.is_ego() || record.time_ms.contains("decode"));
  }
  EXPECT_EQ(frame, 19);
}

TEST_F(RunFixture, SplitHalvesDoNotChangeTheEstimate) {
  RunConfig config = config_of(fixture_->source());
  config.estimator = "joint_flow_depth";
  RunResult plain = run(config);
  config.options["pipeline"]["consistency"] = true;
  RunResult halves = run(config);
  int n = 0, n_gaps = 0;
  for (Record& record : halves.records) {
    n += record.values.contains("split_nees") ? 1 : 0;
    n_gaps += record.values.contains("expansion_chi2") ? 1 : 0;
    for (const char* key :
         {"split_nees", "split_nees_sides", "split_nees_cells", "expansion_gap_m", "expansion_chi2"})
      record.values.erase(key);
  }
  EXPECT_GT(n, 10);
  EXPECT_GT(n_gaps, 0);
  EXPECT_LT(n_gaps, n);  // the camera has none
  EXPECT_EQ(untimed(plain.records), untimed(halves.records));
}

TEST_F(RunFixture, EgoMotionIsRightUpToTheFilesQuantisation) {
  const RunResult result = run(config_of(fixture_->source(), 2));
  for (const Record& record : result.records) {
    if (!record.is_ego()) continue;
    EXPECT_EQ(record.status, Status::ok);
    EXPECT_LT(record.errors.at("Et_m"), 0.05) << "frame " << record.frame;
  }
  EXPECT_EQ(result.sources.at(0).motions.estimated.poses().size(), 20U);
  EXPECT_TRUE(result.sources.at(0).motions.starts_at_truth);
}

/// Returns every file of the run, without times.
OutputFiles untimed_files(RunResult result) {
  result.records = untimed(result.records);
  result.wall_time_s = 0;
  return run_files(result);
}

TEST_F(RunFixture, ResumesAfterFinishedSources) {
  const TempFolder temp;
  RunConfig config = config_of(fixture_->source() + "@0-6", 2);
  for (const char* range : {"@6-9", "@9-14"})
    config.sources.push_back(SourceSpec::parse(fixture_->source() + range));
  config.noise = Noise::parse(R"({"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 0.5}})");
  config.n_seeds = 2;
  const OutputFiles whole = untimed_files(run(config));
  const Json configuration = resolved_configuration(config);

  std::vector<int> frames;
  config.on_pair = [&](const FrameResult& pair, std::span<const Record>) {
    frames.push_back(pair.curr);
    if (pair.curr == 11) throw std::runtime_error("killed");
  };
  fs::create_directory(temp.path() / "out");
  const auto run_on = [&](const Json& of) {
    RunJournal journal(temp.path() / "out", of);
    config.journal = &journal;
    frames.clear();
    return run(config);
  };
  EXPECT_THROW(run_on(configuration), std::runtime_error);
  EXPECT_EQ(frames.front(), 1);
  const std::string journal = read_file(temp.path() / "out" / "unfinished.jsonl");
  config.on_pair = [&](const FrameResult& pair, std::span<const Record>) { frames.push_back(pair.curr); };
  EXPECT_EQ(untimed_files(run_on(configuration)), whole);
  EXPECT_EQ(frames, (std::vector<int>{10, 11, 12, 13, 14}));
  run_on(configuration);
  EXPECT_EQ(frames, std::vector<int>());
  // A truncated block, another configuration or a changed file: the source is processed again.
  const auto expect_first = [&](int frame, const Json& of) {
    EXPECT_EQ(untimed_files(run_on(of)), whole);
    EXPECT_EQ(frames.front(), frame);
  };
  write_file(temp.path() / "out" / "unfinished.jsonl", journal.substr(0, journal.size() - 9));
  expect_first(7, configuration);
  expect_first(1, {{"another", 1}});
  const fs::path depth = fixture_->dir / "depth" / "000008.png";
  const std::string good = read_file(depth);
  Image<uint16_t> other = decode_png16(good, "depth");
  other(0, 0) += 1;
  write_file(depth, encode_png(other));
  run_on({{"another", 1}});
  EXPECT_EQ(frames, (std::vector<int>{7, 8, 9}));
  write_file(depth, good);
}

TEST_F(RunFixture, RefusesTheSameFramesTwice) {
  RunConfig config = config_of(fixture_->source() + "@0-5");
  config.sources.push_back(SourceSpec::parse(fixture_->source() + "@3-8"));
  expect_error([&] { run(config); }, "list each frame pair once");
}

TEST_F(RunFixture, ProvenanceListsTheFilesRead) {
  const RunResult result = run(config_of(fixture_->source() + "@0-2"));
  const Json json = run_provenance(result);
  EXPECT_EQ(json["configuration"]["options"]["pipeline"]["max_object_distance_m"], 25.0);
  EXPECT_TRUE(json["configuration"]["options"]["estimator"].contains("sigma_flow_px"));
  EXPECT_FALSE(json["git_commit"].get<std::string>().empty());
  const Json& inputs = json["sources"][0]["inputs"];
  const std::string depth = (fixture_->dir / "depth" / "000001.png").string();
  ASSERT_TRUE(inputs.contains(depth)) << inputs.dump(1);
  EXPECT_EQ(inputs[depth]["sha256"], sha256(read_file(depth)));
}

TEST_F(RunFixture, SourceCheckPassesAndNamesABadFrame) {
  const auto sequence = open_source(SourceSpec::parse(fixture_->source()));
  for (const SourceCheck& line : check_source(*sequence, {.jobs = 2, .quiet = true})) {
    EXPECT_NE(line.outcome, CheckOutcome::fail) << line.name << ": " << line.message;
  }
  const fs::path depth = fixture_->dir / "depth" / "000003.png";
  const std::string good = read_file(depth);
  write_file(depth, std::string_view(good).substr(0, good.size() / 2));
  const std::vector<SourceCheck> lines = check_source(*sequence, {.jobs = 2, .quiet = true});
  write_file(depth, good);
  const auto bad =
      std::find_if(lines.begin(), lines.end(), [](const auto& line) { return line.name == "depth"; });
  EXPECT_EQ(bad->outcome, CheckOutcome::fail);
  EXPECT_EQ(bad->n_present, 19);
  EXPECT_THAT(bad->message, HasSubstr("000003.png"));
}

TEST(ResolveOptions, IsStrictAtEveryLevel) {
  expect_error([] { resolve_options(Json::parse(R"({"pipelin":{}})")); }, "'pipeline'");
  expect_error([] { resolve_options(Json::parse(R"({"pipeline":3})")); }, "expected an object");
  expect_error([] { resolve_options(Json::parse(R"({"extraction":{"cell":1}})")); }, "extraction.cell");
  EXPECT_EQ(
      resolve_options(Json::parse(R"({"pipeline":{"min_object_points":40}})")).pipeline.min_object_points,
      40);
}

TEST(OutputFolder, IsWrittenCompletelyOrNotAtAll) {
  const TempFolder temp;
  const fs::path out = temp.path() / "a" / "b";
  write_output_folder(out, {{"records.jsonl", "x\n"}, {"sub/t.txt", "y"}});
  EXPECT_EQ(read_file(out / "sub" / "t.txt"), "y");
  // The second file cannot be written (a file is in the place of a folder): earlier results stay unchanged.
  EXPECT_THROW(write_output_folder(out, {{"records.jsonl", "z\n"}, {"records.jsonl/b", "2"}}), Error);
  EXPECT_EQ(read_file(out / "records.jsonl"), "x\n");
  EXPECT_FALSE(fs::exists(out / ".incomplete"));
  EXPECT_THROW(write_output_folder(temp.path() / "c" / "d", {{"a", "1"}, {"a/b", "2"}}), Error);
  EXPECT_FALSE(fs::exists(temp.path() / "c"));
}

TEST(OutputFolder, GoesThroughNoLink) {
  const TempFolder temp;
  const fs::path out = temp.path() / "out", theirs = temp.path() / "theirs";
  fs::create_directories(out);
  fs::create_directories(theirs);
  temp.write("theirs/t.txt", "theirs");
  write_file(out / "a.txt", "old");
  fs::create_directory_symlink(theirs, out / "sub");
  fs::create_directory_symlink(theirs, out / ".incomplete");
  const OutputFiles files = {{"a.txt", "new"}, {"sub/t.txt", "new"}};
  expect_error([&] { write_output_folder(out, files); },
               "sub: is a link: output is not written through links");
  EXPECT_EQ(read_file(out / "a.txt"), "old") << "nothing is replaced where one place is refused";
  fs::remove(out / "sub");
  fs::create_directory(out / "sub");
  fs::create_symlink(theirs / "t.txt", out / "sub" / "t.txt");
  fs::create_symlink(theirs / "t.txt", out / ".incomplete");
  write_output_folder(out, files);
  EXPECT_EQ(read_file(out / "sub" / "t.txt"), "new");
  EXPECT_EQ(read_file(theirs / "t.txt"), "theirs");
}

TEST(OutputFolder, KeepsFilesOfOtherPrograms) {
  const TempFolder temp;
  const fs::path out = temp.path() / "made" / "out";
  {
    const OutputFolder folder(out);  // without commit()
    temp.write("made/theirs.txt", "of another command");
    temp.write("made/out/theirs.txt", "of another command");
  }
  EXPECT_EQ(files_below(temp.path()).size(), 2U);
  EXPECT_FALSE(fs::exists(out / ".incomplete"));
}

TEST(OutputFolder, ARunMayBeRepeatedInPlaceButNotReplaceAnother) {
  const TempFolder temp;
  const Json configuration = {{"estimator", "joint_flow"}};
  EXPECT_NO_THROW(check_output_folder(temp.path(), configuration, false));
  write_file(temp.path() / "records.jsonl", "x\n");
  expect_error([&] { check_output_folder(temp.path(), configuration, false); }, "--force");
  write_file(temp.path() / "run.json", Json{{"configuration", configuration}}.dump());
  EXPECT_NO_THROW(check_output_folder(temp.path(), configuration, false));
  const Json other = {{"estimator", "motion_only"}};
  expect_error([&] { check_output_folder(temp.path(), other, false); }, "--force");
  EXPECT_NO_THROW(check_output_folder(temp.path(), other, true));
}

TEST(OutputFolder, RefusesAFile) {
  const TempFolder temp;
  write_file(temp.path() / "f", "x");
  expect_error([&] { check_output_folder(temp.path() / "f", {}, true); }, "is a file");
}

// ---- real data

double mean_of(const std::vector<Record>& records, const std::string& body, Record::Numbers Record::*map,
               const std::string& key) {
  double sum = 0;
  int n = 0;
  for (const Record& record : records) {
    if (record.body != body || record.status != Status::ok) continue;
    sum += (record.*map).at(key);
    ++n;
  }
  return sum / n;
}

TEST(RunOnRealData, Kitti03DemoReachesTheKnownErrors) {
  SEXTANT_NEEDS_DATA("kitti_03_demo");
  const std::string source = "vdo:" + real_data("kitti_03_demo").string() + "@0-19";
  const RunResult result = run(config_of(source, 2));
  EXPECT_LE(mean_of(result.records, "ego", &Record::errors, "Et_m"), 0.072);
  EXPECT_LE(mean_of(result.records, "ego", &Record::errors, "ER_deg"), 0.042);
  EXPECT_LE(mean_of(result.records, "object:1", &Record::errors, "Ev_kmh"), 3.0);
  const double v_gt_kmh = mean_of(result.records, "object:1", &Record::values, "v_gt_kmh");
  EXPECT_GT(v_gt_kmh, 50);
  EXPECT_LT(v_gt_kmh, 58);
  EXPECT_EQ(std::count_if(result.records.begin(), result.records.end(),
                          [](const Record& r) { return r.body == "object:1" && r.status == Status::ok; }),
            19);
  EXPECT_EQ(untimed_bytes(result), untimed_bytes(run(config_of(source, 1))));
}

}  // namespace
}  // namespace sextant
