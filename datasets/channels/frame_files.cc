#include "sextant/datasets/channels/frame_files.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include "sextant/base/error.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

std::optional<int> frame_of(const std::string& stem) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto first = std::ranges::find_if(stem, is_digit);
  int frame = 0;
  const auto [end, error] = std::from_chars(&*first, stem.data() + stem.size(), frame);
  if (first == stem.end() || error != std::errc()) return std::nullopt;
  return frame;
}

}  // namespace

FrameFiles::FrameFiles(const fs::path& folder, const std::string& extension) : folder_(folder) {
  if (!fs::is_directory(folder)) fail("{}: no such folder", folder.string());
  const std::vector<std::string> accepted = split(extension, '|');
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path& path = entry.path();
    if (std::ranges::find(accepted, path.extension().string()) == accepted.end()) continue;
    const std::optional<int> frame = frame_of(path.stem().string());
    if (!frame) continue;
    const auto [at, is_new] = files_.emplace(*frame, path);
    if (!is_new) {
      const auto [low, high] = std::minmax(at->second, path);
      fail("{}: two files of frame {}: {} and {}; keep one", folder.string(), *frame, low.filename().string(),
           high.filename().string());
    }
  }
  if (files_.empty()) fail("{}: no {} files named by frame number in it", folder.string(), extension);
}

const fs::path& FrameFiles::at(int frame, const std::string& what) const {
  const auto it = files_.find(frame);
  if (it != files_.end()) return it->second;
  fail(
      "{}: frame {} needs its {}, and there is no file of that number; add it, or choose other frames with "
      "@first-last",
      folder_.string(), frame, what);
}

std::set<int> FrameFiles::frames() const {
  std::set<int> frames;
  for (const auto& [frame, path] : files_) frames.insert(frame);
  return frames;
}

}  // namespace sextant
