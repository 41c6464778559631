#include "kinematics/core/lambda_mechanism.hpp"

#include <algorithm>
#include <cmath>

#include "kinematics/core/lambda_differential.hpp"

namespace lambdajet::kinematics {
namespace {

using lambda::Differential;

// Beyond this the squares of lengths lose the millimetre; no machine is a thousand kilometres long.
constexpr double kLargestMm = 1e9;
// A shorter link is none.
constexpr double kShortestLinkMm = 1e-3;

bool Usable(const Eigen::Vector2d& p) {
  return std::abs(p.x()) <= kLargestMm && std::abs(p.y()) <= kLargestMm;  // false for NaN
}

bool Sound(const LambdaMechanism& m) {
  const MechanismParameters& p = m.parameters;
  const bool finite = p.allFinite() && p.cwiseAbs().maxCoeff() <= kLargestMm;
  const bool lengths = p.head<3>().minCoeff() >= kShortestLinkMm;
  const bool modes =
      std::abs(m.working_mode.s1) == 1 && std::abs(m.working_mode.s2) == 1 && std::abs(m.assembly_mode) == 1;
  return finite && lengths && modes;
}

double TravelMargin(const LambdaMechanism& m, double q1, double q2) {
  return std::min(std::min(q1 - m.travel[0].min_mm, m.travel[0].max_mm - q1),
                  std::min(q2 - m.travel[1].min_mm, m.travel[1].max_mm - q2));
}

// What is wrong with a pose that closes: the parts that inverse and forward share.
template <class Answer>
void Judge(const LambdaMechanism& m, bool mode_matches, Answer& answer) {
  const double distance = std::min(answer.serial_distance_mm, answer.parallel_distance_mm);
  if (!mode_matches) {
    answer.reason = Reason::kModeMismatch;
  } else if (!(distance > m.singular_margin_mm)) {
    answer.reason = Reason::kSingular;
    answer.excess_mm = m.singular_margin_mm - distance;
  } else if (answer.travel_margin_mm < 0.0) {
    answer.reason = Reason::kActuatorLimit;
    answer.excess_mm = -answer.travel_margin_mm;
  } else {
    answer.reason = Reason::kSolved;
  }
}

// The nearest point of the type 2 locus: the tool is put onto the tangent at the point before until it stays, so that the
// way there is along the gradient. Where that leads out of reach the first-order distance is all there is.
double RefineParallelDistance(const LambdaMechanism& m, const Eigen::Vector2d& p_DE_mm,
                              const Differential& at) {
  constexpr int kSteps = 60;
  if (!at.differentiable || at.parallel_gradient.squaredNorm() == 0.0) {
    return at.parallel_distance_mm;
  }
  Eigen::Vector2d p = p_DE_mm;
  Differential d = at;
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::Vector2d& g = d.parallel_gradient;
    const Eigen::Vector2d next = p_DE_mm - (d.side_mm + g.dot(p_DE_mm - p)) / g.squaredNorm() * g;
    const double moved = (next - p).norm();
    p = next;
    if (moved < 1e-10) {
      return std::copysign((p - p_DE_mm).norm(), at.side_mm);
    }
    const auto k =
        lambda::CloseInverse<double>(m.geometry, {p.x(), p.y()}, m.working_mode.s1, m.working_mode.s2);
    d = lambda::Differentiate(m.geometry, k, m.working_mode, m.rails_apart);
    if (!d.differentiable || d.parallel_gradient.squaredNorm() == 0.0) {
      break;
    }
  }
  return at.parallel_distance_mm;
}

// Sliders nearer to each other than this stand in one place: with L2 = L3 the main link then turns freely
// about them.
double CoincidenceMm(const lambda::Geometry<double>& g) { return 1e-9 * g.main_mm; }

WorkingMode ReadMode(const lambda::Geometry<double>& g, const lambda::Assembly<double>& a) {
  const double along_1 =
      (a.tool.x - a.slider_1.x) * g.rail_1.cosine + (a.tool.y - a.slider_1.y) * g.rail_1.sine;
  const double along_2 =
      (a.slider_2.x - a.attachment.x) * g.rail_2.cosine + (a.slider_2.y - a.attachment.y) * g.rail_2.sine;
  return {along_1 < 0.0 ? -1 : 1, along_2 < 0.0 ? -1 : 1};
}

// Beside a singularity absurd geometries can overflow a derivative that exists; then it is refused, not
// shipped.
MotionAnswer FiniteOnly(const MotionAnswer& answer) {
  if (answer.motion.velocity_mm_per_s.allFinite() && answer.motion.acceleration_mm_per_s2.allFinite()) {
    return answer;
  }
  MotionAnswer refused;
  refused.motion.position_mm = answer.motion.position_mm;
  return refused;
}

LambdaJacobians FiniteOnly(const LambdaJacobians& answer) {
  const bool finite = answer.J_q_x.allFinite() && answer.J_x_q.allFinite() &&
                      answer.J_q_parameters.allFinite() && answer.J_x_parameters.allFinite() &&
                      std::isfinite(answer.determinant) && std::isfinite(answer.condition) &&
                      std::isfinite(answer.largest_singular_value);
  return finite ? answer : LambdaJacobians{};
}

}  // namespace

