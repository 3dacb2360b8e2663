#include "sextant/datasets/channels/onnx_header.h"

#include <fmt/ranges.h>

#include <cstdint>
#include <set>

#include "sextant/base/error.h"

namespace sextant {
namespace {

// The fields of one protobuf message: (number, wire type, varint or bytes).
class Fields {
 public:
  Fields(std::string_view bytes, const std::string& name) : rest_(bytes), name_(name) {}

  bool next() {
    if (rest_.empty()) return false;
    const uint64_t key = varint();
    number_ = static_cast<int>(key >> 3);
    if (number_ == 0) broken();
    switch (key & 7) {
      case 0:
        value_ = varint();
        break;
      case 1:
        bytes_ = take(8);
        break;
      case 2:
        bytes_ = take(varint());
        break;
      case 5:
        bytes_ = take(4);
        break;
      default:
        broken();
    }
    is_bytes_ = (key & 7) == 2;
    return true;
  }

  int number() const { return number_; }
  bool has_bytes(int number) const { return is_bytes_ && number_ == number; }
  bool has_number(int number) const { return !is_bytes_ && number_ == number; }
  std::string_view bytes() const { return bytes_; }
  int64_t value() const { return static_cast<int64_t>(value_); }

  [[noreturn]] void broken() const {
    fail("{}: not an ONNX model, or a damaged one: expected a protobuf message ModelProto", name_);
  }

 private:
  uint64_t varint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const uint64_t byte = static_cast<unsigned char>(take(1).front());
      value |= (byte & 127) << shift;
      if (byte < 128) return value;
    }
    broken();
  }

  std::string_view take(uint64_t n) {
    if (n > rest_.size()) broken();
    const std::string_view taken = rest_.substr(0, n);
    rest_.remove_prefix(n);
    return taken;
  }

  std::string_view rest_;
  const std::string& name_;
  int number_ = 0;
  bool is_bytes_ = false;
  uint64_t value_ = 0;
  std::string_view bytes_;
};

// TensorShapeProto: dim = 1 { dim_value = 1, dim_param = 2 }
std::vector<int64_t> read_shape(std::string_view bytes, const std::string& name) {
  std::vector<int64_t> shape;
  for (Fields fields(bytes, name); fields.next();) {
    if (!fields.has_bytes(1)) continue;
    shape.push_back(-1);
    for (Fields dim(fields.bytes(), name); dim.next();) {
      if (dim.has_number(1) && dim.value() > 0) shape.back() = dim.value();
    }
  }
  return shape;
}

// ValueInfoProto: name = 1, type = 2 { tensor_type = 1 { elem_type = 1, shape = 2 } }
OnnxTensor read_value(std::string_view bytes, const std::string& name) {
  OnnxTensor tensor;
  for (Fields value(bytes, name); value.next();) {
    if (value.has_bytes(1)) tensor.name = value.bytes();
    if (!value.has_bytes(2)) continue;
    for (Fields type(value.bytes(), name); type.next();) {
      if (!type.has_bytes(1)) continue;
      for (Fields inner(type.bytes(), name); inner.next();) {
        if (inner.has_bytes(2)) tensor.shape = read_shape(inner.bytes(), name);
      }
    }
  }
  return tensor;
}

std::string read_name(std::string_view tensor, const std::string& name) {
  std::string found;
  for (Fields fields(tensor, name); fields.next();) {
    if (fields.has_bytes(8)) found = fields.bytes();
  }
  return found;
}

}  // namespace

std::string OnnxTensor::text() const {
  std::vector<std::string> sizes;
  for (const int64_t n : shape) sizes.push_back(n < 0 ? "?" : std::to_string(n));
  return sizes.empty() ? "no shape" : fmt::format("{}", fmt::join(sizes, "x"));
}

OnnxHeader read_onnx_header(std::string_view bytes, const std::string& name) {
  OnnxHeader header;
  std::set<std::string> weights;
  bool has_graph = false;
  for (Fields model(bytes, name); model.next();) {
    if (!model.has_bytes(7)) continue;
    has_graph = true;
    for (Fields graph(model.bytes(), name); graph.next();) {
      if (graph.has_bytes(1)) ++header.n_nodes;
      if (graph.has_bytes(5)) weights.insert(read_name(graph.bytes(), name));
      if (graph.has_bytes(11)) header.inputs.push_back(read_value(graph.bytes(), name));
      if (graph.has_bytes(12)) header.outputs.push_back(read_value(graph.bytes(), name));
    }
  }
  if (!has_graph || header.n_nodes == 0 || header.outputs.empty()) {
    fail("{}: not an ONNX model: expected a graph with nodes and outputs", name);
  }
  std::erase_if(header.inputs, [&](const OnnxTensor& input) { return weights.contains(input.name); });
  return header;
}

}  // namespace sextant
