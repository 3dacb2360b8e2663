// Output folders of every command: no link inside them leads out of the folder that the command line names,
// and of two commands that write into one folder the second is refused before it computes anything. The
// table has a line for each flag of the command tree that names an output; a flag without a line fails the
// test.

#include <CLI/CLI.hpp>

#include <algorithm>
#include <set>

#include "sextant/base/file_lock.h"
#include "sextant/base/json.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/command_tree.h"
#include "sextant/eval/cli/testing.h"

namespace sextant {
namespace {

struct Place {
  const char* command;  ///< "sextant run"
  const char* flag;
  /// Without the name of the program; OUT is the folder, IN the folder of make_inputs().
  const char* arguments;
  bool is_locked = true;  ///< one command at a time writes there
};

/// gtest's name of a test.
std::ostream& operator<<(std::ostream& to, const Place& place) {
  return to << place.command << ' ' << place.flag;
}

// clang-format off
constexpr Place places[] = {
    {"sextant run", "--out", "run vdo:IN/a vdo:IN/b --jobs 1 --quiet --out OUT"},
    {"sextant run", "--out", "run vdo:IN/a --estimator external:IN/program.json --jobs 1 --quiet --out OUT"},
    {"sextant sweep", "--out", "sweep IN/plan.json --cache IN/cache --jobs 1 --quiet --out OUT"},
    {"sextant merge", "--out", "merge IN/shard1 IN/shard2 --quiet --out OUT"},
    {"sextant benchmark", "--out",
     "benchmark joint_flow --quick --tracks exact --cache IN/cache --jobs 1 --quiet --out OUT"},
    {"sextant rescore", "--out", "rescore IN/external_run --jobs 1 --quiet --out OUT"},
    {"sextant report", "--out", "report IN/sweep --jobs 1 --quiet --out OUT"},
    {"sextant compare", "--out", "compare IN/sweep IN/sweep --jobs 1 --quiet --out OUT"},
    {"sextant baseline update", "--baseline", "baseline update IN/sweep --yes --quiet --baseline OUT"},
    {"sextant trend", "--out", "trend IN/sweep IN/sweep --quiet --out OUT/page.html", false},
    {"sextant evaluate ego", "--out", "evaluate ego IN/run/gt_camera_tum.txt IN/run/est_camera_tum.txt "
                                      "--quiet --out OUT"},
    {"sextant evaluate ego", "--save-tum", "evaluate ego IN/run/gt_camera_tum.txt IN/run/est_camera_tum.txt "
                                           "--quiet --save-tum OUT"},
    {"sextant evaluate ego", "--save-zip", "evaluate ego IN/run/gt_camera_tum.txt IN/run/est_camera_tum.txt "
                                           "--quiet --save-zip OUT/r.zip", false},
    {"sextant evaluate objects", "--out",
     "evaluate objects IN/logs --format dynosam --truth vdo:IN/a --quiet --out OUT"},
    {"sextant evaluate objects", "--save-tum",
     "evaluate objects IN/logs --format dynosam --truth vdo:IN/a --quiet --save-tum OUT"},
    {"sextant evaluate objects", "--save-zip",
     "evaluate objects IN/logs --format dynosam --truth vdo:IN/a --quiet --save-zip OUT"},
    {"sextant view", "--out", "view IN/run --jobs 1 --quiet --out OUT"},
    {"sextant view", "--out", "view IN/run --jobs 1 --quiet --out OUT/page.html", false},
    {"sextant overlay", "--out", "overlay vdo:IN/a --frame 2 --out OUT/o.png", false},
    {"sextant export", "--out", "export IN/run --format csv --quiet --out OUT/e.csv", false},
    {"sextant export", "--out", "export IN/run --format npz --quiet --out OUT/e.npz", false},
    {"sextant export", "--out", "export IN/run --format sqlite --quiet --out OUT/e.sqlite", false},
    {"sextant noise fit", "--out", "noise fit synthetic:s18@0-1 --noise '{\"flow\":{\"epe_px\":1}}' --jobs "
                                   "1 --quiet --out OUT/n.json", false},
    {"sextant noise fit", "--figure", "noise fit synthetic:s18@0-1 --noise '{\"flow\":{\"epe_px\":1}}' "
                                      "--jobs 1 --quiet --out IN/fitted.json --figure OUT"},
    {"sextant data make", "--out", "data make s18@0-1 --layout kitti --jobs 1 --quiet --out OUT", false},
    {"sextant data strip", "--out", "data strip vdo:IN/a --out OUT/s.png", false},
    {"sextant man", "--out", "man --out OUT"},
};
// clang-format on

/// Flags whose places other tests look at, and why.
const std::map<std::string, std::string> elsewhere = {
    {"--cache", "experiment/PackTest: a folder of the user alone"},
    {"sextant benchmark merge --out",
     "its sweeps are merged as by `sextant merge`, its cards are those of `sextant benchmark`"},
    {"sextant benchmark page --out",
     "benchmark/Benchmark.APage*; its files go through write_output_folder()"},
    {"sextant reproduce --out",
     "eval/fuzz/fault_test.py --reproduce; its files go through OutputFolder and make_folder_below()"},
};

Outcome start(std::string arguments, const fs::path& in, const fs::path& out) {
  for (const auto& [word, path] : {std::pair("IN", in), std::pair("OUT", out)}) {
    for (size_t at = 0; (at = arguments.find(word, at)) != std::string::npos;) {
      const bool is_word = (at == 0 || arguments[at - 1] == ' ' || arguments[at - 1] == ':') &&
                           (at + std::string(word).size() == arguments.size() ||
                            arguments.find_first_of(" /", at) == at + std::string(word).size());
      if (is_word) arguments.replace(at, std::string(word).size(), path.string());
      at += is_word ? path.string().size() : 1;
    }
  }
  return sextant_program(arguments);
}

std::string pose_fields(const SE3& T) {
  const Eigen::Vector3d& t = T.translation();
  const Eigen::Quaterniond& q = T.rotation();
  return fmt::format("{},{},{},{},{},{},{}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

/// Makes those inputs that the arguments of a command name.
void make_inputs(const fs::path& in, const std::string& arguments) {
  const VdoFixture scene = make_vdo_fixture(in / "a", {.n_frames = 4, .width = 160, .height = 48});
  make_vdo_fixture(in / "b", {.n_frames = 4, .width = 160, .height = 48});
  write_file(in / "program.sh",
             "for k in 0 1 2 3; do echo $k 1 0 0 0 0 1 0 0 0 0 1 $k; done > $1/camera.txt\n");
  write_file(in / "program.json", R"({"command": "sh {config}/program.sh {output}", "keep": "all"})");
  write_file(in / "plan.json",
             json_text({{"sources", {"vdo:" + (in / "a").string()}},
                        {"estimators", {"motion_only", "external:" + (in / "program.json").string()}},
                        {"noise", {{"parameter", "depth.delta_d_px"}, {"levels", {0.1, 0.2}}}},
                        {"seeds", 2}}));
  fs::create_directory(in / "logs");
  std::string motions = "frame_id,object_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,gt_ty,gt_tz,gt_qx,gt_qy,gt_qz,gt_qw\n";
  std::string cameras = "frame_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,gt_ty,gt_tz,gt_qx,gt_qy,gt_qz,gt_qw\n";
  for (const auto& [k, pose] : scene.T_world_camera) {
    cameras += fmt::format("{0},{1},{1}\n", k, pose_fields(pose));
    if (k == 0) continue;
    motions +=
        fmt::format("{0},1,{1},{1}\n", k,
                    pose_fields(scene.T_world_object.at(k) * scene.T_world_object.at(k - 1).inverse()));
  }
  // Names from files that would leave the folder.
  for (const char* module : {".", "..", "m"}) {
    write_file(in / "logs" / fmt::format("{}_object_motion_log.csv", module), motions);
    write_file(in / "logs" / fmt::format("{}_camera_pose_log.csv", module), cameras);
  }
  for (const auto& [folder, words] :
       {std::pair("IN/run", "run vdo:IN/a"),
        std::pair("IN/external_run", "run vdo:IN/a --estimator external:IN/program.json"),
        std::pair("IN/sweep", "sweep IN/plan.json --cache IN/cache"),
        std::pair("IN/shard1", "sweep IN/plan.json --cache IN/cache --shard 1/2"),
        std::pair("IN/shard2", "sweep IN/plan.json --cache IN/cache --shard 2/2")}) {
    if (arguments.find(folder) == std::string::npos) continue;
    const Outcome outcome = start(fmt::format("{} --jobs 1 --quiet --out {}", words, folder), in, in);
    ASSERT_EQ(outcome.code, 0) << words << ": " << outcome.err;
  }
}

std::set<fs::path> folders_below(const fs::path& root) {
  std::set<fs::path> folders;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.is_directory()) folders.insert(entry.path().lexically_relative(root));
  }
  return folders;
}

class OutputPlaces : public testing::TestWithParam<Place> {
 protected:
  OutputPlaces() { make_inputs(in_, GetParam().arguments); }

