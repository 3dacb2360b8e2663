#include "sextant/datasets/channels/computed_channels.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "sextant/datasets/channels/opencv_view.h"
#include "sextant/datasets/codec/png.h"

namespace sextant {
namespace {

using internal::one_opencv_thread;
using internal::view;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr int steps_per_px = 16;  // OpenCV stores disparities in units of 1/16 px

class DisSource final : public FlowSource {
 public:
  explicit DisSource(const ChannelInputs& inputs) : inputs_(inputs) { one_opencv_thread(); }

  Image<Flow> read(int frame) const override {
    if (frame >= inputs_.last_frame) return {};
    return dis_flow(rgb_to_gray(inputs_.left(frame)), rgb_to_gray(inputs_.left(frame + 1)));
  }
  std::string provenance() const override { return "flow: dis"; }

 private:
  ChannelInputs inputs_;
};

class SgbmSource final : public DepthSource {
 public:
  explicit SgbmSource(const ChannelInputs& inputs) : inputs_(inputs) { one_opencv_thread(); }

  Image<float> read(int frame) const override {
    const Image<float> disparity =
        sgbm_disparity(rgb_to_gray(inputs_.left(frame)), rgb_to_gray(inputs_.right(frame)));
    return depth_from_disparity(disparity, inputs_.camera.bf);
  }
  std::string kind() const override { return "sgbm"; }
  std::string provenance() const override {
    return fmt::format("depth: sgbm, bf = {:.7g}", inputs_.camera.bf);
  }

 private:
  ChannelInputs inputs_;
};

/// Draws the ids of boxes, far to near, so that the nearer one is in front. A box covers the pixels whose
/// centres it contains.
Image<uint16_t> rasterise_boxes(std::vector<LabelBox> boxes, int width, int height) {
  const auto farther = [](const LabelBox& a, const LabelBox& b) {
    return a.depth_m != b.depth_m ? a.depth_m > b.depth_m : a.id > b.id;
  };
  std::ranges::sort(boxes, farther);
  Image<uint16_t> mask(width, height);
  for (const auto& [id, box, depth_m] : boxes) {
    for (const double value : {box.left, box.top, box.right, box.bottom, depth_m})
      if (!std::isfinite(value))
        fail("masks: the box of object {} is not finite: expected finite edges (px) and a finite depth (m)",
             id);
    if (id < 1 || id > 65535) fail("masks: a box has id {}: expected 1 to 65535", id);
    const int x0 = static_cast<int>(std::clamp(std::ceil(box.left), 0.0, width * 1.0));
    const int x1 = static_cast<int>(std::clamp(std::floor(box.right), -1.0, width - 1.0));
    const int y0 = static_cast<int>(std::clamp(std::ceil(box.top), 0.0, height * 1.0));
    const int y1 = static_cast<int>(std::clamp(std::floor(box.bottom), -1.0, height - 1.0));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) mask(x, y) = static_cast<uint16_t>(id);
    }
  }
  return mask;
}

class BoxSource final : public MaskSource {
 public:
  BoxSource(const ChannelInputs& inputs, std::map<int, std::vector<LabelBox>> boxes)
      : width_(inputs.width), height_(inputs.height), boxes_(std::move(boxes)) {}

  Image<uint16_t> read(int frame) const override {
    const auto it = boxes_.find(frame);
    if (it == boxes_.end()) return Image<uint16_t>(width_, height_);
    return rasterise_boxes(it->second, width_, height_);
  }
  std::string provenance() const override { return "masks: boxes"; }

 private:
  int width_;
  int height_;
  std::map<int, std::vector<LabelBox>> boxes_;
};

// Adds `border` columns on the left. Both images of a pair get one column for each disparity, because OpenCV
// does not match as many columns at the left border.
cv::Mat with_border(const Image<uint8_t>& image, int border) {
  cv::Mat wide;
  cv::copyMakeBorder(view(image), wide, 0, 0, border, 0, cv::BORDER_REPLICATE);
  return wide;
}

}  // namespace