LambdaMechanism LambdaMechanism::FromParameters(const MechanismParameters& parameters,
                                                WorkingMode working_mode, int assembly_mode) {
  LambdaMechanism m;
  m.parameters = parameters;
  m.working_mode = working_mode;
  m.assembly_mode = assembly_mode;
  m.valid = Sound(m);
  if (m.valid) {
    m.geometry = lambda::MakeGeometry(parameters.data());
    m.rails_apart =
        lambda::RailsApart(m.geometry.main_mm, m.geometry.rail_1.offset_mm, m.geometry.rail_2.offset_mm);
  }
  return m;
}

LambdaMechanism LambdaMechanism::FromDescription(const MachineDescription& machine) {
  LambdaMechanism m = FromParameters(machine.parameters.head<kMechanismParameterCount>(),
                                     machine.working_mode, machine.assembly_mode);
  for (std::size_t i = 0; i < m.travel.size(); ++i) {
    m.travel[i] = {std::max(machine.actuators[i].position_min_mm, -kUnlimitedMm),
                   std::min(machine.actuators[i].position_max_mm, kUnlimitedMm)};
  }
  m.singular_margin_mm = machine.singular_margin_mm;
  return m;
}

LambdaMechanism LambdaMechanism::WithModes(WorkingMode mode, int assembly) const {
  LambdaMechanism m = *this;
  m.working_mode = mode;
  m.assembly_mode = assembly;
  m.valid = Sound(m);
  return m;
}

LambdaMechanism LambdaMechanism::WithParameters(const MechanismParameters& changed) const {
  LambdaMechanism m = FromParameters(changed, working_mode, assembly_mode);
  m.travel = travel;
  m.singular_margin_mm = singular_margin_mm;
  return m;
}

MechanismParameters IdealLambda(double main_mm, double attach_mm, double second_mm) {
  MechanismParameters p = MechanismParameters::Zero();
  p.head<3>() << main_mm, attach_mm, second_mm;
  return p;
}

MechanismParameters TwoRailBiglide(double main_mm, double second_mm, double height_mm) {
  MechanismParameters p = IdealLambda(main_mm, main_mm, second_mm);
  p[static_cast<Eigen::Index>(Parameter::kRail2OffsetMm)] = height_mm;
  return p;
}

InverseAnswer SolveInverse(const LambdaMechanism& m, const Eigen::Vector2d& p_DE_mm) {
  InverseAnswer answer;
  answer.working_mode = m.working_mode;
  if (!m.valid || !Usable(p_DE_mm)) {
    answer.reason = m.valid ? Reason::kNotFinite : Reason::kBadGeometry;
    return answer;
  }
  const auto k = lambda::CloseInverse<double>(m.geometry, {p_DE_mm.x(), p_DE_mm.y()}, m.working_mode.s1,
                                              m.working_mode.s2);
  answer.reach_margin_mm =
      std::min(m.geometry.main_mm - std::abs(k.across_1_mm), m.geometry.second_mm - std::abs(k.across_2_mm));
  if (answer.reach_margin_mm < 0.0) {
    answer.reason = Reason::kOutOfReach;
    answer.serial_distance_mm = answer.reach_margin_mm;
    answer.excess_mm = -answer.reach_margin_mm;
    return answer;
  }
  const auto q = lambda::ReadingsOf(m.geometry, k);
  answer.positioned = true;
  answer.actuator_position_mm = {q.q1_mm, q.q2_mm};
  answer.travel_margin_mm = TravelMargin(m, q.q1_mm, q.q2_mm);
  const Differential d = lambda::Differentiate(m.geometry, k, m.working_mode, m.rails_apart);
  answer.serial_distance_mm = std::min(d.main_distance_mm, d.second_distance_mm);
  answer.assembly_mode = d.side_mm > 0.0 ? 1 : d.side_mm < 0.0 ? -1 : 0;
  answer.parallel_distance_mm = m.assembly_mode * d.parallel_distance_mm;
  if (d.slider_distance_mm <= CoincidenceMm(m.geometry)) {
    answer.reason = Reason::kIndeterminate;
    return answer;
  }
  Judge(m, answer.assembly_mode * m.assembly_mode >= 0, answer);
  return answer;
}

