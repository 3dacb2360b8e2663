#pragma once

// What a run has done, so that the same run goes on after it: `sextant run` killed and started again gives the
// same bytes (times apart). The unit is a source, over all its seeds, which share one decoding of its frames.
//
//   DIR/unfinished.jsonl   a block per source that is done (records/journal.h); gone when the results are there
//
// A block counts for the same program, configuration and estimator only, and while every file that the source read is as it was.

#include <map>
#include <optional>

#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/records/journal.h"

namespace sextant {

/// What a source gave, over all seeds; motions and tracks are those of the first.
struct SourceOutcome : CaseOutcome {
  std::map<std::string, InputLog::Entry> inputs;
};

/// Files that were read: path -> {"bytes", "sha256"}.
Json inputs_json(const std::map<std::string, InputLog::Entry>& inputs);
/// Whether all of them still are as inputs_json() says.
bool same_inputs(const Json& inputs);

class RunJournal {
 public:
  /// Of the run of `configuration` (resolved_configuration(), and what fingerprints its estimator has) into `folder`, which is made with the first block.
  RunJournal(std::filesystem::path folder, const Json& configuration);

  /// Nothing where the source is not done, or would not give the same any more.
  std::optional<SourceOutcome> find(size_t source) const;
  void append(size_t source, const SourceOutcome& outcome);
  /// The results are in place.
  void remove();

 private:
  void open();

  std::filesystem::path path_;
  std::string owner_;
  std::optional<Journal> journal_;
};

}  // namespace sextant
