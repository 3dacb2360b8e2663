#pragma once

// Sequences of files in folders: the declarations that adapters make, and their common implementation.

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sextant/datasets/channels/channel_source.h"
#include "sextant/datasets/dataset.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// Sets `interpolated` for objects whose position steps from the previous and to the next frame are equal:
/// |p(k+1) - 2 p(k) + p(k-1)| <= 1e-6 max(1, |p(k)|). Linear interpolation by annotation tools gives equal
/// steps; real motion does not.
void mark_interpolated(ObjectTruths& objects);

/// Returns the 2-D boxes, by frame, of all objects that have one, for masks made from boxes.
std::map<int, std::vector<LabelBox>> label_boxes(const ObjectTruths& objects);

// A sequence with one folder per channel and one file per frame: the common part of the adapters. An adapter
// declares its files, and reads calibration and truth:
//
//   auto sequence = std::make_unique<FolderSequence>(source);
//   sequence->truth() = ...;                            // reads through sequence->inputs()
//   FolderFiles files = {.left = folder + "/image", ...};
//   sequence->choose_frames(files, where);              // then info() has the frames and the size
//   sequence->info().camera = ...;
//   sequence->open_channels(files);
//
// All files are read through sequence->inputs(), which logs them: text by rows (codec/text_rows.h), JSON by
// parse_json() and json_member() (base/json.h); their errors name file, line and key. Frames are numbered by
// the names of their files; poses, time stamps and objects have the same numbers.
//
// A kind of file that channels/channel_source.h does not list, such as depth in another unit, needs a decoder
// in codec/dense_maps.h, a line in the table of channels/channel_source.cc, and one in the list at the head
// of channels/channel_source.h.

/// Options of an adapter that reads every channel from its own files, or from any other source.
struct ChannelOptions {
  SEXTANT_OPTIONS((std::string, flow, "auto", "", flow_option_help()),
                  (std::string, depth, "auto", "", depth_option_help()),
                  (std::string, masks, "auto", "", mask_option_help()))
};

/// Options of an adapter whose files state no frame rate.
struct RatedChannelOptions : ChannelOptions {
  SEXTANT_OPTIONS_OF(ChannelOptions, (double, rate_hz, 10, "Hz", "frame rate"))
  void check() const {
    check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "finite and > 0");
  }
};

/// Declaration of one channel of a data set.
template <typename T>
struct FolderChannel {
  std::string option = "auto";  ///< option value: auto, none, or a choice of channels/channel_source.h
  std::string kind;             ///< kind of the data set's files: "cm"
  std::string files;            ///< the files, as in channels/channel_source.h, or one FILE; empty: none
  std::string computed;         ///< choice of auto if there are no files: "dis"; empty: none
  bool exact = false;           ///< the files are the ground truth of the data set
  std::string provenance;       ///< text for files; empty: "depth: KIND:FILES"
  std::string if_none;          ///< warning if auto finds nothing; empty: no warning
  /// Opens files of a format that is not in channels/channel_source.h. If empty, `kind` selects the format.
  std::function<std::unique_ptr<ChannelSource<T>>(const ChannelInputs&)> open;
};

struct FolderFiles {
  std::string left, right;  ///< images, .png or .jpg, as in channels/channel_source.h; empty: none
  FolderChannel<float> depth;
  FolderChannel<Flow> flow, backward_flow;
  FolderChannel<uint16_t> masks;
  std::set<int> frames;       ///< frame numbers if there are no files
  int width = 0, height = 0;  ///< px, if there are no files
};

/// Returns the folder if it exists, otherwise an empty text.
std::string if_there(const std::filesystem::path& folder);

class FolderSequence final : public Sequence {
 public:
  explicit FolderSequence(const SourceSpec& source) : source_(source) { info_.dataset = source.adapter; }

  /// Chooses the frames: those of the first declared folder among left, depth, masks and flow, otherwise
  /// files.frames. All of them, or those of @first-last, must be consecutive. Also sets the image size, from
  /// the first file or as declared. `where` is the sequence in messages.
  void choose_frames(const FolderFiles& files, const std::string& where);
  /// Opens the declared channels, after choose_frames(); info() must have its camera and truth() its boxes.
  void open_channels(const FolderFiles& files);

  /// Returns the numbers of all images, of which the chosen frames may be a part; empty without images.
  std::set<int> image_frames() const;

  SequenceInfo& info() { return info_; }
  SequenceTruth& truth() { return truth_; }
  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }
  Frame read(int frame, Channels channels) const override;
  std::optional<Image<Flow>> true_flow(int frame) const override;
  std::optional<Image<float>> true_depth(int frame) const override;
  void check_files() const override;

 private:
  /// The source of a channel for read(), and the one that reads its exact files; both may be the same.
  template <typename T>
  struct Opened {
    std::shared_ptr<ChannelSource<T>> source, exact;
    bool is_exact() const { return source != nullptr && source == exact; }
  };

  template <typename T, typename Make>
  Opened<T> open(const char* name, const FolderChannel<T>& channel, const Make& make);
  template <typename T, typename Decode>
  Image<T> read_image(const std::filesystem::path& path, const Decode& decode) const;
  Image<Rgb> read_rgb(const FrameFiles& files, int frame, const char* what) const;

  SourceSpec source_;
  std::string where_;
  SequenceInfo info_;
  SequenceTruth truth_;
  ChannelInputs channel_inputs_;
  std::optional<FrameFiles> left_, right_;
  Opened<float> depth_;
  Opened<Flow> flow_, backward_flow_;
  Opened<uint16_t> masks_;
};

}  // namespace sextant
