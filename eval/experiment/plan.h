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
// "procedure": "paper_release" supplies the keys that the plan does not have from a named procedure (end of
// this file). "noise" may be left out (no noise), or be a list of such grids and of single settings {"level":
// 1, "noise": {...}}. `level` is the name of the case in records and figures: the value of the parameter.
// Cases are numbered with seeds fastest, then levels, estimators, sources; shards and resuming use these
// numbers.

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

/// An estimator together with the options of its front end.
struct PlanEstimator {
  std::string name;
  std::string label;  ///< label in records; CaseEstimator::label() by default
  Json options = Json::object();
  ExtractionOptions extraction;  ///< the options of the plan, with the changes of this entry
  PipelineOptions pipeline;
  std::shared_ptr<const CaseEstimator> estimator;  ///< made from `name` and its options
};

/// Results of a case that a sweep stores: every record, or a summary (records/case_summary.h).
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
  ExtractionOptions extraction;  ///< default for estimators
  PipelineOptions pipeline;
  KeepOfCases keep = KeepOfCases::records;

  uint64_t n_cases() const {
    return uint64_t{sources.size()} * estimators.size() * levels.size() * seeds.size();
  }
  PlanCase at(uint64_t number) const;
  /// Returns everything that determines the records, with all defaults ("keep" only if it is not "records"):
  /// plans with equal JSON give equal records on equal data.
  Json json() const;
};

/// Return the member "keep" of Plan::json(), and its number of seeds. Throw Error if the member is invalid;
/// `where` names the file in messages.
KeepOfCases kept(const Json& plan, const std::string& where);
uint64_t planned_seeds(const Json& plan, const std::string& where);

/// Returns the settings of a case; the caller sets its folder and `rescore`.
CaseSettings case_settings(const Plan& plan, const PlanCase& c);

/// Returns true if two sources have a frame pair in common, so that their records would look alike.
bool share_pairs(const SequenceInfo& a, const SequenceInfo& b);

/// Returns the cases of a shard, in order of number; `shard` 0..n_shards-1. Shards differ by at most one
/// case, and each has as few sources as possible, so that it opens few. If shards share a source, its cases
/// are distributed evenly over estimators, levels and seeds.
std::vector<uint64_t> cases_of_shard(const Plan& plan, uint64_t shard, uint64_t n_shards);

/// Largest number of cases in a plan.
inline constexpr uint64_t max_plan_cases = 10'000'000;

/// Parses a plan strictly, and opens its sources. Throws Error "NAME:LINE: ...", which names the key, if the
/// text is not a plan, a list is empty, a source, label, level or seed is repeated, a level is negative or
/// not finite, or there are more than max_plan_cases cases. Relative paths of sources are looked up in
/// `data_root` if they do not exist in the working folder.
Plan parse_plan(std::string_view text, const std::string& name, const std::string& data_root);

// ---- Procedures: how other systems estimate, expressed as options of this program. A procedure is a plan
// without sources and seeds: estimators with their front ends, options, and the noise used.
// Procedures are compiled into the program from eval/procedures/NAME.json, each with a "description" of its
// origin. To add one, add a file.

/// Returns the names in alphabetical order.
std::vector<std::string> procedure_names();

/// Returns the file as JSON. Throws Error on an unknown name, with the nearest one.
Json find_procedure(const std::string& name);

/// Returns `plan`, completed with the keys of the procedure that it does not have: objects are merged key by
/// key, lists are kept as a whole.
Json on_procedure(const std::string& name, const Json& plan);

/// Returns "extraction", "pipeline" and "estimator" of one estimator of a procedure, as options of `sextant
/// run`. Throws Error if the procedure has no estimator of that name.
Json procedure_options(const std::string& name, const std::string& estimator);

}  // namespace sextant
