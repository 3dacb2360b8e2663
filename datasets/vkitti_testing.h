#pragma once

// Test helper: a sequence with every channel of the Virtual KITTI layouts, computed from formulas (without a
// scene), to be written and read back.

#include <cmath>
#include <string>

#include "sextant/base/files.h"
#include "sextant/datasets/layout.h"
#include "sextant/datasets/testing.h"

namespace sextant {

struct FormulaOptions {
  int first_frame = 3;
  int last_frame = 6;
  int id = 3;  ///< id of its only object
  bool truth = true;
  bool size = true;  ///< the truth has box sizes
};

class FormulaSequence final : public MemorySequence {
 public:
  explicit FormulaSequence(const FormulaOptions& options = {}) : options_(options) {
    info_.dataset = "formula";
    info_.sequence = "f18";
    info_.camera = {{725, 725, 620.5, 187}, 725 * 0.532725};
    info_.rate_hz = 10;
    info_.width = 1242;
    info_.height = 375;
    info_.first_frame = options.first_frame;
    info_.last_frame = options.last_frame;
    info_.channels = Channels::all();
    if (options.truth) make_truth();
  }

  Frame read(int frame, Channels channels) const override {
    Frame out;
    out.index = frame;
    if (channels.rgb) out.rgb = picture(frame);
    if (channels.rgb_right) out.rgb_right = picture(frame + 50);
    if (channels.depth) out.depth_m = depth(frame);
    if (channels.flow && frame != info_.last_frame) out.flow = flow(1 + 0.1 * frame);
    if (channels.backward_flow && frame != info_.first_frame) out.backward_flow = flow(-1 - 0.1 * frame);
    if (channels.mask)
      out.mask = image_of(info_.width, info_.height, [&](int x, int y) {
        const bool inside = y >= 100 && y < 150 && x >= 200 + frame && x < 300;
        return static_cast<uint16_t>(inside ? options_.id : 0);
      });
    return out;
  }

 private:
  static uint8_t byte(int value) { return static_cast<uint8_t>(value); }

  // Smooth, so that JPEG preserves it to a few levels.
  Image<Rgb> picture(int k) const {
    return image_of(info_.width, info_.height, [k](int x, int y) {
      return Rgb{byte(x / 8 + k), byte(y / 2), byte(2 * k)};
    });
  }
  Image<float> depth(int frame) const {  // up to 660 m
    return image_of(info_.width, info_.height, [=](int x, int y) {
      return y < 40 ? NAN : static_cast<float>(2 + 0.0137 * x + 1.7 * y + frame);
    });
  }
  Image<Flow> flow(double scale) const {
    return image_of(info_.width, info_.height, [=](int x, int y) {
      const Flow flow{static_cast<float>(scale * 0.1 * (x - 600)),
                      static_cast<float>(scale * 0.2 * (y - 180))};
      return y < 40 ? Flow() : flow;
    });
  }

  void make_truth() {
    for (int k = info_.first_frame; k <= info_.last_frame; ++k) {
      truth_.camera.set(
          k, SE3::exp((Vector6d() << 100 + 0.2 * k, -107, 0.7 * k, 0.01, 2 - 0.05 * k, 0.03).finished()));
      ObjectTruth object;
      object.id = options_.id;
      object.T_camera_object =
          SE3::exp((Vector6d() << -3 + 0.1 * k, 1.5, 12.0 + k, 0.02, 0.4 * k, -0.03).finished());
      if (options_.size) object.size_m = Eigen::Vector3d(1.7, 1.5, 4.25);
      object.type = "Van";
      object.moving = k % 2 == 0;
      truth_.objects[k].push_back(object);
    }
  }

  FormulaOptions options_;
};

/// Errors caused by writing and reading a layout.
struct RoundTripErrors {
  double depth_m = 0;
  double flow_steps = 0;  ///< in quantisation steps of the format, 2 (w-1) / 65535 and 2 (h-1) / 65535 px
  int n_depth = 0, n_flow = 0;
};

inline void compare_depth(const Image<float>& expected, const Image<float>& got, RoundTripErrors& errors) {
  ASSERT_EQ(expected.width(), got.width());
  ASSERT_EQ(expected.height(), got.height());
  for (size_t i = 0; i < expected.size(); ++i) {
    const float z = expected.data()[i];
    const bool representable = std::isfinite(z) && z < 655.34f;
    ASSERT_EQ(std::isfinite(got.data()[i]), representable) << z;
    if (!representable) continue;
    errors.depth_m = std::max(errors.depth_m, static_cast<double>(std::abs(got.data()[i] - z)));
    ++errors.n_depth;
  }
}

inline void compare_flow(const Image<Flow>& expected, const Image<Flow>& got, RoundTripErrors& errors) {
  ASSERT_EQ(expected.width(), got.width());
  ASSERT_EQ(expected.height(), got.height());
  const double w = expected.width() - 1;
  const double h = expected.height() - 1;
  for (const auto [x, y] : pixels(expected)) {
    const Flow f = expected(x, y);
    const float u = static_cast<float>(x) + f.u;
    const float v = static_cast<float>(y) + f.v;
    const bool representable = f.valid() && u >= 0 && v >= 0 && u <= w && v <= h;
    ASSERT_EQ(got(x, y).valid(), representable) << x << ", " << y;
    if (!representable) continue;
    errors.flow_steps = std::max({errors.flow_steps, std::abs(got(x, y).u - f.u) / (2 * w / 65535),
                                  std::abs(got(x, y).v - f.v) / (2 * h / 65535)});
    ++errors.n_flow;
  }
}

/// Fixture with its own copy of the files that LAYOUT writes for frames 3-6 of the formulas.
class VkittiFiles : public FolderTest {
 protected:
  VkittiFiles(const char* layout, const char* sequence) {
    static std::map<std::string, std::unique_ptr<TempFolder>> masters;  // written once per program
    std::unique_ptr<TempFolder>& master = masters[layout];
    if (!master) {
      master = std::make_unique<TempFolder>();
      LayoutRequest request{.out = master->path(), .sequence = sequence, .quiet = true};
      find_layout(layout).write(FormulaSequence(), request);
    }
    std::filesystem::copy(master->path(), root_, std::filesystem::copy_options::recursive);
    source_ = fmt::format("{}:{}#{}", layout, root_.string(), sequence);
  }

  std::string source_;
};

}  // namespace sextant
