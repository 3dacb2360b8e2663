#include "sextant/datasets/dataset.h"

#include <algorithm>
#include <charconv>

namespace sextant {
namespace {

[[noreturn]] void bad(const std::string& text, const std::string& why) {
  fail("source '{}': {}; expected adapter:path[#sequence][@first-last], for example vdo:/data/kitti_03@0-19",
       text, why);
}

int frame_number(const std::string& text, std::string_view digits) {
  int value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (digits.empty() || error != std::errc() || end != digits.data() + digits.size() || value < 0) {
    bad(text, fmt::format("'{}' is not a frame number", digits));
  }
  return value;
}

}  // namespace

std::map<std::string, double> TruthFloor::numbers() const {
  std::map<std::string, double> out;
  const auto put = [&](const char* key, const std::optional<double>& value) {
    if (value) out[key] = *value;
  };
  put("lateral_floor_m", lateral_m);
  put("rotation_floor_deg", rotation_deg);
  put("rotation_timing_floor_deg", rotation_timing_deg);
  return out;
}

SourceSpec SourceSpec::parse(const std::string& text) {
  SourceSpec spec;
  spec.text = text;
  std::string rest = text;

  // Folder names may contain '@' and '#': '@' is searched after the last slash only, and a source that ends
  // in a slash is entirely a path.
  const bool all_path = rest.ends_with('/');
  const size_t at = rest.rfind('@');
  if (at != std::string::npos && rest.find('/', at) == std::string::npos) {
    const std::string range = rest.substr(at + 1);
    const size_t dash = range.find('-');
    if (dash == std::string::npos) bad(text, fmt::format("frame range '{}' lacks its '-'", range));
    spec.first = frame_number(text, std::string_view(range).substr(0, dash));
    spec.last = frame_number(text, std::string_view(range).substr(dash + 1));
    if (*spec.first > *spec.last) bad(text, fmt::format("frame range '{}' is empty", range));
    rest.resize(at);
  }
  const size_t hash = all_path ? std::string::npos : rest.rfind('#');
  if (hash != std::string::npos) {
    spec.sequence = rest.substr(hash + 1);
    if (spec.sequence.empty()) bad(text, "no sequence after '#'");
    rest.resize(hash);
  }
  const size_t colon = rest.find(':');
  if (colon == std::string::npos) bad(text, "no adapter (no ':')");
  spec.adapter = rest.substr(0, colon);
  spec.path = rest.substr(colon + 1);
  if (spec.adapter.empty()) bad(text, "no adapter before ':'");
  if (spec.path.empty()) bad(text, "no path after ':'");
  return spec;
}

namespace {

/// Throws Error if a member of `group` is not an option of the adapter.
void check_group(const Adapter& adapter, const Json& group) {
  if (!group.is_object())
    fail("option source.{}: expected an object, got {}", adapter.name, json_excerpt(group));
  std::vector<std::string> names;
  for (const OptionHelp& option : adapter.options()) {
    const std::string key = option.key.substr(option.key.find('.') + 1);  // without "source."
    names.push_back(key.substr(0, key.find('.')));
  }
  for (const auto& item : group.items()) {
    if (std::ranges::find(names, item.key()) == names.end())
      fail("unknown option key 'source.{}.{}': {}", adapter.name, item.key(), suggest(item.key(), names));
  }
}

}  // namespace

void SourceSpec::add_options(const Json& tree) {
  if (!tree.is_object()) fail("option source: expected an object, got {}", json_excerpt(tree));
  for (const auto& item : tree.items()) {
    const auto of_key = std::ranges::find(adapters(), item.key(), &Adapter::name);
    if (of_key == adapters().end()) {
      options[item.key()] = item.value();
    } else {
      check_group(*of_key, item.value());
    }
  }
  if (const auto own = tree.find(adapter); own != tree.end()) options.update(*own);
}

SourceSpec find_source(const std::string& text, const std::string& data_root) {
  SourceSpec spec = SourceSpec::parse(text);
  std::error_code ignored;
  const fs::path path = spec.path;
  if (path.is_absolute() || fs::exists(path, ignored) || data_root.empty()) return spec;
  if (const fs::path under = fs::path(data_root) / path; fs::exists(under, ignored))
    spec.path = under.string();
  return spec;
}

void choose_frames(const SourceSpec& source, const std::set<int>& available, const std::string& where,
                   SequenceInfo& info) {
  if (available.empty())
    fail("{}: there are no frames: expected images named by frame number, or ground truth with poses", where);
  info.first_frame = source.first.value_or(*available.begin());
  info.last_frame = source.last.value_or(*available.rbegin());
  if (info.first_frame < *available.begin() || info.last_frame > *available.rbegin()) {
    fail("{}: frames {}-{} are requested, but it has frames {}-{}", where, info.first_frame, info.last_frame,
         *available.begin(), *available.rbegin());
  }
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    if (available.contains(frame)) continue;
    fail("{}: frame {} is missing between {} and {}; add it, or choose other frames with @first-last", where,
         frame, info.first_frame, info.last_frame);
  }
}

void check_frame(const SequenceInfo& info, int frame, const std::string& where) {
  if (frame >= info.first_frame && frame <= info.last_frame) return;
  fail("{}: no frame {}: it has frames {}-{}", where, frame, info.first_frame, info.last_frame);
}

}  // namespace sextant
