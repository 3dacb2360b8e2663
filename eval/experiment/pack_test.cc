#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <new>

#include "sextant/base/error.h"
#include "sextant/base/file_lock.h"
#include "sextant/base/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/experiment/pack.h"

namespace sextant {
namespace {

/// A small VDO folder and a correspondence cache.
class PackTest : public testing::Test {
 protected:
  PackTest() : cache_(folder_.path() / "cache") {
    make_vdo_fixture(folder_.path() / "vdo", {.n_frames = 4, .width = 160, .height = 48});
  }

  PackCache::Packed load(const std::string& name = "vdo") const {
    const SourceSpec source = SourceSpec::parse("vdo:" + (folder_.path() / name).string());
    return cache_.load(source, *open_source(source), options_, Noise(), 1, true);
  }
  static std::string bytes_of(const std::vector<ExtractedPair>& pairs) {
    return encode_pack({Json::object(), pairs});
  }
  fs::path file(const std::string& name) const { return folder_.path() / "vdo" / name; }

  TempFolder folder_;
  PackCache cache_;
  ExtractionOptions options_;
};

TEST_F(PackTest, RoundTrips) {
  std::vector<ExtractedPair> pairs = load().pairs;
  ASSERT_EQ(pairs.size(), 3U);
  ASSERT_GT(pairs[0].pair.background.size(), 20U);
  ASSERT_FALSE(pairs[0].pair.objects.empty());
  pairs[1].true_flow = FlowSamples({{3, 4, {0.5F, -1.0F}}, {1, 2, {}}});
  pairs[1].pair.lost_instances = {7};
  const std::string bytes = encode_pack({Json{{"a", 1}}, pairs});
  const Pack back = decode_pack(bytes, "p");
  EXPECT_EQ(back.manifest, (Json{{"a", 1}}));
  EXPECT_EQ(encode_pack(back), bytes);
  const Correspondences& a = pairs[0].pair.background;
  const Correspondences& b = back.pairs[0].pair.background;
  EXPECT_EQ(a.u, b.u);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.flow_v, b.flow_v);
  EXPECT_EQ(back.pairs[0].pair.objects[0].instance_prev, pairs[0].pair.objects[0].instance_prev);
  EXPECT_EQ(back.pairs[0].pair.camera.bf, pairs[0].pair.camera.bf);
  EXPECT_EQ(back.pairs[1].true_flow->at(3, 4).v, -1.0F);
  EXPECT_FALSE(back.pairs[1].true_flow->at(4, 4).valid());
  EXPECT_EQ(back.pairs[1].pair.lost_instances, std::vector<int>{7});
}

TEST_F(PackTest, DamageIsSeen) {
  const std::string bytes = bytes_of(load().pairs);
  for (size_t i = 0; i < bytes.size(); i += bytes.size() / 50) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 1);
    EXPECT_THROW(decode_pack(damaged, "p"), Error) << i;
  }
  for (const size_t n : {size_t{0}, size_t{5}, size_t{40}, bytes.size() / 2, bytes.size() - 1}) {
    EXPECT_THROW(decode_pack(bytes.substr(0, n), "p"), Error) << n;
  }
  EXPECT_THROW(decode_pack(bytes + "x", "p"), Error);
}

// 8 MB of zeros that declare a million pairs, each of which takes at least 105 bytes.
TEST_F(PackTest, ForgedCountsAllocateNoMemory) {
  const auto number = [](uint64_t n) { return std::string(reinterpret_cast<const char*>(&n), sizeof n); };
  const std::string pairs = number(1'000'000) + std::string(8'000'000, '\0');
  const auto version = static_cast<uint32_t>(pack_version);
  std::string bytes = "SEXTPACK" + std::string(reinterpret_cast<const char*>(&version), sizeof version) +
                      number(2) + "{}" + number(pairs.size()) + pairs;
  bytes += sha256(bytes);
  const auto decode_in_100_mb_more = [&] {
    uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlimit limit{pages * static_cast<uint64_t>(::getpagesize()) + 100'000'000, RLIM_INFINITY};
    ::setrlimit(RLIMIT_AS, &limit);
    try {
      decode_pack(bytes, "forged");
    } catch (const Error& error) {
      std::fputs(error.what(), stderr);
      ::_exit(0);
    } catch (const std::bad_alloc&) {
    }
    ::_exit(1);
  };
  EXPECT_EXIT(decode_in_100_mb_more(), testing::ExitedWithCode(0), "forged: damaged");
}

TEST_F(PackTest, ASecondLoadDecodesNothing) {
  const PackCache::Packed first = load();
  const PackCache::Packed second = load();
  EXPECT_FALSE(first.was_there);
  EXPECT_TRUE(second.was_there);
  EXPECT_EQ(bytes_of(first.pairs), bytes_of(second.pairs));
  EXPECT_EQ(first.inputs.size(), second.inputs.size());
  EXPECT_GE(second.inputs.size(), 15U);  // 4 images, depths, masks, 3 flows and the truth
}

TEST_F(PackTest, AnInputWithANewTimeButTheSameBytesChangesNothing) {
  load();
  fs::last_write_time(file("depth/000001.png"), fs::file_time_type::clock::now() + std::chrono::hours(1));
  EXPECT_TRUE(load().was_there);
}

TEST_F(PackTest, AChangedInputMakesANewPack) {
  const PackCache::Packed first = load();
  fs::copy_file(file("depth/000000.png"), file("depth/000001.png"), fs::copy_options::overwrite_existing);
  const PackCache::Packed second = load();
  EXPECT_FALSE(second.was_there);
  EXPECT_NE(first.file, second.file);
  EXPECT_NE(bytes_of(first.pairs), bytes_of(second.pairs));
}

