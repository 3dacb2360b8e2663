#pragma once

// Fingerprint of an external estimator: a program that sextant starts, or a Python function. Two results come
// from the same estimator if its fingerprints are equal.
//
//   "fingerprints": {LABEL: [{"sha256": ..., "parts": {NAME: SHA-256}, "not_seen": [TEXT]}]}
//
// in plan.json and run.json: for each label of records, the versions of the estimator that computed the cases
// (more than one after --reuse-stale or merge --allow-mixed).
//
//   parts     the hashed parts: "program python3", "estimator.py", "configuration", "global SCALE"
//   not_seen  dependencies of the estimator that are not hashed, as texts
//   sha256    of the parts

#include <map>
#include <string>
#include <vector>

#include "sextant/base/json.h"

namespace sextant {

struct Fingerprint {
  std::map<std::string, std::string> parts;
  std::vector<std::string> not_seen;

  std::string sha256() const;
  Json json() const;
  /// Parses a fingerprint. Throws Error that begins with `where` if a member is missing or malformed.
  static Fingerprint from(const Json& json, const std::string& where);
};

/// Compares the parts; `not_seen` is ignored.
bool operator==(const Fingerprint& a, const Fingerprint& b);

/// Describes how `now` differs from `before`: "estimator.py changed, params.txt is new, old.txt is gone,
/// 3 more"; empty if they are equal.
std::string difference(const Fingerprint& before, const Fingerprint& now);

/// Versions by the estimator's label.
using Fingerprints = std::map<std::string, std::vector<Fingerprint>>;

/// Appends `one` unless the list contains it.
void add_version(const Fingerprint& one, std::vector<Fingerprint>& versions);

constexpr const char* fingerprints_key = "fingerprints";
Json fingerprints_json(const Fingerprints& fingerprints);
/// Returns the fingerprints in a plan.json or run.json; empty if the file has no such key. Throws Error that
/// begins with `where` if they are malformed.
Fingerprints fingerprints_in(const Json& file, const std::string& where);

}  // namespace sextant
