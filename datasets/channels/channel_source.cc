#include "sextant/datasets/channels/channel_source.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/datasets/channels/computed_channels.h"
#include "sextant/datasets/channels/network.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/mots.h"

namespace sextant {

namespace {

// To add a kind, write one line in the table of its channel here, and one in the list at the head of
// channel_source.h. The help of the adapters' options and the message of an unknown choice follow from the
// table.
template <typename T>
using Opener =
    std::function<std::unique_ptr<ChannelSource<T>>(const std::string& path, const ChannelInputs&)>;

template <typename T>
struct Kind {
  std::string name;
  std::string argument;  // "DIR", "FILE" or ""
  Opener<T> open;

  std::string form() const { return argument.empty() ? name : name + ":" + argument; }
};

template <typename T>
std::vector<std::string> forms_of(const std::vector<Kind<T>>& table) {
  std::vector<std::string> forms;
  for (const Kind<T>& kind : table) forms.push_back(kind.form());
  return forms;
}

// Splits a choice such as "flo:DIR" and opens the source of its kind.
template <typename T>
std::unique_ptr<ChannelSource<T>> open_kind(const char* channel, const std::string& choice,
                                            const std::vector<Kind<T>>& table, const ChannelInputs& inputs) {
  SEXTANT_CHECK(inputs.inputs != nullptr && inputs.width > 0 && inputs.height > 0);
  const size_t colon = choice.find(':');
  const std::string name = choice.substr(0, colon);
  const auto kind = std::ranges::find(table, name, &Kind<T>::name);
  if (kind == table.end()) {
    std::vector<std::string> names;
    for (const auto& known : table) names.push_back(known.name);
    const std::vector<std::string> forms = forms_of(table);
    const std::string_view nearest = nearest_name(name, names);
    const auto at = std::ranges::find(names, nearest);
    fail("{}: unknown choice '{}': {}", channel, choice,
         suggest(at == names.end() ? name : forms[static_cast<size_t>(at - names.begin())], forms));
  }
  const std::string path = colon == std::string::npos ? "" : choice.substr(colon + 1);
  if (path.empty() != kind->argument.empty()) fail("{}: '{}': expected {}", channel, choice, kind->form());
  return kind->open(path, inputs);
}

/// Returns a factory of sources with one file per frame: FrameFiles finds the file by the number in its name,
/// and `decode` converts its bytes to the image of the channel.
template <typename T>
Opener<T> files(const char* channel, const char* kind, const char* extension,
                typename FolderSource<T>::Decode decode) {
  return [=](const std::string& path, const ChannelInputs& inputs) {
    return std::make_unique<FolderSource<T>>(channel, kind, extension, path, inputs, decode);
  };
}

template <typename Map>
auto of_png16(Map map) {
  return [map](const std::string& bytes, const std::string& name) { return map(decode_png16(bytes, name)); };
}

template <typename Map>
auto of_png_rgb16(Map map) {
  return
      [map](const std::string& bytes, const std::string& name) { return map(decode_png_rgb16(bytes, name)); };
}

std::unique_ptr<DepthSource> make_disparity256_source(const std::string& path, const ChannelInputs& inputs) {
  const auto depth = [bf = inputs.camera.bf](const auto& image) {
    return depth_from_disparity256(image, bf);
  };
  return files<float>("depth", "disparity256", ".png", of_png16(depth))(path, inputs);
}

Image<uint16_t> decode_mots(const std::string& bytes, const std::string& name) {
  return mask_from_mots(decode_png16(bytes, name), name);
}

/// Masks from one text file for all frames.
class MotsSource final : public MaskSource {
 public:
  MotsSource(const char* kind, MotsIds ids, const std::string& path, const ChannelInputs& inputs)
      : text_(inputs.inputs->read(path), path, ids),
        width_(inputs.width),
        height_(inputs.height),
        provenance_(fmt::format("masks: {}:{}", kind, path)) {
    if (ids == MotsIds::detections) provenance_ += " (detections: ids are of one frame each, not tracks)";
  }

