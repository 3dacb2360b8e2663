#pragma once

// report.html, with which a run ends: what came out in a sentence, the summary, errors over time, paths from
// above, distributions, the three worst frames of each body as pictures, where it comes from, and the line
// that opens the page to walk through it. One file that needs nothing else; links into that page work once
// the line has been run. Same run, same bytes, wherever its folder is.

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/experiment/run.h"
#include "sextant/eval/report/document.h"
#include "sextant/metrics/definitions.h"

namespace sextant {

// ---- The frames in which each body is worst, with what the estimator saw of it there: found while a run
// goes, pair by pair, so that nothing has to be estimated again to draw them.

struct WorstFrame {
  Record record;
  BodyResult result;
  int prev = 0;     ///< the frame to draw on; the record's is the current one
  double Et_m = 0;  ///< as the preset has it
};

class WorstFrames {
 public:
  static constexpr size_t n_frames = 3;

  explicit WorstFrames(const MetricPreset& preset) : preset_(preset) {}

  /// A PairObserver. Of an estimator with several results the first counts.
  void add(const FrameResult& result, std::span<const Record> of_pair);
  /// Whether pairs of these frames were seen.
  bool has_seen(const SequenceInfo& info) const;
  /// By body_order(): the largest E_t first, of equal ones the earlier frame. Empty where no pair was seen.
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
  std::string data_root;  ///< for the line, where the user has to say it again; else empty
};

/// `worst` has watched the run. Sources that it has not seen, because an earlier run had done them, go
/// through the estimator again here, with their first seed.
ReportDocument run_document(const RunReportRequest& request, WorstFrames& worst);

}  // namespace sextant
