#include "sextant/datasets/channels/frame_files.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

struct Pattern {
  fs::path folder;
  std::string prefix;  ///< prefix of the names
};

Pattern pattern_of(const std::string& files) {
  if (!files.ends_with('*')) return {files, ""};
  const std::string prefix = fs::path(files).filename().string();
  return {fs::path(files).parent_path(), prefix.substr(0, prefix.size() - 1)};
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Returns the position of the number in a name; the length of the name if there is none.
size_t number_in(const std::string& name, const std::string& prefix) {
  if (!name.starts_with(prefix)) return name.size();
  const auto from = name.begin() + static_cast<std::ptrdiff_t>(prefix.size());
  return static_cast<size_t>(std::find_if(from, name.end(), is_digit) - name.begin());
}

/// Calls use(frame, path) for each matching file.
template <typename Use>
void for_each_file(const Pattern& pattern, const std::string& extensions, const Use& use) {
  const std::vector<std::string> accepted = split(extensions, '|');
  for (const auto& entry : fs::directory_iterator(pattern.folder)) {
    const fs::path& path = entry.path();
    if (std::ranges::find(accepted, path.extension().string()) == accepted.end()) continue;
    const std::string name = path.stem().string();
    const size_t at = number_in(name, pattern.prefix);
    int frame = 0;
    const auto [end, error] = std::from_chars(name.data() + at, name.data() + name.size(), frame);
    if (error == std::errc()) use(frame, path);
  }
}

}  // namespace

FrameFiles::FrameFiles(const std::string& files, const std::string& extensions) {
  const Pattern pattern = pattern_of(files);
  prefix_ = pattern.prefix;
  if (!fs::is_directory(pattern.folder)) fail("{}: no such folder", pattern.folder.string());
  for_each_file(pattern, extensions, [&](int frame, const fs::path& path) {
    const auto [known, is_new] = paths_.emplace(frame, path);
    if (is_new) return;
    const auto [low, high] = std::minmax(known->second, path);
    fail("{}: two files of frame {}: {} and {}; keep one", pattern.folder.string(), frame,
         low.filename().string(), high.filename().string());
  });
  if (!paths_.empty()) return;
  fail("{}: no {} files named by frame number in it: add them", files,
       fmt::join(split(extensions, '|'), " or "));
}

const fs::path& FrameFiles::at(int frame, const std::string& what) const {
  const auto known = paths_.find(frame);
  if (known != paths_.end()) return known->second;
  // Builds the name like those of the other files.
  const fs::path& first = paths_.begin()->second;
  std::string name = first.filename().string();
  const size_t at = number_in(name, prefix_);
  const auto digits = name.begin() + static_cast<std::ptrdiff_t>(at);
  const auto n_digits = static_cast<size_t>(std::find_if_not(digits, name.end(), is_digit) - digits);
  name.replace(at, n_digits, fmt::format("{:0{}}", frame, n_digits));
  fail_missing(first.parent_path() / name, frame, what);
}

std::set<int> FrameFiles::frames() const {
  std::set<int> frames;
  for (const auto& [frame, path] : paths_) frames.insert(frame);
  return frames;
}

bool has_frame_files(const std::string& files, const std::string& extensions) {
  const Pattern pattern = pattern_of(files);
  bool found = false;
  if (!fs::is_directory(pattern.folder)) return false;
  for_each_file(pattern, extensions, [&](int, const fs::path&) { found = true; });
  return found;
}

void fail_missing(const fs::path& path, int frame, const std::string& what) {
  fail("{}: missing file: frame {} needs its {}; add it, or choose other frames with @first-last",
       path.string(), frame, what);
}

}  // namespace sextant
