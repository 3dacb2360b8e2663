#include "sextant/eval/experiment/case_estimator.h"

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"

namespace sextant {
namespace {

struct Kind {
  std::string prefix;
  std::string example;
  OpenCaseEstimator open;
};

/// Estimators and kinds of estimators that programs have added.
struct Additions {
  std::vector<EstimatorEntry> estimators;
  std::vector<Kind> kinds;
};

Additions& additions() {
  static Additions added;
  return added;
}

class PipelinePairEstimator final : public PairEstimator {
 public:
  PipelinePairEstimator(const CaseContext& context, std::shared_ptr<const Estimator> estimator,
                        const OnPair& on_pair)
      : info_(context.sequence.info()),
        seed_(context.seed),
        pipeline_(context.pipeline, std::move(estimator)),
        on_pair_(on_pair) {}
  FrameResult process(const FramePair& pair) override {
    if (on_pair_) on_pair_(info_, seed_, &pair);
    FrameResult result = pipeline_.process(pair);
    if (on_pair_) on_pair_(info_, seed_, nullptr);
    return result;
  }

 private:
  const SequenceInfo& info_;
  uint64_t seed_;
  FrameEstimator pipeline_;
  OnPair on_pair_;
};

/// An Estimator of single bodies inside the pipeline.
class PipelineEstimator final : public CaseEstimator {
 public:
  PipelineEstimator(std::string name, std::shared_ptr<const Estimator> estimator,
                    std::optional<Fingerprint> fingerprint, OnPair on_pair)
      : name_(std::move(name)),
        estimator_(std::move(estimator)),
        fingerprint_(std::move(fingerprint)),
        on_pair_(std::move(on_pair)) {}
  std::vector<NamedEstimator> begin(const CaseContext& context) const override {
    std::vector<NamedEstimator> alone;
    alone.push_back({"", std::make_unique<PipelinePairEstimator>(context, estimator_, on_pair_)});
    return alone;
  }
  Json options() const override { return estimator_->options(); }
  std::string label() const override { return name_; }
  bool is_third_party() const override {
    return std::ranges::count(estimators(), name_, &EstimatorEntry::name) == 0;
  }
  std::optional<Fingerprint> fingerprint() const override { return fingerprint_; }

 private:
  std::string name_;
  std::shared_ptr<const Estimator> estimator_;
  std::optional<Fingerprint> fingerprint_;
  OnPair on_pair_;
};

/// Returns the fingerprint of an estimator that a program has added, which is the SHA-256 of the program's
/// file; nullopt for other estimators.
std::optional<Fingerprint> fingerprint_of_added(const std::string& name) {
  if (std::ranges::count(additions().estimators, name, &EstimatorEntry::name) == 0) return std::nullopt;
  static const std::string program = file_sha256(fs::canonical("/proc/self/exe"));
  return Fingerprint{.parts = {{"program", program}}, .not_seen = {}};
}

std::string found_file(const std::string& path, const fs::path& beside) {
  std::error_code ignored;
  const fs::path there = beside / path;
  return !fs::exists(path, ignored) && fs::exists(there, ignored) ? there.string() : path;
}

}  // namespace

std::shared_ptr<const CaseEstimator> make_case_estimator(const std::string& name, const Json& options,
                                                         const fs::path& beside) {
  const size_t colon = name.find(':');
  if (colon != std::string::npos) {
    std::string examples;
    for (const Kind& kind : additions().kinds) {
      if (kind.prefix == name.substr(0, colon)) {
        return kind.open(found_file(name.substr(colon + 1), beside), options);
      }
      examples += (examples.empty() ? "" : ", ") + kind.example;
    }
    fail("unknown estimator '{}': expected a name{}{}", name, examples.empty() ? "" : ", or ", examples);
  }
  const std::vector<EstimatorEntry> known = all_estimators();
  auto estimator = find_entry(std::span<const EstimatorEntry>(known), name, "estimator").make(options);
  return pipeline_case_estimator(name, std::move(estimator), fingerprint_of_added(name));
}

bool is_of_a_kind(const std::string& name) { return name.find(':') != std::string::npos; }

std::shared_ptr<const CaseEstimator> pipeline_case_estimator(std::string name,
                                                             std::shared_ptr<const Estimator> estimator,
                                                             std::optional<Fingerprint> fingerprint,
                                                             OnPair on_pair) {
  return std::make_shared<PipelineEstimator>(std::move(name), std::move(estimator), std::move(fingerprint),
                                             std::move(on_pair));
}

std::vector<EstimatorEntry> all_estimators() {
  std::vector<EstimatorEntry> all(estimators().begin(), estimators().end());
  all.insert(all.end(), additions().estimators.begin(), additions().estimators.end());
  return all;
}

void add_estimator(EstimatorEntry entry) {
  if (std::ranges::count(all_estimators(), entry.name, &EstimatorEntry::name) > 0) {
    fail("estimator '{}' exists already: choose another name", entry.name);
  }
  additions().estimators.push_back(std::move(entry));
}

void add_estimator_kind(const std::string& prefix, const std::string& example, OpenCaseEstimator open) {
  if (std::ranges::count(additions().kinds, prefix, &Kind::prefix) > 0) {
    fail("estimators '{}:' exist already: choose another prefix", prefix);
  }
  additions().kinds.push_back({prefix, example, std::move(open)});
}

}  // namespace sextant
