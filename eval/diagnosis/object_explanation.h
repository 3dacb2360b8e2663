#pragma once

// Explanations of the data of several objects: one mistake of the whole log, or mistakes of single objects.

#include <map>
#include <set>
#include <string>
#include <vector>

#include "sextant/eval/diagnosis/hypothesis.h"

namespace sextant {

/// A hypothesis about some objects of a log.
struct ObjectExplanation {
  std::vector<int> objects;  ///< ids
  bool of_all = false;       ///< `objects` are all objects of the data
  Explanation explanation;

  const std::string& code() const { return explanation.best.code; }
  bool allows(const std::string& code)
      const;  ///< true for the reported reading and for those that explain the data as well
  /// Formats message() as "SUBJECT of objects 1, 2: ...", or as "SUBJECT: ..." if all objects are concerned.
  std::string text(const std::string& subject) const;
};

/// Groups the explanations of single objects by the reading that explains them; the reading that explains the
/// most objects comes first. `n_all` is the number of objects in the data.
std::vector<ObjectExplanation> group_by_reading(std::map<int, Explanation> of_object, size_t n_all);

/// Applies the rule of hypothesis.h to all objects `ids` together, then to each object that the hypothesis
/// about all does not explain. The hypothesis about all is dropped if single objects have explanations, but
/// fewer than half of all objects agree with it. `explain_of(ids)` returns the explanation of the data of
/// these objects.
template <typename ExplainOf>
std::vector<ObjectExplanation> explain_objects(const std::set<int>& ids, const ExplainOf& explain_of) {
  std::vector<ObjectExplanation> out;
  std::map<int, Explanation> open;
  std::optional<Explanation> all = explain_of(ids);
  std::map<int, std::optional<Explanation>> single;
  size_t n_explained = 0, n_agree = 0;
  for (const int id : ids) {
    const auto& own = single[id] = explain_of({id});
    n_explained += own.has_value();
    n_agree += all && own && ObjectExplanation{{}, false, *own}.allows(all->best.code);
  }
  // A few objects with mistakes of their own can make another reading of all objects look better.
  if (n_explained > 0 && 2 * n_agree < ids.size()) all.reset();
  ObjectExplanation of_log{{}, false, all.value_or(Explanation{})};
  for (const int id : ids) {
    const std::optional<Explanation>& own = single.at(id);
    if (all && (!own || ObjectExplanation{{}, false, *own}.allows(all->best.code))) {
      of_log.objects.push_back(id);
    } else if (own) {
      open.emplace(id, *own);
    }
  }
  of_log.of_all = of_log.objects.size() == ids.size();
  if (!of_log.objects.empty()) out.push_back(std::move(of_log));
  for (ObjectExplanation& group : group_by_reading(std::move(open), ids.size()))
    out.push_back(std::move(group));
  return out;
}

}  // namespace sextant
