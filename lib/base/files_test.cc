#include "sextant/base/files.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <iterator>

#include "sextant/base/error.h"
#include "sextant/base/machine.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

class Files : public ::testing::Test {
 protected:
  std::ptrdiff_t entries() const {
    return std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
  }

  TempFolder folder_of_its_own_;
  fs::path folder_ = folder_of_its_own_.path();
};

TEST_F(Files, RoundTripBytes) {
  std::string bytes = "line\nwith\0zero and \xff";
  bytes.push_back('\0');
  write_file(folder_ / "a", bytes);
  EXPECT_EQ(read_file(folder_ / "a"), bytes);
  EXPECT_EQ(entries(), 1);
  write_file(folder_ / "a", "");
  EXPECT_EQ(read_file(folder_ / "a"), "");
}

// The file is sparse: it occupies no disk space, and reading it would take 20 GB of memory.
TEST_F(Files, TooLargeIsRefusedBeforeReading) {
  const fs::path path = folder_ / "huge.txt";
  write_file(path, "x");
  fs::resize_file(path, 20'000'000'000);
  EXPECT_EQ(error_of([&] { read_file(path); }),
            path.string() + ": has 20.0 GB, expected at most 1.07 GB for a file of data");
  expect_error([&] { read_file(path, json_file); }, "at most 0.27 GB for a JSON file");
  expect_error([&] { read_file(path, records_file); }, "at most 8.59 GB for a file of records");
  expect_error([&] { InputLog().read(path); }, "has 20.0 GB");
}

TEST_F(Files, ReadNamesThePathAndTheReason) {
  const std::string path = (folder_ / "missing.png").string();
  EXPECT_THAT(error_of([&] { read_file(path); }), AllOf(HasSubstr(path), HasSubstr("No such file")));
  expect_error([&] { read_file(folder_); }, "is a folder");
}

TEST_F(Files, AFailedWriteLeavesNothingBehind) {
  expect_error([&] { write_file(folder_ / "no" / "a", "x"); }, "cannot create");
  EXPECT_EQ(entries(), 0);
  fs::create_directory(folder_ / "taken");
  write_file(folder_ / "taken" / "child", "x");
  // The temporary file can be written but cannot be renamed over a folder.
  expect_error([&] { write_file(folder_ / "taken", "x"); }, "taken: is a folder");
  EXPECT_EQ(entries(), 1);
}

TEST_F(Files, TwoThreadsMayWriteTheSameFile) {
  parallel_for(200, 8, [&](int i) {
    write_file(folder_ / "same", std::string(10000, static_cast<char>('a' + i % 26)));
  });
  const std::string bytes = read_file(folder_ / "same");
  ASSERT_EQ(bytes.size(), 10000U);
  EXPECT_TRUE(std::all_of(bytes.begin(), bytes.end(), [&](char c) { return c == bytes[0]; }));
  EXPECT_EQ(entries(), 1);
}

// Vectors of FIPS 180-4 (NIST examples).
TEST(Sha256, KnownVectors) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_F(Files, InputLogRemembersEveryFileOnce) {
  write_file(folder_ / "b", "abc");
  write_file(folder_ / "a", "");
  InputLog log;
  parallel_for(32, 4, [&](int i) { log.read(folder_ / (i % 2 == 0 ? "a" : "b")); });
  const auto entries = log.entries();
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries.begin()->first, (folder_ / "a").string());
  EXPECT_EQ(entries.begin()->second.bytes, 0U);
  const InputLog::Entry& b = entries.at((folder_ / "b").string());
  EXPECT_EQ(b.bytes, 3U);
  EXPECT_EQ(b.sha256, sha256("abc"));
}

TEST_F(Files, APipeIsNotWaitedFor) {
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  expect_error([&] { read_file(pipe); }, "pipe: is a pipe or device, expected a file");
}

TEST_F(Files, InputLogForgetsWhatCouldNotBeRead) {
  InputLog log;
  EXPECT_THROW(log.read(folder_ / "missing"), Error);
  EXPECT_TRUE(log.entries().empty());
}

}  // namespace
}  // namespace sextant
