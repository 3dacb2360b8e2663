#pragma once

// Channels computed from the images, without files of their own.
//
// DIS: Kroeger et al., Fast Optical Flow using Dense Inverse Search, ECCV 2016, in OpenCV's implementation.
// SGBM: Hirschmueller, Stereo Processing by Semiglobal Matching and Mutual Information, PAMI 2008, in
// OpenCV's implementation.

#include "sextant/datasets/channels/channel_source.h"

namespace sextant {

/// Returns the flow from `prev` to `curr` by DIS, preset medium. Valid everywhere, also where the point is
/// occluded or outside in `curr`. Throws Error if the images differ in size, or are smaller than 16 px in
/// either direction.
Image<Flow> dis_flow(const Image<uint8_t>& prev, const Image<uint8_t>& curr);

/// Returns the disparity of the left image (px, to 1/16 px); NaN where no match is unique, where both views
/// disagree, in speckles, and where the match would lie outside the right image. Throws Error if the images
/// differ in size.
Image<float> sgbm_disparity(const Image<uint8_t>& left, const Image<uint8_t>& right);

/// Returns bf / disparity (m); NaN stays NaN, and a disparity of 0 (infinite depth) becomes NaN.
Image<float> depth_from_disparity(const Image<float>& disparity_px, double bf);

/// Make the channel sources; `inputs` as for make_flow_source(). Throw Error if there are no images (sgbm: of
/// both cameras) or boxes.
std::unique_ptr<FlowSource> make_dis_source(const ChannelInputs& inputs);
std::unique_ptr<DepthSource> make_sgbm_source(const ChannelInputs& inputs);
std::unique_ptr<MaskSource> make_box_source(const ChannelInputs& inputs,
                                            std::map<int, std::vector<LabelBox>> boxes);

}  // namespace sextant
