#pragma once

// How the bytes of an input become what a reader needs: a folder of files, or a valid PNG.
//
// A folder is one text:
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
#include <string>
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

/// Reads width, height, depth, kind and size of the palette (a byte each), then palette and pixels, and
/// encodes them as a PNG with right checksums. Throws Error on fewer than five bytes.
std::string png_of_pixels(std::string_view bytes);

}  // namespace sextant
