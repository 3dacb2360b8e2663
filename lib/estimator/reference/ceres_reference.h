#pragma once

// The literal costs of motion_only and joint_flow in Ceres, every refined flow an explicit 2-D parameter
// block (Schur elimination), automatic derivatives: what the production estimators are tested against. Slow.

#include "sextant/base/with_options.h"
#include "sextant/estimator/estimators/joint_flow.h"

namespace sextant {

class MotionOnlyCeres : public WithOptions<Estimator, MotionOnlyOptions> {
 public:
  explicit MotionOnlyCeres(const MotionOnlyOptions& options) : WithOptions(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
};

class JointFlowCeres : public WithOptions<Estimator, JointFlowOptions> {
 public:
  explicit JointFlowCeres(const JointFlowOptions& options) : WithOptions(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
};

}  // namespace sextant
