#include "sextant/eval/check/check_source.h"

#include "sextant/base/machine.h"

namespace sextant {
namespace {

std::string share_text(int n, double coverage, int n_frames) {
  return fmt::format("over {} pixels of {} {}, {:.1f} % of those with truth", n, n_frames,
                     n_frames == 1 ? "frame" : "frames", 100 * coverage);
}

// Collects measure(frame) over all frames, in order of frames.
template <typename T, typename Measure>
std::vector<T> collect(const SequenceInfo& info, int jobs, const Measure& measure) {
  const int n = info.last_frame - info.first_frame + 1;
  std::vector<std::optional<T>> frames(static_cast<size_t>(n));
  parallel_for(n, jobs, [&](int i) { frames[static_cast<size_t>(i)] = measure(info.first_frame + i); });
  std::vector<T> found;
  for (const auto& frame : frames) {
    if (frame) found.push_back(*frame);
  }
  return found;
}

}  // namespace

std::string DenseTruthErrors::flow_text() const {
  if (!flow) return "";
  return fmt::format("EPE {:.3g} px ({:.3g} along x, {:.3g} along y), outliers {:.2f} %, {}", flow->epe_px,
                     flow->x_px, flow->y_px, 100 * flow->outlier_share,
                     share_text(flow->n, flow->coverage, n_flow_frames));
}

std::string DenseTruthErrors::disparity_text() const {
  if (!disparity) return "";
  return fmt::format(
      "mean disparity error {:.3g} px, outliers {:.2f} %, mean signed error of the inliers {:+.2f} px, {}",
      disparity->mean_px, 100 * disparity->outlier_share, disparity->shift_px,
      share_text(disparity->n, disparity->coverage, n_depth_frames));
}

DenseTruthErrors dense_truth_errors(const Sequence& sequence, int jobs) {
  const SequenceInfo& info = sequence.info();
  DenseTruthErrors errors;
  if (info.channels.flow && !info.exact.flow) {
    const auto flows = collect<DenseFlowError>(info, jobs, [&](int frame) {
      const auto truth = sequence.true_flow(frame);
      const Image<Flow> flow = truth ? sequence.read(frame, {.flow = true}).flow : Image<Flow>();
      return flow.empty() ? std::nullopt : std::optional(dense_flow_error(flow, *truth));
    });
    errors.n_flow_frames = static_cast<int>(flows.size());
    if (!flows.empty()) errors.flow = pooled(flows);
  }
  if (info.channels.depth && !info.exact.depth) {
    const auto depths = collect<DenseDisparityError>(info, jobs, [&](int frame) {
      const auto truth = sequence.true_depth(frame);
      const Image<float> depth = truth ? sequence.read(frame, {.depth = true}).depth_m : Image<float>();
      return depth.empty() ? std::nullopt
                           : std::optional(dense_disparity_error(depth, *truth, info.camera.bf));
    });
    errors.n_depth_frames = static_cast<int>(depths.size());
    if (!depths.empty()) errors.disparity = pooled(depths);
  }
  return errors;
}

}  // namespace sextant
