#include "sextant/eval/external/program_fingerprint.h"

#include <sys/stat.h>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

class ProgramFingerprintTest : public testing::Test {
 protected:
  ProgramFingerprintTest() {
    write("program.py", "print(1)\n");
    write("mine.json", "{}");
  }

  fs::path at(const std::string& name) const { return folder_.path() / "mine" / name; }
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories(at(name).parent_path());
    write_file(at(name), text);
  }
  static Json configuration(Json more = Json::object()) {
    if (!more.contains("command")) more["command"] = "sh {config}/program.py {input} {output}";
    return more;
  }
  Fingerprint now(const Json& more = Json::object()) const {
    write_file(at("mine.json"), configuration(more).dump());
    return program_fingerprint(read_external_config(at("mine.json").string()), at("mine.json"));
  }
  std::vector<std::string> names(const Json& more = Json::object()) const {
    std::vector<std::string> names;
    const Fingerprint fingerprint = now(more);
    for (const auto& [name, ignored] : fingerprint.parts) names.push_back(name);
    return names;
  }
  /// Returns the difference after `change`.
  template <typename Change>
  std::string after(const Change& change, const Json& more = Json::object()) const {
    const Fingerprint before = now(more);
    change();
    return difference(before, now(more));
  }

  TempFolder folder_;
};

TEST_F(ProgramFingerprintTest, HasConfigurationProgramScriptAndFilesBeside) {
  write("helper.py", "1");
  write("package/part.py", "2");
  EXPECT_THAT(names(),
              ElementsAre("configuration", "helper.py", "package/part.py", "program sh", "program.py"));
  EXPECT_EQ(now().parts.at("helper.py"), sha256("1"));
  EXPECT_THAT(now().not_seen, IsEmpty());
}

TEST_F(ProgramFingerprintTest, EveryPartThatChangesIsNamed) {
  write("helper.py", "1");
  EXPECT_EQ(after([&] { write("program.py", "print(2)\n"); }), "program.py changed");
  EXPECT_EQ(after([&] { write("helper.py", "2"); }), "helper.py changed");
  EXPECT_EQ(after([&] { write("new.py", "2"); }), "new.py is new");
  EXPECT_EQ(after([&] { fs::remove(at("new.py")); }), "new.py is gone");
  EXPECT_EQ(difference(now(), now({{"time_limit_s", 5}})), "configuration changed");
  EXPECT_EQ(after([] {}), "");
}

TEST_F(ProgramFingerprintTest, DoesNotDependOnPlaceTimeAndLayoutOfTheConfiguration) {
  write("b.py", "1");
  write("a/c.py", "2");
  const Fingerprint here = now();
  fs::copy(at(""), folder_.path() / "elsewhere", fs::copy_options::recursive);
  const fs::path there = folder_.path() / "elsewhere" / "mine.json";
  EXPECT_EQ(program_fingerprint(read_external_config(there.string()), there).parts, here.parts);
  write_file(there, configuration().dump(4) + "\n");
  fs::last_write_time(there.parent_path() / "b.py", fs::file_time_type::clock::now() + std::chrono::hours(1));
  EXPECT_EQ(program_fingerprint(read_external_config(there.string()), there).sha256(), here.sha256());
}

