#pragma once

// Diagnosis of data that can be read but look wrong: inverse poses, centimetres, quaternions in another
// order.
//
// A hypothesis is another reading of the same data: a name, how to read the data that way, and the flag or
// edit that corrects them. The residual r of a reading measures how badly the data, read that way, agree with
// a reference or with themselves (the unit is the caller's, e.g. m^2). With r_0 the residual of the declared
// reading and r_h that of a hypothesis, the hypothesis is reported when
//
//   explains_times * r_h <= r_0    and    explains_times * r_h <= r_null, where there is a null reading
//
// The null reading assumes that nothing happens, for example that the body does not move. It prevents a
// hypothesis that merely scales the data down, such as "these are centimetres", from explaining noise about
// zero. If the errors are those of independent samples, residuals are squared: a reported hypothesis then
// leaves at most a fifth of the error's energy, 45 % of its RMS.
//
//   const auto readings = read_as(hypotheses, data, residual);
//   if (const auto found = explain(*residual(data), readings)) warn(message(*found, "estimate", "m"));

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace sextant {

/// Square of 0.1 mm, or of 0.1 mrad at a radius of 1 m: smaller errors are rounding, whatever explains them.
inline constexpr double negligible_residual = 1e-8;

/// A hypothesis is reported only if its residual is smaller than the declared one by this factor.
inline constexpr double explains_times = 5;

inline constexpr double degree = std::numbers::pi / 180;  ///< in rad
inline double degrees(double radians) { return radians * 180 / std::numbers::pi; }

/// A finding about data: its code for programs, and a text with the cause and the correction.
struct DataWarning {
  std::string code, text;
};

inline void append(std::vector<DataWarning>& all, std::vector<DataWarning> more) {
  std::ranges::move(more, std::back_inserter(all));
}

/// Formats "a, b, c", or the first `most` items followed by ", ...".
std::string listed(const std::vector<std::string>& items, size_t most);

/// Formats a fitted factor: "too large by a factor 1.593", or for a factor below 1 "too small by a factor"
/// and its inverse.
std::string factor_text(double factor);

/// Returns the cause of a hypothesis with the number that it fitted: "{}" in it becomes the number,
/// "{factor}" factor_text().
std::string cause_text(const std::string& cause, double fitted);

/// An alternative reading of `Data`, different from the declared one.
template <typename Data>
struct Hypothesis {
  std::string code;  ///< for programs: "inverse"
  /// "motions are inverted, from frame k to k-1"; with the number that undo() found by cause_text()
  std::string cause;
  std::string remedy;  ///< the flag or edit that corrects the data: "invert each motion"; may be empty
  /// Rereads the data this way, in place. Returns false if the hypothesis does not apply to them; writes a
  /// fitted number to `fitted`.
  std::function<bool(Data& data, double& fitted)> undo;
  double price = 0;  ///< the lower price wins between two hypotheses that explain the data equally well
  bool fits_number = false;  ///< undo() fits a number, and so can explain much by chance
  double strictness = 1;     ///< factor on the times by which this hypothesis must explain the data better
};

/// Residual under a hypothesis, with the texts of the hypothesis.
struct Reading {
  std::string code, cause, remedy;
  double residual = 0;
  double price = 0;
  double strictness = 1;
};

/// A reported hypothesis, and the other hypotheses that explain the data as well.
struct Explanation {
  Reading best;
  std::vector<Reading> alike;  ///< residuals at most twice the lowest one, lowest price first
  double declared = 0;         ///< residual of the declared reading

  /// Returns true for the code of the reported reading and of those that explain the data as well.
  bool allows(const std::string& code) const;
};

/// Applies every hypothesis to a copy of `data`, and returns the readings of those that apply and have a
/// residual. `residual` is a function Data -> std::optional<double>.
template <typename Data, typename Residual>
std::vector<Reading> read_as(const std::vector<Hypothesis<Data>>& hypotheses, const Data& data,
                             const Residual& residual) {
  std::vector<Reading> readings;
  for (const Hypothesis<Data>& hypothesis : hypotheses) {
    Data changed = data;
    double fitted = 0;
    if (!hypothesis.undo(changed, fitted)) continue;
    const std::optional<double> left = residual(changed);
    if (!left) continue;
    readings.push_back({hypothesis.code, cause_text(hypothesis.cause, fitted), hypothesis.remedy, *left,
                        hypothesis.price, hypothesis.strictness});
  }
  return readings;
}

/// Conditions under which a reading is reported, besides being better than the declared one.
struct ExplanationRule {
  double negligible = negligible_residual;    ///< a declared residual up to here needs no explanation
  std::optional<double> null = std::nullopt;  ///< residual of the null reading
  double times = explains_times;
};

/// Returns the reading with the lowest residual if it explains the data by the rule above; nullopt if it does
/// not, or if the declared residual is negligible or not finite. Among readings within a factor of two of the
/// lowest residual, the one with the lowest price is returned, and the first of equal prices.
std::optional<Explanation> explain(double declared, const std::vector<Reading>& readings,
                                   const ExplanationRule& rule = {});

/// Formats "SUBJECT: CAUSE (RMS residual 0.03 m read so, 1.2 m as declared): REMEDY; or: CAUSE", with at most
/// three causes. `unit` is that of the square root of the residuals.
std::string message(const Explanation& explanation, const std::string& subject, const std::string& unit);

// ---- Explanations of the data of several objects: one mistake of the whole log, or mistakes of single
// objects.

/// A hypothesis about some objects of a log.
struct ObjectExplanation {
  std::vector<int> objects;  ///< ids
  bool of_all = false;       ///< `objects` are all objects of the data
  Explanation explanation;

  const std::string& code() const { return explanation.best.code; }
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
  const auto agrees = [&](const std::optional<Explanation>& own) {
    return all && own && own->allows(all->best.code);
  };
  std::map<int, std::optional<Explanation>> single;
  size_t n_explained = 0, n_agree = 0;
  for (const int id : ids) {
    const auto& own = single[id] = explain_of({id});
    n_explained += own.has_value();
    n_agree += agrees(own);
  }
  // A few objects with mistakes of their own can make another reading of all objects look better.
  if (n_explained > 0 && 2 * n_agree < ids.size()) all.reset();
  ObjectExplanation of_log{{}, false, all.value_or(Explanation{})};
  for (const int id : ids) {
    const std::optional<Explanation>& own = single.at(id);
    if (all && (!own || agrees(own))) {
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
