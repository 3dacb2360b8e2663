#pragma once

// A folder of files as one text, for readers that need a folder:
//
//   @@ label_02/0000.txt
//   0 1 Car ...
//
//   @@ oxts/0000.txt
//   ...
//
// A line "@@ NAME" begins a file. Its content ends before the newline that precedes the next such line, or
// at the end of the text.

#include <filesystem>
#include <string_view>

#include "sextant/base/new_file.h"

namespace sextant {

/// A folder with these files below the system's temporary folder; removed on destruction.
class FuzzFolder {
 public:
  /// Throws Error on a text of another form, on names that leave the folder, and on more than 64 files.
  explicit FuzzFolder(std::string_view text);

  const std::filesystem::path& path() const { return folder_.path(); }

 private:
  ScratchFolder folder_{"sextant_fuzz_"};
};

}  // namespace sextant
