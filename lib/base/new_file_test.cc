#include "sextant/base/new_file.h"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <set>

#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
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

// The program does not reach check_interrupt(), and a child that it has started, as gnuplot, goes on writing.
TEST(ScratchFolder, IsRemovedWhenASignalEndsTheProgramWhileAChildWritesInIt) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const pid_t program = ::fork();
  if (program == 0) {
    install_interrupt_handler("", 130);
    const ScratchFolder scratch("sextant-interrupted-");
    if (::fork() == 0) {
      for (int i = 0; std::ofstream(scratch.path() / std::to_string(i % 1000)); ++i) {
      }
      ::_exit(0);
    }
    const std::string path = scratch.path().string();
    while (!fs::exists(scratch.path() / "100")) ::usleep(1000);
    if (!write_all(ends[1], path)) ::_exit(1);
    while (true) ::pause();
  }
  ::close(ends[1]);
  std::string path(4096, '\0');
  const ssize_t n = ::read(ends[0], path.data(), path.size());
  ::close(ends[0]);
  ASSERT_GT(n, 0);
  path.resize(static_cast<size_t>(n));
  EXPECT_TRUE(fs::exists(path));
  ::kill(program, SIGTERM);
  int status = 0;
  ASSERT_EQ(::waitpid(program, &status, 0), program);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 130) << status;
  EXPECT_FALSE(fs::exists(path));
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
