#pragma once

// What an ONNX file asks for and gives: names and shapes of its inputs and outputs. Source: onnx/onnx.proto
// (ModelProto.graph = 7; GraphProto.node = 1, initializer = 5, input = 11, output = 12), read by the protobuf
// wire format.

#include <string>
#include <string_view>
#include <vector>

namespace sextant {

struct OnnxTensor {
  std::string name;
  std::vector<int64_t> shape;  ///< -1: not fixed in the file
  std::string text() const;    ///< "1x3xHxW", with ? for what is not fixed
};

struct OnnxHeader {
  std::vector<OnnxTensor> inputs;  ///< without weights
  std::vector<OnnxTensor> outputs;
  int n_nodes = 0;
};

/// Throws Error "NAME: ..." on bytes that are not an ONNX model.
OnnxHeader read_onnx_header(std::string_view bytes, const std::string& name);

}  // namespace sextant
