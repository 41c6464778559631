#include "foundation/machine/machine_description.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace lambdajet {
namespace {

constexpr std::array<std::string_view, kParameterCount> kNames = {
    "main_link_length_mm", "attach_length_mm", "second_link_length_mm",
    "rail_1_angle_rad",    "rail_1_offset_mm", "rail_2_angle_rad",
    "rail_2_offset_mm",    "slider_1_zero_mm", "slider_2_zero_mm",
    "base_x_mm",           "base_y_mm",        "base_theta_rad",
    "sheet_x_mm",          "sheet_y_mm",       "sheet_theta_rad",
    "camera_x_mm",         "camera_y_mm",      "elastic_lag_s2",
    "damping_time_s"};

class Faults {
 public:
  void Positive(const std::string& key, double value) {
    if (!(std::isfinite(value) && value > 0.0)) {
      list_.push_back({key, value, "a finite number above 0"});
    }
  }
  void NotNegative(const std::string& key, double value) {
    if (!(std::isfinite(value) && value >= 0.0)) {
      list_.push_back({key, value, "a finite number, 0 or above"});
    }
  }
  void Require(bool holds, const std::string& key, double value, const std::string& should) {
    if (!holds) {
      list_.push_back({key, value, should});
    }
  }
  std::vector<DescriptionFault> Take() { return std::move(list_); }

 private:
  std::vector<DescriptionFault> list_;
};

void CheckParameters(const MachineDescription& machine, Faults& faults) {
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const double value = machine.parameters[static_cast<Eigen::Index>(i)];
    faults.Require(std::isfinite(value), "parameters." + std::string(kNames[i]), value, "a finite number");
  }
  for (const Parameter p :
       {Parameter::kMainLinkLengthMm, Parameter::kAttachLengthMm, Parameter::kSecondLinkLengthMm}) {
    faults.Positive("parameters." + std::string(ParameterName(p)), machine.value(p));
  }
  faults.NotNegative("parameters.elastic_lag_s2", machine.value(Parameter::kElasticLagS2));
  faults.NotNegative("parameters.damping_time_s", machine.value(Parameter::kDampingTimeS));
  faults.Require(machine.covariance.allFinite(), "covariance", NAN, "finite numbers");
  if (machine.covariance.allFinite()) {
    const ParameterCovariance difference = machine.covariance - machine.covariance.transpose();
    faults.Require(difference.cwiseAbs().maxCoeff() <= 1e-12, "covariance", difference.cwiseAbs().maxCoeff(),
                   "a symmetric matrix");
    // Scaled to unit diagonal, so that mm^2 and (s^2)^2 are judged alike.
    ParameterVector scale = machine.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    scale = (scale.array() > 0.0).select(scale.cwiseInverse(), 1.0);
    const ParameterCovariance scaled = scale.asDiagonal() * machine.covariance * scale.asDiagonal();
    const double lowest =
        Eigen::SelfAdjointEigenSolver<ParameterCovariance>(scaled, Eigen::EigenvaluesOnly).eigenvalues()[0];
    faults.Require(lowest >= -1e-9, "covariance", lowest, "no negative eigenvalue");
  }
}

void CheckLimits(const MachineDescription& machine, Faults& faults) {
  for (std::size_t i = 0; i < machine.actuators.size(); ++i) {
    const ActuatorLimits& a = machine.actuators[i];
    const std::string at = "actuators." + std::to_string(i + 1) + ".";
    faults.Require(a.position_max_mm > a.position_min_mm, at + "position_max_mm", a.position_max_mm,
                   "more than position_min_mm");
    faults.Positive(at + "velocity_mm_per_s", a.velocity_mm_per_s);
    faults.Positive(at + "acceleration_mm_per_s2", a.acceleration_mm_per_s2);
    faults.Positive(at + "jerk_mm_per_s3", a.jerk_mm_per_s3);
  }
  faults.Positive("path.feed_mm_per_s", machine.path.feed_mm_per_s);
  faults.Positive("path.rapid_mm_per_s", machine.path.rapid_mm_per_s);
  faults.Positive("path.acceleration_mm_per_s2", machine.path.acceleration_mm_per_s2);
  faults.Positive("path.jerk_mm_per_s3", machine.path.jerk_mm_per_s3);
  faults.Positive("path.corner_tolerance_mm", machine.path.corner_tolerance_mm);
}

void CheckProcess(const MachineDescription& machine, Faults& faults) {
  const ProcessModel& p = machine.process;
  faults.NotNegative("process.kerf_width_mm", p.kerf_width_mm);
  faults.NotNegative("process.jet_lag_time_s", p.jet_lag_time_s);
  faults.NotNegative("process.pierce_time_s", p.pierce_time_s);
  faults.NotNegative("process.jet_on_delay_s", p.jet_on_delay_s);
  faults.NotNegative("process.jet_off_delay_s", p.jet_off_delay_s);
  faults.NotNegative("process.abrasive_on_delay_s", p.abrasive_on_delay_s);
  faults.NotNegative("process.abrasive_off_delay_s", p.abrasive_off_delay_s);
  faults.NotNegative("process.abrasive_flow_g_per_min", p.abrasive_flow_g_per_min);
  faults.NotNegative("process.abrasive_flow_max_g_per_min", p.abrasive_flow_max_g_per_min);
  faults.NotNegative("process.measuring_settle_time_s", p.measuring_settle_time_s);
  const Uncertainties& u = machine.uncertainties;
  faults.NotNegative("uncertainties.straightness_mm", u.straightness_mm);
  faults.NotNegative("uncertainties.backlash_mm", u.backlash_mm);
  faults.NotNegative("uncertainties.following_mm", u.following_mm);
  faults.NotNegative("uncertainties.camera_mm", u.camera_mm);
  faults.NotNegative("uncertainties.mark_mm", u.mark_mm);
  faults.NotNegative("uncertainties.jet_wander_mm", u.jet_wander_mm);
  faults.NotNegative("uncertainties.jet_lag_relative", u.jet_lag_relative);
}

}  // namespace

std::string_view ParameterName(Parameter parameter) { return kNames[static_cast<std::size_t>(parameter)]; }

std::optional<Parameter> ParameterByName(std::string_view name) {
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    if (kNames[i] == name) {
      return static_cast<Parameter>(i);
    }
  }
  return std::nullopt;
}

double MachineDescription::stiffness_n_per_mm() const {
  return 1e-3 * moving_mass_kg / value(Parameter::kElasticLagS2);
}

std::vector<DescriptionFault> Validate(const MachineDescription& machine) {
  Faults faults;
  CheckParameters(machine, faults);
  CheckLimits(machine, faults);
  CheckProcess(machine, faults);
  faults.Require(std::abs(machine.working_mode.s1) == 1, "working_mode.s1", machine.working_mode.s1,
                 "-1 or 1");
  faults.Require(std::abs(machine.working_mode.s2) == 1, "working_mode.s2", machine.working_mode.s2,
                 "-1 or 1");
  faults.Require(std::abs(machine.assembly_mode) == 1, "assembly_mode", machine.assembly_mode, "-1 or 1");
  faults.Positive("moving_mass_kg", machine.moving_mass_kg);
  faults.Positive("sheet_width_mm", machine.sheet_width_mm);
  faults.Positive("sheet_height_mm", machine.sheet_height_mm);
  faults.NotNegative("singular_margin_mm", machine.singular_margin_mm);
  faults.Require(machine.control_period_s >= 1e-4 && machine.control_period_s <= 0.1, "control_period_s",
                 machine.control_period_s, "0.0001 to 0.1 s");
  return faults.Take();
}

}  // namespace lambdajet
