#include "sextant/eval/fuzz/targets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/files.h"

namespace sextant {

/// The name in messages.
void PrintTo(const FuzzTarget& target, std::ostream* out) { *out << target.name; }

namespace {

const fs::path corpus = SEXTANT_CORPUS;

std::vector<fs::path> files_of(const FuzzTarget& target) {
  std::vector<fs::path> files;
  if (!fs::is_directory(corpus / target.name)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(corpus / target.name))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

class Replay : public testing::TestWithParam<FuzzTarget> {};

TEST_P(Replay, EveryFileIsTakenOrRefused) {
  const std::vector<fs::path> files = files_of(GetParam());
  int taken = 0;
  std::string refused;
  for (const fs::path& file : files) {
    try {
      const std::string why = refusal(GetParam(), read_file(file));
      taken += why.empty() ? 1 : 0;
      if (!why.empty()) refused += fmt::format("\n  {}: {}", file.filename().string(), why);
    } catch (const std::exception& error) {
      ADD_FAILURE() << file << ": " << error.what();
    }
  }
  EXPECT_GT(taken, 0) << (corpus / GetParam().name)
                      << " holds no file that this reader accepts: put one there, made by us" << refused;
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Replay, testing::ValuesIn(fuzz_targets().begin(), fuzz_targets().end()),
                         [](const auto& instance) {
                           std::string name = instance.param.name;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(FuzzCorpus, BelongsToTargetsAndIsSmall) {
  std::set<std::string> names;
  for (const FuzzTarget& target : fuzz_targets())
    EXPECT_TRUE(names.insert(target.name).second) << target.name;
  for (const auto& folder : fs::directory_iterator(corpus))
    EXPECT_TRUE(names.contains(folder.path().filename())) << folder.path() << ": no such target";
  uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(corpus))
    if (entry.is_regular_file()) bytes += entry.file_size();
  EXPECT_LT(bytes, 500'000U) << "large files belong elsewhere; make them smaller";
}

}  // namespace
}  // namespace sextant
