#pragma once

// Layouts: writing a sequence in the format of a published data set, so that the adapter of the data set
// reads it like a download. To add a layout, write a file with a function such as write_vdo_layout()
// (vdo_folder.h), and one line in the table of layout.cc.

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"

namespace sextant {

struct LayoutRequest {
  std::filesystem::path out;  ///< root of the data set; created if missing
  /// name of the sequence in the layout ("0018/clone"); empty: made from default_number() (vdo: no subfolder)
  std::string sequence;
  Json options = Json::object();  ///< options of the layout (strict)
  std::filesystem::path stage;    ///< folder for the files until all are complete; empty: out
  /// called before each frame, by several threads; may throw to abort; may be empty
  std::function<void()> between_frames;
  int jobs = 1;        ///< number of threads; the files do not depend on it
  bool quiet = false;  ///< no progress line

  const std::filesystem::path& folder() const { return stage.empty() ? out : stage; }
};

struct Layout {
  std::string name;
  std::string description;  ///< one line for help
  /// Writes all frames and the truth; returns the SOURCE that reads them. Throws Error if the sequence exists
  /// already, or contains something that the format cannot represent. Files appear in `out` only when all are
  /// complete; an error before that leaves nothing behind. If moving them is interrupted, the next writer in
  /// `out` moves the remaining ones first; if its request is the same, it then has nothing left to write.
  std::function<std::string(const Sequence&, const LayoutRequest&)> write;
  std::function<std::vector<OptionHelp>()> options;
};

/// A folder of a layout: one channel, one file per frame.
struct LayoutFolder {
  bool Channels::*channel;
  std::filesystem::path path;
  std::string name;                                 ///< format of the file names, such as "{:06}.png"
  std::function<std::string(const Frame&)> encode;  ///< returns the bytes of the file; empty: no file
};

/// Declares a folder for an image channel; frames with an empty image have no file.
template <typename T, typename Encode>
LayoutFolder layout_folder(bool Channels::*channel, Image<T> Frame::*image, std::filesystem::path path,
                           std::string name, const Encode& encode) {
  return {channel, std::move(path), std::move(name), [=](const Frame& frame) {
            return (frame.*image).empty() ? std::string() : std::string(encode(frame.*image));
          }};
}

struct LayoutFrames {
  std::vector<LayoutFolder> folders;               ///< written for the channels that the sequence has
  int zero = 0;                                    ///< frame with the number 0 in file names
  std::function<Frame(int frame, Channels)> read;  ///< empty: Sequence::read
  std::function<void(const Frame&)> also;  ///< called for every frame, by several threads; may be empty
};

/// Creates the folders and writes all frames, in parallel and with a progress line.
void write_layout_frames(const Sequence& sequence, const LayoutRequest& request, const LayoutFrames& frames);

std::span<const Layout> layouts();
/// Returns the layout of this name; throws Error with the nearest name if there is none.
const Layout& find_layout(const std::string& name);

/// Returns the first number in a sequence's name ("s18" -> 18, "0018/clone" -> 18), 0 if there is none.
int default_number(const std::string& sequence);

}  // namespace sextant
