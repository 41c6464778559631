#include "kinematics/rpc/wire_planar.hpp"

#include <fmt/format.h>

namespace lambdajet::kinematics {
namespace {

constexpr double kLongestMm = 1e6;  // a kilometre of link is a slip of the unit
constexpr double kShortestMm = 1e-3;

void CheckLength(const char* field, double value, ArgumentChecks& checks) {
  if (!(value > 0.0)) {
    checks.Positive(field, value, "mm");
  } else {
    checks.InRange(field, value, kShortestMm, kLongestMm, "mm");
  }
}

void CheckRail(const std::string& field, const v1::RailGeometry& rail, ArgumentChecks& checks) {
  checks.InRange(field + ".angle_rad", rail.angle_rad(), -3.2, 3.2, "rad");
  checks.InRange(field + ".offset_mm", rail.offset_mm(), -kLongestMm, kLongestMm, "mm");
  checks.InRange(field + ".slider_zero_mm", rail.slider_zero_mm(), -kLongestMm, kLongestMm, "mm");
}

int SignFromWire(const std::string& field, int sign, ArgumentChecks& checks) {
  checks.Require(sign == 1 || sign == -1, field, "OUT_OF_RANGE", fmt::format("{} is not +1 or -1", sign));
  return sign;
}

WorkingMode ModeOf(bool given, const v1::WorkingMode& wire, const std::string& field,
                   ArgumentChecks& checks) {
  return given ? kinematics::FromWire(wire, field, checks) : WorkingMode{};
}

void CheckTravel(const v1::LambdaGeometry& wire, ArgumentChecks& checks) {
  checks.Require(wire.travel_size() == 0 || wire.travel_size() == 2, "mechanism.lambda.travel", "TOO_FEW",
                 fmt::format("{} entries; none or one for each of the 2 sliders", wire.travel_size()));
  for (int i = 0; i < wire.travel_size() && i < 2; ++i) {
    const std::string at = fmt::format("mechanism.lambda.travel[{}]", i);
    checks.InRange(at + ".min_mm", wire.travel(i).min_mm(), -kUnlimitedMm, kUnlimitedMm, "mm");
    checks.InRange(at + ".max_mm", wire.travel(i).max_mm(), -kUnlimitedMm, kUnlimitedMm, "mm");
    checks.Require(wire.travel(i).max_mm() > wire.travel(i).min_mm(), at + ".max_mm", "OUT_OF_RANGE",
                   "must be more than min_mm");
  }
}

void MarginsToWire(double reach, double serial, double parallel, double travel, v1::Margins& wire) {
  wire.set_reach_mm(reach);
  wire.set_serial_mm(serial);
  wire.set_parallel_mm(parallel);
  wire.set_travel_mm(travel);
}

template <class Answer>
void RefusalToWire(const Answer& answer, v1::Refusal& wire) {
  wire.set_reason(ToWire(answer.reason));
  wire.set_message(RefusalMessage(answer.reason, answer.excess_mm));
  wire.set_excess(answer.excess_mm);
  MarginsToWire(answer.reach_margin_mm, answer.serial_distance_mm, answer.parallel_distance_mm,
                answer.travel_margin_mm, *wire.mutable_margins());
}

void PlainRefusalToWire(Reason reason, v1::Refusal& wire) {
  wire.set_reason(ToWire(reason));
  wire.set_message(RefusalMessage(reason, 0.0));
}

}  // namespace

WorkingMode FromWire(const v1::WorkingMode& wire, const std::string& field, ArgumentChecks& checks) {
  return {SignFromWire(field + ".s1", wire.s1(), checks), SignFromWire(field + ".s2", wire.s2(), checks)};
}

Eigen::Vector2d FromWire(const v1::PlanarVector& wire, const std::string& field, const char* unit,
                         ArgumentChecks& checks) {
  checks.Finite(field + ".x", wire.x(), unit);
  checks.Finite(field + ".y", wire.y(), unit);
  return {wire.x(), wire.y()};
}

LambdaMechanism FromWire(const v1::LambdaGeometry& wire, ArgumentChecks& checks) {
  CheckLength("mechanism.lambda.main_link_length_mm", wire.main_link_length_mm(), checks);
  CheckLength("mechanism.lambda.attach_length_mm", wire.attach_length_mm(), checks);
  CheckLength("mechanism.lambda.second_link_length_mm", wire.second_link_length_mm(), checks);
  CheckRail("mechanism.lambda.rail_1", wire.rail_1(), checks);
  CheckRail("mechanism.lambda.rail_2", wire.rail_2(), checks);
  checks.InRange("mechanism.lambda.singular_margin_mm", wire.singular_margin_mm(), 0.0, kLongestMm, "mm");
  CheckTravel(wire, checks);
  const WorkingMode mode =
      ModeOf(wire.has_working_mode(), wire.working_mode(), "mechanism.lambda.working_mode", checks);
  const int assembly = wire.has_assembly_mode()
                           ? SignFromWire("mechanism.lambda.assembly_mode", wire.assembly_mode(), checks)
                           : 1;
  if (!checks.ok()) {
    return {};
  }
  MechanismParameters p;
  p << wire.main_link_length_mm(), wire.attach_length_mm(), wire.second_link_length_mm(),
      wire.rail_1().angle_rad(), wire.rail_1().offset_mm(), wire.rail_2().angle_rad(),
      wire.rail_2().offset_mm(), wire.rail_1().slider_zero_mm(), wire.rail_2().slider_zero_mm();
  LambdaMechanism mechanism = LambdaMechanism::FromParameters(p, mode, assembly);
  mechanism.singular_margin_mm = wire.singular_margin_mm();
  for (int i = 0; i < wire.travel_size(); ++i) {
    mechanism.travel[static_cast<std::size_t>(i)] = {wire.travel(i).min_mm(), wire.travel(i).max_mm()};
  }
  return mechanism;
}

LambdaMechanism FromWire(const v1::BiglideGeometry& wire, ArgumentChecks& checks) {
  CheckLength("mechanism.biglide.first_link_length_mm", wire.first_link_length_mm(), checks);
  CheckLength("mechanism.biglide.second_link_length_mm", wire.second_link_length_mm(), checks);
  checks.InRange("mechanism.biglide.rail_distance_mm", wire.rail_distance_mm(), -kLongestMm, kLongestMm,
                 "mm");
  checks.InRange("mechanism.biglide.singular_margin_mm", wire.singular_margin_mm(), 0.0, kLongestMm, "mm");
  const WorkingMode mode =
      ModeOf(wire.has_working_mode(), wire.working_mode(), "mechanism.biglide.working_mode", checks);
  const int assembly = wire.has_assembly_mode()
                           ? SignFromWire("mechanism.biglide.assembly_mode", wire.assembly_mode(), checks)
                           : 1;
  if (!checks.ok()) {
    return {};
  }
  LambdaMechanism mechanism = LambdaMechanism::FromParameters(
      TwoRailBiglide(wire.first_link_length_mm(), wire.second_link_length_mm(), wire.rail_distance_mm()),
      mode, assembly);
  mechanism.singular_margin_mm = wire.singular_margin_mm();
  return mechanism;
}

void ToWire(const LambdaMechanism& m, v1::LambdaGeometry& wire) {
  wire.set_main_link_length_mm(m.parameters[0]);
  wire.set_attach_length_mm(m.parameters[1]);
  wire.set_second_link_length_mm(m.parameters[2]);
  wire.mutable_rail_1()->set_angle_rad(m.parameters[3]);
  wire.mutable_rail_1()->set_offset_mm(m.parameters[4]);
  wire.mutable_rail_2()->set_angle_rad(m.parameters[5]);
  wire.mutable_rail_2()->set_offset_mm(m.parameters[6]);
  wire.mutable_rail_1()->set_slider_zero_mm(m.parameters[7]);
  wire.mutable_rail_2()->set_slider_zero_mm(m.parameters[8]);
  kinematics::ToWire(m.working_mode, *wire.mutable_working_mode());
  wire.set_assembly_mode(m.assembly_mode);
  for (const ActuatorTravel& travel : m.travel) {
    v1::Travel& entry = *wire.add_travel();
    entry.set_min_mm(travel.min_mm);
    entry.set_max_mm(travel.max_mm);
  }
  wire.set_singular_margin_mm(m.singular_margin_mm);
}

void ToWire(WorkingMode mode, v1::WorkingMode& wire) {
  wire.set_s1(mode.s1);
  wire.set_s2(mode.s2);
}

void ToWire(const Eigen::Vector2d& vector, v1::PlanarVector& wire) {
  wire.set_x(vector.x());
  wire.set_y(vector.y());
}

void ToWire(const InverseAnswer& answer, v1::SolveInverseResponse& wire) {
  if (answer.reason != Reason::kSolved) {
    RefusalToWire(answer, *wire.mutable_refusal());
    return;
  }
  v1::InverseSolution& solution = *wire.mutable_solution();
  solution.add_actuator_position_mm(answer.actuator_position_mm.x());
  solution.add_actuator_position_mm(answer.actuator_position_mm.y());
  ToWire(answer.working_mode, *solution.mutable_working_mode());
  solution.set_assembly_mode(answer.assembly_mode);
  MarginsToWire(answer.reach_margin_mm, answer.serial_distance_mm, answer.parallel_distance_mm,
                answer.travel_margin_mm, *solution.mutable_margins());
}

void ToWire(const ForwardAnswer& answer, v1::SolveForwardResponse& wire) {
  if (answer.reason != Reason::kSolved) {
    RefusalToWire(answer, *wire.mutable_refusal());
    return;
  }
  v1::ForwardSolution& solution = *wire.mutable_solution();
  ToWire(answer.p_DE_mm, *solution.mutable_p_de());
  ToWire(answer.working_mode, *solution.mutable_working_mode());
  solution.set_assembly_mode(answer.assembly_mode);
  MarginsToWire(answer.reach_margin_mm, answer.serial_distance_mm, answer.parallel_distance_mm,
                answer.travel_margin_mm, *solution.mutable_margins());
}

void ToWire(const LambdaJacobians& jacobians, v1::ComputeJacobianResponse& wire) {
  if (!jacobians.differentiable) {
    PlainRefusalToWire(jacobians.reason == Reason::kSolved ? Reason::kSingular : jacobians.reason,
                       *wire.mutable_refusal());
    return;
  }
  v1::JacobianSolution& solution = *wire.mutable_solution();
  MatrixToWire(jacobians.J_q_x, *solution.mutable_j_q_x());
  MatrixToWire(jacobians.J_q_parameters, *solution.mutable_j_q_parameters());
  if (jacobians.invertible) {
    MatrixToWire(jacobians.J_x_q, *solution.mutable_j_x_q());
    MatrixToWire(jacobians.J_x_parameters, *solution.mutable_j_x_parameters());
  }
  for (int i = 0; i < kMechanismParameterCount; ++i) {
    solution.add_parameter_name(std::string(ParameterName(static_cast<Parameter>(i))));
  }
  solution.set_determinant(jacobians.determinant);
  solution.set_condition(jacobians.condition);
  solution.set_smallest_singular_value(jacobians.smallest_singular_value);
}

void ToWire(const SingularityReport& report, v1::ReportSingularityResponse& wire) {
  const bool closes = report.reason != Reason::kOutOfReach && report.reason != Reason::kNotFinite &&
                      report.reason != Reason::kBadGeometry;
  if (!closes) {
    PlainRefusalToWire(report.reason, *wire.mutable_refusal());
    return;
  }
  v1::SingularitySolution& solution = *wire.mutable_solution();
  solution.set_type(static_cast<v1::SingularityType>(report.type));
  solution.set_main_link_distance_mm(report.main_link_distance_mm);
  solution.set_second_link_distance_mm(report.second_link_distance_mm);
  solution.set_parallel_distance_mm(report.parallel_distance_mm);
  solution.set_determinant(report.determinant);
  solution.set_condition(report.condition);
  solution.set_smallest_singular_value(report.smallest_singular_value);
}

std::string RefusalMessage(Reason reason, double excess) {
  switch (reason) {
    case Reason::kOutOfReach:
      return fmt::format(
          "the links fall short of the pose by {:.4f} mm; move it towards the rail or use longer links",
          excess);
    case Reason::kSingular:
      return fmt::format(
          "the pose lies {:.4f} mm inside the singular margin; move it away from the singular line", excess);
    case Reason::kActuatorLimit:
      return fmt::format(
          "an actuator would pass the end of its travel by {:.4f} mm; move the pose or extend the travel",
          excess);
    case Reason::kNotFinite:
      return "the pose has a number that is not finite or beyond 1e9; give finite millimetres";
    case Reason::kModeMismatch:
      return "the pose belongs to another working or assembly mode than the one asked for; ask for the mode "
             "it is in";
    case Reason::kIndeterminate:
      return "the sliders stand in one place and the attachment equals the second link: the main link turns "
             "freely; choose "
             "another working mode";
    case Reason::kNotConverged:
      return "the iteration ran into its limit; start it nearer to the pose";
    case Reason::kJointLimit:
      return fmt::format("a passive joint would leave its cone by {:.6f} rad; tilt the pose less", excess);
    case Reason::kBadGeometry:
      return "the mechanism's lengths must be finite and above 0";
    case Reason::kSolved:
      break;
  }
  return "";
}

}  // namespace lambdajet::kinematics
