#pragma once

// Test helper: ONNX files with a few nodes.

#include <cstring>

#include "sextant/base/testing.h"
#include "sextant/datasets/channels/channel_source.h"

namespace sextant {

/// A protobuf message under construction, as in ONNX files.
class Proto {
 public:
  Proto& number(int field, uint64_t value) {
    varint(static_cast<uint64_t>(field) << 3);
    varint(value);
    return *this;
  }
  Proto& bytes(int field, std::string_view text) {
    varint(static_cast<uint64_t>(field) << 3 | 2);
    varint(text.size());
    bytes_ += text;
    return *this;
  }
  Proto& message(int field, const Proto& inner) { return bytes(field, inner.bytes_); }
  const std::string& str() const { return bytes_; }

 private:
  void varint(uint64_t value) {
    for (; value >= 128; value >>= 7) bytes_ += static_cast<char>(value | 128);
    bytes_ += static_cast<char>(value);
  }
  std::string bytes_;
};

/// An ONNX model (opset 11) of convolutions, concatenations and reshapes.
class OnnxModel {
 public:
  /// Adds an input; -1 is a size that is not fixed in the file.
  OnnxModel& input(const std::string& name, const std::vector<int>& shape) {
    graph_.message(11, value(name, shape));
    return *this;
  }
  OnnxModel& output(const std::string& name, const std::vector<int>& shape) {
    graph_.message(12, value(name, shape));
    return *this;
  }
  /// Adds a convolution with 1x1 kernels: out_i = sum_j weights[i][j] in_j + bias[i].
  OnnxModel& mix(const std::string& in, const std::string& out,
                 const std::vector<std::vector<float>>& weights, std::vector<float> bias = {}) {
    std::vector<float> flat;
    for (const auto& row : weights) flat.insert(flat.end(), row.begin(), row.end());
    const int n = static_cast<int>(weights.size());
    bias.resize(weights.size());
    tensor(out + "_w", {n, static_cast<int>(weights.front().size()), 1, 1}, flat);
    tensor(out + "_b", {n}, bias);
    return node("Conv", {in, out + "_w", out + "_b"}, out, ints("kernel_shape", {1, 1}));
  }
  /// Adds the mean over 2x2 pixels, at half the size.
  OnnxModel& halve(const std::string& in, const std::string& out) {
    Proto proto = start("AveragePool", {in}, out);
    proto.message(5, ints("kernel_shape", {2, 2})).message(5, ints("strides", {2, 2}));
    graph_.message(1, proto);
    return *this;
  }
  OnnxModel& concat(const std::vector<std::string>& in, const std::string& out) {
    return node("Concat", in, out, Proto().bytes(1, "axis").number(3, 1).number(20, 2));
  }
  OnnxModel& squeeze(const std::string& in, const std::string& out, int axis) {
    return node("Squeeze", {in}, out, ints("axes", {axis}));
  }
  /// Adds an arbitrary node.
  OnnxModel& node(const std::string& type, const std::vector<std::string>& in, const std::string& out,
                  const Proto& attribute) {
    graph_.message(1, start(type, in, out).message(5, attribute));
    return *this;
  }

  std::string bytes() const {
    Proto graph = graph_;
    graph.bytes(2, "test");
    return Proto().number(1, 6).message(7, graph).message(8, Proto().bytes(1, "").number(2, 11)).str();
  }

 private:
  static Proto start(const std::string& type, const std::vector<std::string>& in, const std::string& out) {
    Proto proto;
    for (const std::string& name : in) proto.bytes(1, name);
    return proto.bytes(2, out).bytes(3, out + "_node").bytes(4, type);
  }
  static Proto ints(const std::string& name, const std::vector<int>& values) {
    Proto proto;
    proto.bytes(1, name);
    for (const int n : values) proto.number(8, static_cast<uint64_t>(n));
    return proto.number(20, 7);
  }
  static Proto value(const std::string& name, const std::vector<int>& shape) {
    Proto dims;
    for (const int n : shape) {
      dims.message(1, n < 0 ? Proto().bytes(2, "open") : Proto().number(1, static_cast<uint64_t>(n)));
    }
    const Proto type = Proto().message(1, Proto().number(1, 1).message(2, dims));
    return Proto().bytes(1, name).message(2, type);
  }
  void tensor(const std::string& name, const std::vector<int>& shape, const std::vector<float>& values) {
    Proto proto;
    for (const int n : shape) proto.number(1, static_cast<uint64_t>(n));
    std::string raw(values.size() * sizeof(float), '\0');
    std::memcpy(raw.data(), values.data(), raw.size());
    graph_.message(5, proto.number(2, 1).bytes(8, name).bytes(9, raw));
  }

  Proto graph_;
};

}  // namespace sextant
