#include "sextant/base/files.h"
#include "sextant/eval/experiment/case_results.h"

#include "sextant/base/byte_stream.h"
#include "sextant/base/error.h"
#include "sextant/eval/records/journal.h"

namespace sextant {
namespace {

class RecordsReader : public CaseResultReader {
 public:
  explicit RecordsReader(const fs::path& folder)
      : index_name_((folder / "cases.jsonl").string()),
        records_name_((folder / "records.jsonl").string()),
        index_(index_name_),
        records_(records_name_) {
    if (!index_) fail("{}: cannot open", index_name_);
    if (!records_) fail("{}: cannot open", records_name_);
  }

  std::optional<CaseResult> next() override {
    for (std::string text; std::getline(index_, text);) {
      ++line_;
      if (text.empty()) continue;
      const Json json = parse_json(text, index_name_, line_);
      const std::string where = fmt::format("{}:{}", index_name_, line_);
      CaseResult result;
      result.number = json_member<uint64_t>(json, "case", where);
      if (last_ && result.number == *last_) fail("{}: case {} is there twice", where, result.number);
      if (last_ && result.number < *last_) fail("{}: case {} stands after case {}", where, result.number, *last_);
      last_ = result.number;
      result.n_records = json_member<uint64_t>(json, "records", where);
      result.noise = json.value("noise", Json());
      take_lines(result.n_records, result.content);
      return result;
    }
    if (records_.peek() != std::char_traits<char>::eof()) fail_count("more");
    return std::nullopt;
  }

 private:
  void take_lines(uint64_t n, std::string& lines) {
    for (std::string line; n > 0; --n) {
      if (!std::getline(records_, line) || records_.eof()) fail_count("fewer");
      lines += line;
      lines += '\n';
    }
  }
  [[noreturn]] void fail_count(const char* what) const {
    fail("{}: has {} records than {} says", records_name_, what, index_name_);
  }

  std::string index_name_, records_name_;
  std::ifstream index_, records_;
  int line_ = 0;
  std::optional<uint64_t> last_;
};

class SummariesReader : public CaseResultReader {
 public:
  explicit SummariesReader(const fs::path& folder)
      : name_((folder / summary_file_name).string()), file_(folder / summary_file_name) {}

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

CaseResultWriter::CaseResultWriter(const OutputFolder& folder, const Json& plan, uint64_t n_cases) : noise_(plan) {
  if (kept(plan, "plan.json") == KeepOfCases::summary) {
    summary_.emplace(folder.path(summary_file_name), n_cases);
  } else {
    index_.emplace(folder.path("cases.jsonl"));
    records_.emplace(folder.path("records.jsonl"));
  }
}

void CaseResultWriter::add(const CaseResult& result) {
  if (summary_) {
    const CaseSummary summary = decode_case_summary(result.content, fmt::format("summary of case {}", result.number));
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
  return summary_ ? std::vector<std::string>{summary_file_name} : std::vector<std::string>{"cases.jsonl", "records.jsonl"};
}

std::unique_ptr<CaseResultReader> open_case_results(const fs::path& folder, KeepOfCases keep) {
  if (keep == KeepOfCases::summary) return std::make_unique<SummariesReader>(folder);
  return std::make_unique<RecordsReader>(folder);
}

}  // namespace sextant
