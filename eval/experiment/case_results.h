#pragma once

// What the cases of a sweep leave, as files, in order of case (sweep.h): records.jsonl and cases.jsonl, or
// summary.bin.

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/json.h"
#include "sextant/eval/experiment/noise_of_cases.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/output.h"

namespace sextant {

struct CaseResult {
  uint64_t number = 0;
  std::string content;     ///< the lines of its records, or the bytes of its summary
  uint64_t n_records = 0;  ///< of lines; a summary knows its own
  Json noise;              ///< beside lines, as in cases.jsonl
};

/// What a journal holds of a case whose summary is kept, the noise of its points where that is counted here.
std::string encode_journal_case(const CaseSummary& summary, const NoiseVerification* noise);
struct JournalCase {
  std::string_view summary;  ///< encode_case_summary()
  ExactNoise noise;
};
/// Throws Error that begins with `where`.
JournalCase decode_journal_case(std::string_view bytes, const std::string& where);

/// Writes the files of a folder.
class CaseResultWriter {
 public:
  /// `plan` is Plan::json().
  CaseResultWriter(const OutputFolder& folder, const Json& plan, uint64_t n_cases);

  /// Cases come in order of number. Throws Error that names the case.
  void add(const CaseResult& result);
  /// Of cases whose summaries are kept.
  void add_noise(const ExactNoises& noises);
  void close();

  uint64_t n_records() const { return n_records_; }
  Json noise() const { return noise_.json(); }
  /// Of the files, the results last.
  std::vector<std::string> names() const;

 private:
  NoiseOfCases noise_;
  ExactNoises exact_noise_;
  uint64_t n_records_ = 0;
  std::optional<StreamedFile> records_, index_;
  std::optional<SummaryWriter> summary_;
};

/// Reads those of a sweep, from its first case to its last.
class CaseResultReader {
 public:
  virtual ~CaseResultReader() = default;
  /// Numbers rise; nothing after the last. Throws Error that names the file.
  virtual std::optional<CaseResult> next() = 0;
  /// That of all cases where summaries are kept, after the last.
  virtual ExactNoises noise() const { return {}; }
};
std::unique_ptr<CaseResultReader> open_case_results(const std::filesystem::path& folder, KeepOfCases keep);
/// Of one file of summaries.
std::unique_ptr<CaseResultReader> open_summaries(const std::filesystem::path& file);
/// Of a journal, which does not change meanwhile.
std::unique_ptr<CaseResultReader> open_journal(const Journal& journal, KeepOfCases keep,
                                               const NoiseOfCases& noise);

/// The cases of several readers in order of number.
class MergedCases {
 public:
  explicit MergedCases(std::vector<std::unique_ptr<CaseResultReader>> readers);

  struct Next {
    size_t reader;
    CaseResult result;
  };
  /// Nothing after the last. Where several have a number, that of the earlier reader comes first.
  std::optional<Next> next();
  /// Of each reader, after the last case.
  std::vector<ExactNoises> noises() const;

 private:
  void advance(size_t reader);

  std::vector<std::unique_ptr<CaseResultReader>> readers_;
  std::map<std::pair<uint64_t, size_t>, CaseResult> next_;  ///< by number and reader
};

// ---- Cases of an unfinished sweep that keeps summaries, moved out of its journal: when that has grown to
// some size, its cases become a file of summaries, whose noise is summed and which is half as large, and the
// journal begins anew. At the end the files are joined like shards.
//
//   DIR/.finished/OWNER/000001.bin   summary.bin (records/case_summary.h) of some cases; OWNER is who owns
//                                    the journal
//
// A file is there as a whole or not at all. One that was damaged is passed over, and its cases are done
// again.

class FinishedCases {
 public:
  /// Finds those of `owner`, or of any owner; nothing is changed.
  FinishedCases(const std::filesystem::path& folder, const std::string& owner, bool of_any = false);

  bool contains(uint64_t number) const { return number < is_there_.size() && is_there_[number]; }
  uint64_t n_cases() const { return n_cases_; }
  std::vector<std::unique_ptr<CaseResultReader>> readers() const;

  /// Makes the journal's cases a file and empties the journal. Throws Error when the disk is full; the
  /// journal then is as before.
  void take_from(Journal& journal, const NoiseOfCases& noise);

  /// How many cases a folder has in such files, whoever owns them.
  static uint64_t count(const std::filesystem::path& folder);
  /// All of a folder's.
  static void remove(const std::filesystem::path& folder);
  /// Those of other owners.
  void remove_others() const;

 private:
  void mark(uint64_t number);

  std::filesystem::path folder_;
  std::vector<std::filesystem::path> files_;
  std::vector<bool> is_there_;  ///< by number of case
  uint64_t n_cases_ = 0;
};

}  // namespace sextant
