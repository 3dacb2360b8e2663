#pragma once

// A plan is a grid: every source x estimator x noise level x seed is one case. JSON (docs/sweeps.md):
//
//   { "name": "depth",
//     "sources": ["synthetic:s18", {"source": "kitti:kitti_tracking#0005", "options": {"flow": "dis"}}],
//     "estimators": ["motion_only", {"name": "joint_flow", "options": {...}, "label": "joint_flow wide",
//                                    "extraction": {...}, "pipeline": {...}}],   // on top of "options" below
//     "noise": {"parameter": "depth.delta_d_px", "levels": [0.05, 0.1], "base": {"flow": {"epe_px": 0.3}}},
//     "seeds": 20,                                  // 0..19; or a list; or {"first": 5, "count": 10}
//     "options": {"extraction": {...}, "pipeline": {...}},
//     "keep": "records" }                           // or "summary": sums and histograms a case, no records
//
// "procedure": "paper_release" puts the keys of a named procedure (at the end) below the plan's own.
// "noise" may be left out (no noise), or be a list of such grids and of single settings {"level": 1,
// "noise": {...}}. `level` is what records and figures call the case: the parameter's value.
// Cases are numbered seeds fastest, then levels, estimators, sources; the number is what shards and resuming
// go by.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/datasets/dataset.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/noise/noise.h"

namespace sextant {

/// A method: an estimator, and the front end before it.
struct PlanEstimator {
  std::string name;
  std::string label;  ///< in records; CaseEstimator::label() unless given
  Json options = Json::object();
  ExtractionOptions extraction;  ///< the plan's, with what the entry changes
  PipelineOptions pipeline;
  std::shared_ptr<const CaseEstimator> estimator;  ///< made of these
};

/// What a sweep leaves of a case: every record, or its summary (records/case_summary.h).
enum class KeepOfCases { records, summary };
constexpr Names<2> names_of(KeepOfCases) { return {"records", "summary"}; }

struct PlanLevel {
  double level = 0;
  Noise noise;
};

/// One case, as indices into the plan.
struct PlanCase {
  uint64_t number = 0;
  size_t source = 0;
  size_t estimator = 0;
  size_t level = 0;
  uint64_t seed = 0;
};

struct Plan {
  std::string name;
  std::vector<SourceSpec> sources;
  std::vector<PlanEstimator> estimators;
  std::vector<PlanLevel> levels;
  std::vector<uint64_t> seeds;
  ExtractionOptions extraction;  ///< of estimators that say nothing else
  PipelineOptions pipeline;
  KeepOfCases keep = KeepOfCases::records;

  uint64_t n_cases() const {
    return uint64_t{sources.size()} * estimators.size() * levels.size() * seeds.size();
  }
  PlanCase at(uint64_t number) const;
  /// Everything that decides the records, with every default spelled out ("keep" where it is not records):
  /// equal JSON, equal records on equal data.
  Json json() const;
};

/// "keep", and how many seeds there are, of Plan::json(). Throws Error that begins with `where`.
KeepOfCases kept(const Json& plan, const std::string& where);
uint64_t planned_seeds(const Json& plan, const std::string& where);

/// A case as it is run; its folder and whether it is rescored are for the caller to say.
CaseSettings case_settings(const Plan& plan, const PlanCase& c);

/// Whether two sources have a frame pair in common: their records would look alike.
bool share_pairs(const SequenceInfo& a, const SequenceInfo& b);

/// The cases of a shard, in order of number; `shard` 0..n_shards-1. Shards differ by one case at most, and
/// each has as few sources as that allows, so that it opens few. Among the shards of one source its cases are
/// dealt out evenly over estimators, levels and seeds.
std::vector<uint64_t> cases_of_shard(const Plan& plan, uint64_t shard, uint64_t n_shards);

/// The most cases that one plan may have.
inline constexpr uint64_t max_plan_cases = 10'000'000;

/// Strict: throws Error "NAME:LINE: ..." that names the key, on anything that is not a plan, an empty grid, a
/// negative level of a scale parameter, or more than max_plan_cases. Relative paths of sources are looked up
/// in `data_root` when they are not in the working folder.
Plan parse_plan(std::string_view text, const std::string& name, const std::string& data_root);

// ---- procedures: how somebody else estimates, as options of ours. A procedure is a plan without sources and
// seeds (plan.h): estimators with their front ends, options, and the noise it was run under. They come with
// the program, eval/procedures/NAME.json, each with a "description" that says what it follows. To add one,
// add a file.

/// Names in alphabetical order.
std::vector<std::string> procedure_names();

/// The file as JSON. Throws Error on an unknown name, naming the nearest.
Json find_procedure(const std::string& name);

/// `plan` with the procedure's keys where it has none of its own: objects key by key, lists as a whole.
Json on_procedure(const std::string& name, const Json& plan);

/// "extraction", "pipeline" and "estimator" of one of its estimators, as options of `sextant run`. Throws
/// Error when the procedure has no estimator of that name.
Json procedure_options(const std::string& name, const std::string& estimator);

}  // namespace sextant
