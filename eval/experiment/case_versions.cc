#include "sextant/eval/experiment/case_versions.h"

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/experiment/sweep_folder.h"

namespace sextant {
namespace {

constexpr const char* configuration = "configuration";

}  // namespace

Json plan_key(Json plan) {
  if (!plan.is_object() || !plan.contains("estimators") || !plan["estimators"].is_array()) return plan;
  for (Json& estimator : plan["estimators"]) {
    if (!estimator.is_object() || !estimator.contains("name") || !estimator["name"].is_string()) continue;
    if (is_of_a_kind(estimator["name"].get<std::string>())) estimator.erase("options");
  }
  return plan;
}

Fingerprints present_fingerprints(const Plan& plan) {
  Fingerprints now;
  for (const PlanEstimator& estimator : plan.estimators) {
    if (const auto fingerprint = estimator.estimator->fingerprint()) now[estimator.label] = {*fingerprint};
  }
  return now;
}

Fingerprints rescored_fingerprints(const Plan& plan, const fs::path& rescored) {
  const Json file = read_plan_file(rescored);
  const std::string where = (rescored / "plan.json").string();
  const Fingerprints ran = fingerprints_in(file, where);
  const Json recorded = json_list(file["plan"], "estimators", where);
  Fingerprints now;
  for (size_t i = 0; i < plan.estimators.size(); ++i) {
    const PlanEstimator& estimator = plan.estimators[i];
    if (!is_of_a_kind(estimator.name)) {
      if (const auto fingerprint = estimator.estimator->fingerprint()) now[estimator.label] = {*fingerprint};
      continue;
    }
    Fingerprint fingerprint;
    const auto versions = i < recorded.size() ? ran.find(recorded[i].value("label", "")) : ran.end();
    if (versions == ran.end() || versions->second.empty()) {
      fingerprint.not_seen = {fmt::format("the program: {} does not say which version ran", where)};
    } else {
      fingerprint = versions->second.front();
      for (size_t version = 1; version < versions->second.size(); ++version)
        fingerprint.parts[fmt::format("version {}", version + 1)] = versions->second[version].sha256();
    }
    fingerprint.parts[configuration] = sha256(json_line(estimator.options));
    now[estimator.label] = {fingerprint};
  }
  return now;
}

CaseVersions::CaseVersions(const Plan& plan, std::string sweep, Fingerprints now, Fingerprints known)
    : plan_(plan), sweep_(std::move(sweep)), now_(std::move(now)), known_(std::move(known)) {}

std::vector<Fingerprint> CaseVersions::versions(uint64_t number) const {
  const auto present = now_.find(label(number));
  if (present == now_.end()) return {};
  std::vector<Fingerprint> all = present->second;
  const auto earlier = known_.find(label(number));
  if (earlier != known_.end()) {
    for (const Fingerprint& version : earlier->second) add_version(version, all);
  }
  return all;
}

std::vector<std::string> CaseVersions::owners(uint64_t number) const {
  std::vector<std::string> names;
  for (const Fingerprint& version : versions(number))
    names.push_back(sha256(sweep_ + "\n" + version.sha256()));
  return names.empty() ? std::vector{sweep_} : names;
}

std::string CaseVersions::owner_of_all() const {
  if (now_.empty()) return sweep_;
  std::string text = sweep_;
  for (const auto& [label, versions] : now_)
    text += fmt::format("\n{}\n{}", label, versions.front().sha256());
  return sha256(text);
}

bool CaseVersions::is_stale(uint64_t number) const {
  const auto present = now_.find(label(number));
  if (present == now_.end()) return false;
  const auto made = known_.find(label(number));
  return made == known_.end() || made->second != present->second;
}

std::string CaseVersions::stale_text(const std::string& label, uint64_t n_cases) const {
  const auto made = known_.find(label);
  const std::string cases = n_cases == 1 ? "1 finished case" : fmt::format("{} finished cases", n_cases);
  if (made == known_.end() || made->second.empty())
    return fmt::format("'{}': it is not known which version of it made {}", label, cases);
  std::string changes = "several versions made them";
  for (const Fingerprint& version : made->second) {
    if (version == now_.at(label).front()) continue;
    if (made->second.size() <= 2) changes = difference(version, now_.at(label).front());
  }
  return fmt::format("'{}': another version of it made {} ({})", label, cases, changes);
}

void CaseVersions::add_used(uint64_t number, size_t place, Fingerprints& used) const {
  const std::vector<Fingerprint> all = versions(number);
  if (!all.empty()) add_version(all.at(place), used[label(number)]);
}

}  // namespace sextant
