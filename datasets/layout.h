#pragma once

// Writing a sequence in the layout of a published data set, so that the adapter of that data set reads it
// back as it would read a download. How to add a layout: one file with a function like these, one line in
// layout.cc.

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"

namespace sextant {

struct LayoutRequest {
  std::filesystem::path out;  ///< the data set's root; made when it is not there
  std::string sequence;       ///< the layout's name of the sequence ("0018/clone"); empty: default_number()
  Json options = Json::object();         ///< the layout's own options (strict)
  std::filesystem::path stage;           ///< where the files are put until all are there; empty: out
  std::function<void()> between_frames;  ///< called often, may throw to give up; may be empty
  int jobs = 1;                          ///< threads; the files do not depend on it
  bool quiet = false;                    ///< no progress line
};

struct Layout {
  std::string name;
  std::string description;  ///< one line for help
  /// Writes all frames and the truth; returns the SOURCE that reads them. Throws Error when the sequence is
  /// there already, or holds what the format cannot express. Files appear in `out` when all are complete;
  /// with an error nothing is left. Killed while they are moved there, the next writer in `out` moves the
  /// rest first; when it is to write the same it is done with that.
  std::function<std::string(const Sequence&, const LayoutRequest&)> write;
  std::function<std::vector<OptionHelp>()> options;
};

/// A folder of a layout: one channel, one file a frame.
struct LayoutFolder {
  bool Channels::*channel;
  std::filesystem::path path;
  std::string name;                                 ///< of a file, "{:06}.png"
  std::function<std::string(const Frame&)> encode;  ///< empty: the frame has no such file
};

/// The same of an image: empty where the frame has none.
template <typename T, typename Encode>
LayoutFolder layout_folder(bool Channels::*channel, Image<T> Frame::*image, std::filesystem::path path,
                           std::string name, const Encode& encode) {
  return {channel, std::move(path), std::move(name), [=](const Frame& frame) {
            return (frame.*image).empty() ? std::string() : std::string(encode(frame.*image));
          }};
}

struct LayoutFrames {
  std::vector<LayoutFolder> folders;               ///< of channels that the sequence has are written
  int zero = 0;                                    ///< the frame with number 0 in names
  std::function<Frame(int frame, Channels)> read;  ///< empty: Sequence::read
  std::function<void(const Frame&)> also;  ///< called with every frame, by several threads; may be empty
};

/// Makes the folders and writes all frames, in parallel and with a progress line.
void write_layout_frames(const Sequence& sequence, const LayoutRequest& request, const LayoutFrames& frames);

std::span<const Layout> layouts();
/// By name; throws Error with the nearest one.
const Layout& find_layout(const std::string& name);

/// The first number in a sequence's name ("s18" -> 18, "0018/clone" -> 18), 0 when there is none.
int default_number(const std::string& sequence);

}  // namespace sextant
