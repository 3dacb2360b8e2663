#include "sextant/datasets/channels/channel_source.h"

#include <algorithm>

#include "sextant/base/text.h"
#include "sextant/datasets/channels/computed_channels.h"
#include "sextant/datasets/channels/file_channels.h"
#include "sextant/datasets/channels/network.h"

namespace sextant {
namespace {

// How to add a kind: its maker in one of the files above, one line in the table of its channel here, and one
// in the list at the head of channel_source.h.
template <typename Make>
struct Kind {
  std::string name;
  std::string argument;  // "DIR", "FILE" or ""
  Make make;
};

template <typename T>
using Make = std::function<std::unique_ptr<ChannelSource<T>>(const std::string& path, const ChannelInputs&)>;

// Splits "flo:DIR" and finds its kind.
template <typename T>
std::unique_ptr<ChannelSource<T>> make(const char* channel, const std::string& choice,
                                       const std::vector<Kind<Make<T>>>& table, const ChannelInputs& inputs) {
  SEXTANT_CHECK(inputs.inputs != nullptr && inputs.width > 0 && inputs.height > 0);
  const size_t colon = choice.find(':');
  const std::string name = choice.substr(0, colon);
  const auto form = [](const Kind<Make<T>>& kind) {
    return kind.argument.empty() ? kind.name : kind.name + ":" + kind.argument;
  };
  const auto kind = std::ranges::find(table, name, &Kind<Make<T>>::name);
  if (kind == table.end()) {
    std::vector<std::string> names, forms;
    for (const auto& known : table) names.push_back(known.name);
    for (const auto& known : table) forms.push_back(form(known));
    const std::string_view nearest = nearest_name(name, names);
    const auto at = std::ranges::find(names, nearest);
    fail("{}: unknown choice '{}': {}", channel, choice,
         suggest(at == names.end() ? name : forms[static_cast<size_t>(at - names.begin())], forms));
  }
  const std::string path = colon == std::string::npos ? "" : choice.substr(colon + 1);
  if (path.empty() != kind->argument.empty()) fail("{}: '{}': expected {}", channel, choice, form(*kind));
  return kind->make(path, inputs);
}

}  // namespace

void check_size(int width, int height, const std::string& path, const ChannelInputs& inputs) {
  if (width == inputs.width && height == inputs.height) return;
  fail("{}: {}x{} pixels, expected {}x{} as in {}: all files of a sequence need the same size", path, width,
       height, inputs.width, inputs.height, inputs.size_from);
}

std::unique_ptr<FlowSource> make_flow_source(const std::string& choice, const ChannelInputs& inputs) {
  static const std::vector<Kind<Make<Flow>>> table = {
      {"dis", "", [](const auto&, const auto& i) { return make_dis_source(i); }},
      {"flo", "DIR", make_flo_source},
      {"kitti_png", "DIR", make_kitti_flow_source},
      {"vkitti_png", "DIR", make_vkitti_flow_source},
      {"onnx", "FILE", make_network_flow_source},
  };
  return make("flow", choice, table, inputs);
}

std::unique_ptr<DepthSource> make_depth_source(const std::string& choice, const ChannelInputs& inputs) {
  static const std::vector<Kind<Make<float>>> table = {
      {"sgbm", "", [](const auto&, const auto& i) { return make_sgbm_source(i); }},
      {"disparity256", "DIR", make_disparity256_source},
      {"depth256", "DIR", make_depth256_source},
      {"cm", "DIR", make_cm_source},
  };
  return make("depth", choice, table, inputs);
}

std::unique_ptr<MaskSource> make_mask_source(const std::string& choice, const ChannelInputs& inputs,
                                             std::map<int, std::vector<LabelBox>> boxes) {
  const std::vector<Kind<Make<uint16_t>>> table = {
      {"instance_png", "DIR", make_instance_png_source},
      {"mots_png", "DIR", make_mots_png_source},
      {"mots_txt", "FILE", make_mots_txt_source},
      {"detections_txt", "FILE", make_detections_txt_source},
      {"vdo_text", "DIR", make_vdo_text_source},
      {"boxes", "", [&](const auto&, const auto& i) { return make_box_source(i, std::move(boxes)); }},
      {"onnx", "FILE", make_network_mask_source},
  };
  return make("masks", choice, table, inputs);
}

}  // namespace sextant
