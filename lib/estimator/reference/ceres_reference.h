#pragma once

// The literal costs of motion_only and joint_flow in Ceres, every refined flow an explicit 2-D parameter
// block (Schur elimination), automatic derivatives: what the production estimators are tested against. Slow.

#include "sextant/estimator/estimators/joint_flow.h"

namespace sextant {

class MotionOnlyCeres : public Estimator {
 public:
  explicit MotionOnlyCeres(const MotionOnlyOptions& options) : options_(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
  Json options() const override { return write_options(options_); }

 private:
  MotionOnlyOptions options_;
};

class JointFlowCeres : public Estimator {
 public:
  explicit JointFlowCeres(const JointFlowOptions& options) : options_(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
  Json options() const override { return write_options(options_); }

 private:
  JointFlowOptions options_;
};

}  // namespace sextant
