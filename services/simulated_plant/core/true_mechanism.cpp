#include "simulated_plant/core/true_mechanism.hpp"

#include <cmath>
#include <numbers>

namespace lambdajet::simulated_plant {
namespace {

Eigen::Vector2d OnRail(const RailTruth& rail, double along_mm) {
  double off_mm = 0.0;
  for (const Wave& wave : rail.straightness) {
    off_mm += wave.amplitude_mm == 0.0 ? 0.0 : ValueOf(wave, along_mm);
  }
  const double c = std::cos(rail.angle_rad);
  const double s = std::sin(rail.angle_rad);
  return {along_mm * c - off_mm * s, rail.offset_mm + along_mm * s + off_mm * c};
}

}  // namespace

double ValueOf(const Wave& wave, double x_mm) {
  return wave.amplitude_mm * std::sin(2.0 * std::numbers::pi * x_mm / wave.length_mm + wave.phase_rad);
}

std::optional<Eigen::Vector2d> TruePoint(const PlantTruth& truth,
                                         const std::array<double, kActuatorCount>& reading_mm) {
  const Eigen::Vector2d s1 = OnRail(truth.rails[0], reading_mm[0] + truth.actuators[0].zero_mm);
  const Eigen::Vector2d s2 = OnRail(truth.rails[1], reading_mm[1] + truth.actuators[1].zero_mm);
  const Eigen::Vector2d apart = s2 - s1;
  const double distance = apart.norm();
  if (!(distance > 1e-9)) {
    return std::nullopt;
  }
  const double a = truth.attach_length_mm;
  const double b = truth.second_link_length_mm;
  const double along = (distance * distance + a * a - b * b) / (2.0 * distance);
  const double height2 = a * a - along * along;
  if (!(height2 >= 0.0)) {
    return std::nullopt;
  }
  const Eigen::Vector2d u = apart / distance;
  // The sign of y is the assembly mode; slider 2 may stand on either side of slider 1.
  const double side = truth.assembly_mode * (u.x() >= 0.0 ? 1.0 : -1.0);
  const Eigen::Vector2d normal(-u.y(), u.x());
  const Eigen::Vector2d to_joint = along * u + side * std::sqrt(height2) * normal;
  return s1 + truth.main_link_length_mm / a * to_joint;
}

}  // namespace lambdajet::simulated_plant