TEST_F(ProgramFingerprintTest, FilesWrittenByTheProgramAreSkipped) {
  const Fingerprint before = now();
  for (const char* name :
       {"out/records.jsonl", "out/external/case_000000/log.txt", "running/journal.jsonl", "cache/1.pack",
        "cache/1.json", "gate/comparison.json", "gate/junit.xml", "page/report.html", "page/report.md",
        "__pycache__/helper.pyc", "package/__pycache__/helper.pyc", ".git/index", ".hidden", "run.log",
        "x.tmp", "program.py~"})
    write(name, "x");
  for (const char* name : {"many/shards/1/plan.json", "many/log/1.out", "cluster/slurm/log/1.out"})
    write(name, "x");
  write("cluster/slurm/plan.json", R"({"sources": ["a"], "estimators": ["b"]})");
  write("begun/plan.json", R"({"plan": {}, "shard": [0, 1], "data": {}})");
  write("gate.json", R"({"sources": ["a"], "estimators": ["b"]})");
  write("benchmark/mine/card.json", R"({"sextant_card": 1})");
  write("benchmark/mine/card.md", "x");
  write("benchmark/mine/left_out.json", "{}");
  write("shard1/mine/left_out.json", "{}");
  write("shard1/mine/depth/plan.json", R"({"plan": {}, "shard": [0, 2], "data": {}})");
  write("site/index.html", "<!DOCTYPE html>\n<meta name=\"generator\" content=\"Sextant\">\n");
  EXPECT_EQ(difference(before, now()), "");
}

TEST_F(ProgramFingerprintTest, CardsAndPagesOfTheProgramItselfCount) {
  EXPECT_EQ(after([&] { write("model/card.json", R"({"model": 1})"); }), "model/card.json is new");
  EXPECT_EQ(after([&] { write("model/left_out.json", "{}"); }), "model/left_out.json is new");
  EXPECT_EQ(after([&] { write("model/index.html", "<!DOCTYPE html>"); }), "model/index.html is new");
}

TEST_F(ProgramFingerprintTest, DependsNamesFilesAnywhere) {
  write("helper.py", "1");
  write("../common/weights.bin", "1");
  write("../common/deep/er/more.bin", "1");
  write("../common/note.txt", "1");
  const Json depends = {{"depends", {"../common/**/*.bin"}}};
  EXPECT_THAT(names(depends), ElementsAre("../common/deep/er/more.bin", "../common/weights.bin",
                                          "configuration", "program sh", "program.py"));
  EXPECT_EQ(after([&] { write("../common/deep/er/more.bin", "2"); }, depends),
            "../common/deep/er/more.bin changed");
  EXPECT_EQ(after([&] { write("../common/note.txt", "2"); }, depends), "");
  EXPECT_EQ(after([&] { write("helper.py", "2"); }, depends), "");
  EXPECT_THAT(names({{"depends", Json::array()}}), ElementsAre("configuration", "program sh", "program.py"));
  EXPECT_THAT(names({{"depends", {"h?lper.*"}}}),
              ElementsAre("configuration", "helper.py", "program sh", "program.py"));
  expect_error(
      [&] {
        now({{"depends", {"../shard/*.bin"}}});
      },
      "depends: '../shard/*.bin' matches no file in");
  expect_error([&] { now({{"depends", "helper.py"}}); }, "option depends: expected a list of names of files");
}

TEST_F(ProgramFingerprintTest, ArgumentsThatNameFilesCount) {
  write("../tools/extra.bin", "1");
  const std::string extra = (folder_.path() / "tools" / "extra.bin").string();
  const Json option = {
      {"command", "sh program.py --weights=../tools/extra.bin " + extra + " {input}/x {output}"}};
  EXPECT_THAT(names(option), UnorderedElementsAre("--weights=../tools/extra.bin", extra, "configuration",
                                                  "program sh", "program.py"));
  EXPECT_EQ(after([&] { write("../tools/extra.bin", "2"); }, option),
            fmt::format("--weights=../tools/extra.bin changed, {} changed", extra));
  const Fingerprint of_folder = now({{"command", "sh program.py ../tools"}});
  EXPECT_THAT(of_folder.not_seen, ElementsAre(HasSubstr("../tools: a folder")));
}

TEST_F(ProgramFingerprintTest, AFolderBesideItIsListedUnlessItsFilesAreDependencies) {
  write("weights/a.bin", "1");
  const auto not_seen = [&](const Json& depends) {
    Json more = {{"command", "sh program.py {config}/weights/ {output}"}};
    if (!depends.is_null()) more["depends"] = depends;
    return now(more).not_seen;
  };
  EXPECT_THAT(not_seen({"program.py"}),
              ElementsAre(HasSubstr("{config}/weights/: a folder; name the files")));
  EXPECT_THAT(not_seen(Json()), IsEmpty());
  EXPECT_THAT(not_seen({"weights/*.bin"}), IsEmpty());
}

