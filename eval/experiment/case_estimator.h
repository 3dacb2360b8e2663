#pragma once

// What a case runs: an estimator that turns the frame pairs of one case, in order, into results. Three kinds:
//
//   NAME          an entry of estimators() inside the pipeline (estimator/pipeline.h)
//   NAME          one that a program which links this library has added with add_estimator()
//   PREFIX:REST   of a kind added with add_estimator_kind(); "external:CONFIG.json" (eval/external)
//
// A kind of its own may look at the whole sequence, with the noise of the case on it, before the first pair.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/registry.h"
#include "sextant/eval/records/fingerprint.h"
#include "sextant/eval/records/record.h"
#include "sextant/noise/noise.h"

namespace sextant {

/// What is known of a case before its pairs.
struct CaseContext {
  const Sequence& sequence;
  const PipelineOptions& pipeline;
  const Noise& noise;
  uint64_t seed = 0;
  std::filesystem::path folder;  ///< for files that the estimator leaves behind; empty: it must leave none
  /// Programs of others do not run: what they left in `folder` is read again. Nothing is written there.
  bool rescore = false;
};

/// Of one case.
class PairSolver {
 public:
  virtual ~PairSolver() = default;
  /// The pairs of the sequence, in order.
  virtual FrameResult process(const FramePair& pair) = 0;
  /// Adds what the frame has cost beyond its BodyResult::times to the record of the camera.
  virtual void add_costs(int /*frame*/, Record& /*ego*/) const {}
  /// What went wrong, for the user, one line each. Records have a status for it too.
  virtual std::vector<std::string> problems() const { return {}; }
  /// T_world_camera as somebody else wrote it, in a world of its own, for diagnose_case(); nullptr: motions
  /// alone are known.
  virtual const Trajectory* recorded_camera() const { return nullptr; }
};

/// One of the results of a case. Records call it by the estimator's label, and ".NAME" where it has a name.
struct NamedSolver {
  std::string name;
  std::unique_ptr<PairSolver> solver;
};

class CaseEstimator {
 public:
  virtual ~CaseEstimator() = default;
  /// One, or several with names of their own. Safe to call from several threads. The context lives as long as
  /// the solvers.
  virtual std::vector<NamedSolver> begin(const CaseContext& context) const = 0;
  /// All options with their values, for provenance.
  virtual Json options() const = 0;
  /// What records call it unless told otherwise.
  virtual std::string label() const = 0;
  /// Its results are checked for other conventions than the declared ones (diagnose_case(), case_runner.h).
  /// False for entries of estimators().
  virtual bool is_third_party() const { return true; }
  /// Of an estimator that is no part of Sextant, as it is now; nothing for Sextant's own, which its version
  /// identifies. May read files. Throws Error.
  virtual std::optional<Fingerprint> fingerprint() const { return std::nullopt; }
};

/// Whether a name is that of a kind, PREFIX:REST. Its options are part of its fingerprint.
bool is_of_a_kind(const std::string& name);

/// Throws Error on an unknown name (with the nearest one) or option. A file named after a prefix is looked up
/// in the working folder, then in `beside`.
std::shared_ptr<const CaseEstimator> make_case_estimator(const std::string& name,
                                                         const Json& options = Json::object(),
                                                         const std::filesystem::path& beside = {});

/// `estimator`, of single bodies, inside the pipeline.
std::shared_ptr<const CaseEstimator> pipeline_case_estimator(std::string name,
                                                             std::shared_ptr<const Estimator> estimator,
                                                             std::optional<Fingerprint> fingerprint = {});

/// estimators(), then those added.
std::vector<EstimatorEntry> all_estimators();

// Both are for the start of a program, before other threads; a name that is taken is an Error.
void add_estimator(EstimatorEntry entry);

using OpenCaseEstimator =
    std::function<std::shared_ptr<const CaseEstimator>(const std::string& rest, const Json& options)>;
/// `example` stands in messages: "external:CONFIG.json".
void add_estimator_kind(const std::string& prefix, const std::string& example, OpenCaseEstimator open);

}  // namespace sextant
