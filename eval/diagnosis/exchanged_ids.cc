#include <map>
#include <set>
#include <tuple>

#include "sextant/eval/diagnosis/motion_readings.h"

namespace sextant {
namespace {

constexpr double strictness = 2;
constexpr size_t most_named = 6;

using References = std::map<ObjectFrame, MotionSample>;

/// Samples of all objects that have a reference, logged or not.
References references_of(const MotionData& data) {
  References references;
  for (const auto* samples : {&data.samples, &data.not_logged}) {
    for (const MotionSample& sample : *samples) references.emplace(sample.key, sample);
  }
  return references;
}

/// The motions logged for `id` with the reference of the object `as`.
MotionData read_as_object(const MotionData& data, const References& references, int id, int as) {
  MotionData read{data.declared, {}, {}, {}};
  for (const auto& [key, motion] : entries_of(data.logged, id)) {
    const auto reference = references.find({as, key.second});
    if (reference == references.end()) continue;
    read.samples.push_back(reference->second);
    read.samples.back().given = motion;
  }
  return read;
}

/// Returns the residual of an object that stands still in the world.
std::optional<double> residual_at_rest(MotionData data) {
  for (MotionSample& sample : data.samples)
    sample.given = change_frame(SE3(), MotionFrame::world, data.declared, sample).value_or(SE3());
  return motion_residual(data);
}

/// Formats "the motions of object 1 are logged as object 2, the motions of object 2 as object 3".
std::string list_of(const std::map<int, int>& true_ids) {
  std::vector<std::string> texts;
  for (const auto& [id, true_id] : true_ids)
    texts.push_back(fmt::format("the motions of object {} {}as object {}", true_id,
                                texts.empty() ? "are logged " : "", id));
  return listed(texts, most_named);
}

/// Maps each logged id that belongs to another true object to the id of that object. Each true object is
/// assigned at most once, in order of the residuals.
std::map<int, int> exchanged_ids(const MotionData& data) {
  const References references = references_of(data);
  const std::set<int> logged = ids_of(data.logged), known = ids_of(references);
  std::map<int, std::optional<double>> own;
  for (const int id : logged) own[id] = motion_residual(read_as_object(data, references, id, id));
  std::vector<std::tuple<double, int, int>> fits;
  for (const int id : logged) {
    if (own.at(id) && *own.at(id) <= negligible_residual) continue;
    for (const int as : known) {
      if (id == as) continue;
      const MotionData read = read_as_object(data, references, id, as);
      const auto residual = motion_residual(read), still = residual_at_rest(read);
      if (!residual) continue;
      const double needed = strictness * explains_times_of(read.samples.size()) * *residual;
      const auto explains = [&](const std::optional<double>& other) { return !other || needed < *other; };
      const auto correct = own.find(as);
      if (explains(own.at(id)) && explains(still) && (correct == own.end() || explains(correct->second)))
        fits.emplace_back(*residual, id, as);
    }
  }
  std::ranges::sort(fits);
  std::map<int, int> true_ids;
  std::set<int> taken;
  for (const auto& [residual, id, as] : fits) {
    if (!true_ids.contains(id) && taken.insert(as).second) true_ids[id] = as;
  }
  return true_ids;
}

}  // namespace

std::optional<Hypothesis<MotionData>> exchanged_ids_hypothesis(const MotionData& data) {
  const std::map<int, int> true_ids = exchanged_ids(data);
  if (true_ids.empty()) return std::nullopt;
  std::set<int> offsets;
  for (const auto& [id, true_id] : true_ids) offsets.insert(true_id - id);
  const int offset = *offsets.begin();
  // A single object, or a few of many, do not show an offset of all ids.
  const bool same_offset =
      offsets.size() == 1 && true_ids.size() > 1 && 2 * true_ids.size() >= ids_of(data.logged).size();
  Hypothesis<MotionData> hypothesis;
  hypothesis.code = "ids";
  hypothesis.cause =
      fmt::format("the ids look {}: {}",
                  same_offset ? fmt::format("off by {}", std::abs(offset)) : "exchanged", list_of(true_ids));
  hypothesis.remedy =
      same_offset
          ? fmt::format("{} {} {} each id (objects.id_offset {} of an external program)",
                        offset > 0 ? "add" : "subtract", std::abs(offset), offset > 0 ? "to" : "from", offset)
          : "use the ids of the truth (or objects.ids overlap of an external program)";
  hypothesis.undo = [true_ids, references = references_of(data)](MotionData& read, double&) {
    std::vector<MotionSample> kept;
    bool any = false;
    for (MotionSample& sample : read.samples) {
      const auto as = true_ids.find(sample.key.first);
      if (as != true_ids.end()) {
        const auto reference = references.find({as->second, sample.key.second});
        if (reference == references.end()) continue;
        sample.reference = reference->second.reference;
        sample.T_world_object = reference->second.T_world_object;
        any = true;
      }
      kept.push_back(std::move(sample));
    }
    const bool most = 2 * kept.size() >= read.samples.size();
    read.samples = std::move(kept);
    return any && most;
  };
  return hypothesis;
}

}  // namespace sextant
