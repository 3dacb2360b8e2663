#include "sextant/datasets/rendered_sequence.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <mutex>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/machine.h"
#include "sextant/base/new_file.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/dataset.h"
#include "sextant/datasets/synthetic/choreography.h"
#include "sextant/datasets/synthetic/renderer.h"
#include "sextant/datasets/vkitti1.h"
#include "sextant/datasets/vkitti_layout.h"

namespace sextant {

namespace synthetic {
namespace {

/// The content of a scenario as bytes, one value after the other.
class Content {
 public:
  template <typename T>
  void add(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  void add(const std::string& text) {
    add(text.size());
    bytes_ += text;
  }
  template <typename Scalar, int Rows>
  void add(const Eigen::Matrix<Scalar, Rows, 1>& vector) {
    for (int i = 0; i < Rows; ++i) add(vector[i]);
  }
  void add(const SE3& pose) {
    add(Eigen::Vector4d(pose.rotation().coeffs()));
    add(pose.translation());
  }
  void add(const Mesh& mesh) {
    add(mesh.vertices.size());
    for (const Eigen::Vector3d& vertex : mesh.vertices) add(vertex);
    add(mesh.triangles.size());
    for (const Triangle& triangle : mesh.triangles) {
      for (const uint32_t vertex : triangle.vertices) add(vertex);
      add(triangle.patch);
    }
    add(mesh.patches.size());
    for (const Patch& patch : mesh.patches) {
      add(patch.look.material);
      add(patch.look.colour);
      add(patch.look.seed);
      add(patch.look.extent);
      add(patch.origin);
      add(patch.u_axis);
      add(patch.v_axis);
    }
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace

std::string content_key(const Scenario& scenario, const std::string& version) {
  Content content;
  content.add(version);
  const PinholeCamera& camera = scenario.camera.left;
  for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy, scenario.camera.bf})
    content.add(value);
  content.add(scenario.width);
  content.add(scenario.height);
  content.add(scenario.world);
  content.add(scenario.T_world_camera.size());
  for (const SE3& pose : scenario.T_world_camera) content.add(pose);
  for (const Actor& actor : scenario.actors) {
    content.add(actor.id);
    content.add(make_car(actor.shape));
    for (const std::optional<SE3>& pose : actor.T_world_object) {
      content.add(pose.has_value());
      if (pose) content.add(*pose);
    }
  }
  return sha256(content.bytes());
}

namespace {

/// Returns the folder of the option: cache_root()/frames for "auto", empty if there is no root; otherwise
/// `option` itself; empty = no cache.
fs::path cache_folder(const std::string& option) {
  if (option != "auto") return option;
  const fs::path root = cache_root();
  return root.empty() ? root : root / "frames";
}

/// Cache of rendered images on disk, addressed by content: folder/<SHA-256 of the scenario and the renderer's
/// version>/<frame>-<channel>.bin. A file consists of a line of text (kind, size, SHA-256 of the pixels) and
/// the raw pixels; a damaged file is treated as missing. Files are written under another name and renamed, so
/// that several programs may share a folder. Nothing is stored once the folder has `max_bytes`; to empty the
/// cache, delete the folder.
class FrameCache {
 public:
  /// With an empty folder, nothing is found or stored. Throws Error if the folder exists and does not belong
  /// to this user, or if other users can write into it.
  FrameCache(const fs::path& folder, const std::string& key, uint64_t max_bytes)
      : folder_(folder.empty() ? fs::path() : folder / key), max_bytes_(max_bytes) {
    if (folder.empty()) return;
    check_private_folder(folder);
    std::error_code error;
    for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      std::error_code gone;  // another program may be writing
      const uint64_t size = it->is_regular_file(gone) ? it->file_size(gone) : 0;
      if (!gone) used_bytes_ += size;
    }
  }

  /// Returns false if the image is missing, damaged, or of another size.
  template <typename T>
  bool load(int frame, const char* channel, int width, int height, Image<T>& image) const {
    std::error_code error;
    if (folder_.empty() || !fs::is_regular_file(file(frame, channel), error)) return false;
    std::string bytes;
    try {
      bytes = read_file(file(frame, channel));
    } catch (const Error&) {
      return false;  // deleted in the meantime
    }
    constexpr size_t hash_size = 64;
    Image<T> found(width, height);
    const size_t size = found.size() * sizeof(T);
    const std::string start = header(found);
    const size_t begin = start.size() + hash_size + 1;
    if (bytes.size() != begin + size || !bytes.starts_with(start)) return false;
    const std::string_view pixels = std::string_view(bytes).substr(begin);
    if (sha256(pixels) != std::string_view(bytes).substr(start.size(), hash_size)) return false;
    std::memcpy(found.data(), pixels.data(), size);
    image = std::move(found);
    return true;
  }
  /// Stores an image; does nothing if the folder is full or cannot be written.
  template <typename T>
  void store(int frame, const char* channel, const Image<T>& image) const {
    const size_t size = image.size() * sizeof(T);
    if (image.empty() || folder_.empty() || used_bytes_ + size > max_bytes_) return;
    const std::string_view pixels(reinterpret_cast<const char*>(image.data()), size);
    std::string bytes = header(image) + sha256(pixels) + "\n";
    bytes += pixels;
    std::error_code error;
    try {
      make_private_folder(folder_.parent_path());
      fs::create_directory(folder_, error);
      write_file(file(frame, channel), bytes);
      used_bytes_ += bytes.size();
    } catch (const Error&) {
      // A folder that cannot be written costs time and does not affect results.
    }
  }

