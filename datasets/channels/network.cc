#include "sextant/datasets/channels/network.h"

#include <fmt/ranges.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <span>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/datasets/channels/opencv_view.h"

namespace sextant {
namespace {

// Iterates over the fields of one protobuf message: (number, wire type, varint or bytes).
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

namespace {

using internal::view;

std::string shape_text(const cv::Mat& blob) {
  std::string text;
  for (int i = 0; i < blob.dims; ++i) text += fmt::format("{}{}", i == 0 ? "" : "x", blob.size[i]);
  return text;
}

// The network of one file. A cv::dnn::Net serves one thread at a time: each thread takes a free one, or makes
// its own.
class Network {
 public:
  Network(const std::string& path, const ChannelInputs& inputs, std::vector<std::vector<int>> channels,
          const std::string& expected)
      : path_(path), bytes_(inputs.inputs->read(path)), header_(read_onnx_header(bytes_, path)) {
    internal::one_opencv_thread();
    // errors of OpenCV are reported as Error instead
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    check_inputs(channels, expected);
    if (header_.outputs.size() != 1) {
      fail("{}: it has {} outputs ({} first), expected one: cut off the others", path_,
           header_.outputs.size(), header_.outputs.front().name);
    }
    const std::vector<int64_t>& shape = header_.inputs.front().shape;
    height_ = shape[2] > 0 ? static_cast<int>(shape[2]) : inputs.height;
    width_ = shape[3] > 0 ? static_cast<int>(shape[3]) : inputs.width;
    give_back(make());
  }

  const std::string& path() const { return path_; }
  int width() const { return width_; }
  int height() const { return height_; }

  // Runs the network on images, whose channels are passed to the inputs in order.
  cv::Mat run(const std::vector<Image<Rgb>>& images) {
    cv::dnn::Net net = take();
    cv::Mat output;
    try {
      size_t next = 0;
      for (const OnnxTensor& input : header_.inputs) {
        const size_t n = header_.inputs.size() == 1 ? images.size() : 1;
        net.setInput(blob(std::span(images).subspan(next, n)), input.name);
        next += n;
      }
      output = net.forward().clone();
    } catch (const cv::Exception& error) {
      fail("{}: OpenCV cannot run this network: {}", path_, one_line(error.err));
    }
    give_back(std::move(net));
    if (output.depth() != CV_32F)
      fail("{}: its output is not of type float32: expected a network with float32 output", path_);
    return output;
  }

  [[noreturn]] void wrong_output(const cv::Mat& output, const char* expected) const {
    fail("{}: its output {} has shape {}, expected {}", path_, header_.outputs.front().name,
         shape_text(output), expected);
  }

 private:
  // Checks the inputs; `channels` lists the accepted numbers of input channels, such as {{6}, {3, 3}}.
  void check_inputs(const std::vector<std::vector<int>>& channels, const std::string& expected) const {
    const std::vector<OnnxTensor>& inputs = header_.inputs;
    std::string found;
    for (const OnnxTensor& input : inputs) {
      found += fmt::format("{}{} {}", found.empty() ? "" : " and ", input.name, input.text());
    }
    const auto fits = [&](const std::vector<int>& list) {
      return std::ranges::equal(list, inputs, [&](int n, const OnnxTensor& input) {
        return input.shape.size() == 4 && std::abs(input.shape[0]) == 1 && input.shape[1] == n &&
               input.shape[2] == inputs.front().shape[2] && input.shape[3] == inputs.front().shape[3];
      });
    };
    if (std::ranges::any_of(channels, fits)) return;
    fail("{}: its input is {}, expected {}", path_, found.empty() ? "absent" : found, expected);
  }

  cv::dnn::Net make() const {
    try {
      cv::dnn::Net net = cv::dnn::readNetFromONNX(bytes_.data(), bytes_.size());
      net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
      net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
      return net;
    } catch (const cv::Exception& error) {
      fail("{}: OpenCV cannot read this network: {}", path_, one_line(error.err));
    }
  }

