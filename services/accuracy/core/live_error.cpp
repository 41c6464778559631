#include "accuracy/core/live_error.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::accuracy {
namespace {

constexpr double kLongestStepS =
    0.2;  // after a longer pause the change of velocity says nothing of acceleration

double Part(const std::array<double, kSourceCount>& values, Source source) {
  return values[static_cast<std::size_t>(source)];
}

}  // namespace

LiveError LiveEstimator::Update(const ErrorChain& chain, const DriveMotion& drive, bool compensated) {
  LiveError live;
  const auto tool = kinematics::SolveForwardMotion(
      chain.mechanism, {drive.position_mm, drive.velocity_mm_per_s, Eigen::Vector2d::Zero()});
  if (!tool.differentiable) {
    return live;
  }
  JetMotion jet;
  jet.p_W_mm =
      chain.R_WE * (chain.X_DJ.translation_mm() - tool.motion.position_mm - chain.X_EW.translation_mm());
  jet.v_W_mm_per_s = -chain.R_WE * tool.motion.velocity_mm_per_s;
  const double step_s = 1e-9 * static_cast<double>(drive.time_ns - time_ns_);
  if (step_s > 0.0 && step_s < kLongestStepS) {
    jet.a_W_mm_per_s2 = (jet.v_W_mm_per_s - v_W_mm_per_s_) / step_s;
  }
  time_ns_ = drive.time_ns;
  v_W_mm_per_s_ = jet.v_W_mm_per_s;
  const ContourError error = ContourErrorAt(chain, jet, compensated);
  const PlaceSensitivity place = SensitivityAt(chain, jet.p_W_mm);
  if (!error.valid || !place.valid) {
    return live;
  }
  live.valid = true;
  live.p_WJ_mm = jet.p_W_mm;
  live.bound_95_mm = error.bound_95_mm;
  live.base_mm = std::sqrt(std::max(0.0, Part(error.variance_by_source_mm2, Source::kBase) +
                                             Part(error.variance_by_source_mm2, Source::kSheet) +
                                             Part(error.variance_by_source_mm2, Source::kJetOffset) +
                                             Part(error.variance_by_source_mm2, Source::kMechanism)));
  live.elastic_mm = Part(error.bias_by_source_mm, Source::kElastic);
  const double lag_mm = Part(error.bias_by_source_mm, Source::kJetLag);
  live.process_mm = std::sqrt(lag_mm * lag_mm + Part(error.variance_by_source_mm2, Source::kJetWander));
  live.following_error_mm = (place.J_p_q * drive.following_error_mm).norm();
  return live;
}

}  // namespace lambdajet::accuracy