Image<Flow> dis_flow(const Image<uint8_t>& prev, const Image<uint8_t>& curr) {
  if (prev.width() != curr.width() || prev.height() != curr.height()) {
    fail("flow: the images have {}x{} and {}x{} pixels: expected two of one size", prev.width(),
         prev.height(), curr.width(), curr.height());
  }
  if (prev.width() < 16 || prev.height() < 16) {
    fail("flow: DIS needs images of at least 16x16 pixels, got {}x{}", prev.width(), prev.height());
  }
  one_opencv_thread();
  cv::Mat out;  // empty: DIS would use a matrix of the right size as initial flow
  cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM)->calc(view(prev), view(curr), out);
  Image<Flow> flow(prev.width(), prev.height());
  out.copyTo(cv::Mat(flow.height(), flow.width(), CV_32FC2, flow.data()));
  return flow;
}

// The parameters lie within the ranges that OpenCV's documentation of StereoSGBM recommends. Luminance is
// matched, and costs are aggregated along three paths: on the pairs 000002 and 000007 of KITTI scene flow
// 2015 this gives fewer outliers and more pixels in less time than colour, or than five or eight paths.
Image<float> sgbm_disparity(const Image<uint8_t>& left, const Image<uint8_t>& right) {
  if (left.width() != right.width() || left.height() != right.height()) {
    fail("depth: the left image has {}x{} pixels and the right one {}x{}: a rectified pair has one size",
         left.width(), left.height(), right.width(), right.height());
  }
  one_opencv_thread();
  constexpr int block_size_px = 5, area = block_size_px * block_size_px;
  const int n = (left.width() / 8 + 15) / 16 * 16;  // disparities
  const auto matcher = cv::StereoSGBM::create(
      /*minDisparity=*/0, n, block_size_px, /*P1=*/8 * area, /*P2=*/32 * area, /*disp12MaxDiff=*/1,
      /*preFilterCap=*/63, /*uniquenessRatio=*/10, /*speckleWindowSize=*/100, /*speckleRange=*/2,
      cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat steps;
  matcher->compute(with_border(left, n), with_border(right, n), steps);
  Image<float> disparity(left.width(), left.height(), nan);
  for (int y = 0; y < disparity.height(); ++y) {
    const int16_t* row = steps.ptr<int16_t>(y) + n;
    for (int x = 0; x < disparity.width(); ++x) {
      const bool matched = row[x] >= 0 && row[x] <= steps_per_px * x;
      if (matched) disparity(x, y) = static_cast<float>(row[x]) / steps_per_px;
    }
  }
  return disparity;
}

Image<float> depth_from_disparity(const Image<float>& disparity_px, double bf) {
  Image<float> depth(disparity_px.width(), disparity_px.height(), nan);
  for (size_t i = 0; i < depth.size(); ++i) {
    const float d = disparity_px.data()[i];
    if (d > 0) depth.data()[i] = static_cast<float>(bf / static_cast<double>(d));
  }
  return depth;
}

std::unique_ptr<FlowSource> make_dis_source(const ChannelInputs& inputs) {
  if (!inputs.left) fail("flow: dis needs images, and this source has none: give the flow in files");
  return std::make_unique<DisSource>(inputs);
}

std::unique_ptr<DepthSource> make_sgbm_source(const ChannelInputs& inputs) {
  if (!inputs.left) fail("depth: sgbm needs images, and this source has none: give the depth in files");
  if (!inputs.right)
    fail("depth: sgbm needs the right images, and this source has none: give the depth in files");
  return std::make_unique<SgbmSource>(inputs);
}

std::unique_ptr<MaskSource> make_box_source(const ChannelInputs& inputs,
                                            std::map<int, std::vector<LabelBox>> boxes) {
  if (boxes.empty())
    fail("masks: boxes needs label boxes, and this source has none: give the masks in files");
  return std::make_unique<BoxSource>(inputs, std::move(boxes));
}

}  // namespace sextant