  /// A folder with one file, to which links lead.
  fs::path theirs() const {
    temp_.write("theirs/file", "theirs");
    return temp_.path() / "theirs";
  }
  void expect_untouched() const {
    EXPECT_THAT(files_below(temp_.path() / "theirs"), ElementsAre(testing::Pair("file", "theirs")));
  }
  fs::path make_out(const std::string& name) const {
    fs::create_directories(temp_.path() / name / "out");
    return temp_.path() / name / "out";
  }

  TempFolder temp_;
  fs::path in_ = temp_.path() / "in";
};

TEST_P(OutputPlaces, GoThroughNoLinkAndHaveALock) {
  const Place& place = GetParam();
  const fs::path whole = make_out("whole");
  const Outcome outcome = start(place.arguments, in_, whole);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::map<std::string, std::string> files = files_below(whole);
  ASSERT_FALSE(files.empty());
  EXPECT_THAT(files_below(temp_.path() / "whole"), testing::SizeIs(files.size()))
      << "nothing lies beside the folder";

  int n = 0;
  for (const fs::path& folder : folders_below(whole)) {
    const fs::path out = make_out(fmt::format("folder{}", n++));
    fs::create_directories((out / folder).parent_path());
    fs::create_directory_symlink(theirs(), out / folder);
    const Outcome refused = start(place.arguments, in_, out);
    expect_untouched();
    if (refused.code != 0) expect_bad_input(refused, out.string());
  }

  const fs::path linked = make_out("files");
  for (const auto& [name, bytes] : files) {
    fs::create_directories((linked / name).parent_path());
    fs::create_symlink(theirs() / "file", linked / name);
  }
  const Outcome replaced = start(place.arguments, in_, linked);
  EXPECT_TRUE(replaced.code == 0 || replaced.code == 2) << replaced.err;
  expect_untouched();

  if (!place.is_locked) return;
  const fs::path out = make_out("locked");
  const FolderLock lock(out);
  expect_bad_input(start(place.arguments, in_, out), "is writing into this folder");
  EXPECT_TRUE(fs::is_empty(out));
}

INSTANTIATE_TEST_SUITE_P(Commands, OutputPlaces, testing::ValuesIn(places));

/// A folder that the user names may be on another disk.
TEST(OutputFolder, ThatIsALinkIsFollowed) {
  const TempFolder temp;
  fs::create_directory(temp.path() / "disk");
  fs::create_directory_symlink(temp.path() / "disk", temp.path() / "out");
  ASSERT_EQ(sextant_program("run synthetic:s18@0-1 --jobs 1 --quiet --out " + (temp / "out")).code, 0);
  EXPECT_TRUE(fs::is_symlink(temp.path() / "out"));
  EXPECT_TRUE(fs::exists(temp.path() / "disk" / "records.jsonl"));
}

TEST(OutputPlacesTable, HasEveryFlagThatNamesAnOutput) {
  const TempFolder temp;
  // The flags come from the command tree, from which the man pages are generated, too.
  ASSERT_EQ(sextant_program("man --out " + (temp / "man")).code, 0);
  std::set<std::string> known;
  for (const Place& place : places) known.insert(fmt::format("{} {}", place.command, place.flag));
  for (const auto& [name, bytes] : files_below(temp.path() / "man")) {
    std::string command = name.substr(0, name.size() - 2);
    std::ranges::replace(command, '-', ' ');
    for (const char* flag : {"--out", "--save-tum", "--save-zip", "--figure", "--baseline", "--cache"}) {
      std::string bold = fmt::format("\\fB{}\\fR \\fI", flag);
      for (size_t at = 0; (at = bold.find('-', at)) != std::string::npos; at += 2) bold.insert(at, "\\");
      if (bytes.find(bold) == std::string::npos || elsewhere.contains(flag)) continue;
      const std::string both = command + " " + flag;
      EXPECT_TRUE(known.contains(both) || elsewhere.contains(both)) << both << ": has no line in `places`";
    }
  }
}

TEST(OneAtATime, MergeAndItsShards) {
  const TempFolder temp;
  const fs::path in = temp.path() / "in";
  make_inputs(in, "IN/shard1 IN/shard2");
  const std::map<std::string, std::string> before = files_below(in / "shard1");
  expect_bad_input(start("merge IN/shard1 IN/shard2 --out IN/shard1", in, in),
                   "is one of the folders that are merged");
  EXPECT_EQ(files_below(in / "shard1"), before);
  // A merge that fails leaves what others put into the folder that it made.
  expect_bad_input(start("merge IN/shard1 --out IN/new/merged", in, in), "give the folders of all shards");
  EXPECT_FALSE(fs::exists(in / "new"));
}

TEST(SaveTum, NamesOfLogsStayInTheFolder) {
  const TempFolder temp;
  make_inputs(temp.path() / "in", "IN/logs");
  const Outcome outcome =
      start("evaluate objects IN/logs --format dynosam --truth vdo:IN/a --quiet --save-tum OUT",
            temp.path() / "in", temp.path() / "a" / "tum");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  std::set<std::string> folders;
  for (const fs::path& folder : folders_below(temp.path() / "a")) folders.insert(folder.string());
  EXPECT_EQ(folders, (std::set<std::string>{"tum", "tum/_", "tum/_.", "tum/m"}));
  for (const auto& [name, bytes] : files_below(temp.path() / "a"))
    EXPECT_THAT(name, testing::AnyOf(HasSubstr("/obj_"), HasSubstr("/.sextant_outputs")));
}

TEST(DryRun, StartsAndWritesNothing) {
  const TempFolder temp;
  make_vdo_fixture(temp.path() / "a", {.n_frames = 4, .width = 160, .height = 48});
  temp.write("program.json", fmt::format(R"({{"command": "touch {}"}})", temp / "started"));
  temp.write("plan.json", json_text({{"sources", {"vdo:" + temp / "a"}},
                                     {"estimators", {"external:" + temp / "program.json", "motion_only"}},
                                     {"seeds", 3}}));
  const std::map<std::string, std::string> before = files_below(temp.path());
  const Outcome text = sextant_program(
      fmt::format("sweep {0}/plan.json --dry-run --cache {0}/cache --out {0}/out", temp.path().string()));
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("6 cases, 18 frame pairs"));
  const Outcome json =
      sextant_program(fmt::format("sweep {0}/plan.json --dry-run --json", temp.path().string()));
  EXPECT_EQ(Json::parse(json.out), (Json{{"cases", 6}, {"pairs", 18}, {"estimated_s", nullptr}}));
  EXPECT_EQ(files_below(temp.path()), before);
  const Outcome packs = sextant_program(
      fmt::format("sweep {0}/plan.json --packs-only --cache {0}/cache --jobs 1", temp.path().string()));
  EXPECT_EQ(packs.code, 0) << packs.err;
  EXPECT_FALSE(fs::exists(temp / "started"));
  EXPECT_FALSE(fs::exists(temp / "out"));
  EXPECT_EQ(files_below(temp.path() / "cache").size(),
            3U);  // the correspondence cache, the link to it, and the mark of the folder
}

TEST(SourceNames, ThatFallTogetherAreRefusedBeforeAnythingRuns) {
  const TempFolder temp;
  for (const char* name : {"seq 1", "seq+1"})
    make_vdo_fixture(temp.path() / name, {.n_frames = 3, .width = 160, .height = 48});
  const std::string here = temp.path().string();
  const Outcome outcome =
      sextant_program(fmt::format("run 'vdo:{0}/seq 1' vdo:{0}/seq+1 --jobs 1 --quiet --out {0}/out", here));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(temp.path() / "out" / "report.html")) << outcome.err;
  const Outcome refused = sextant_program(
      fmt::format("run 'vdo:{0}/seq 1#a/b' vdo:{0}/seq+1#a-b --jobs 1 --quiet --out {0}/other", here));
  expect_bad_input(refused, "would both write into 'vdo_a-b_0-2'");
  EXPECT_FALSE(fs::exists(temp.path() / "other"));
}

