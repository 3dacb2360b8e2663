#pragma once

// Cache of rendered images on disk, addressed by content: folder/<SHA-256 of the scenario and the renderer's
// version>/<frame>-<channel>.bin. A file consists of a line of text (kind, size, SHA-256 of the pixels) and
// the raw pixels; a damaged file is treated as missing. Files are written under another name and renamed, so
// that several programs may share a folder. Nothing is stored once the folder has `max_bytes`; to empty the
// cache, delete the folder.

#include <atomic>
#include <filesystem>
#include <string>

#include "sextant/datasets/synthetic/scenario.h"
#include "sextant/measurement/image.h"

namespace sextant::synthetic {

/// Returns the SHA-256 of everything that determines the images of a scenario, and of `version`.
std::string content_key(const Scenario& scenario, const std::string& version);

/// Returns the folder of the option: cache_root()/frames for "auto", empty if there is no root; otherwise
/// `option` itself; empty = no cache.
std::filesystem::path cache_folder(const std::string& option);

class FrameCache {
 public:
  /// With an empty folder, nothing is found or stored. Throws Error if the folder exists and does not belong
  /// to this user, or if other users can write into it.
  FrameCache(const std::filesystem::path& folder, const std::string& key, uint64_t max_bytes);

  /// Returns false if the image is missing, damaged, or of another size.
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
  /// Stores an image; does nothing if the folder is full or cannot be written.
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

  std::filesystem::path folder_;  ///< folder of this scenario
  uint64_t max_bytes_;
  mutable std::atomic<uint64_t> used_bytes_ = 0;
};

}  // namespace sextant::synthetic
