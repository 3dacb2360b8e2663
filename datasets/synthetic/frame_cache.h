#pragma once

// Rendered images on disk, found by what they show: folder/<SHA-256 of the scenario and the renderer's
// version>/<frame>-<channel>.bin. A file is a line of text (kind, size, SHA-256 of the pixels) and the raw
// pixels; one that is damaged counts as not there. Files are written under another name and renamed, so that
// several programs may share a folder. Nothing is stored beyond `max_bytes` in the folder; to empty it,
// delete it.

#include <atomic>
#include <filesystem>
#include <string>

#include "sextant/datasets/synthetic/scenario.h"
#include "sextant/measurement/image.h"

namespace sextant::synthetic {

/// SHA-256 of all that the images of a scenario depend on, and of `version`.
std::string content_key(const Scenario& scenario, const std::string& version);

/// "auto": cache_root()/frames, none where there is no root; otherwise as given; empty = none.
std::filesystem::path cache_folder(const std::string& option);

class FrameCache {
 public:
  /// An empty folder: nothing is ever found or stored.
  FrameCache(const std::filesystem::path& folder, const std::string& key, uint64_t max_bytes);

  /// False when it is not there, damaged, or of another size.
  template <typename T>
  bool load(int frame, const char* channel, int width, int height, Image<T>& image) const {
    Image<T> found(width, height);
    if (!load_bytes(frame, channel, header(width, height, sizeof(T)), found.data(),
                    found.size() * sizeof(T))) {
      return false;
    }
    image = std::move(found);
    return true;
  }
  /// Does nothing when the folder is full or cannot be written.
  template <typename T>
  void store(int frame, const char* channel, const Image<T>& image) const {
    if (image.empty()) return;
    store_bytes(frame, channel, header(image.width(), image.height(), sizeof(T)), image.data(),
                image.size() * sizeof(T));
  }

 private:
  static std::string header(int width, int height, size_t pixel_bytes);
  std::filesystem::path file(int frame, const char* channel) const;
  bool load_bytes(int frame, const char* channel, const std::string& header, void* data, size_t size) const;
  void store_bytes(int frame, const char* channel, const std::string& header, const void* data,
                   size_t size) const;

  std::filesystem::path folder_;  ///< of this scenario
  uint64_t max_bytes_;
  mutable std::atomic<uint64_t> used_bytes_ = 0;
};

}  // namespace sextant::synthetic
