#pragma once

// Sequences of files in folders: what adapters declare, and what they have in common.
//
// Object truth by frame number, as label files of every data set give it.

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sextant/datasets/channels/channel_source.h"
#include "sextant/datasets/channels/frame_files.h"
#include "sextant/datasets/dataset.h"
#include "sextant/truth/truth.h"

namespace sextant {

using ObjectTruths = std::map<int, std::vector<ObjectTruth>>;

/// Sets `interpolated` where an object's position steps from and to its neighbour frames are equal:
/// |p(k+1) - 2 p(k) + p(k-1)| <= 1e-6 max(1, |p(k)|), which annotators' linear interpolation gives and real
/// motion does not.
void mark_interpolated(ObjectTruths& objects);

/// The 2-D boxes of all objects that have one, for masks of boxes.
std::map<int, std::vector<LabelBox>> label_boxes(const ObjectTruths& objects);

// A sequence of one folder a channel and one file a frame. What adapters have in common; an adapter is the
// declaration of its files, and its readers of calibration and truth:
//
//   auto sequence = std::make_unique<FolderSequence>(source);
//   sequence->truth() = ...;                            // reads through sequence->inputs()
//   FolderFiles files = {.left = folder + "/image", ...};
//   sequence->choose_frames(files, where);              // then info() has the frames and the size
//   sequence->info().camera = ...;
//   sequence->open_channels(files);

/// Options of an adapter whose channels are its own files or any other choice.
struct ChannelOptions {
  SEXTANT_OPTIONS(
      (std::string, flow, "auto", "",
       "auto = the data set's files, without them dis; none; or dis, flo:DIR, kitti_png:DIR, vkitti_png:DIR, "
       "tartanair_png:DIR, onnx:FILE"),
      (std::string, depth, "auto", "",
       "auto = the data set's files, without them sgbm; none; or sgbm, disparity256:DIR, depth256:DIR, "
       "cm:DIR, tartanair_png:DIR"),
      (std::string, masks, "auto", "",
       "auto = the data set's files; none; or instance_png:DIR, mots_png:DIR, mots_txt:FILE, "
       "detections_txt:FILE, vdo_text:DIR, boxes, onnx:FILE"))
};

/// A channel of a data set.
template <typename T>
struct FolderChannel {
  std::string option = "auto";  ///< the user's choice: auto, none, or one of channels/channel_source.h
  std::string kind;             ///< of the data set's own files, as there: "cm"
  std::string files;            ///< those files, as in channels/frame_files.h, or one FILE; empty: not there
  std::string computed;         ///< what auto takes without files: "dis"; empty: nothing
  bool exact = false;           ///< the files are the truth of the data set
  std::string provenance;       ///< of the files; empty: "depth: KIND:FILES"
  std::string if_none;          ///< a warning when auto finds nothing; empty: none
  /// Files that no kind reads; empty: `kind`.
  std::function<std::unique_ptr<ChannelSource<T>>(const ChannelInputs&)> open;
};

struct FolderFiles {
  std::string left, right;  ///< images, .png or .jpg, as in channels/frame_files.h; empty: not there
  FolderChannel<float> depth;
  FolderChannel<Flow> flow, backward_flow;
  FolderChannel<uint16_t> masks;
  std::set<int> frames;       ///< where there are no files
  int width = 0, height = 0;  ///< px, likewise
};

/// The folder if it is there, else empty.
std::string if_there(const std::filesystem::path& folder);

class FolderSequence final : public Sequence, public KnowsTruthFloor {
 public:
  explicit FolderSequence(const SourceSpec& source) : source_(source) { info_.dataset = source.adapter; }

  /// Chooses the frames: those of the first folder that is there of left, depth, masks and flow, else those
  /// declared; without a gap, or @first-last. Sets the size. `where` is the sequence in messages.
  void choose_frames(const FolderFiles& files, const std::string& where);
  /// Opens what is declared, once info() has its camera and truth() its boxes.
  void open_channels(const FolderFiles& files);

  SequenceInfo& info() { return info_; }
  SequenceTruth& truth() { return truth_; }
  TruthFloor& floor() { return floor_; }
  const TruthFloor& floor() const override { return floor_; }
  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }
  Frame read(int frame, Channels channels) const override;
  std::optional<Image<Flow>> true_flow(int frame) const override;
  std::optional<Image<float>> true_depth(int frame) const override;
  void check_files() const override;

 private:
  /// A channel as it is read, and its exact files, which may be the same.
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
  TruthFloor floor_;
  ChannelInputs channel_inputs_;
  std::optional<FrameFiles> left_, right_;
  Opened<float> depth_;
  Opened<Flow> flow_, backward_flow_;
  Opened<uint16_t> masks_;
};

}  // namespace sextant
