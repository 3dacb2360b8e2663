#include "sextant/base/folder_lock.h"

#include <optional>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

/// Message of another process that takes the lock; "" when it gets it.
std::string from_another_process(const fs::path& folder, const fs::path& said) {
  status_of_child([&] {
    write_file(said, error_of([&] { const FolderLock lock(folder); }));
    return 0;
  });
  return read_file(said);
}

TEST(FolderLock, OneProcessAtATime) {
  const TempFolder temp;
  const fs::path out = temp.path() / "out";
  {
    const FolderLock lock(out);
    const FolderLock again(out / "." / "");  // shared with itself
    EXPECT_THAT(from_another_process(out, temp / "said"), HasSubstr("out: another process is writing into this folder"));
    EXPECT_EQ(from_another_process(temp.path() / "other", temp / "said"), "no error");
  }
  EXPECT_EQ(from_another_process(out, temp / "said"), "no error");
  EXPECT_THAT(files_below(temp.path()), testing::SizeIs(1)) << "the lock leaves no file";
}

TEST(FolderLock, EndsWithTheLastHolder) {
  const TempFolder temp;
  std::optional<FolderLock> first(temp.path());
  const std::optional<FolderLock> second(temp.path());
  first.reset();
  EXPECT_THAT(from_another_process(temp.path(), temp / "said"), HasSubstr("is writing into this folder"));
}

TEST(FolderLock, RemovesTheEmptyFoldersThatItMade) {
  const TempFolder temp;
  fs::create_directory(temp / "there");
  {
    const FolderLock lock(temp.path() / "there" / "a" / "b");
    EXPECT_TRUE(fs::is_directory(temp / "there/a/b"));
  }
  EXPECT_TRUE(fs::is_empty(temp / "there"));
  {
    const FolderLock lock(temp.path() / "there" / "a" / "b");
    temp.write("there/a/theirs", "of another command");
  }
  EXPECT_TRUE(fs::exists(temp / "there/a/theirs"));
  EXPECT_FALSE(fs::exists(temp / "there/a/b"));
}

TEST(FolderLock, NeedsAFolder) {
  const TempFolder temp;
  temp.write("file", "x");
  expect_error([&] { FolderLock lock(temp / "file"); }, "is a file, expected a folder for the results");
  expect_error([&] { FolderLock lock(temp / "file/below"); }, "cannot create");
  expect_error([&] { FolderLock lock(""); }, "expected a folder");
}

}  // namespace
}  // namespace sextant
