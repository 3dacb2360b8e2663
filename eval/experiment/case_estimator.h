#pragma once

// Estimators of cases, which turn the frame pairs of one case, in order, into results. There are three kinds:
//
//   NAME          an entry of estimators() inside the pipeline (estimator/pipeline.h)
//   NAME          an estimator added with add_estimator() by a program that links this library
//   PREFIX:REST   of a kind added with add_estimator_kind(); "external:CONFIG.json" (eval/external)
//
// A kind added with add_estimator_kind() may use the whole sequence, with the noise of the case, before the
// first pair.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/registry.h"
#include "sextant/eval/experiment/case_motions.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/noise/noise.h"

namespace sextant {

/// Description of a case, available before its first pair.
struct CaseContext {
  const Sequence& sequence;
  const PipelineOptions& pipeline;
  const Noise& noise;
  uint64_t seed = 0;
  std::filesystem::path folder;  ///< folder for files of the estimator; empty: no files may be left
  /// External programs do not run: the files that they left in `folder` are read again. Nothing is written
  /// there.
  bool rescore = false;
};

/// Estimates the motions in the pairs of one case.
class PairEstimator {
 public:
  virtual ~PairEstimator() = default;
  /// Processes the next pair; pairs come in the order of the sequence.
  virtual FrameResult process(const FramePair& pair) = 0;
  /// Adds the costs of the frame that are not in BodyResult::times to the record of the camera.
  virtual void add_costs(int /*frame*/, Record& /*ego*/) const {}
  /// Returns the problems that occurred, one line each for the user. The statuses of records show them, too.
  virtual std::vector<std::string> problems() const { return {}; }
  /// Returns the form of an external system's results, for diagnose_case().
  virtual RecordedForm recorded() const { return {}; }
};

/// One result of a case. Its name in records is the label of the estimator, followed by ".NAME" if `name` is
/// not empty.
struct NamedEstimator {
  std::string name;
  std::unique_ptr<PairEstimator> estimator;
};

class CaseEstimator {
 public:
  virtual ~CaseEstimator() = default;
  /// Begins a case; returns one estimator of its pairs, or several with names. Safe to call from several
  /// threads. What the context refers to must outlive these estimators.
  virtual std::vector<NamedEstimator> begin(const CaseContext& context) const = 0;
  /// Returns all options with their values, for provenance.
  virtual Json options() const = 0;
  /// Returns the name of the estimator in records, unless the user gives another label.
  virtual std::string label() const = 0;
  /// Returns true if the results must be checked for other conventions than the declared ones
  /// (diagnose_case(), case_motions.h). False for entries of estimators().
  virtual bool is_third_party() const { return true; }
  /// Returns the present fingerprint of an estimator that is not part of Sextant; nullopt for Sextant's own
  /// estimators, which the version of Sextant identifies. May read files. Throws Error if one cannot be read.
  virtual std::optional<Fingerprint> fingerprint() const { return std::nullopt; }
};

/// Returns true if a name has the form PREFIX:REST. The options of such an estimator are part of its
/// fingerprint.
bool is_of_a_kind(const std::string& name);

/// Names of external programs begin with this: "external:CONFIG.json".
inline constexpr std::string_view external_prefix = "external:";
/// Names of functions of a Python process, which no other process can call, begin with this.
inline constexpr std::string_view python_prefix = "python:";

/// Creates an estimator. A file named after a prefix (external:CONFIG.json) is looked up in the working
/// folder, then in `beside`. Throws Error on an unknown option, an unknown name (with the nearest one) or an
/// unknown prefix (with examples of the known ones).
std::shared_ptr<const CaseEstimator> make_case_estimator(const std::string& name,
                                                         const Json& options = Json::object(),
                                                         const std::filesystem::path& beside = {});

/// Function that is called with each pair of a case before it is processed, and with null after it.
using OnPair = std::function<void(const SequenceInfo& info, uint64_t seed, const FramePair* pair)>;

/// Creates a case estimator that runs `estimator`, which estimates single bodies, inside the pipeline.
std::shared_ptr<const CaseEstimator> pipeline_case_estimator(std::string name,
                                                             std::shared_ptr<const Estimator> estimator,
                                                             std::optional<Fingerprint> fingerprint = {},
                                                             OnPair on_pair = {});

/// Returns estimators(), followed by the added ones.
std::vector<EstimatorEntry> all_estimators();

// Both functions must be called at the start of a program, before other threads exist. They throw Error if
// the name or prefix is taken.
void add_estimator(EstimatorEntry entry);

using OpenCaseEstimator =
    std::function<std::shared_ptr<const CaseEstimator>(const std::string& rest, const Json& options)>;
/// `example` is shown in messages: "external:CONFIG.json".
void add_estimator_kind(const std::string& prefix, const std::string& example, OpenCaseEstimator open);

}  // namespace sextant