TEST_F(PackTest, AnotherOptionMakesAnotherPack) {
  const PackCache::Packed first = load();
  options_.object_step_px = 2;
  const PackCache::Packed second = load();
  EXPECT_FALSE(second.was_there);
  EXPECT_NE(first.file, second.file);
  options_.object_step_px = 3;
  EXPECT_TRUE(load().was_there);
}

TEST_F(PackTest, DamagedFilesAreComputedAgain) {
  const PackCache::Packed first = load();
  std::string bytes = read_file(first.file);
  bytes[bytes.size() / 2] ^= 1;
  write_file(first.file, bytes);
  EXPECT_FALSE(cache_.list().at(0).valid);
  const PackCache::Packed second = load();
  EXPECT_FALSE(second.was_there);
  EXPECT_EQ(second.file, first.file);
  EXPECT_TRUE(load().was_there);
}

TEST_F(PackTest, EqualDataInAnotherFolderShareThePack) {
  const PackCache::Packed first = load();
  fs::create_directories(folder_.path() / "moved");
  fs::copy(folder_.path() / "vdo", folder_.path() / "moved" / "vdo", fs::copy_options::recursive);
  EXPECT_EQ(load("moved/vdo").file, first.file);
  EXPECT_EQ(cache_.list().size(), 1U);
}

TEST_F(PackTest, PruneKeepsWhatIsValid) {
  const PackCache::Packed old = load();
  fs::copy_file(file("depth/000000.png"), file("depth/000001.png"), fs::copy_options::overwrite_existing);
  const PackCache::Packed present = load();
  EXPECT_EQ(cache_.list().size(), 2U);
  EXPECT_GE(cache_.prune(false), fs::file_size(present.file) / 2);
  EXPECT_FALSE(fs::exists(old.file));
  EXPECT_TRUE(load().was_there);
  EXPECT_GT(cache_.prune(true), 0U);
  EXPECT_TRUE(cache_.list().empty());
  EXPECT_THAT(files_below(cache_.folder()), ElementsAre(testing::Key("CACHEDIR.TAG")));
}

TEST_F(PackTest, PruneRemovesNothingElse) {
  const PackCache::Packed present = load();
  const std::map<std::string, std::string> theirs = {{"run.json", "{}"},
                                                     {"plan.json", "{}"},
                                                     {"my.pack", "x"},
                                                     {"a.json.tmp1", "x"},
                                                     {sha256("x") + ".json.bak", "x"}};
  for (const auto& [name, bytes] : theirs) write_file(cache_.folder() / name, bytes);
  fs::create_symlink(present.file, cache_.folder() / (sha256("link") + ".pack"));
  EXPECT_GT(cache_.prune(true), 0U);
  std::map<std::string, std::string> left = files_below(cache_.folder());
  left.erase("CACHEDIR.TAG");
  EXPECT_EQ(left, theirs);
  EXPECT_TRUE(fs::is_symlink(cache_.folder() / (sha256("link") + ".pack")));
}

TEST_F(PackTest, OnlyAMarkedFolderIsPruned) {
  // A folder with other files can be used as a cache, but is not marked.
  fs::create_directories(cache_.folder());
  write_file(cache_.folder() / "run.json", "{}");
  const PackCache::Packed present = load();
  EXPECT_TRUE(load().was_there);
  expect_error([&] { cache_.prune(true); },
               "does not contain Sextant's CACHEDIR.TAG, which marks a cache, so nothing was removed");
  EXPECT_TRUE(fs::exists(present.file));
  // The mark of another program does not count.
  write_file(cache_.folder() / "CACHEDIR.TAG", "Signature: 8a477f597d28d172789f06886806bc55\n");
  expect_error([&] { cache_.prune(true); }, "does not contain Sextant's CACHEDIR.TAG");
  EXPECT_EQ(PackCache(cache_.folder() / "none").prune(true), 0U);
}

TEST_F(PackTest, CachesOfOtherUsersAreRefused) {
  load();
  fs::permissions(cache_.folder(), fs::perms::all);
  expect_error([&] { load(); }, "others may write into this cache");
  expect_error([&] { cache_.list(); }, "others may write into this cache");
  expect_error([&] { cache_.prune(true); }, "others may write into this cache");
}

TEST_F(PackTest, PruneRemovesFilesOfKilledProcesses) {
  const PackCache::Packed present = load();
  const std::string request = sha256("a request");
  const std::vector<fs::path> left = {present.file.string() + ".tmp0123456789abcdef",
                                      cache_.folder() / (request + ".json.tmp0123456789abcdef")};
  for (const fs::path& path : left) write_file(path, "half of it");
  const fs::path lock_file = cache_.folder() / (request + ".json.making");
  {
    const std::optional<FileLock> making = FileLock::take(lock_file);
    ASSERT_TRUE(making);
    EXPECT_EQ(cache_.prune(false), 0U) << "another process fills the cache: these may be its files";
    for (const fs::path& path : left) EXPECT_TRUE(fs::exists(path)) << path;
  }
  EXPECT_EQ(cache_.prune(false), 20U);
  for (const fs::path& path : left) EXPECT_FALSE(fs::exists(path)) << path;
  EXPECT_FALSE(fs::exists(lock_file));
  EXPECT_TRUE(load().was_there);
}

TEST_F(PackTest, AFolderThatCannotBeMadeIsAnError) {
  write_file(folder_.path() / "file", "x");
  cache_ = PackCache(folder_.path() / "file" / "cache");
  expect_error([&] { load(); }, "--cache");
}

}  // namespace
}  // namespace sextant
