#include "sextant/base/error.h"
#include "sextant/base/names.h"

#include "sextant/estimator/estimators/joint_flow.h"
#include "sextant/estimator/flow_depth/joint_flow_depth.h"
#include "sextant/estimator/reference/ceres_reference.h"
#include "sextant/estimator/registry.h"

namespace sextant {
namespace {

template <typename E, typename Options>
EstimatorEntry entry(const char* name, const char* description) {
  return {name, description,
          [](const Json& json) -> std::unique_ptr<Estimator> {
            Options options;
            read_options(json, options, "estimator");
            return std::make_unique<E>(options);
          },
          [] { return describe_options(Options{}, "estimator"); }};
}

/// A reference in Ceres, which treats errors as independent and ends by Ceres' own criteria.
template <typename E, typename Options>
EstimatorEntry reference(const char* name, const char* description) {
  const auto defaults = [] {
    Options options;
    options.covariance = CovarianceOf::independent;
    return options;
  };
  return {name, description,
          [=](const Json& json) -> std::unique_ptr<Estimator> {
            Options options = defaults();
            read_options(json, options, "estimator");
            if (options.covariance != CovarianceOf::independent)
              fail(
                  "option estimator.covariance = correlated: {} treats errors as independent: expected "
                  "independent",
                  name);
            if (options.solver.step_tolerance != Options{}.solver.step_tolerance)
              fail("option estimator.solver.step_tolerance = {:g}: {} ends by Ceres' own criteria: omit it",
                   options.solver.step_tolerance, name);
            return std::make_unique<E>(options);
          },
          [=] { return describe_options(defaults(), "estimator"); }};
}

}  // namespace

std::span<const EstimatorEntry> estimators() {
  static const std::vector<EstimatorEntry> table = {
      entry<JointFlow, JointFlowOptions>("joint_flow",
                                         "motion and refined flow, paper eq. (11), closed form"),
      entry<JointFlowDepth, JointFlowDepthOptions>(
          "joint_flow_depth", "motion, refined flow and depth, robust, noise levels from the data"),
      entry<MotionOnly, MotionOnlyOptions>("motion_only", "motion from given flow, paper eq. (4) and (10)"),
      reference<JointFlowDepthCeres, JointFlowDepthOptions>(
          "joint_flow_depth_ceres", "reference of joint_flow_depth in Ceres, for independent errors (slow)"),
      reference<JointFlowCeres, JointFlowOptions>("joint_flow_ceres",
                                                  "reference of joint_flow in Ceres (slow)"),
      reference<MotionOnlyCeres, MotionOnlyOptions>("motion_only_ceres",
                                                    "reference of motion_only in Ceres (slow)"),
  };
  return table;
}

std::unique_ptr<Estimator> make_estimator(const std::string& name, const Json& options) {
  return find_entry(estimators(), name, "estimator").make(options);
}

}  // namespace sextant
