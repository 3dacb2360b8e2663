#pragma once

// A folder of its own below the system's temporary one, named `prefix` and six letters that no other has, not even one
// that a killed process has left. Removed with everything in it at the end. Throws Error where none can be made.

#include <cstdlib>
#include <filesystem>
#include <string>

#include "sextant/base/error.h"

namespace sextant {

class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& prefix) {
    std::string name = (std::filesystem::temp_directory_path() / (prefix + "XXXXXX")).string();
    if (::mkdtemp(name.data()) == nullptr) fail("{}: cannot create a temporary folder", name);
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace sextant