TEST_F(ProgramFingerprintTest, TheInterpreterOfAScriptCounts) {
  write("interpreter", "#!/bin/sh\n");
  write("run", "#!" + at("interpreter").string() + " -x\n");
  ::chmod(at("interpreter").c_str(), 0755);
  const Json command = {{"command", "./run {output}"}, {"depends", Json::array()}};
  EXPECT_THAT(names(command), ElementsAre("configuration", "interpreter", "run"));
  write("run", "#!/usr/bin/env -S sh\n");
  EXPECT_THAT(names(command), ElementsAre("configuration", "interpreter sh", "run"));
}

TEST_F(ProgramFingerprintTest, AMissingProgramIsReportedAtItsStart) {
  EXPECT_THAT(names({{"command", "no_such_program_here {output}"}}),
              ElementsAre("configuration", "program.py"));
}

TEST_F(ProgramFingerprintTest, LinksToFilesAreReadLinksToFoldersAreNot) {
  write("../other/linked.py", "1");
  fs::create_symlink(at("../other/linked.py"), at("link.py"));
  fs::create_directory_symlink(at("../other"), at("folder"));
  fs::create_directory_symlink(at(""), at("itself"));
  fs::create_symlink("nowhere", at("broken"));
  EXPECT_THAT(names(), ElementsAre("configuration", "link.py", "program sh", "program.py"));
  EXPECT_EQ(after([&] { write("../other/linked.py", "2"); }), "link.py changed");
}

TEST_F(ProgramFingerprintTest, LargeAndManyFilesAreListedAsNotSeen) {
  write("large.bin", "");
  fs::resize_file(at("large.bin"), most_bytes_beside + 1);
  Fingerprint fingerprint = now();
  EXPECT_FALSE(fingerprint.parts.contains("large.bin"));
  EXPECT_THAT(fingerprint.not_seen, ElementsAre(HasSubstr("large.bin: larger than 10 MB")));
  EXPECT_TRUE(now({{"depends", {"*.bin"}}}).parts.contains("large.bin"));
  write("frames/first", "");
  for (size_t i = 0; i < most_files_beside; ++i) std::ofstream(at("frames") / std::to_string(i)) << i;
  fingerprint = now();
  EXPECT_EQ(fingerprint.parts.size(), 3U);
  EXPECT_THAT(fingerprint.not_seen, Contains(HasSubstr("more than 2000 files")));
}

TEST_F(ProgramFingerprintTest, HashesOfFilesAreThoseOfTheirContent) {
  std::string text(3'000'001, 'x');
  text[2'500'000] = 'y';
  write("long", text);
  EXPECT_EQ(file_sha256(at("long")), sha256(text));
  expect_error([&] { file_sha256(at("none")); }, "none");
}

TEST_F(ProgramFingerprintTest, SurvivesPlanAndRunFiles) {
  Fingerprint fingerprint = now();
  fingerprint.not_seen = {"a folder"};
  const Json file = {{fingerprints_key, fingerprints_json({{"mine", {fingerprint}}})}};
  const Fingerprints read = fingerprints_in(parse_json(json_text(file), "plan.json"), "plan.json");
  EXPECT_EQ(read.at("mine").front().parts, fingerprint.parts);
  EXPECT_EQ(read.at("mine").front().not_seen, fingerprint.not_seen);
  EXPECT_THAT(fingerprints_in(Json::object(), "plan.json"), IsEmpty());
  expect_error(
      [] {
        fingerprints_in({{fingerprints_key, {{"mine", {{{"parts", {{"a", 1}}}}}}}}}, "plan.json");
      },
      "plan.json: fingerprints 'mine': parts: key 'a'");
}

}  // namespace
}  // namespace sextant
