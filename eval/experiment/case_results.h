#pragma once

// Result files of the cases of a sweep, in order of case (sweep.h): records.jsonl and cases.jsonl, or
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
  uint64_t n_records = 0;  ///< number of lines; a summary contains its own count
  Json noise;  ///< if records are kept: sums of the added noise, as in cases.jsonl; null without noise
};

/// Encodes the journal entry of a case whose summary is kept. `noise`: the noise added to its points; null if
/// the case is not counted (NoiseOfCases::is_counted()).
std::string encode_journal_case(const CaseSummary& summary, const NoiseVerification* noise);
struct JournalCase {
  std::string_view summary;  ///< encode_case_summary()
  ExactNoise noise;
};
/// Decodes a journal entry. Throws Error that begins with `where` if it is damaged.
JournalCase decode_journal_case(std::string_view bytes, const std::string& where);

/// Writes the result files of a folder.
class CaseResultWriter {
 public:
  /// `plan` is Plan::json().
  CaseResultWriter(const OutputFolder& folder, const Json& plan, uint64_t n_cases);

  /// Appends a case; cases come in order of number. Throws Error that names the case if its summary is
  /// damaged, or if the sums of its noise are missing or invalid.
  void add(const CaseResult& result);
  /// Adds the noise of cases whose summaries are kept; close() stores it.
  void add_noise(const ExactNoises& noises);
  void close();

  uint64_t n_records() const { return n_records_; }
  /// Returns the member "noise" of run.json; complete after close().
  Json noise() const { return noise_.json(); }
  /// Returns the names of the files; the one with the results comes last.
  std::vector<std::string> names() const;

 private:
  NoiseOfCases noise_;
  ExactNoises exact_noise_;
  uint64_t n_records_ = 0;
  std::optional<StreamedFile> records_, index_;
  std::optional<SummaryWriter> summary_;
};

/// Reads the cases of a sweep, from the first to the last.
class CaseResultReader {
 public:
  virtual ~CaseResultReader() = default;
  /// Returns the next case, in ascending order of number; nullopt after the last. Throws Error that names the
  /// file if it is damaged.
  virtual std::optional<CaseResult> next() = 0;
  /// Returns the noise of all cases if summaries are kept; available after the last case.
  virtual ExactNoises noise() const { return {}; }
};
std::unique_ptr<CaseResultReader> open_case_results(const std::filesystem::path& folder, KeepOfCases keep);
/// Returns the number of records of each case of a finished sweep. Throws Error if cases.jsonl lacks a case
/// or states another number of records than records.jsonl holds.
std::vector<uint64_t> records_by_case(const std::filesystem::path& folder);
/// Opens a file of summaries.
std::unique_ptr<CaseResultReader> open_summaries(const std::filesystem::path& file);
/// Opens a journal, which must not change while it is read.
std::unique_ptr<CaseResultReader> open_journal(const Journal& journal, KeepOfCases keep,
                                               const NoiseOfCases& noise);

/// Merges the cases of several readers in order of number.
class MergedCases {
 public:
  explicit MergedCases(std::vector<std::unique_ptr<CaseResultReader>> readers);

  struct Next {
    size_t reader;
    CaseResult result;
  };
  /// Returns the next case; nullopt after the last. Cases of equal number come in the order of the readers.
  std::optional<Next> next();
  /// Returns the noise of each reader; available after the last case.
  std::vector<ExactNoises> noises() const;

 private:
  void advance(size_t reader);

  std::vector<std::unique_ptr<CaseResultReader>> readers_;
  std::map<std::pair<uint64_t, size_t>, CaseResult> next_;  ///< by number and reader
};

// ---- Cases of an unfinished sweep with summaries that were moved out of its journal: when the journal has
// grown to SweepConfig::journal_bytes, its cases are written into a file of summaries, which contains the
// sums of their noise and is half as large, and the journal is emptied. When all cases are finished, these
// files are merged like shards.
//
//   DIR/.finished/OWNER/000001.bin   summary.bin (records/case_summary.h) of some cases; OWNER: first 16
//                                    characters of the name of the journal's owner
//
// A file is written completely or not at all. A damaged file is skipped, and its cases are computed again.

class FinishedCases {
 public:
  /// Finds the files of `owner` or, with `of_any`, of all owners; changes nothing.
  FinishedCases(const std::filesystem::path& folder, const std::string& owner, bool of_any = false);

  bool contains(uint64_t number) const { return number < is_there_.size() && is_there_[number]; }
  uint64_t n_cases() const { return n_cases_; }
  std::vector<std::unique_ptr<CaseResultReader>> readers() const;

  /// Moves the journal's cases into a file and empties the journal. Throws Error if the file cannot be
  /// written, for example because the disk is full; the journal is then unchanged.
  void take_from(Journal& journal, const NoiseOfCases& noise);

  /// Returns the number of cases in such files of a folder, for all owners.
  static uint64_t count(const std::filesystem::path& folder);
  /// Removes all such files of a folder.
  static void remove(const std::filesystem::path& folder);
  /// Removes the files of other owners.
  void remove_others() const;

 private:
  void mark(uint64_t number);

  std::filesystem::path folder_;
  std::vector<std::filesystem::path> files_;
  std::vector<bool> is_there_;  ///< by number of the case
  uint64_t n_cases_ = 0;
};

}  // namespace sextant
