#pragma once

// A folder of files as one text, for readers that want a folder:
//
//   @@ label_02/0000.txt
//   0 1 Car ...
//
//   @@ oxts/0000.txt
//   ...
//
// A line "@@ NAME" begins a file; its content ends before the newline before the next such line, or at the
// end.

#include <filesystem>
#include <string_view>

#include "sextant/base/new_file.h"

namespace sextant {

/// Bytes laid out below the system's temporary folder while this lives.
class FuzzFolder {
 public:
  /// Throws Error on a text of another form, on names that leave the folder, and on more than 64 files.
  explicit FuzzFolder(std::string_view text);

  const std::filesystem::path& path() const { return folder_.path(); }

 private:
  ScratchFolder folder_{"sextant_fuzz_"};
};

}  // namespace sextant
