#include "sextant/eval/experiment/case_results.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "sextant/base/byte_stream.h"
#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/new_file.h"

namespace sextant {
namespace {

class RecordsReader : public CaseResultReader {
 public:
  explicit RecordsReader(const fs::path& folder)
      : index_name_((folder / "cases.jsonl").string()),
        records_name_((folder / "records.jsonl").string()),
        index_(index_name_),
        records_(records_name_) {
    if (!index_) fail("{}: cannot open: {}", index_name_, std::strerror(errno));
    if (!records_) fail("{}: cannot open: {}", records_name_, std::strerror(errno));
  }

  std::optional<CaseResult> next() override {
    for (std::string text; std::getline(index_, text);) {
      ++line_;
      if (text.empty()) continue;
      const Json json = parse_json(text, index_name_, line_);
      const std::string where = fmt::format("{}:{}", index_name_, line_);
      CaseResult result;
      result.number = json_member<uint64_t>(json, "case", where);
      if (last_ && result.number == *last_)
        fail("{}: case {} is repeated: expected each case once", where, result.number);
      if (last_ && result.number < *last_)
        fail("{}: case {} stands after case {}: expected ascending numbers", where, result.number, *last_);
      last_ = result.number;
      result.n_records = json_member<uint64_t>(json, "records", where);
      n_stated_ += result.n_records;
      result.noise = json.value("noise", Json());
      take_lines(result.n_records, result.content);
      return result;
    }
    if (records_.peek() != std::char_traits<char>::eof()) fail_count();
    return std::nullopt;
  }

 private:
  void take_lines(uint64_t n, std::string& lines) {
    for (std::string line; n > 0; --n) {
      if (!std::getline(records_, line) || records_.eof()) fail_count();
      ++n_read_;
      lines += line;
      lines += '\n';
    }
  }
  [[noreturn]] void fail_count() {
    std::string line;
    while (std::getline(records_, line) && !records_.eof()) ++n_read_;
    while (std::getline(index_, line))
      if (!line.empty())
        n_stated_ += json_member<uint64_t>(parse_json(line, index_name_), "records", index_name_);
    fail(
        "{}: holds {} complete records, but {} states {}: one of the files was cut off or changed; restore "
        "it, or run the sweep again with --force",
        records_name_, n_read_, index_name_, n_stated_);
  }

  std::string index_name_, records_name_;
  std::ifstream index_, records_;
  int line_ = 0;
  uint64_t n_stated_ = 0, n_read_ = 0;
  std::optional<uint64_t> last_;
};

class SummariesReader : public CaseResultReader {
 public:
  explicit SummariesReader(const fs::path& path) : name_(path.string()), file_(path) {}

  std::optional<CaseResult> next() override {
    std::optional<SummaryReader::Block> block = file_.next();
    if (!block) return std::nullopt;
    CaseResult result;
    result.number = block->number;
    result.content = std::move(block->bytes);
    return result;
  }

  ExactNoises noise() const override { return decode_exact_noises(file_.noise(), name_ + ": noise"); }

 private:
  std::string name_;
  SummaryReader file_;
};

class JournalReader : public CaseResultReader {
 public:
  JournalReader(const Journal& journal, KeepOfCases keep, const NoiseOfCases& noise)
      : journal_(journal), keep_(keep), counted_(noise), at_(journal.blocks().begin()) {}

  std::optional<CaseResult> next() override {
    if (at_ == journal_.blocks().end()) return std::nullopt;
    const auto& [number, block] = *at_++;
    CaseResult result{number, journal_.content(block), block.n_records, block.noise};
    if (keep_ == KeepOfCases::summary) {
      const JournalCase in_journal =
          decode_journal_case(result.content, fmt::format("journal: case {}", number));
      if (counted_.is_counted(number)) noise_[counted_.source_and_level(number)].add(in_journal.noise);
      result.content = std::string(in_journal.summary);
    }
    return result;
  }

  ExactNoises noise() const override { return noise_; }

