#pragma once

// Flow and masks by ONNX networks, and the header of an ONNX file.
//
// Names and shapes of the inputs and outputs of an ONNX file. Source: onnx/onnx.proto (ModelProto.graph = 7;
// GraphProto.node = 1, initializer = 5, input = 11, output = 12), read from the protobuf wire format.

#include <string>
#include <string_view>
#include <vector>

#include "sextant/datasets/channels/channel_source.h"

namespace sextant {

struct OnnxTensor {
  std::string name;
  std::vector<int64_t> shape;  ///< -1: not fixed in the file
  std::string text() const;    ///< such as "1x3x?x?", with ? for sizes that are not fixed
};

struct OnnxHeader {
  std::vector<OnnxTensor> inputs;  ///< without weights
  std::vector<OnnxTensor> outputs;
  int n_nodes = 0;
};

/// Reads the header. Throws Error "NAME: ..." if the bytes are not an ONNX model.
OnnxHeader read_onnx_header(std::string_view bytes, const std::string& name);

// Channels computed by a network in an ONNX file, which OpenCV's DNN module runs on the CPU; see
// docs/datasets.md.
//
//   flow    input   one of 1x6xHxW (previous, next) or two of 1x3xHxW, in this order: RGB, float, 0..255
//           output  exactly one: 1x2xhxw, float, (u, v) in pixels of the network's input
//   masks   input   one of 1x3xHxW: RGB, float, 0..255
//           output  exactly one, float: 1x1xhxw or 1xhxw instance ids (whole numbers 0..65535), or class
//                   scores, 1xCxhxw, C > 1, class 0 the background: each 8-connected region of one best class
//                   is an instance, numbered from 1 in order of its first pixel
//
// If H or W is not fixed in the file, it is that of the image. Images are resized to H x W bilinearly; flow
// is resized back bilinearly and its vectors are scaled, ids are taken from the nearest pixel.

/// Make the channel sources. Throw Error if the source has no images; throw Error that names the file if it
/// cannot be read or has several outputs, and also the expected and found shapes if its inputs are not as
/// described above. Type and shape of the output are checked when a frame is read.
std::unique_ptr<FlowSource> make_network_flow_source(const std::string& path, const ChannelInputs& inputs);
std::unique_ptr<MaskSource> make_network_mask_source(const std::string& path, const ChannelInputs& inputs);

/// Returns the 8-connected regions of equal, positive class: ids from 1 in order of their first pixel, row by
/// row. Throws Error "NAME: ..." if there are more than 65535.
Image<uint16_t> connected_instances(const Image<uint16_t>& classes, const std::string& name);

}  // namespace sextant
