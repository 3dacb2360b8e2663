#include "sextant/eval/experiment/finished_cases.h"

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/safe_paths.h"

namespace sextant {
namespace {

constexpr const char* folder_name = ".finished";
constexpr size_t owner_digits = 16;

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(folder, error)) {
    if (entry.path().extension() == ".bin") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

std::vector<uint64_t> read_numbers(const fs::path& file) {
  std::vector<uint64_t> numbers;
  SummaryReader reader(file);
  while (const auto block = reader.next()) {
    constexpr uint64_t most_cases = 10'000'000;  // of a plan
    if (block->number >= most_cases) fail("{}: case {}: expected at most {} cases", file.string(), block->number, most_cases);
    numbers.push_back(block->number);
  }
  return numbers;
}

}  // namespace

FinishedCases::FinishedCases(const fs::path& folder, const std::string& owner, bool of_any)
    : folder_(folder / folder_name / owner.substr(0, owner_digits)) {
  for (const fs::path& file : files_in(of_any ? folder_.parent_path() : folder_)) {
    try {
      const std::vector<uint64_t> numbers = read_numbers(file);
      if (std::ranges::any_of(numbers, [this](uint64_t number) { return contains(number); })) continue;
      for (const uint64_t number : numbers) mark(number);
      files_.push_back(file);
    } catch (const Error&) {
      continue;  // damaged: its cases are done again
    }
  }
}

void FinishedCases::mark(uint64_t number) {
  if (number >= is_there_.size()) is_there_.resize(number + 1);
  is_there_[number] = true;
  ++n_cases_;
}

std::vector<std::unique_ptr<CaseResultReader>> FinishedCases::readers() const {
  std::vector<std::unique_ptr<CaseResultReader>> readers;
  for (const fs::path& file : files_) readers.push_back(open_summaries(file));
  return readers;
}

void FinishedCases::take_from(Journal& journal, const NoiseOfCases& noise) {
  std::error_code error;
  make_folder_below(folder_.parent_path().parent_path(), fs::path(folder_name) / folder_.filename());
  size_t number = files_in(folder_).size() + 1;
  const auto numbered = [&] { return folder_ / fmt::format("{:06}.bin", number); };
  while (fs::exists(numbered(), error)) ++number;
  const fs::path file = numbered();
  const fs::path temporary = folder_ / "next.tmp";
  fs::remove(temporary, error);  // of a process that was killed
  try {
    SummaryWriter writer(temporary, journal.blocks().size());
    const auto reader = open_journal(journal, KeepOfCases::summary, noise);
    while (const auto result = reader->next()) writer.append(result->number, result->content);
    writer.close(encode_exact_noises(reader->noise()));
    fs::rename(temporary, file);
    sync_folder(folder_);
  } catch (...) {
    fs::remove(temporary, error);
    throw;
  }
  files_.push_back(file);
  for (const auto& [number, block] : journal.blocks()) mark(number);
  journal.clear();
}

uint64_t FinishedCases::count(const fs::path& folder) {
  uint64_t n = 0;
  for (const fs::path& file : files_in(folder / folder_name)) n += SummaryReader(file).n_cases();
  return n;
}

void FinishedCases::remove_others() const {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_.parent_path(), error)) {
    if (entry.path().filename() == folder_.filename()) continue;
    std::error_code ignored;
    fs::remove_all(entry.path(), ignored);
  }
}

void FinishedCases::remove(const fs::path& folder) {
  std::error_code ignored;
  fs::remove_all(folder / folder_name, ignored);
}

}  // namespace sextant
