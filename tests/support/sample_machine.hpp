// A machine and a plan for tests of quiet rooms: the paper's lengths, a sheet in the middle of the working
// zone.
//
// Threads: values. Units: mm, s, rad.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "foundation/machine/machine_description.hpp"
#include "foundation/motion/plan.hpp"

namespace lambdajet::support {

inline MachineDescription SampleMachine() {
  MachineDescription m;
  m.machine_id = "sample";
  m.version = 1;
  m.value(Parameter::kMainLinkLengthMm) = 1200.0;
  m.value(Parameter::kAttachLengthMm) = 600.0;
  m.value(Parameter::kSecondLinkLengthMm) = 700.0;
  m.value(Parameter::kBaseXMm) = 900.0;
  m.value(Parameter::kBaseYMm) = 900.0;
  m.value(Parameter::kBaseThetaRad) = 0.01;
  m.value(Parameter::kSheetXMm) = 20.0;
  m.value(Parameter::kSheetYMm) = 30.0;
  m.value(Parameter::kSheetThetaRad) = 0.02;
  m.value(Parameter::kElasticLagS2) = 8e-4;
  m.value(Parameter::kDampingTimeS) = 0.004;
  m.moving_mass_kg = 40.0;
  m.actuators[0] = m.actuators[1] = {-3000.0, 3000.0, 500.0, 5000.0, 50000.0};
  m.path = {100.0, 200.0, 500.0, 10000.0, 0.02};
  m.process.kerf_width_mm = 1.0;
  m.process.jet_lag_time_s = 0.01;
  m.sheet_width_mm = 500.0;
  m.sheet_height_mm = 400.0;
  m.singular_margin_mm = 20.0;
  return m;
}

// Feeds round a circle at constant speed with the jet on, from rest to rest as no real plan would: the spring
// sees a step.
inline std::vector<PlanSample> CirclePlan(double x_W_mm, double y_W_mm, double radius_mm,
                                          double speed_mm_per_s, double step_s = 0.002) {
  std::vector<PlanSample> samples;
  const double omega = speed_mm_per_s / radius_mm;
  const double duration_s = 2.0 * std::numbers::pi / omega;
  const auto count = static_cast<std::size_t>(duration_s / step_s);
  for (std::size_t i = 0; i <= count; ++i) {
    const double tau = static_cast<double>(i) * step_s;
    const double c = std::cos(omega * tau);
    const double s = std::sin(omega * tau);
    PlanSample p;
    p.tau_s = tau;
    p.s_mm = speed_mm_per_s * tau;
    p.x_W_mm = x_W_mm + radius_mm * c;
    p.y_W_mm = y_W_mm + radius_mm * s;
    p.vx_W_mm_per_s = -speed_mm_per_s * s;
    p.vy_W_mm_per_s = speed_mm_per_s * c;
    p.ax_W_mm_per_s2 = -speed_mm_per_s * omega * c;
    p.ay_W_mm_per_s2 = -speed_mm_per_s * omega * s;
    p.cutting = true;
    p.source_line = 10 + static_cast<std::uint32_t>(8 * i / (count + 1));
    samples.push_back(p);
  }
  return samples;
}

}  // namespace lambdajet::support