  cv::dnn::Net take() {
    {
      const std::scoped_lock lock(mutex_);
      if (!free_.empty()) {
        cv::dnn::Net net = std::move(free_.back());
        free_.pop_back();
        return net;
      }
    }
    return make();
  }

  void give_back(cv::dnn::Net net) {
    const std::scoped_lock lock(mutex_);
    free_.push_back(std::move(net));
  }

  cv::Mat blob(std::span<const Image<Rgb>> images) const {
    const int shape[] = {1, static_cast<int>(3 * images.size()), height_, width_};
    cv::Mat blob(4, shape, CV_32F);
    for (size_t i = 0; i < images.size(); ++i) {
      cv::Mat pixels, small;
      view(images[i]).convertTo(pixels, CV_32FC3);
      cv::resize(pixels, small, {width_, height_}, 0, 0, cv::INTER_LINEAR);
      std::vector<cv::Mat> planes;
      for (int c = 0; c < 3; ++c) {
        planes.emplace_back(height_, width_, CV_32F, blob.ptr<float>(0, static_cast<int>(3 * i) + c));
      }
      cv::split(small, planes);
    }
    return blob;
  }

  std::string path_;
  std::string bytes_;
  OnnxHeader header_;
  int width_ = 0;
  int height_ = 0;
  std::mutex mutex_;
  std::vector<cv::dnn::Net> free_;
};

class NetworkFlow final : public FlowSource {
 public:
  NetworkFlow(const std::string& path, const ChannelInputs& inputs)
      : inputs_(inputs),
        network_(path, inputs, {{6}, {3, 3}}, "one of 1x6xHxW or two of 1x3xHxW (previous and next image)") {}

  Image<Flow> read(int frame) const override {
    if (frame >= inputs_.last_frame) return {};
    const cv::Mat output = network_.run({inputs_.left(frame), inputs_.left(frame + 1)});
    if (output.dims != 4 || output.size[0] != 1 || output.size[1] != 2) {
      network_.wrong_output(output, "1x2xHxW (flow u, v)");
    }
    const auto plane = [&](int c) {
      return cv::Mat(output.size[2], output.size[3], CV_32F, const_cast<float*>(output.ptr<float>(0, c)));
    };
    Image<Flow> flow(inputs_.width, inputs_.height);
    cv::Mat small, out(flow.height(), flow.width(), CV_32FC2, flow.data());
    cv::merge(std::vector<cv::Mat>{plane(0), plane(1)}, small);
    cv::resize(small, out, out.size(), 0, 0, cv::INTER_LINEAR);
    const float sx = static_cast<float>(inputs_.width) / static_cast<float>(network_.width());
    const float sy = static_cast<float>(inputs_.height) / static_cast<float>(network_.height());
    for (size_t i = 0; i < flow.size(); ++i) {
      Flow& f = flow.data()[i];
      f = {f.u * sx, f.v * sy};
      if (!f.valid()) f = {};
    }
    return flow;
  }
  std::string provenance() const override { return "flow: onnx:" + network_.path(); }

 private:
  ChannelInputs inputs_;
  mutable Network network_;  // hands out its nets under a lock
};

class NetworkMasks final : public MaskSource {
 public:
  NetworkMasks(const std::string& path, const ChannelInputs& inputs)
      : inputs_(inputs), network_(path, inputs, {{3}}, "one of 1x3xHxW") {}

  Image<uint16_t> read(int frame) const override {
    cv::Mat output = network_.run({inputs_.left(frame)});
    if (output.dims == 3 && output.size[0] == 1) {
      const int shape[] = {1, 1, output.size[1], output.size[2]};
      output = output.reshape(1, 4, shape);
    }
    if (output.dims != 4 || output.size[0] != 1 || output.size[1] < 1) {
      network_.wrong_output(output, "1x1xHxW or 1xHxW (instance ids) or 1xCxHxW (scores of classes)");
    }
    if (output.size[1] == 1) return resized(ids(output, frame));
    return connected_instances(resized(best_classes(output)), network_.path());
  }
  std::string provenance() const override {
    return fmt::format("masks: onnx:{} (ids are of one frame each, not tracks)", network_.path());
  }

