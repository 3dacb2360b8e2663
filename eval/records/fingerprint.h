#pragma once

// Fingerprint of an estimator that is no part of this program: a program that it starts, a function of
// Python. Two results are of the same estimator when its fingerprints are equal.
//
//   "fingerprints": {LABEL: [{"sha256": ..., "parts": {NAME: SHA-256}, "not_seen": [TEXT]}]}
//
// in plan.json and run.json: per label of records, the versions of the estimator that made the cases (more
// than one after --reuse-stale or merge --allow-mixed).
//
//   parts     what was looked at: "program python3", "estimator.py", "configuration", "global SCALE"
//   not_seen  what belongs to the estimator and is in no part, in words
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
  /// Throws Error that begins with `where`.
  static Fingerprint from(const Json& json, const std::string& where);
};

/// Equal parts; what was not seen does not count.
bool operator==(const Fingerprint& a, const Fingerprint& b);

/// "estimator.py changed, params.txt is new, 3 more": how `now` differs from `before`; empty where they are
/// equal.
std::string difference(const Fingerprint& before, const Fingerprint& now);

/// By the estimator's label.
using Fingerprints = std::map<std::string, std::vector<Fingerprint>>;

/// Adds `one` at the end unless it is there.
void add_version(const Fingerprint& one, std::vector<Fingerprint>& versions);

constexpr const char* fingerprints_key = "fingerprints";
Json fingerprints_json(const Fingerprints& fingerprints);
/// Those of a plan.json or run.json; none where the file has no such key. Throws Error that begins with
/// `where`.
Fingerprints fingerprints_in(const Json& file, const std::string& where);

}  // namespace sextant
