#include "accuracy/core/error_chain.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "accuracy/core/jet_stack.hpp"

namespace lambdajet::accuracy {
namespace {

constexpr std::array<std::string_view, kSourceCount> kSourceNames = {
    "BASE",      "SHEET",        "MECHANISM", "JET_OFFSET", "ELASTIC",
    "FOLLOWING", "STRAIGHTNESS", "BACKLASH",  "JET_WANDER", "JET_LAG"};

constexpr Eigen::Index Index(Parameter p) { return static_cast<Eigen::Index>(p); }

double NormalCumulative(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }
double NormalDensity(double x) { return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi); }

double Square(double x) { return x * x; }

constexpr double kMeanOfHalfNormal = 0.7978845608028654;  // root of 2/pi

double& At(std::array<double, kSourceCount>& values, Source source) {
  return values[static_cast<std::size_t>(source)];
}

}  // namespace

std::string_view SourceName(Source source) {
  return source < Source::kCount ? kSourceNames[static_cast<std::size_t>(source)]
                                 : std::string_view("UNKNOWN");
}

Source SourceOf(Parameter parameter) {
  if (parameter <= Parameter::kSlider2ZeroMm) {
    return Source::kMechanism;
  }
  if (parameter >= Parameter::kElasticLagS2) {
    return Source::kElastic;
  }
  const bool sheet = parameter >= Parameter::kSheetXMm && parameter <= Parameter::kSheetThetaRad;
  return sheet ? Source::kSheet : Source::kBase;
}

ErrorChain::ErrorChain(const MachineDescription& machine)
    : mechanism(kinematics::LambdaMechanism::FromDescription(machine)),
      parameters(machine.parameters),
      covariance(machine.covariance),
      uncertainties(machine.uncertainties),
      X_DJ(machine.X_DJ()),
      X_EW(machine.X_EW()),
      R_WE(X_EW.rotation().transpose()),
      reference_feed_mm_per_s(machine.path.feed_mm_per_s),
      reference_acceleration_mm_per_s2(machine.path.acceleration_mm_per_s2),
      jet_lag_time_s(machine.process.jet_lag_time_s),
      elastic_lag_s2(machine.value(Parameter::kElasticLagS2)),
      damping_time_s(machine.value(Parameter::kDampingTimeS)) {
  if (machine.version == 0) {
    const JetStack stack = TypicalJetStack();
    jet_offset_mm = {stack.nozzle_tilt_rad * stack.nozzle_to_exit_mm,
                     stack.tube_tilt_rad * stack.tube_length_mm, stack.radial_offset_mm};
  }
}

PlaceSensitivity SensitivityAt(const ErrorChain& chain, const Eigen::Vector2d& p_W_mm) {
  PlaceSensitivity place;
  const auto J = kinematics::ComputeJacobians(chain.mechanism, chain.EffectorAt(p_W_mm));
  place.reason = J.reason;
  if (!J.differentiable || !J.invertible) {
    return place;
  }
  place.valid = true;
  SensitivityMatrix& G = place.J_p_parameters;
  G.leftCols<kinematics::kMechanismParameterCount>() = -chain.R_WE * J.J_x_parameters;
  G.middleCols<2>(Index(Parameter::kBaseXMm)) = chain.R_WE;
  G.middleCols<2>(Index(Parameter::kSheetXMm)) = -chain.R_WE;
  G.col(Index(Parameter::kSheetThetaRad)) = Eigen::Vector2d(p_W_mm.y(), -p_W_mm.x());
  place.J_p_q = -chain.R_WE * J.J_x_q;
  place.J_p_rail.col(0) = G.col(Index(Parameter::kRail1OffsetMm));
  place.J_p_rail.col(1) = G.col(Index(Parameter::kRail2OffsetMm));
  place.J_q_p = -J.J_q_x * chain.R_WE.transpose();
  return place;
}

double ServoBias(const ErrorChain& chain, const PlaceSensitivity& place, const Eigen::Vector2d& n_W,
                 const Eigen::Vector2d& a_W_mm_per_s2) {
  const Eigen::Vector2d surge = place.J_q_p * a_W_mm_per_s2 / chain.reference_acceleration_mm_per_s2;
  return -kMeanOfHalfNormal * chain.uncertainties.following_mm * n_W.dot(place.J_p_q * surge);
}

