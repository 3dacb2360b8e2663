#include "sextant/datasets/kitti_tracking.h"

#include <cmath>

namespace sextant {
namespace {

/// Throws Error if the chosen frames reach beyond the samples of oxts; a sequence without oxts passes.
void check_poses(const KittiTruth& truth, const fs::path& oxts, const SequenceInfo& info) {
  if (truth.n_poses == 0 || info.last_frame < truth.n_poses) return;
  const bool none = info.first_frame >= truth.n_poses;
  fail("{}: it has frames 0-{}, but frames {}-{} are requested: complete it, or {}", oxts.string(),
       truth.n_poses - 1, info.first_frame, info.last_frame,
       none ? "remove it to run without true camera motion"
            : fmt::format("choose @{}-{}", info.first_frame, truth.n_poses - 1));
}

FolderFiles declare(const fs::path& training, const std::string& sequence,
                    const KittiTrackingOptions& options) {
  const auto folder = [&](const char* channel) { return training / channel / sequence; };
  const std::string depth = folder("depth_02").string(), flow = folder("flow_02").string();
  const std::string right = folder("image_03").string(), masks = folder("instances").string();
  const std::string masks_text = (training / "instances_txt" / (sequence + ".txt")).string();
  FolderFiles files{.left = if_there(folder("image_02")), .right = if_there(right)};
  if (options.depth == "sgbm" && files.right.empty()) {
    fail(
        "{}: no such folder, and depth = sgbm needs its right images: add it, or give option depth "
        "(disparity256:DIR, depth256:DIR, cm:DIR or none)",
        right);
  }
  files.depth = {.option = options.depth,
                 .kind = "depth256",
                 .files = if_there(depth),
                 .computed = "sgbm",
                 .if_none = fmt::format("{} and {} do not exist, so there is no depth", depth, right)};
  files.flow = {.option = options.flow,
                .kind = "kitti_png",
                .files = if_there(flow),
                .computed = "dis",
                .if_none = fmt::format("{} and images do not exist, so there is no flow", flow)};
  files.masks = {
      .option = options.masks,
      .kind = "mots_png",
      .files = if_there(masks),
      .if_none = fmt::format(
          "{} and {} do not exist, so there are no masks (option masks = boxes takes the label boxes)", masks,
          masks_text)};
  if (files.masks.files.empty() && fs::is_regular_file(masks_text)) {
    files.masks.kind = "mots_txt";
    files.masks.files = masks_text;
  }
  return files;
}

}  // namespace

void KittiTrackingOptions::check() const {
  KittiTruthOptions::check();
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "finite and > 0");
}

std::unique_ptr<Sequence> open_kitti_tracking(const SourceSpec& source) {
  KittiTrackingOptions options;
  read_options(source.options, options, source.adapter);
  auto sequence = std::make_unique<FolderSequence>(source);
  SequenceInfo& info = sequence->info();
  KittiTruth truth = read_kitti_truth(source.path, source.sequence, options, sequence->inputs());
  sequence->truth() = std::move(truth.truth);
  sequence->floor() = truth.floor;
  sequence->faults() = std::move(truth.faults);
  info.sequence = source.sequence;
  info.camera = truth.camera;
  info.rate_hz = options.rate_hz;
  info.warnings = std::move(truth.warnings);
  info.provenance = std::move(truth.provenance);

  const fs::path training = fs::path(source.path) / "training";
  const std::string where = fmt::format("{}: sequence {}", training.string(), source.sequence);
  FolderFiles files = declare(training, source.sequence, options);
  if (files.left.empty()) {
    info.missing.push_back(fmt::format("{} does not exist, so there are no images",
                                       (training / "image_02" / source.sequence).string()));
    const KittiImageSize size = kitti_image_size(source.path, source.sequence, sequence->inputs());
    files.width = size.width;
    files.height = size.height;
    const int n = truth.n_poses > 0 ? truth.n_poses : truth.last_labelled_frame.value_or(-1) + 1;
    for (int frame = 0; frame < n; ++frame) files.frames.insert(frame);
    if (!size.is_known) {
      info.missing.push_back(
          fmt::format("{}: the size of the images is unknown: using {}x{}", where, size.width, size.height));
    }
  }
  sequence->choose_frames(files, where);
  check_poses(truth, training / "oxts" / (source.sequence + ".txt"), info);
  sequence->open_channels(files);
  return sequence;
}

}  // namespace sextant
