#pragma once

// report.html of a run: a summary in one sentence, the table, errors over time, paths from above,
// distributions, pictures of the three worst frames of each body, provenance, and the command that makes the
// interactive page. It is one self-contained file; links into the interactive page work once that command has
// been run. The same run gives the same bytes, wherever its folder is.

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/experiment/run.h"
#include "sextant/eval/report/document.h"
#include "sextant/metrics/definitions.h"

namespace sextant {

// ---- The worst frames of each body, with the estimator's result there. They are collected pair by pair
// during a run, so that nothing must be estimated again to draw them.

struct WorstFrame {
  Record record;
  BodyResult result;
  int prev = 0;     ///< frame to draw on; the record's frame is the current one
  double Et_m = 0;  ///< as defined by the preset
};

class WorstFrames {
 public:
  static constexpr size_t n_frames = 3;

  explicit WorstFrames(const MetricPreset& preset) : preset_(preset) {}

  /// Adds a pair, as a PairObserver. If an estimator has several results, the first one is used.
  void add(const FrameResult& result, std::span<const Record> of_pair);
  /// Returns true if pairs of these frames were seen.
  bool has_seen(const SequenceInfo& info) const;
  /// Returns the worst frames of each body, by body_order(): the largest E_t first, and of equal ones the
  /// earlier frame. Empty if no pair was seen.
  const std::map<int, std::vector<WorstFrame>>& of(const SequenceInfo& info) const;

 private:
  struct OfSequence {
    std::set<int> frames;
    std::map<int, std::vector<WorstFrame>> bodies;
  };
  const MetricPreset& preset_;
  std::map<std::pair<std::string, std::string>, OfSequence> sequences_;
};

struct RunReportRequest {
  const RunConfig& config;
  const RunResult& result;
  const MetricPreset& preset;
  std::string data_root;  ///< for the command, if the user must give it again; otherwise empty
};

/// Makes the report. `worst` has observed the run. Sources that it has not seen, because an earlier run had
/// finished them, are estimated again here with their first seed.
ReportDocument run_document(const RunReportRequest& request, WorstFrames& worst);

}  // namespace sextant
