// Propagates what is not known of a machine to where the jet meets the sheet: sensitivities, and the contour error of one
// point of a motion.
//
// Model: the sheet's point under the jet is p_WJ = R_EW^T (p_DJ - p_DE(q) - p_EW) (frames.md); first order in every
// parameter with the slider readings held. Along the contour's normal n, with acceleration a_n on the side of n:
//     elastic      bias -(m/k) a_n, gone if compensated; sensitivity to m/k: -a_n either way (seed paper 000, delta = m a/k)
//     jet lag      bias +T^2 a_n/2, to the inside (core/jet_lag.hpp)
//     following    slider i lags by f_i q_i'/feed, f_i of sigma following_mm, and as any servo of finite bandwidth by
//                  |g_i| q_i''/path acceleration, g_i likewise
//     backlash     +-width/2 of slider i by the sign of q_i'
//     straightness of rail i acts like its offset
//     jet offset   the axis leaves the head's by the jet stack's tilts (core/jet_stack.hpp) until version 1 has found it
//     jet wander   as it is
// The quasi-static elastic bias stands for the peak of a jerk-limited motion; core/prediction.hpp plays the spring instead.
// Frames: everything in W but the sliders. Units: mm, s, rad; variances mm^2.
// Shapes: a sensitivity row is ordered as foundation's Parameter.
// Threads: an ErrorChain is immutable once built. Cost: ContourErrorAt below 1 us, no allocation.
// Errors: `valid` false where the mechanism cannot stand or cannot be differentiated.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string_view>

#include "foundation/machine/machine_description.hpp"
#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::accuracy {

// Where contour error comes from; the order is the wire's names' only.
enum class Source : std::uint8_t {
  kBase,
  kSheet,
  kMechanism,
  kJetOffset,
  kElastic,
  kFollowing,
  kStraightness,
  kBacklash,
  kJetWander,
  kJetLag,
  kCount
};
inline constexpr std::size_t kSourceCount = static_cast<std::size_t>(Source::kCount);

// UPPER_SNAKE.
std::string_view SourceName(Source source);
// The source that a parameter belongs to. The camera's place moves no cut; it counts to the base that was
// found with it.
Source SourceOf(Parameter parameter);

using SensitivityMatrix = Eigen::Matrix<double, 2, static_cast<int>(kParameterCount)>;
using SensitivityRow = Eigen::Matrix<double, 1, static_cast<int>(kParameterCount)>;

// How the jet's place on the sheet answers to small changes, the readings held.
struct PlaceSensitivity {
  bool valid = false;
  kinematics::Reason reason = kinematics::Reason::kNotFinite;
  SensitivityMatrix J_p_parameters = SensitivityMatrix::Zero();
  Eigen::Matrix2d J_p_q = Eigen::Matrix2d::Zero();     // slider standing elsewhere than it reads
  Eigen::Matrix2d J_p_rail = Eigen::Matrix2d::Zero();  // slider off its rail's straight line
  Eigen::Matrix2d J_q_p = Eigen::Matrix2d::Zero();     // slider rates of a jet moving on the sheet
};

// The jet's motion on the sheet at one instant.
struct JetMotion {
  Eigen::Vector2d p_W_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d v_W_mm_per_s = Eigen::Vector2d::Zero();
  Eigen::Vector2d a_W_mm_per_s2 = Eigen::Vector2d::Zero();
};

struct ContourError {
  bool valid = false;
  double bias_mm = 0.0;  // signed, along the normal to the left of the motion
  double sigma_mm = 0.0;
  double bound_95_mm = 0.0;  // |error| stays below with 95 %
  std::array<double, kSourceCount> bias_by_source_mm{};
  std::array<double, kSourceCount>
      variance_by_source_mm2{};  // shares by covariance: they sum to sigma^2, one may be negative
};

// A machine made ready for propagation.
struct ErrorChain {
  explicit ErrorChain(const MachineDescription& machine);

  kinematics::LambdaMechanism mechanism;
  ParameterVector parameters;
  ParameterCovariance covariance;
  Uncertainties uncertainties;
  PlanarPose X_DJ;
  PlanarPose X_EW;
  Eigen::Matrix2d R_WE;  // E is parallel to D
  double reference_feed_mm_per_s;
  double reference_acceleration_mm_per_s2;
  double jet_lag_time_s;
  double elastic_lag_s2;
  double damping_time_s;
  std::array<double, 3>
      jet_offset_mm{};  // nozzle, tube and stack, each of unknown azimuth; 0 once identified

  // Where the effector must stand for the jet to be over p_W.
  Eigen::Vector2d EffectorAt(const Eigen::Vector2d& p_W_mm) const {
    return X_DJ.translation_mm() - X_EW * p_W_mm;
  }
};

PlaceSensitivity SensitivityAt(const ErrorChain& chain, const Eigen::Vector2d& p_W_mm);

// Variances by source of the deviation along n, for a given row of parameter sensitivities.
std::array<double, kSourceCount> VarianceBySource(const ErrorChain& chain, const PlaceSensitivity& place,
                                                  const SensitivityRow& row, const Eigen::Vector2d& n_W,
                                                  const JetMotion& motion, double lag_bias_mm);

// What servos of finite bandwidth cut outside on arcs, expected: they answer q'' late.
double ServoBias(const ErrorChain& chain, const PlaceSensitivity& place, const Eigen::Vector2d& n_W,
                 const Eigen::Vector2d& a_W_mm_per_s2);

// Of one point; `normal` to the left of the velocity, or along x at standstill.
ContourError ContourErrorAt(const ErrorChain& chain, const JetMotion& motion, bool compensated);

// The x with P(|N(bias, sigma)| <= x) = probability.
double FoldedNormalQuantile(double bias, double sigma, double probability);

}  // namespace lambdajet::accuracy
