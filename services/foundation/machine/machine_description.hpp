// Describes one open-base machine: what it was designed to be, what its parameters are believed to be now, and how well.
//
// Model: lambda mechanism on up to two rails (seed paper 000, section on kinematics; the second link of length
// `second_link_length_mm` joins the main link at `attach_length_mm` from slider 1); elastic levers as a lumped mass on a
// spring at the tool (m u'' + c u' + k u = -m a); electronic base X_DJ; sheet in its clamp X_EW; camera beside the jet p_JC.
// Frames and units: foundation/geometry/frames.md; mm, s, rad, kg, N/mm.
// Validity: a description read by platform/machine_file has been checked; Validate() names what is wrong otherwise.
// Threads: a value; share as shared_ptr<const MachineDescription>.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "foundation/geometry/planar_pose.hpp"

namespace lambdajet {

// The entries of the one parameter vector, in its order on every wire. kinematics solves with them, calibration
// identifies them, accuracy propagates their covariance, trajectory plans with them.
enum class Parameter : std::size_t {
  kMainLinkLengthMm,    // slider 1 to tool point
  kAttachLengthMm,      // slider 1 to the joint of the second link on the main link
  kSecondLinkLengthMm,  // slider 2 to that joint
  kRail1AngleRad,       // rail 1 against D's x axis
  kRail1OffsetMm,       // rail 1 off D's origin, along D's y
  kRail2AngleRad,
  kRail2OffsetMm,
  kSlider1ZeroMm,       // position along the rail = encoder reading + zero
  kSlider2ZeroMm,
  kBaseXMm,             // X_DJ, the electronic base
  kBaseYMm,
  kBaseThetaRad,
  kSheetXMm,            // X_EW, the sheet in its clamp
  kSheetYMm,
  kSheetThetaRad,
  kCameraXMm,           // p_JC, the camera beside the jet; minus this is the jet's offset as the camera sees it
  kCameraYMm,
  kElasticLagS2,        // m/k at the tool: deflection = -(m/k) a, in mm per mm/s^2
  kDampingTimeS,        // c/k at the tool
  kCount
};
inline constexpr std::size_t kParameterCount = static_cast<std::size_t>(Parameter::kCount);

using ParameterVector = Eigen::Matrix<double, static_cast<int>(kParameterCount), 1>;
using ParameterCovariance =
    Eigen::Matrix<double, static_cast<int>(kParameterCount), static_cast<int>(kParameterCount)>;

// The key of a parameter in YAML, CSV columns, reports and metrics; unit last.
std::string_view ParameterName(Parameter parameter);
std::optional<Parameter> ParameterByName(std::string_view name);

// Which inverse branch the machine was assembled for: s1 = +1 slider 1 left of the tool, s2 = +1 slider 2 right of the
// attachment, (+,+) is the lambda shape.
struct WorkingMode {
  int s1 = 1;
  int s2 = 1;
  friend bool operator==(const WorkingMode&, const WorkingMode&) = default;
};

struct ActuatorLimits {
  double position_min_mm = 0.0;
  double position_max_mm = 0.0;
  double velocity_mm_per_s = 0.0;
  double acceleration_mm_per_s2 = 0.0;
  double jerk_mm_per_s3 = 0.0;
};

struct PathLimits {
  double feed_mm_per_s = 0.0;           // fastest cutting feed
  double rapid_mm_per_s = 0.0;          // fastest jet-off move
  double acceleration_mm_per_s2 = 0.0;  // magnitude, tangential and normal together
  double jerk_mm_per_s3 = 0.0;
  double corner_tolerance_mm = 0.0;     // largest distance of planned from programmed contour
};

// How the process behaves, as its supplier's data sheets say.
struct ProcessModel {
  double kerf_width_mm = 0.0;
  double jet_lag_time_s = 0.0;        // the cut front trails the jet by speed * this
  double pierce_time_s = 0.0;
  double jet_on_delay_s = 0.0;        // command to water at the sheet
  double jet_off_delay_s = 0.0;
  double abrasive_on_delay_s = 0.0;
  double abrasive_off_delay_s = 0.0;
  double abrasive_flow_g_per_min = 0.0;      // that a plan begins with
  double abrasive_flow_max_g_per_min = 0.0;  // 0: a program cannot set the flow
  double measuring_settle_time_s = 0.0;  // stand still this long before the camera looks
};

// One-sigma figures of what no parameter describes; accuracy adds them to the covariance's share.
struct Uncertainties {
  double straightness_mm = 0.0;        // rails, per slider
  double backlash_mm = 0.0;            // full width, per slider
  double following_mm = 0.0;           // servo following error at cutting feed, per slider
  double camera_mm = 0.0;              // one reading, each coordinate
  double mark_mm = 0.0;                // place of a mark on the sheet
  double jet_wander_mm = 0.0;          // jet axis at the sheet during a cut, each coordinate
  double jet_lag_relative = 0.0;       // of jet_lag_time_s
};

// A mark of known place on the sheet, for the camera.
struct SheetMark {
  int id = 0;
  double x_W_mm = 0.0;
  double y_W_mm = 0.0;
};

// What a module or a service must know of the machine, beyond its parameters.
struct MachineDescription {
  std::string machine_id;
  std::uint32_t version = 0;         // 0: as the crew set the modules up; each activated identification counts up
  std::string hash;                  // of everything below, 12 hex digits; set by platform/machine_file

  ParameterVector parameters = ParameterVector::Zero();
  ParameterCovariance covariance = ParameterCovariance::Zero();

  WorkingMode working_mode;
  int assembly_mode = 1;             // sign of y
  double moving_mass_kg = 0.0;
  std::array<ActuatorLimits, 2> actuators;
  PathLimits path;
  ProcessModel process;
  Uncertainties uncertainties;
  double sheet_width_mm = 0.0;       // along W's x
  double sheet_height_mm = 0.0;
  std::vector<SheetMark> marks;
  double singular_margin_mm = 0.0;   // the tool point stays at least this far from every singular line
  double control_period_s = 0.001;

  double value(Parameter p) const { return parameters[static_cast<Eigen::Index>(p)]; }
  double& value(Parameter p) { return parameters[static_cast<Eigen::Index>(p)]; }

  PlanarPose X_DJ() const {
    return {value(Parameter::kBaseXMm), value(Parameter::kBaseYMm), value(Parameter::kBaseThetaRad)};
  }
  PlanarPose X_EW() const {
    return {value(Parameter::kSheetXMm), value(Parameter::kSheetYMm), value(Parameter::kSheetThetaRad)};
  }
  Eigen::Vector2d p_JC_mm() const { return {value(Parameter::kCameraXMm), value(Parameter::kCameraYMm)}; }

  // 1000 mm/m stands between N/mm and kg/s^2: k [N/mm] = 1e-3 m [kg] / (m/k) [s^2].
  double stiffness_n_per_mm() const;
};

// What is wrong with a description, one entry a fault; empty if nothing is.
struct DescriptionFault {
  std::string key;      // as in the YAML file, dotted
  double value = 0.0;
  std::string should;   // what would be right, with unit
};
std::vector<DescriptionFault> Validate(const MachineDescription& machine);

}  // namespace lambdajet
