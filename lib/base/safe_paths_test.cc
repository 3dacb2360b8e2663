#include "sextant/base/new_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

TEST(SafeFileName, NeverLeavesItsFolder) {
  EXPECT_EQ(safe_file_name("vkitti1_0018-clone 15°_1-2"), "vkitti1_0018-clone 15°_1-2");
  EXPECT_EQ(safe_file_name(".."), "_.");
  EXPECT_EQ(safe_file_name("."), "_");
  EXPECT_EQ(safe_file_name(""), "_");
  EXPECT_EQ(safe_file_name("../../etc/passwd"), "_.-..-etc-passwd");
  EXPECT_EQ(safe_file_name("/a\nb\x7f"), "-a-b-");
}

TEST(SafeFileName, LongNamesAreShortAndDistinct) {
  std::string text;
  for (int i = 0; i < 200; ++i) text += "ü";
  const std::string name = safe_file_name(text), other = safe_file_name(text + "x");
  EXPECT_LE(name.size(), 200U);
  EXPECT_GT(name.size(), 190U);
  EXPECT_NE(name, other);
  EXPECT_THAT(name, StartsWith("ü"));
  EXPECT_THAT(name, HasSubstr("ü-")) << "whole characters";
}

TEST(DistinctNames, LaterOnesGetANumber) {
  EXPECT_THAT(distinct_names({"a", "b", "a", "a-2", "a"}), ElementsAre("a", "b", "a-2", "a-2-2", "a-3"));
}

TEST(FoldersBelow, AreNotReachedThroughLinks) {
  const TempFolder folder;
  fs::create_directories(folder / "out");
  fs::create_directories(folder / "theirs");
  const fs::path out = folder / "out";
  EXPECT_EQ(make_folder_below(out, "a/b"), out / "a" / "b");
  EXPECT_TRUE(fs::is_directory(out / "a" / "b"));
  fs::create_directory_symlink(folder / "theirs", out / "link");
  fs::create_symlink(folder / "nowhere", out / "dangling");
  write_file(out / "file", "x");
  expect_error([&] { make_folder_below(out, "link"); },
               "link: is a link: output is not written through links");
  expect_error([&] { make_folder_below(out, "link/b"); }, "link: is a link");
  expect_error([&] { make_folder_below(out, "dangling"); }, "dangling: is a link");
  expect_error([&] { make_folder_below(out, "file"); }, "is a file, expected a folder");
  for (const char* leaving : {"..", "a/../../theirs", "/theirs", ""})
    expect_error([&] { make_folder_below(out, leaving); }, "is not a path inside this folder");
  write_file(folder / "new", "new");
  expect_error([&] { move_below(folder / "new", out, "link/new"); }, "is a link");
  expect_error([&] { move_below(folder / "new", out, "../theirs/new"); }, "is not a path inside");
  EXPECT_TRUE(fs::is_empty(folder / "theirs"));
  fs::create_symlink(folder / "theirs", out / "a" / "new");
  move_below(folder / "new", out, "a/new");  // replaces the link
  EXPECT_EQ(read_file(out / "a" / "new"), "new");
  // The root itself may be a link, since the user named it on the command line.
  fs::create_directory_symlink(out, folder / "root");
  make_folder_below(folder / "root", "c");
  EXPECT_TRUE(fs::is_directory(out / "c"));
}

TEST(PrivateFolder, IsWritableForItsUserOnly) {
  const TempFolder temp;
  const fs::path folder = temp.path() / "a" / "cache";
  check_private_folder(folder);  // does not exist
  ::umask(0);
  make_private_folder(folder);
  ::umask(022);
  EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
  make_private_folder(folder);
  for (const mode_t mode : {0777, 01777, 0775, 0702}) {
    ASSERT_EQ(::chmod(folder.c_str(), mode), 0);
    expect_error([&] { make_private_folder(folder); }, "others may write into this cache");
  }
  ASSERT_EQ(::chmod(folder.c_str(), 0755), 0);
  check_private_folder(folder);
  constexpr uid_t nobody = 65534;
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a folder to another user";
  ASSERT_EQ(::chown(folder.c_str(), nobody, nobody), 0);
  expect_error([&] { check_private_folder(folder); }, "belongs to another user");
}

}  // namespace
}  // namespace sextant