  Image<uint16_t> read(int frame) const override { return text_.mask(frame, width_, height_); }
  std::string provenance() const override { return provenance_; }

 private:
  MotsText text_;
  int width_;
  int height_;
  std::string provenance_;
};

Opener<uint16_t> mots_text(const char* kind, MotsIds ids) {
  return [=](const std::string& path, const ChannelInputs& inputs) {
    return std::make_unique<MotsSource>(kind, ids, path, inputs);
  };
}

const std::vector<Kind<Flow>>& flow_kinds() {
  static const std::vector<Kind<Flow>> table = {
      {"dis", "", [](const auto&, const auto& i) { return make_dis_source(i); }},
      {"flo", "DIR", files<Flow>("flow", "flo", ".flo", decode_flo)},
      {"kitti_png", "DIR", files<Flow>("flow", "kitti_png", ".png", of_png_rgb16(flow_from_kitti))},
      {"vkitti_png", "DIR", files<Flow>("flow", "vkitti_png", ".png", of_png_rgb16(flow_from_vkitti))},
      {"tartanair_png", "DIR",
       files<Flow>("flow", "tartanair_png", ".png", of_png_rgb16(flow_from_tartanair))},
      {"onnx", "FILE", make_network_flow_source},
  };
  return table;
}

const std::vector<Kind<float>>& depth_kinds() {
  static const std::vector<Kind<float>> table = {
      {"sgbm", "", [](const auto&, const auto& i) { return make_sgbm_source(i); }},
      {"disparity256", "DIR", make_disparity256_source},
      {"depth256", "DIR", files<float>("depth", "depth256", ".png", of_png16(depth_from_depth256))},
      {"cm", "DIR", files<float>("depth", "cm", ".png", of_png16(depth_from_cm))},
      {"tartanair_png", "DIR",
       files<float>("depth", "tartanair_png", ".png",
                    [](const std::string& bytes, const std::string& name) {
                      return depth_from_tartanair(decode_png_rgba(bytes, name));
                    })},
  };
  return table;
}

std::vector<Kind<uint16_t>> mask_kinds(std::map<int, std::vector<LabelBox>> boxes) {
  return {
      {"instance_png", "DIR", files<uint16_t>("masks", "instance_png", ".png", decode_png_ids)},
      {"mots_png", "DIR", files<uint16_t>("masks", "mots_png", ".png", decode_mots)},
      {"mots_txt", "FILE", mots_text("mots_txt", MotsIds::tracks)},
      {"detections_txt", "FILE", mots_text("detections_txt", MotsIds::detections)},
      {"vdo_text", "DIR", files<uint16_t>("masks", "vdo_text", ".txt", decode_mask_text)},
      {"boxes", "",
       [boxes = std::move(boxes)](const auto&, const auto& i) { return make_box_source(i, boxes); }},
      {"onnx", "FILE", make_network_mask_source},
  };
}

}  // namespace

void check_size(int width, int height, const std::string& path, const ChannelInputs& inputs) {
  if (width == inputs.width && height == inputs.height) return;
  fail("{}: {}x{} pixels, expected {}x{} as in {}: all files of a sequence need the same size", path, width,
       height, inputs.width, inputs.height, inputs.size_from);
}

std::unique_ptr<FlowSource> make_flow_source(const std::string& choice, const ChannelInputs& inputs) {
  return open_kind("flow", choice, flow_kinds(), inputs);
}

std::unique_ptr<DepthSource> make_depth_source(const std::string& choice, const ChannelInputs& inputs) {
  return open_kind("depth", choice, depth_kinds(), inputs);
}

std::unique_ptr<MaskSource> make_mask_source(const std::string& choice, const ChannelInputs& inputs,
                                             std::map<int, std::vector<LabelBox>> boxes) {
  return open_kind("masks", choice, mask_kinds(std::move(boxes)), inputs);
}

const char* flow_option_help() {
  static const std::string help = fmt::format("auto = the data set's files, without them dis; none; or {}",
                                              fmt::join(forms_of(flow_kinds()), ", "));
  return help.c_str();
}

const char* depth_option_help() {
  static const std::string help = fmt::format("auto = the data set's files, without them sgbm; none; or {}",
                                              fmt::join(forms_of(depth_kinds()), ", "));
  return help.c_str();
}

const char* mask_option_help() {
  static const std::string help =
      fmt::format("auto = the data set's files; none; or {}", fmt::join(forms_of(mask_kinds({})), ", "));
  return help.c_str();
}

namespace {

struct Pattern {
  fs::path folder;
  std::string prefix;  ///< prefix of the names
};

Pattern pattern_of(const std::string& files) {
  if (!files.ends_with('*')) return {files, ""};
  const std::string prefix = fs::path(files).filename().string();
  return {fs::path(files).parent_path(), prefix.substr(0, prefix.size() - 1)};
}

/// Returns the position of the number in a name; the length of the name if there is none.
size_t number_in(const std::string& name, const std::string& prefix) {
  if (!name.starts_with(prefix)) return name.size();
  const auto from = name.begin() + static_cast<std::ptrdiff_t>(prefix.size());
  return static_cast<size_t>(std::find_if(from, name.end(), is_digit) - name.begin());
}

/// Calls use(frame, path) for each matching file.
template <typename Use>
void for_each_file(const Pattern& pattern, const std::string& extensions, const Use& use) {
  const std::vector<std::string> accepted = split(extensions, '|');
  for (const auto& entry : fs::directory_iterator(pattern.folder)) {
    const fs::path& path = entry.path();
    if (std::ranges::find(accepted, path.extension().string()) == accepted.end()) continue;
    const std::string name = path.stem().string();
    const size_t at = number_in(name, pattern.prefix);
    int frame = 0;
    const auto [end, error] = std::from_chars(name.data() + at, name.data() + name.size(), frame);
    if (error == std::errc()) use(frame, path);
  }
}

}  // namespace

FrameFiles::FrameFiles(const std::string& files, const std::string& extensions) {
  const Pattern pattern = pattern_of(files);
  prefix_ = pattern.prefix;
  if (!fs::is_directory(pattern.folder)) fail("{}: no such folder", pattern.folder.string());
  for_each_file(pattern, extensions, [&](int frame, const fs::path& path) {
    const auto [known, is_new] = paths_.emplace(frame, path);
    if (is_new) return;
    const auto [low, high] = std::minmax(known->second, path);
    fail("{}: two files of frame {}: {} and {}; keep one", pattern.folder.string(), frame,
         low.filename().string(), high.filename().string());
  });
  if (!paths_.empty()) return;
  fail("{}: no {} files named by frame number in it: add them", files,
       fmt::join(split(extensions, '|'), " or "));
}

const fs::path& FrameFiles::at(int frame, const std::string& what) const {
  const auto known = paths_.find(frame);
  if (known != paths_.end()) return known->second;
  // The name has the form of the other files' names.
  const fs::path& first = paths_.begin()->second;
  std::string name = first.filename().string();
  const size_t at = number_in(name, prefix_);
  const auto digits = name.begin() + static_cast<std::ptrdiff_t>(at);
  const auto n_digits = static_cast<size_t>(std::find_if_not(digits, name.end(), is_digit) - digits);
  name.replace(at, n_digits, fmt::format("{:0{}}", frame, n_digits));
  fail_missing(first.parent_path() / name, frame, what);
}

std::set<int> FrameFiles::frames() const {
  std::set<int> frames;
  for (const auto& [frame, path] : paths_) frames.insert(frame);
  return frames;
}

bool has_frame_files(const std::string& files, const std::string& extensions) {
  const Pattern pattern = pattern_of(files);
  bool found = false;
  if (!fs::is_directory(pattern.folder)) return false;
  for_each_file(pattern, extensions, [&](int, const fs::path&) { found = true; });
  return found;
}

void fail_missing(const fs::path& path, int frame, const std::string& what) {
  fail("{}: missing file: frame {} needs its {}; add it, or choose other frames with @first-last",
       path.string(), frame, what);
}

}  // namespace sextant
