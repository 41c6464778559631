#include "tests/support/hand_made_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "foundation/contract/expects.hpp"

namespace lambdajet::tests {
namespace {

struct Along {
  double s, v, a;
};

// Way, speed and acceleration of a stroke at time t.
Along Profile(double t, double ramp_s, double total_s, double speed) {
  if (t <= ramp_s) {
    const double u = t / ramp_s;
    return {speed * ramp_s * u * u * u * (1.0 - 0.5 * u), speed * u * u * (3.0 - 2.0 * u),
            speed * 6.0 * u * (1.0 - u) / ramp_s};
  }
  if (t <= total_s - ramp_s) {
    return {speed * (0.5 * ramp_s + t - ramp_s), speed, 0.0};
  }
  const Along mirrored = Profile(total_s - t, ramp_s, total_s, speed);
  return {speed * (total_s - ramp_s) - mirrored.s, mirrored.v, -mirrored.a};
}

// The quintic with these end values over a time T.
Polynomial Quintic(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double T) {
  const double h = b[0] - a[0] - a[1] * T - 0.5 * a[2] * T * T;
  const double g = (b[1] - a[1] - a[2] * T) * T;
  const double m = (b[2] - a[2]) * T * T;
  Polynomial p;
  p.c = {a[0],
         a[1],
         0.5 * a[2],
         (10 * h - 4 * g + 0.5 * m) / std::pow(T, 3),
         (-15 * h + 7 * g - m) / std::pow(T, 4),
         (6 * h - 3 * g + 0.5 * m) / std::pow(T, 5)};
  return p;
}

}  // namespace

HandMadePlan::HandMadePlan(const MachineDescription& machine, double node_s)
    : machine_(machine), mechanism_(kinematics::LambdaMechanism::FromDescription(machine)), node_s_(node_s) {
  plan_.machine_id = machine.machine_id;
  plan_.machine_version = machine.version;
}

void HandMadePlan::From(double x_W_mm, double y_W_mm) { p_W_mm_ = {x_W_mm, y_W_mm}; }

void HandMadePlan::LineTo(double x_W_mm, double y_W_mm, double speed_mm_per_s) {
  const Eigen::Vector2d from = p_W_mm_;
  const Eigen::Vector2d to(x_W_mm, y_W_mm);
  const double length_mm = (to - from).norm();
  const Eigen::Vector2d u = (to - from) / length_mm;
  Stroke(
      [from, u](double s) {
        return PathState{from + s * u, u, Eigen::Vector2d::Zero()};
      },
      length_mm, speed_mm_per_s);
  p_W_mm_ = to;
}

void HandMadePlan::CircleAround(double x_W_mm, double y_W_mm, double speed_mm_per_s) {
  const Eigen::Vector2d centre(x_W_mm, y_W_mm);
  const Eigen::Vector2d arm = p_W_mm_ - centre;
  const double r = arm.norm();
  const double start = std::atan2(arm.y(), arm.x());
  Stroke(
      [=](double s) {
        const double phi = start + s / r;
        const Eigen::Vector2d n(std::cos(phi), std::sin(phi));
        return PathState{centre + r * n, Eigen::Vector2d(-n.y(), n.x()), -n / r};
      },
      2.0 * std::numbers::pi * r, speed_mm_per_s);
}

void HandMadePlan::Gate(GateKind kind, double argument, InputCondition condition) {
  Expects(!plan_.segments.empty(), "a gate stands at a segment's end");
  const auto id = static_cast<std::uint32_t>(plan_.gates.size()) + 1;
  plan_.gates.push_back({.id = id,
                         .kind = kind,
                         .s_mm = s_mm_,
                         .argument = argument,
                         .source_line = 0,
                         .condition = condition});
  plan_.segments.back().gate_at_end = id;
}

void HandMadePlan::Event(ProcessAction action, double argument) { EventAt(action, s_mm_, argument); }

void HandMadePlan::EventAt(ProcessAction action, double s_mm, double argument) {
  const auto index = static_cast<std::uint32_t>(plan_.events.size());
  plan_.events.push_back(
      {.index = index, .action = action, .s_mm = s_mm, .argument = argument, .source_line = 0});
}

Plan HandMadePlan::Finish(std::uint64_t id) {
  plan_.id = id;
  plan_.duration_s = tau_s_;
  plan_.length_mm = s_mm_;
  return std::move(plan_);
}

void HandMadePlan::Stroke(const Curve& curve, double length_mm, double speed_mm_per_s) {
  const double acceleration = 0.9 * machine_.path.acceleration_mm_per_s2;
  double speed = speed_mm_per_s;
  double ramp_s = 1.5 * speed / acceleration;
  if (speed * ramp_s > length_mm) {  // no room to reach the speed
    speed = std::sqrt(length_mm * acceleration / 1.5);
    ramp_s = 1.5 * speed / acceleration;
  }
  const double total_s = length_mm / speed + ramp_s;
  for (const auto& [from, to] :
       {std::pair{0.0, ramp_s}, std::pair{ramp_s, total_s - ramp_s}, std::pair{total_s - ramp_s, total_s}}) {
    const int nodes = std::max(1, static_cast<int>(std::ceil((to - from) / node_s_)));
    if (to - from < 1e-9) {
      continue;
    }
    for (int i = 0; i < nodes; ++i) {
      AddNode(curve, from + (to - from) * i / nodes, from + (to - from) * (i + 1) / nodes, ramp_s, total_s,
              speed);
    }
  }
  s_mm_ += length_mm;
  tau_s_ += total_s;
}

void HandMadePlan::AddNode(const Curve& curve, double start_s, double end_s, double ramp_s, double total_s,
                           double speed) {
  const PlanarPose X_EW = machine_.X_EW();
  const Eigen::Matrix2d R_EW = X_EW.rotation();
  std::array<kinematics::Motion, 2> ends;
  std::array<Eigen::Vector3d, 2> way;
  for (std::size_t i = 0; i < 2; ++i) {
    const Along along = Profile(i == 0 ? start_s : end_s, ramp_s, total_s, speed);
    const PathState path = curve(along.s);
    kinematics::Motion tool;
    tool.position_mm = machine_.X_DJ().translation_mm() - X_EW * path.p;
    tool.velocity_mm_per_s = -R_EW * path.first * along.v;
    tool.acceleration_mm_per_s2 = -R_EW * (path.second * along.v * along.v + path.first * along.a);
    const kinematics::MotionAnswer answer = kinematics::SolveInverseMotion(mechanism_, tool);
    Expects(answer.differentiable, "a hand-made plan stays inside the working zone");
    ends[i] = answer.motion;
    way[i] = {s_mm_ + along.s, along.v, along.a};
  }
  Segment segment;
  segment.index = static_cast<std::uint32_t>(plan_.segments.size());
  segment.start_s = tau_s_ + start_s;
  segment.duration_s = end_s - start_s;
  for (int a = 0; a < kActuatorCount; ++a) {
    const auto at = [&](std::size_t i) {
      return Eigen::Vector3d(ends[i].position_mm[a], ends[i].velocity_mm_per_s[a],
                             ends[i].acceleration_mm_per_s2[a]);
    };
    segment.q_mm[static_cast<std::size_t>(a)] = Quintic(at(0), at(1), segment.duration_s);
  }
  segment.s_mm = Quintic(way[0], way[1], segment.duration_s);
  plan_.segments.push_back(segment);
}

}  // namespace lambdajet::tests
