#include "sextant/eval/benchmark/points_without_estimate.h"

#include <optional>
#include <utility>
#include <vector>

namespace sextant {
namespace {

BodyResult body_without_estimate(const FramePair& pair, int instance, Correspondences points) {
  BodyResult body{.instance = instance, .status = Status::diverged, .points = std::move(points)};
  const auto declared = pair.noise.find(instance);
  if (declared != pair.noise.end()) body.noise = declared->second;
  return body;
}

class PointsOfPairs final : public PairEstimator {
 public:
  explicit PointsOfPairs(double max_depth_m) : max_depth_m_(max_depth_m) {}
  FrameResult process(const FramePair& pair) override {
    FrameResult result{.prev = pair.prev, .curr = pair.curr, .dt_s = pair.dt_s};
    result.ego = body_without_estimate(pair, 0, pair.background);
    for (const ObjectObservation& object : pair.objects)
      result.objects.push_back(body_without_estimate(
          pair, object.instance, points_of_instance(object, object.instance, max_depth_m_)));
    return result;
  }

 private:
  double max_depth_m_;
};

class PointsWithoutEstimate final : public CaseEstimator {
 public:
  std::vector<NamedEstimator> begin(const CaseContext& context) const override {
    std::vector<NamedEstimator> alone;
    alone.push_back({"", std::make_unique<PointsOfPairs>(context.pipeline.max_object_distance_m)});
    return alone;
  }
  Json options() const override { return Json::object(); }
  std::string label() const override { return "points"; }
  bool is_third_party() const override { return false; }
};

}  // namespace

std::shared_ptr<const CaseEstimator> points_without_estimate() {
  return std::make_shared<const PointsWithoutEstimate>();
}

}  // namespace sextant