ForwardAnswer SolveForward(const LambdaMechanism& m, const Eigen::Vector2d& actuator_position_mm) {
  ForwardAnswer answer;
  answer.assembly_mode = m.assembly_mode;
  if (!m.valid || !Usable(actuator_position_mm)) {
    answer.reason = m.valid ? Reason::kNotFinite : Reason::kBadGeometry;
    return answer;
  }
  const lambda::Geometry<double>& g = m.geometry;
  const lambda::Readings<double> q{actuator_position_mm.x(), actuator_position_mm.y()};
  const auto a = lambda::Assemble(g, q, m.assembly_mode, m.rails_apart);
  const double attach = g.ratio * g.main_mm;
  answer.travel_margin_mm = TravelMargin(m, q.q1_mm, q.q2_mm);
  const double shortest = std::abs(attach - g.second_mm);
  const double distance = std::sqrt(a.distance_2_mm2);
  if (distance <= CoincidenceMm(g) && shortest <= CoincidenceMm(g)) {
    answer.reason = Reason::kIndeterminate;
    return answer;
  }
  answer.reach_margin_mm = std::min(distance - shortest, attach + g.second_mm - distance);
  if (!(answer.reach_margin_mm >= 0.0)) {
    answer.reason = Reason::kOutOfReach;
    answer.excess_mm = -answer.reach_margin_mm;
    return answer;
  }
  answer.positioned = true;
  answer.p_DE_mm = {a.tool.x, a.tool.y};
  answer.working_mode = ReadMode(g, a);
  const auto k = lambda::CloseInverse(g, a.tool, answer.working_mode.s1, answer.working_mode.s2);
  const Differential d = lambda::Differentiate(g, k, answer.working_mode, m.rails_apart);
  answer.serial_distance_mm = std::min(d.main_distance_mm, d.second_distance_mm);
  answer.parallel_distance_mm = std::abs(d.parallel_distance_mm);
  Judge(m, answer.working_mode == m.working_mode, answer);
  return answer;
}

MotionAnswer SolveInverseMotion(const LambdaMechanism& m, const Motion& tool) {
  const InverseAnswer position = SolveInverse(m, tool.position_mm);
  MotionAnswer answer;
  answer.reason = position.reason;
  answer.motion.position_mm = position.actuator_position_mm;
  if (!position.positioned || !Usable(tool.velocity_mm_per_s) || !Usable(tool.acceleration_mm_per_s2)) {
    answer.reason = position.positioned ? Reason::kNotFinite : position.reason;
    return answer;
  }
  const auto k = lambda::CloseInverse<double>(m.geometry, {tool.position_mm.x(), tool.position_mm.y()},
                                              m.working_mode.s1, m.working_mode.s2);
  const Differential d = lambda::Differentiate(m.geometry, k, m.working_mode, m.rails_apart);
  answer.differentiable = d.differentiable;
  if (d.differentiable) {
    answer.motion.velocity_mm_per_s = d.J_q_x * tool.velocity_mm_per_s;
    answer.motion.acceleration_mm_per_s2 =
        d.J_q_x * tool.acceleration_mm_per_s2 +
        lambda::Curvature(m.geometry, k, d, m.working_mode, tool.velocity_mm_per_s);
  }
  return FiniteOnly(answer);
}