TEST(Cache, OfAnotherUserIsRefused) {
  const TempFolder temp;
  make_vdo_fixture(temp.path() / "a", {.n_frames = 3, .width = 160, .height = 48});
  temp.write("plan.json", json_text({{"sources", {"vdo:" + temp / "a"}}, {"estimators", {"motion_only"}}}));
  fs::create_directory(temp / "shared");
  // Without a home folder correspondence caches lie in a folder of the user's own below the system's
  // temporary folder.
  const std::string words =
      fmt::format("sweep {0}/plan.json --jobs 1 --quiet --out {0}/", temp.path().string());
  const std::string bare =
      fmt::format("env -u HOME -u XDG_CACHE_HOME -u SEXTANT_CACHE TMPDIR={}", temp / "shared");
  ASSERT_EQ(
      std::system(fmt::format("{} {} {}one > {}", bare, SEXTANT_PROGRAM, words, temp / "message").c_str()),
      0);
  ASSERT_TRUE(
      fs::exists(temp.path() / "shared" / fmt::format("sextant-packs-{}", ::geteuid()) / "CACHEDIR.TAG"));
  fs::create_directory(temp / "open");
  fs::permissions(temp / "open", fs::perms::all);
  expect_bad_input(sextant_program(fmt::format("{}two --cache {}", words, temp / "open")),
                   "others may write into this cache");
  expect_bad_input(sextant_program(fmt::format("cache prune --cache {}", temp / "open")),
                   "others may write into this cache");
  expect_bad_input(sextant_program(fmt::format("cache prune --all --cache {}", temp / "one")),
                   "which marks a cache, so nothing was removed");
  EXPECT_TRUE(fs::exists(temp / "one/run.json"));
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a folder to another user";
  fs::permissions(temp / "open", fs::perms::owner_all);
  ASSERT_EQ(::chown((temp / "open").c_str(), 65534, 65534), 0);
  expect_bad_input(sextant_program(fmt::format("{}three --cache {}", words, temp / "open")),
                   "belongs to another user");
}

TEST(ManPages, SayNothingOfThisMachine) {
  const Outcome page = sextant_program("man sweep");
  EXPECT_THAT(page.out, HasSubstr("Default: number of cores"));
}

}  // namespace
}  // namespace sextant
