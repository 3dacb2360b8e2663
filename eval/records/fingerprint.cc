#include "sextant/eval/records/fingerprint.h"

#include <algorithm>

#include "sextant/base/files.h"

namespace sextant {
namespace {

Json parts_json(const std::map<std::string, std::string>& parts) {
  Json json = Json::object();
  for (const auto& [name, content] : parts) json[name] = content;
  return json;
}

}  // namespace

std::string Fingerprint::sha256() const { return sextant::sha256(json_line(parts_json(parts))); }

Json Fingerprint::json() const {
  return {{"sha256", sha256()}, {"parts", parts_json(parts)}, {"not_seen", not_seen}};
}

Fingerprint Fingerprint::from(const Json& json, const std::string& where) {
  Fingerprint fingerprint;
  const Json parts = json_object(json, "parts", where);
  for (const auto& [name, ignored] : parts.items())
    fingerprint.parts[name] = json_member<std::string>(parts, name, where + ": parts");
  for (const Json& text : json_list(json, "not_seen", where)) {
    if (!text.is_string())
      fail("{}: key 'not_seen': expected a list of texts, got {}", where, json_excerpt(text));
    fingerprint.not_seen.push_back(text);
  }
  return fingerprint;
}

bool operator==(const Fingerprint& a, const Fingerprint& b) { return a.parts == b.parts; }

std::string difference(const Fingerprint& before, const Fingerprint& now) {
  constexpr size_t shown = 3;
  std::vector<std::string> all;
  for (const auto& [name, content] : now.parts) {
    const auto known = before.parts.find(name);
    if (known == before.parts.end()) {
      all.push_back(name + " is new");
    } else if (known->second != content) {
      all.push_back(name + " changed");
    }
  }
  for (const auto& [name, content] : before.parts) {
    if (!now.parts.contains(name)) all.push_back(name + " is gone");
  }
  const size_t n = all.size();
  if (n > shown) {
    all.resize(shown);
    all.push_back(fmt::format("{} more", n - shown));
  }
  return fmt::format("{}", fmt::join(all, ", "));
}

void add_version(const Fingerprint& one, std::vector<Fingerprint>& versions) {
  if (std::ranges::find(versions, one) == versions.end()) versions.push_back(one);
}

Json fingerprints_json(const Fingerprints& fingerprints) {
  Json json = Json::object();
  for (const auto& [label, versions] : fingerprints) {
    json[label] = Json::array();
    for (const Fingerprint& version : versions) json[label].push_back(version.json());
  }
  return json;
}

Fingerprints fingerprints_in(const Json& file, const std::string& where) {
  Fingerprints fingerprints;
  const Json labels = json_object(file, fingerprints_key, where);
  for (const auto& [label, ignored] : labels.items()) {
    const std::string here = fmt::format("{}: {}", where, fingerprints_key);
    for (const Json& version : json_list(labels, label, here))
      fingerprints[label].push_back(Fingerprint::from(version, fmt::format("{} '{}'", here, label)));
  }
  return fingerprints;
}

}  // namespace sextant
