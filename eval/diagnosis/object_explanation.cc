#include "sextant/eval/diagnosis/object_explanation.h"

namespace sextant {

bool ObjectExplanation::allows(const std::string& code) const {
  return this->code() == code ||
         std::ranges::any_of(explanation.alike, [&](const Reading& reading) { return reading.code == code; });
}

std::vector<ObjectExplanation> group_by_reading(std::map<int, Explanation> of_object, size_t n_all) {
  std::vector<ObjectExplanation> out;
  while (!of_object.empty()) {
    std::map<std::string, size_t> objects;  // code -> objects that it explains
    for (const auto& [id, explanation] : of_object) {
      ++objects[explanation.best.code];
      for (const Reading& reading : explanation.alike) ++objects[reading.code];
    }
    // Among readings that explain equally many objects, the reported reading of the first object is taken.
    const auto n_explained = [&](const auto& at) { return objects.at(at.second.best.code); };
    const auto most = std::ranges::max_element(of_object, {}, n_explained);
    ObjectExplanation group{{}, false, most->second};
    for (const auto& [id, explanation] : of_object) {
      if (ObjectExplanation{{}, false, explanation}.allows(group.code())) group.objects.push_back(id);
    }
    for (const int id : group.objects) of_object.erase(id);
    group.of_all = group.objects.size() == n_all;
    out.push_back(std::move(group));
  }
  return out;
}

std::string ObjectExplanation::text(const std::string& subject) const {
  if (of_all) return message(explanation, subject, "m");
  return message(
      explanation,
      fmt::format("{} of object{} {}", subject, objects.size() > 1 ? "s" : "", fmt::join(objects, ", ")),
      "m");
}

}  // namespace sextant
