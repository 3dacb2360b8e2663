#pragma once

// What the adapters of Virtual KITTI 1.3.1 and 2.0.3 share: folders with one file a frame, any of which may
// be absent, and channels that are the data set's own or any choice of channels/channel_source.h.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "sextant/datasets/channels/channel_source.h"
#include "sextant/datasets/channels/frame_files.h"
#include "sextant/datasets/dataset.h"

namespace sextant {

/// The folders of one sequence and camera; empty: not there.
struct VkittiFolders {
  std::optional<std::filesystem::path> left, right;  ///< images, .png or .jpg
  std::optional<std::filesystem::path> depth;        ///< centimetres
  std::optional<std::filesystem::path> flow, backward_flow;
  std::optional<std::filesystem::path> masks;
};

/// The options `flow`, `depth` and `masks`.
struct VkittiChannelChoice {
  std::string flow, depth, masks;
};

class VkittiSequence : public Sequence {
 public:
  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }
  Frame read(int frame, Channels channels) const override;
  /// The data set's own flow, also when read() gives another.
  std::optional<Image<Flow>> true_flow(int frame) const override;
  /// The data set's own depth, when read() gives another.
  std::optional<Image<float>> true_depth(int frame) const override;
  void check_files() const override;

 protected:
  static constexpr int kWidth = 1242;  ///< px, of both releases
  static constexpr int kHeight = 375;

  using MakeMasks = std::function<std::unique_ptr<MaskSource>(const ChannelInputs&)>;

  /// Chooses the frames: those of the first folder that is there, or those that `truth_` has poses (else
  /// objects) of. `where` is the sequence in messages. Sets the size. Throws Error when there are none, and
  /// when a frame has no pose although others have.
  void choose_frames(const SourceSpec& source, const VkittiFolders& folders, const std::string& where);
  /// Makes the channels, after info_ has camera, size and frames. `own_masks` reads folders.masks.
  void open_channels(const VkittiFolders& folders, const VkittiChannelChoice& choice,
                     const MakeMasks& own_masks);

  SequenceInfo info_;
  SequenceTruth truth_;

 private:
  void open_flow(const VkittiFolders& folders, const std::string& choice);
  void open_depth(const VkittiFolders& folders, const std::string& choice);
  void open_masks(const VkittiFolders& folders, const std::string& choice, const MakeMasks& own_masks);
  std::map<int, std::vector<LabelBox>> label_boxes() const;
  Image<Rgb> read_image(const std::filesystem::path& path) const;

  std::string where_;
  std::optional<FrameFiles> left_, right_;
  ChannelInputs channel_inputs_;
  std::unique_ptr<FlowSource> flow_, own_flow_, backward_flow_;
  std::unique_ptr<DepthSource> depth_, own_depth_;
  std::unique_ptr<MaskSource> masks_;
};

/// The folder if it exists.
std::optional<std::filesystem::path> existing_folder(const std::filesystem::path& folder);

/// Checks the options that both adapters have: rate_hz > 0 and the channels' choices not empty.
void check_vkitti_options(double rate_hz, const VkittiChannelChoice& choice);

}  // namespace sextant