 private:
  const Journal& journal_;
  KeepOfCases keep_;
  const NoiseOfCases& counted_;
  std::map<uint64_t, Journal::Block>::const_iterator at_;
  ExactNoises noise_;
};

}  // namespace

std::string encode_journal_case(const CaseSummary& summary, const NoiseVerification* noise) {
  ByteWriter out;
  out.text(encode_case_summary(summary));
  if (noise != nullptr) {
    ExactNoise exact;
    exact.add(*noise);
    out.raw(exact.bytes());
  }
  return out.take();
}

JournalCase decode_journal_case(std::string_view bytes, const std::string& where) {
  ByteReader in(bytes, where);
  const std::string_view summary = in.text();
  return {summary, ExactNoise::decode(in.rest(), where)};
}

CaseResultWriter::CaseResultWriter(const OutputFolder& folder, const Json& plan, uint64_t n_cases)
    : noise_(plan) {
  if (kept(plan, "plan.json") == KeepOfCases::summary) {
    summary_.emplace(folder.path(summary_file_name), n_cases);
  } else {
    index_.emplace(folder.path("cases.jsonl"));
    records_.emplace(folder.path("records.jsonl"));
  }
}

void CaseResultWriter::add(const CaseResult& result) {
  if (summary_) {
    const CaseSummary summary =
        decode_case_summary(result.content, fmt::format("summary of case {}", result.number));
    n_records_ += summary.n_records();
    summary_->append(result.number, result.content);
    return;
  }
  n_records_ += result.n_records;
  noise_.add(result.number, result.noise);
  index_->append(json_line(case_json(result.number, result.n_records, result.noise)) + "\n");
  records_->append(result.content);
}

void CaseResultWriter::add_noise(const ExactNoises& noises) {
  for (const auto& [place, noise] : noises) exact_noise_[place].add(noise);
}

void CaseResultWriter::close() {
  if (summary_) {
    for (const auto& [place, noise] : exact_noise_) noise_.set(place, noise.total());
    summary_->close(encode_exact_noises(exact_noise_));
  } else {
    index_->close();
    records_->close();
  }
}

std::vector<std::string> CaseResultWriter::names() const {
  return summary_ ? std::vector<std::string>{summary_file_name}
                  : std::vector<std::string>{"cases.jsonl", "records.jsonl"};
}

std::unique_ptr<CaseResultReader> open_case_results(const fs::path& folder, KeepOfCases keep) {
  if (keep == KeepOfCases::summary) return open_summaries(folder / summary_file_name);
  return std::make_unique<RecordsReader>(folder);
}

std::vector<uint64_t> records_by_case(const fs::path& folder) {
  std::vector<uint64_t> numbers;
  const auto reader = open_case_results(folder, KeepOfCases::records);
  while (const auto result = reader->next()) {
    if (result->number != numbers.size())
      fail("{}: case {} is missing", (folder / "cases.jsonl").string(), numbers.size());
    numbers.push_back(result->n_records);
  }
  return numbers;
}

std::unique_ptr<CaseResultReader> open_summaries(const fs::path& file) {
  return std::make_unique<SummariesReader>(file);
}

std::unique_ptr<CaseResultReader> open_journal(const Journal& journal, KeepOfCases keep,
                                               const NoiseOfCases& noise) {
  return std::make_unique<JournalReader>(journal, keep, noise);
}

MergedCases::MergedCases(std::vector<std::unique_ptr<CaseResultReader>> readers)
    : readers_(std::move(readers)) {
  for (size_t reader = 0; reader < readers_.size(); ++reader) advance(reader);
}

void MergedCases::advance(size_t reader) {
  std::optional<CaseResult> result = readers_[reader]->next();
  if (!result) return;
  const std::pair key(result->number, reader);
  next_.emplace(key, std::move(*result));
}

std::optional<MergedCases::Next> MergedCases::next() {
  if (next_.empty()) return std::nullopt;
  auto first = next_.extract(next_.begin());
  const size_t reader = first.key().second;
  advance(reader);
  return Next{reader, std::move(first.mapped())};
}

std::vector<ExactNoises> MergedCases::noises() const {
  std::vector<ExactNoises> noises;
  for (const auto& reader : readers_) noises.push_back(reader->noise());
  return noises;
}

namespace {

constexpr const char* results_folder = ".finished";
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
    if (block->number >= max_plan_cases)
      fail("{}: case {}: expected at most {} cases", file.string(), block->number, max_plan_cases);
    numbers.push_back(block->number);
  }
  return numbers;
}

}  // namespace

FinishedCases::FinishedCases(const fs::path& folder, const std::string& owner, bool of_any)
    : folder_(folder / results_folder / owner.substr(0, owner_digits)) {
  for (const fs::path& file : files_in(of_any ? folder_.parent_path() : folder_)) {
    try {
      const std::vector<uint64_t> numbers = read_numbers(file);
      if (std::ranges::any_of(numbers, [this](uint64_t number) { return contains(number); })) continue;
      for (const uint64_t number : numbers) mark(number);
      files_.push_back(file);
    } catch (const Error&) {
      continue;  // damaged: its cases are computed again
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
  make_folder_below(folder_.parent_path().parent_path(), fs::path(results_folder) / folder_.filename());
  size_t number = files_in(folder_).size() + 1;
  const auto numbered = [&] { return folder_ / fmt::format("{:06}.bin", number); };
  while (fs::exists(numbered(), error)) ++number;
  const fs::path file = numbered();
  const fs::path temporary = folder_ / "next.tmp";
  fs::remove(temporary, error);  // left by a killed process
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
  for (const auto& [finished, block] : journal.blocks()) mark(finished);
  journal.clear();
}

uint64_t FinishedCases::count(const fs::path& folder) {
  uint64_t n = 0;
  for (const fs::path& file : files_in(folder / results_folder)) n += SummaryReader(file).n_cases();
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
  fs::remove_all(folder / results_folder, ignored);
}

}  // namespace sextant
