// Locks between processes, with flock() and where there is none.

#include "sextant/base/file_lock.h"

#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>

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

  /// Whether another process can take the lock.
  bool other_process_takes() const {
    return WEXITSTATUS(
               status_of_child([&] { return FileLock::take(file_, nullptr, GetParam()).has_value(); })) == 1;
  }
};

TEST_P(FileLocks, OneHoldsAndTheOtherIsTold) {
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
    ::_exit(0);  // without destructors, as after kill -9
  });
  EXPECT_TRUE(other_process_takes());
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutFlock, FileLocks, ::testing::Values(&::flock, &no_flock));

TEST(FileLock, OfAnotherHostIsKeptAndNamed) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path() / "journal.jsonl";
  std::ofstream(file.string() + ".lock") << "node17 4711\n";
  std::string holder;
  EXPECT_FALSE(FileLock::take(file, &holder, &no_flock));
  EXPECT_THAT(holder, HasSubstr("process 4711 on node17 (if it is no more: remove " + file.string() + ".lock)"));
}

TEST(FileLock, TheSystemsReasonIsSaid) {
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
}  // namespace sextant
