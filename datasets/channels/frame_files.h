#pragma once

// The files of a folder by frame number. FILES is one of
//
//   DIR           the frame's number is the first run of digits in a name ("000012.png", "flow_00012.png",
//                 "000012_10.png")
//   DIR/PREFIX*   only names that begin with PREFIX, and the number is the first behind it: of
//                 image_2/000007_*, 000007_10.png is frame 10

#include <filesystem>
#include <map>
#include <set>
#include <string>

namespace sextant {

class FrameFiles {
 public:
  /// Lists FILES; only those with this extension (".png"; several: ".jpg|.png"). Throws Error when there is
  /// no such folder, no such file in it, or two files of one frame.
  FrameFiles(const std::string& files, const std::string& extensions);

  bool has(int frame) const { return paths_.contains(frame); }
  /// Throws Error that names the file, the frame and `what`.
  const std::filesystem::path& at(int frame, const std::string& what) const;
  std::set<int> frames() const;

 private:
  std::map<int, std::filesystem::path> paths_;
  std::string prefix_;  // of names, before the number
};

/// Whether there are files of any frame.
bool has_frame_files(const std::string& files, const std::string& extensions);

/// Throws the Error of FrameFiles::at().
[[noreturn]] void fail_missing(const std::filesystem::path& path, int frame, const std::string& what);

}  // namespace sextant