MotionAnswer SolveForwardMotion(const LambdaMechanism& m, const Motion& actuators) {
  const ForwardAnswer position = SolveForward(m, actuators.position_mm);
  MotionAnswer answer;
  answer.reason = position.reason;
  answer.motion.position_mm = position.p_DE_mm;
  if (!position.positioned || !Usable(actuators.velocity_mm_per_s) ||
      !Usable(actuators.acceleration_mm_per_s2)) {
    answer.reason = position.positioned ? Reason::kNotFinite : position.reason;
    return answer;
  }
  const auto k = lambda::CloseInverse<double>(m.geometry, {position.p_DE_mm.x(), position.p_DE_mm.y()},
                                              position.working_mode.s1, position.working_mode.s2);
  const Differential d = lambda::Differentiate(m.geometry, k, position.working_mode, m.rails_apart);
  answer.differentiable = d.invertible;
  if (d.invertible) {
    const Eigen::Vector2d velocity = d.J_x_q * actuators.velocity_mm_per_s;
    answer.motion.velocity_mm_per_s = velocity;
    answer.motion.acceleration_mm_per_s2 =
        d.J_x_q * (actuators.acceleration_mm_per_s2 -
                   lambda::Curvature(m.geometry, k, d, position.working_mode, velocity));
  }
  return FiniteOnly(answer);
}

LambdaJacobians ComputeJacobians(const LambdaMechanism& m, const Eigen::Vector2d& p_DE_mm) {
  LambdaJacobians answer;
  const InverseAnswer position = SolveInverse(m, p_DE_mm);
  answer.reason = position.reason;
  if (!position.positioned) {
    return answer;
  }
  const auto k = lambda::CloseInverse<double>(m.geometry, {p_DE_mm.x(), p_DE_mm.y()}, m.working_mode.s1,
                                              m.working_mode.s2);
  const Differential d = lambda::Differentiate(m.geometry, k, m.working_mode, m.rails_apart);
  answer.differentiable = d.differentiable;
  answer.invertible = d.invertible;
  if (!d.differentiable) {
    return answer;
  }
  answer.J_q_x = d.J_q_x;
  answer.J_q_parameters = lambda::ToParameters(m.geometry, k, d, m.working_mode);
  answer.determinant = d.determinant;
  answer.smallest_singular_value = d.smallest_singular_value;
  answer.largest_singular_value = d.largest_singular_value;
  if (d.invertible) {
    answer.J_x_q = d.J_x_q;
    answer.J_x_parameters = -d.J_x_q * answer.J_q_parameters;
    answer.condition = d.largest_singular_value / d.smallest_singular_value;
  }
  return FiniteOnly(answer);
}

SingularityReport ReportSingularity(const LambdaMechanism& m, const Eigen::Vector2d& p_DE_mm) {
  SingularityReport report;
  const InverseAnswer position = SolveInverse(m, p_DE_mm);
  report.reason = position.reason;
  if (!position.positioned) {
    report.main_link_distance_mm = report.second_link_distance_mm = position.serial_distance_mm;
    return report;
  }
  const auto k = lambda::CloseInverse<double>(m.geometry, {p_DE_mm.x(), p_DE_mm.y()}, m.working_mode.s1,
                                              m.working_mode.s2);
  const Differential d = lambda::Differentiate(m.geometry, k, m.working_mode, m.rails_apart);
  report.main_link_distance_mm = d.main_distance_mm;
  report.second_link_distance_mm = d.second_distance_mm;
  report.parallel_distance_mm = m.assembly_mode * RefineParallelDistance(m, p_DE_mm, d);
  report.determinant = d.determinant;
  report.serial_determinant_mm2 = -4.0 * m.working_mode.s1 * k.root_1_mm * m.working_mode.s2 * k.root_2_mm;
  report.parallel_determinant_mm2 = d.parallel_determinant_mm2;
  report.smallest_singular_value = d.smallest_singular_value;
  report.condition = d.invertible ? d.largest_singular_value / d.smallest_singular_value : 0.0;
  const bool serial = !(std::min(d.main_distance_mm, d.second_distance_mm) > m.singular_margin_mm);
  const bool parallel = !(std::abs(report.parallel_distance_mm) > m.singular_margin_mm);
  report.type = serial && parallel ? SingularityType::kSerialAndParallel
                : serial           ? SingularityType::kSerial
                : parallel         ? SingularityType::kParallel
                                   : SingularityType::kRegular;
  return report;
}

}  // namespace lambdajet::kinematics
