#include "sextant/base/new_file.h"

#include <sys/stat.h>

#include <set>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

TEST(NewFile, GetsItsNameWhenItIsComplete) {
  const TempFolder folder;
  {
    NewFile file(folder / "a");
    file.append("text");
    EXPECT_FALSE(fs::exists(folder / "a"));
    file.commit();
  }
  EXPECT_EQ(read_file(folder / "a"), "text");
  { NewFile(folder / "b").append("text"); }
  EXPECT_EQ(files_below(folder.path()).size(), 1U) << "without commit() nothing stays";
}

TEST(NewFile, TemporaryNamesAreUnpredictable) {
  const TempFolder folder;
  std::set<fs::path> names;
  for (int i = 0; i < 100; ++i) names.insert(NewFile(folder / "a").temporary());
  EXPECT_EQ(names.size(), 100U);
}

TEST(NewFile, ReplacesALinkAndKeepsItsTarget) {
  const TempFolder folder;
  folder.write("theirs", "theirs");
  fs::create_symlink(folder / "theirs", folder / "link");
  fs::create_symlink(folder / "nowhere", folder / "dangling");
  write_file(folder / "link", "ours");
  write_file(folder / "dangling", "ours");
  EXPECT_EQ(read_file(folder / "theirs"), "theirs");
  EXPECT_EQ(read_file(folder / "link"), "ours");
  EXPECT_FALSE(fs::is_symlink(folder / "link"));
  EXPECT_FALSE(fs::exists(folder / "nowhere"));
}

TEST(NewFile, TakesThePlaceOfFilesOnly) {
  const TempFolder folder;
  expect_error([&] { write_file(folder.path(), "x"); }, "is a folder: expected the name of a file");
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  fs::create_symlink(folder / "pipe", folder / "link");
  expect_error([&] { write_file(folder / "pipe", "x"); }, "is a pipe or device: expected the name of a file");
  expect_error([&] { write_file(folder / "link", "x"); }, "is a pipe or device: expected the name of a file");
  expect_error([&] { write_file("/dev/null", "x"); }, "is a pipe or device: expected the name of a file");
}

TEST(StreamedFile, DoesNotWriteIntoExistingFiles) {
  const TempFolder folder;
  folder.write("theirs", "theirs");
  fs::create_symlink(folder / "theirs", folder / "link");
  for (const char* name : {"theirs", "link"})
    expect_error([&] { StreamedFile file(folder / name); }, "cannot create: File exists");
  EXPECT_EQ(read_file(folder / "theirs"), "theirs");
}

}  // namespace
}  // namespace sextant
