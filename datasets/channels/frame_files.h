#pragma once

// The files of a folder by frame number: the first run of digits in the name ("000012.png", "flow_00012.png",
// "000012_10.png").

#include <filesystem>
#include <map>
#include <set>
#include <string>

namespace sextant {

class FrameFiles {
 public:
  FrameFiles() = default;
  /// Lists `folder`; only files with this extension (".png"; several: ".jpg|.png"). Throws Error when there
  /// is no such folder, no such file in it, or two files of one frame.
  FrameFiles(const std::filesystem::path& folder, const std::string& extension);

  bool has(int frame) const { return files_.contains(frame); }
  /// Throws Error that names the folder, the frame and `what`.
  const std::filesystem::path& at(int frame, const std::string& what) const;
  std::set<int> frames() const;

 private:
  std::filesystem::path folder_;
  std::map<int, std::filesystem::path> files_;
};

}  // namespace sextant
