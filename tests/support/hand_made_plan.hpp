// Builds plans from lines, circles and gates for tests of the modules, without a planner.
//
// Model: each stroke starts and ends at rest; its speed rises and falls by 3u^2 - 2u^3 and is constant between. Node by
// node (10 ms) the actuators' position, velocity and acceleration come from the kinematics core, and a quintic joins them.
// No compensation: e = 0. Frames: W. Units: mm, s. Threads: one.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

#include "foundation/machine/machine_description.hpp"
#include "foundation/motion/plan.hpp"
#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::tests {

class HandMadePlan {
 public:
  explicit HandMadePlan(const MachineDescription& machine, double node_s = 0.01);

  void From(double x_W_mm, double y_W_mm);
  void LineTo(double x_W_mm, double y_W_mm, double speed_mm_per_s);
  // Once round, counter-clockwise, from where the path stands.
  void CircleAround(double x_W_mm, double y_W_mm, double speed_mm_per_s);
  void Gate(GateKind kind, double argument, InputCondition condition = {});
  void Event(ProcessAction action, double argument = 0.0);
  void EventAt(ProcessAction action, double s_mm, double argument = 0.0);  // in path order
  double s_mm() const { return s_mm_; }
  double tau_s() const { return tau_s_; }
  Plan Finish(std::uint64_t id);

 private:
  struct PathState {
    Eigen::Vector2d p, first, second;  // to path length
  };
  using Curve = std::function<PathState(double)>;
  void Stroke(const Curve& curve, double length_mm, double speed_mm_per_s);
  void AddNode(const Curve& curve, double start_s, double end_s, double ramp_s, double total_s, double speed);

  MachineDescription machine_;
  kinematics::LambdaMechanism mechanism_;
  double node_s_;
  Plan plan_;
  Eigen::Vector2d p_W_mm_ = Eigen::Vector2d::Zero();
  double s_mm_ = 0.0;
  double tau_s_ = 0.0;
};

}  // namespace lambdajet::tests
