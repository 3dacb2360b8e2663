#include "sextant/eval/gate/comparison.h"

#include <algorithm>
#include <future>

#include "sextant/base/error.h"

namespace sextant {
namespace {

/// Only the first repetition is judged; the others must hold the same cases.
void check_repetitions(const Side& side, const Policy& policy, std::vector<Mismatch>& findings) {
  for (const RunFolder& run : side.runs) {
    const size_t n = side.runs.front().n_cases;
    if (run.n_cases == n) continue;
    findings.push_back(mismatch(policy.same.cases, "cases", run.path + ": repetition",
                                fmt::format("{} cases in the first", n),
                                fmt::format("{} here", run.n_cases)));
  }
}

void compare_records(const Side& base, const Side& fresh, const Policy& policy, int jobs, Comparison& out) {
  if (base.runs.empty() != fresh.runs.empty()) {
    const auto said = [](const Side& side) { return side.runs.empty() ? "missing" : "there"; };
    out.findings.push_back(mismatch(Strictness::must, "cases", "records.jsonl", said(base), said(fresh)));
  }
  if (base.runs.empty() || fresh.runs.empty()) return;
  check_repetitions(base, policy, out.findings);
  check_repetitions(fresh, policy, out.findings);
  compare_accuracy(base.runs.front().subjects, fresh.runs.front().subjects, policy, jobs, out);
}

}  // namespace

Comparison compare_paths(const std::filesystem::path& base, const std::filesystem::path& fresh,
                         const Policy& policy, int jobs) {
  Comparison out;
  out.base = base.string();
  out.fresh = fresh.string();
  try {
    // Both sides are read at the same time, because reading takes most of the time.
    std::future<Side> reading =
        std::async(jobs > 1 ? std::launch::async : std::launch::deferred, [&] { return read_side(base); });
    const Side second = read_side(fresh), first = reading.get();
    out.findings = compare_provenance(first, second, policy);
    compare_records(first, second, policy, jobs, out);
    if (policy.speed.judge) {
      SpeedComparison speed = compare_speed(first, second, policy);
      out.speed = std::move(speed.rows);
      std::ranges::move(speed.findings, std::back_inserter(out.findings));
    }
    if (out.accuracy.empty() && out.speed.empty()) {
      out.findings.push_back(
          mismatch(Strictness::must, "cases", "everything", "nothing to compare", "nothing to compare"));
    }
  } catch (const Error& error) {
    out.findings.insert(out.findings.begin(), mismatch(Strictness::must, "input", error.what(), "", ""));
  }
  out.verdict = out.worst_verdict();
  for (const SpeedRow& row : out.speed) out.verdict = std::min(out.verdict, row.verdict);
  return out;
}

}  // namespace sextant