 private:
  template <typename T>
  static std::string header(const Image<T>& image) {
    return fmt::format("sextant frame {}x{}x{} ", image.width(), image.height(), sizeof(T));
  }
  fs::path file(int frame, const char* channel) const {
    return folder_ / fmt::format("{:05}-{}.bin", frame, channel);
  }

  fs::path folder_;  ///< folder of this scenario
  uint64_t max_bytes_;
  mutable std::atomic<uint64_t> used_bytes_ = 0;
};

}  // namespace
}  // namespace synthetic

namespace {

// Incremented whenever any pixel or pose of a scenario changes.
constexpr const char* version = "synthetic scenes version 5";

class RenderedSequence final : public Sequence {
 public:
  RenderedSequence(const std::function<RenderedSource(InputLog&)>& make, const RenderCacheOptions& options) {
    RenderedSource source = make(inputs());
    info_ = std::move(source.info);
    first_scenario_frame_ = source.first_scenario_frame;
    truth_ = std::move(source.truth);
    renderer_ = std::make_unique<synthetic::Renderer>(std::move(source.scenario));
    const synthetic::Scenario& scenario = renderer_->scenario();
    cache_ = std::make_unique<synthetic::FrameCache>(synthetic::cache_folder(options.cache),
                                                     synthetic::content_key(scenario, version),
                                                     static_cast<uint64_t>(options.cache_max_mb) << 20U);
    info_.camera = scenario.camera;
    info_.rate_hz = scenario.rate_hz;
    info_.width = scenario.width;
    info_.height = scenario.height;
    info_.channels = Channels::all();
    info_.exact = info_.channels;
    info_.provenance.emplace_back(std::string("images: rendered, ") + version);
    info_.provenance.emplace_back("depth: rendered, exact");
    info_.provenance.emplace_back("flow: rendered, exact");
    info_.provenance.emplace_back("masks: rendered, exact");
  }

  const SequenceInfo& info() const override { return info_; }
  /// Computed on first use, because the visibility of objects requires the geometry of every frame.
  const SequenceTruth& truth() const override {
    std::call_once(truth_once_, [&] {
      if (!truth_) truth_ = renderer_->truth(info_.first_frame, info_.last_frame);
    });
    return *truth_;
  }
  Frame read(int frame, Channels channels) const override {
    check_frame(info_, frame, name());
    Channels missing = channels;
    missing.rgb = channels.rgb || channels.gray;
    missing.gray = false;
    const int scenario_frame = frame - first_scenario_frame_;
    Frame out;
    each_channel(missing, out, out, [&](const char* channel, bool& wanted, auto& image, auto&) {
      if (wanted && cache_->load(scenario_frame, channel, info_.width, info_.height, image)) wanted = false;
    });
    Frame rendered = renderer_->render(scenario_frame, missing);
    each_channel(missing, out, rendered, [&](const char* channel, bool wanted, auto& image, auto& made) {
      if (!wanted) return;
      cache_->store(scenario_frame, channel, made);
      image = std::move(made);
    });
    out.index = frame;
    if (channels.gray) out.gray = rgb_to_gray(out.rgb);
    if (!channels.rgb) out.rgb = {};
    return out;
  }
  std::optional<Image<Flow>> true_flow(int frame) const override {
    check_frame(info_, frame, name());
    Image<Flow> flow = read(frame, {.flow = true}).flow;
    if (flow.empty()) return std::nullopt;
    return flow;
  }
  void check_files() const override {}  // frames are rendered on demand

 private:
  /// Calls visit(name, wanted, image of a, image of b) for each channel except gray.
  template <typename Visit>
  static void each_channel(Channels& channels, Frame& a, Frame& b, const Visit& visit) {
    visit("rgb", channels.rgb, a.rgb, b.rgb);
    visit("rgb_right", channels.rgb_right, a.rgb_right, b.rgb_right);
    visit("depth", channels.depth, a.depth_m, b.depth_m);
    visit("flow", channels.flow, a.flow, b.flow);
    visit("backward_flow", channels.backward_flow, a.backward_flow, b.backward_flow);
    visit("mask", channels.mask, a.mask, b.mask);
  }
  std::string name() const { return info_.dataset + ":" + info_.sequence; }

