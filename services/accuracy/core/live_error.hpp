// Estimates the contour error of this moment from what the drive module says it is doing.
//
// Model: readings and their rates through the forward kinematics give the jet's place and velocity on the sheet; its
// acceleration is the change of velocity since the update before. The error is ContourErrorAt there; the following error is
// carried to the tool by the Jacobian. Frames: W. Units: mm, s; stamps ns. Threads: its owner's. Cost: 2 us, no allocation.
#pragma once

#include <cstdint>
#include <optional>

#include "accuracy/core/error_chain.hpp"

namespace lambdajet::accuracy {

struct DriveMotion {
  std::int64_t time_ns = 0;
  Eigen::Vector2d position_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity_mm_per_s = Eigen::Vector2d::Zero();
  Eigen::Vector2d following_error_mm = Eigen::Vector2d::Zero();
};

struct LiveError {
  bool valid = false;
  Eigen::Vector2d p_WJ_mm = Eigen::Vector2d::Zero();
  double bound_95_mm = 0.0;
  double base_mm = 0.0;             // one sigma of base, sheet, mechanism and jet offset together
  double elastic_mm = 0.0;          // signed bias, quasi-static
  double process_mm = 0.0;          // jet lag's bias and jet wander's sigma, root of squares
  double following_error_mm = 0.0;  // at the tool
};

class LiveEstimator {
 public:
  LiveError Update(const ErrorChain& chain, const DriveMotion& drive, bool compensated);

 private:
  std::int64_t time_ns_ = 0;
  Eigen::Vector2d v_W_mm_per_s_ = Eigen::Vector2d::Zero();
};

}  // namespace lambdajet::accuracy