std::array<double, kSourceCount> VarianceBySource(const ErrorChain& chain, const PlaceSensitivity& place,
                                                  const SensitivityRow& row, const Eigen::Vector2d& n_W,
                                                  const JetMotion& motion, double lag_bias_mm) {
  std::array<double, kSourceCount> variance{};
  const SensitivityRow share = row * chain.covariance;
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    At(variance, SourceOf(static_cast<Parameter>(i))) += share[k] * row[k];
  }
  const std::array<double, 3>& offset = chain.jet_offset_mm;
  At(variance, Source::kJetOffset) = 0.5 * (Square(offset[0]) + Square(offset[1]) + Square(offset[2]));
  const Eigen::Vector2d slider = place.J_p_q.transpose() * n_W;
  const Eigen::Vector2d rail = place.J_p_rail.transpose() * n_W;
  const Eigen::Vector2d rate = place.J_q_p * motion.v_W_mm_per_s / chain.reference_feed_mm_per_s;
  const Eigen::Vector2d surge = place.J_q_p * motion.a_W_mm_per_s2 / chain.reference_acceleration_mm_per_s2;
  constexpr double kVarianceOfHalfNormal = 1.0 - kMeanOfHalfNormal * kMeanOfHalfNormal;
  const Uncertainties& u = chain.uncertainties;
  At(variance, Source::kFollowing) =
      Square(u.following_mm) * (slider.cwiseProduct(rate).squaredNorm() +
                                kVarianceOfHalfNormal * slider.cwiseProduct(surge).squaredNorm());
  At(variance, Source::kBacklash) = Square(0.5 * u.backlash_mm) * slider.squaredNorm();
  At(variance, Source::kStraightness) = Square(u.straightness_mm) * rail.squaredNorm();
  At(variance, Source::kJetWander) = Square(u.jet_wander_mm);
  At(variance, Source::kJetLag) = Square(2.0 * u.jet_lag_relative * lag_bias_mm);
  return variance;
}

ContourError ContourErrorAt(const ErrorChain& chain, const JetMotion& motion, bool compensated) {
  ContourError error;
  const PlaceSensitivity place = SensitivityAt(chain, motion.p_W_mm);
  if (!place.valid) {
    return error;
  }
  const double speed = motion.v_W_mm_per_s.norm();
  const Eigen::Vector2d t =
      speed > 0.0 ? Eigen::Vector2d(motion.v_W_mm_per_s / speed) : Eigen::Vector2d(0.0, -1.0);
  const Eigen::Vector2d n(-t.y(), t.x());
  const double a_n = n.dot(motion.a_W_mm_per_s2);
  SensitivityRow row = n.transpose() * place.J_p_parameters;
  row[Index(Parameter::kElasticLagS2)] = -a_n;
  const double lag_bias = 0.5 * Square(chain.jet_lag_time_s) * a_n;
  At(error.bias_by_source_mm, Source::kElastic) = compensated ? 0.0 : -chain.elastic_lag_s2 * a_n;
  At(error.bias_by_source_mm, Source::kFollowing) = ServoBias(chain, place, n, motion.a_W_mm_per_s2);
  At(error.bias_by_source_mm, Source::kJetLag) = lag_bias;
  error.variance_by_source_mm2 = VarianceBySource(chain, place, row, n, motion, lag_bias);
  double variance = 0.0;
  for (std::size_t i = 0; i < kSourceCount; ++i) {
    error.bias_mm += error.bias_by_source_mm[i];
    variance += error.variance_by_source_mm2[i];
  }
  error.sigma_mm = std::sqrt(std::max(0.0, variance));
  error.bound_95_mm = FoldedNormalQuantile(error.bias_mm, error.sigma_mm, 0.95);
  error.valid = true;
  return error;
}

double FoldedNormalQuantile(double bias, double sigma, double probability) {
  const double b = std::abs(bias);
  if (!(sigma > 1e-12 * b)) {
    return b;
  }
  const double offset = b / sigma;
  double low = 0.0;
  double high = offset + 9.0;
  double x = offset + 1.65;
  for (int i = 0; i < 60; ++i) {  // Newton, kept inside a shrinking bracket
    const double excess = NormalCumulative(x - offset) - NormalCumulative(-x - offset) - probability;
    (excess > 0.0 ? high : low) = x;
    const double slope = NormalDensity(x - offset) + NormalDensity(x + offset);
    const double next = slope > 1e-300 ? x - excess / slope : 0.5 * (low + high);
    const double kept = next > low && next < high ? next : 0.5 * (low + high);
    if (std::abs(kept - x) < 1e-12 * high) {
      break;
    }
    x = kept;
  }
  return x * sigma;
}

}  // namespace lambdajet::accuracy
