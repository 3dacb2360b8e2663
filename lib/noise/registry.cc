#include "sextant/base/names.h"

#include "sextant/noise/models.h"
#include "sextant/noise/noise_model.h"

namespace sextant {
namespace {

template <typename Model, typename Options>
NoiseModelEntry entry(const char* name, const char* description) {
  const std::string where = std::string("noise.") + name;
  return {name, description,
          [where](const Json& json) -> std::unique_ptr<NoiseModel> {
            Options options;
            read_options(json, options, where);
            return std::make_unique<Model>(options);
          },
          [where] { return describe_options(Options{}, where); }};
}

}  // namespace

std::span<const NoiseModelEntry> noise_models() {
  static const std::vector<NoiseModelEntry> table = {
      entry<DepthNoise, DepthNoiseOptions>("depth", "stereo depth, sigma = z^2/(f b) delta_d"),
      entry<Quantisation, QuantisationOptions>("quantisation", "disparity of finite resolution"),
      entry<FlowNoise, FlowNoiseOptions>("flow", "Gaussian flow noise, specified by end-point error"),
      entry<FlowOutliers, FlowOutlierOptions>("outliers", "a share of wrong flows"),
      entry<MaskNoise, MaskNoiseOptions>("mask", "masks too small or too large"),
  };
  return table;
}

}  // namespace sextant
