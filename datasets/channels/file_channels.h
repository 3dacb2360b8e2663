#pragma once

// Channels in files: the choices "kind:DIR" and "kind:FILE" of channel_source.h.

#include "sextant/datasets/channels/channel_source.h"

namespace sextant {

/// Throw Error when there is no such folder or file, or nothing of the kind in it. `path` is what stands
/// after the colon.
std::unique_ptr<FlowSource> make_flo_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<FlowSource> make_kitti_flow_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<FlowSource> make_vkitti_flow_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<DepthSource> make_disparity256_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<DepthSource> make_depth256_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<DepthSource> make_cm_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<MaskSource> make_instance_png_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<MaskSource> make_mots_png_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<MaskSource> make_mots_txt_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<MaskSource> make_detections_txt_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<MaskSource> make_vdo_text_source(const std::string& path, const ChannelInputs& inputs);

/// Masks of a data set's own kind, one file a frame; `files` as in frame_files.h.
std::unique_ptr<MaskSource> make_mask_folder(
    const std::string& name, const std::string& files, const ChannelInputs& inputs,
    const std::function<Image<uint16_t>(const std::string& bytes, const std::string& path)>& decode);

}  // namespace sextant