 private:
  Image<uint16_t> ids(const cv::Mat& output, int frame) const {
    Image<uint16_t> mask(output.size[3], output.size[2]);
    const float* values = output.ptr<float>();
    for (size_t i = 0; i < mask.size(); ++i) {
      const float id = std::round(values[i]);
      if (!(std::abs(values[i] - id) < 1e-3f) || id < 0 || id > 65535) {
        fail(
            "{}: frame {}: its output has the value {} at column "
            "{}, row {}: expected whole numbers 0 to 65535",
            network_.path(), frame, values[i], i % static_cast<size_t>(mask.width()),
            i / static_cast<size_t>(mask.width()));
      }
      mask.data()[i] = static_cast<uint16_t>(id);
    }
    return mask;
  }

  static Image<uint16_t> best_classes(const cv::Mat& output) {
    Image<uint16_t> classes(output.size[3], output.size[2]);
    std::vector<float> best(output.ptr<float>(0, 0), output.ptr<float>(0, 0) + classes.size());
    for (int c = 1; c < output.size[1]; ++c) {
      const float* scores = output.ptr<float>(0, c);
      for (size_t i = 0; i < classes.size(); ++i) {
        if (!(scores[i] > best[i])) continue;
        best[i] = scores[i];
        classes.data()[i] = static_cast<uint16_t>(c);
      }
    }
    return classes;
  }

  // Resizes to the image's size, by nearest pixel.
  Image<uint16_t> resized(const Image<uint16_t>& mask) const {
    Image<uint16_t> out(inputs_.width, inputs_.height);
    for (int y = 0; y < out.height(); ++y) {
      const uint16_t* row = mask.row(static_cast<int>((y + 0.5) * mask.height() / out.height()));
      for (int x = 0; x < out.width(); ++x) {
        out(x, y) = row[static_cast<int>((x + 0.5) * mask.width() / out.width())];
      }
    }
    return out;
  }

  ChannelInputs inputs_;
  mutable Network network_;  // hands out its nets under a lock
};

}  // namespace

Image<uint16_t> connected_instances(const Image<uint16_t>& classes, const std::string& name) {
  Image<uint16_t> ids(classes.width(), classes.height());
  std::vector<std::pair<int, int>> open;
  int n = 0;
  const auto visit = [&](int x, int y) {
    ids(x, y) = static_cast<uint16_t>(n);
    open.emplace_back(x, y);
  };
  for (const auto [x, y] : pixels(classes)) {
    const uint16_t class_id = classes(x, y);
    if (class_id == 0 || ids(x, y) != 0) continue;
    if (++n > 65535) fail("{}: more than 65535 separate instances in one frame", name);
    visit(x, y);
    while (!open.empty()) {
      const auto [cx, cy] = open.back();
      open.pop_back();
      for (int ny = cy - 1; ny <= cy + 1; ++ny) {
        for (int nx = cx - 1; nx <= cx + 1; ++nx) {
          if (classes.contains(nx, ny) && classes(nx, ny) == class_id && ids(nx, ny) == 0) visit(nx, ny);
        }
      }
    }
  }
  return ids;
}

std::unique_ptr<FlowSource> make_network_flow_source(const std::string& path, const ChannelInputs& inputs) {
  if (!inputs.left) fail("flow: a network needs images, and this source has none: give the flow in files");
  return std::make_unique<NetworkFlow>(path, inputs);
}

std::unique_ptr<MaskSource> make_network_mask_source(const std::string& path, const ChannelInputs& inputs) {
  if (!inputs.left) fail("masks: a network needs images, and this source has none: give the masks in files");
  return std::make_unique<NetworkMasks>(path, inputs);
}

}  // namespace sextant
