// Locks between processes, with flock() and on file systems without it.

#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <optional>
#include <vector>

#include "sextant/base/file_lock.h"
#include "sextant/base/files.h"
#include "sextant/base/machine.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

int no_flock(int /*file*/, int /*operation*/) {
  errno = ENOLCK;
  return -1;
}

int broken_flock(int /*file*/, int /*operation*/) {
  errno = EIO;
  return -1;
}

class FileLocks : public ::testing::TestWithParam<FileLock::Flock> {
 protected:
  TempFolder folder_;
  std::filesystem::path file_ = folder_.path() / "journal.jsonl";

  /// Returns true if another process can take the lock.
  bool other_process_takes() const {
    return WEXITSTATUS(
               status_of_child([&] { return FileLock::take(file_, nullptr, GetParam()).has_value(); })) == 1;
  }
};

TEST_P(FileLocks, ASecondProcessGetsTheHolder) {
  {
    const auto lock = FileLock::take(file_, nullptr, GetParam());
    ASSERT_TRUE(lock);
    EXPECT_FALSE(other_process_takes());
    std::string holder;
    EXPECT_FALSE(FileLock::take(file_, &holder, GetParam()));
    EXPECT_THAT(holder, HasSubstr("process"));
  }
  EXPECT_TRUE(other_process_takes());
}

TEST_P(FileLocks, EndsWithItsProcess) {
  status_of_child([&]() -> int {
    const auto lock = FileLock::take(file_, nullptr, GetParam());
    ::_exit(0);  // skips destructors, as kill -9 does
  });
  EXPECT_TRUE(other_process_takes());
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutFlock, FileLocks, ::testing::Values(&::flock, &no_flock));

TEST(FileLock, LocksOfOtherHostsAreKeptAndNamed) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path() / "journal.jsonl";
  std::ofstream(file.string() + ".lock") << "node17 4711\n";
  std::string holder;
  EXPECT_FALSE(FileLock::take(file, &holder, &no_flock));
  EXPECT_THAT(holder, HasSubstr("process 4711 on node17 (if it no longer exists, remove " + file.string() +
                                ".lock)"));
}

TEST(FileLock, ErrorsContainTheSystemsReason) {
  const TempFolder folder;
  expect_error([&] { FileLock::take(folder.path() / "journal.jsonl", nullptr, &broken_flock); },
               "journal.jsonl: cannot lock: Input/output error");
}

TEST(Machine, CoresAreThoseOfTheAffinity) {
  cpu_set_t before;
  ASSERT_EQ(::sched_getaffinity(0, sizeof(before), &before), 0);
  int first = 0;
  while (!CPU_ISSET(first, &before)) ++first;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(first, &one);
  ASSERT_EQ(::sched_setaffinity(0, sizeof(one), &one), 0);
  EXPECT_EQ(available_cores(), 1);
  ASSERT_EQ(::sched_setaffinity(0, sizeof(before), &before), 0);
  EXPECT_LE(available_cores(), CPU_COUNT(&before));
}

TEST(Machine, CoresAreThoseOfTheTask) {
  ::setenv("SLURM_CPUS_PER_TASK", "1", 1);
  EXPECT_EQ(available_cores(), 1);
  ::setenv("SLURM_CPUS_PER_TASK", "none", 1);
  EXPECT_GE(available_cores(), 1);
  ::unsetenv("SLURM_CPUS_PER_TASK");
}

TEST(Machine, Quotas) {
  EXPECT_DOUBLE_EQ(cores_of_quota("150000 100000"), 1.5);
  EXPECT_EQ(cores_of_quota("max 100000"), 0);
  EXPECT_EQ(cores_of_quota("-1 100000"), 0);
  EXPECT_EQ(cores_of_quota(" "), 0);
}

TEST(Machine, HostNameIsFitForFiles) {
  EXPECT_THAT(host_name(), Not(IsEmpty()));
  EXPECT_EQ(host_name().find_first_of("/. \n"), std::string::npos);
}

}  // namespace

namespace {

/// Returns the error message of another process that tries to take the lock; "" if it succeeds.
std::string from_another_process(const fs::path& folder, const fs::path& message_file) {
  status_of_child([&] {
    write_file(message_file, error_of([&] { const FolderLock lock(folder); }));
    return 0;
  });
  return read_file(message_file);
}

TEST(FolderLock, OneProcessAtATime) {
  const TempFolder temp;
  const fs::path out = temp.path() / "out";
  {
    const FolderLock lock(out);
    const FolderLock again(out / "." / "");  // shared with itself
    EXPECT_THAT(from_another_process(out, temp / "message"), HasSubstr("out: another process is writing into "
                                                                       "this folder"));
    EXPECT_EQ(from_another_process(temp.path() / "other", temp / "message"), "no error");
  }
  EXPECT_EQ(from_another_process(out, temp / "message"), "no error");
  EXPECT_THAT(files_below(temp.path()), testing::SizeIs(1)) << "the lock leaves no file";
}

TEST(FolderLock, EndsWithTheLastHolder) {
  const TempFolder temp;
  std::optional<FolderLock> first(temp.path());
  const std::optional<FolderLock> second(temp.path());
  first.reset();
  EXPECT_THAT(from_another_process(temp.path(), temp / "message"), HasSubstr("is writing into this folder"));
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

/// Takes and releases the lock of `folder` 300 times, and writes into the folder while it holds the lock.
/// Returns 0 if every attempt either succeeded or was refused because another process holds the lock.
int lock_repeatedly(const fs::path& folder) {
  for (int round = 0; round < 300; ++round) {
    const std::string error = error_of([&] {
      const FolderLock lock(folder);
      write_file(folder / "result", "of the process that holds the lock");
      fs::remove(folder / "result");
    });
    if (error != "no error" && error.find("is writing into this folder") == std::string::npos) {
      std::cerr << error << "\n";
      return 1;
    }
  }
  return 0;
}

TEST(FolderLock, ARefusedProcessRemovesNoFolderOfTheHolder) {
  const TempFolder temp;
  std::vector<pid_t> children;
  for (int i = 0; i < 4; ++i) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(lock_repeatedly(temp / "shards/1"));
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = -1;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
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