  std::unique_ptr<synthetic::Renderer> renderer_;
  std::unique_ptr<synthetic::FrameCache> cache_;
  SequenceInfo info_;
  int first_scenario_frame_ = 0;
  mutable std::once_flag truth_once_;
  mutable std::optional<SequenceTruth> truth_;
};

}  // namespace

std::unique_ptr<Sequence> open_rendered(const std::function<RenderedSource(InputLog&)>& make,
                                        const RenderCacheOptions& options) {
  return std::make_unique<RenderedSequence>(make, options);
}

void SyntheticOptions::check() const {
  RenderCacheOptions::check();
  check_option(every >= 1, "every", every, ">= 1");
}

std::unique_ptr<Sequence> open_synthetic(const SourceSpec& source) {
  const auto options = options_of<SyntheticOptions>(source);
  if (!source.sequence.empty()) {
    fail("source '{}': a synthetic source has no '#': expected synthetic:scenario[@first-last]", source.text);
  }
  return open_rendered(
      [&](InputLog&) {
        RenderedSource rendered;
        rendered.scenario = synthetic::every_nth_frame(synthetic::make_scenario(source.path), options.every);
        rendered.info.dataset = source.adapter;
        rendered.info.sequence = rendered.scenario.name;
        std::set<int> frames;
        for (int frame = 0; frame < rendered.scenario.n_frames(); ++frame) frames.insert(frames.end(), frame);
        choose_frames(source, frames, "synthetic:" + source.path, rendered.info);
        return rendered;
      },
      options);
}

namespace {

/// Turns the chosen frames of a sequence with this `info` and `truth` into a scenario; `shape` has the image
/// size.
RenderedSource replay_of(SequenceInfo info, SequenceTruth truth, synthetic::Scenario shape) {
  shape.name = info.dataset + ":" + info.sequence;
  shape.camera = info.camera;
  shape.rate_hz = info.rate_hz;
  RenderedSource rendered{
      .scenario = synthetic::replay_scenario(truth, info.first_frame, info.last_frame, std::move(shape)),
      .first_scenario_frame = info.first_frame};
  info.provenance.emplace_back("scene: true motions from the text files, synthetic shapes and street");
  rendered.info = std::move(info);
  rendered.truth = std::move(truth);
  return rendered;
}

std::set<int> frames_of(const SequenceTruth& truth) {
  std::set<int> frames;
  for (const auto& [frame, pose] : truth.camera.poses()) frames.insert(frame);
  return frames;
}

}  // namespace

void ReplayVkitti1Options::check() const {
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "finite and > 0");
  check_option(std::isfinite(bf) && bf > 0, "bf", bf, "finite and > 0");
}

void ReplayKittiOptions::check() const {
  KittiTruthOptions::check();
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "finite and > 0");
}

std::unique_ptr<Sequence> open_replay_vkitti1(const SourceSpec& source) {
  const auto options = options_of<ReplayVkitti1Options>(source);
  const VkittiName name = parse_vkitti1_name(source.sequence);
  return open_rendered(
      [&](InputLog& inputs) {
        Vkitti1Truth text = read_vkitti1_truth(source.path, name.group, name.variation, inputs);
        SequenceInfo info{.dataset = source.adapter,
                          .sequence = name.text(),
                          .camera = synthetic::Scenario::virtual_kitti_camera()};
        info.camera.bf = options.bf;
        info.rate_hz = options.rate_hz;
        info.warnings = std::move(text.warnings);
        choose_frames(source, frames_of(text.truth), source.path + "#" + source.sequence, info);
        return replay_of(std::move(info), std::move(text.truth), /*shape=*/{});
      },
      options.render);
}

std::unique_ptr<Sequence> open_replay_kitti(const SourceSpec& source) {
  const auto options = options_of<ReplayKittiOptions>(source);
  return open_rendered(
      [&](InputLog& inputs) {
        KittiTruth text = read_kitti_truth(source.path, source.sequence, options, inputs);
        if (text.n_poses == 0) {
          fail("{}: no training/oxts/{}.txt: a replay needs the camera's motion", source.path,
               source.sequence);
        }
        SequenceInfo info{.dataset = source.adapter,
                          .sequence = source.sequence,
                          .camera = text.camera,
                          .rate_hz = options.rate_hz};
        const KittiImageSize size = kitti_image_size(source.path, source.sequence, inputs);
        info.warnings = std::move(text.warnings);
        info.provenance = std::move(text.provenance);
        // The rendered camera moves exactly as the text says, so that the errors of the text are none of this
        // truth.
        text.truth.camera_step_floor_m.reset();
        std::erase_if(info.provenance, [&](const std::string& line) {
          return std::ranges::find(text.accuracy, line) != text.accuracy.end();
        });
        choose_frames(source, frames_of(text.truth), source.path + "#" + source.sequence, info);
        synthetic::Scenario shape{.width = size.width, .height = size.height};
        return replay_of(std::move(info), std::move(text.truth), std::move(shape));
      },
      options.render);
}

}  // namespace sextant
