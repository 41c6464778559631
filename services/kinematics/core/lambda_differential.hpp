// Differentiates a closed lambda mechanism: first derivatives to the tool and to the parameters, the
// quadratic part of the accelerations, and the distances to the singular lines.
//
// Model: with the closure of core/lambda_kernel.hpp, r = T - b_1, g_1 = u_1 + s1 (a_1/c) n_1, g_2 = u_2 - s2
// (a_2/d) n_2:
//     dp_1/dT = g_1,  dp_2/dP = g_2,  dP = l dT + (1 - l) u_1 dp_1,  det J = l (g_1 x g_2)
//     d2p_1 = s1 main^2/c^3 (n_1.v)^2,  d2p_2 = g_2.d2P - s2 second^2/d^3 (n_2.P')^2
// which on one rail are seed paper 000, (60), (61) corrected and det J = -l y [s1/c + s2 l/d].
// Distances to the type 1 lines are exact: on parallel rails the lines are straight; with rails at an angle the second
// link's is found by projection (NearestSecondLine). The type 2 distance here is f/|grad f|, exact on one straight rail and
// of first order otherwise; lambda_mechanism.cpp's RefineParallelDistance makes it exact. Frames: D. Units: mm, rad.
// Threads: pure. Cost: no allocation.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "foundation/machine/machine_description.hpp"
#include "kinematics/core/lambda_kernel.hpp"

namespace lambdajet::kinematics::lambda {

struct Differential {
  bool differentiable = false;  // neither link square to its rail
  bool invertible = false;      // and det J not 0
  Eigen::Vector2d g_1 = Eigen::Vector2d::Zero();
  Eigen::Vector2d g_2 = Eigen::Vector2d::Zero();
  Eigen::Matrix2d J_q_x = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d J_x_q = Eigen::Matrix2d::Zero();
  double determinant = 0.0;
  double parallel_determinant_mm2 = 0.0;  // det A of the closure equations
  double smallest_singular_value = 0.0;
  double largest_singular_value = 0.0;
  double main_distance_mm = 0.0;      // tool to the main link's type 1 line
  double second_distance_mm = 0.0;    // tool to the second link's type 1 line
  double side_mm = 0.0;               // tool off the line of the sliders; its sign is the assembly mode
  double parallel_distance_mm = 0.0;  // tool to the type 2 locus, same sign
  Eigen::Vector2d parallel_gradient = Eigen::Vector2d::Zero();  // of side_mm
  double slider_distance_mm = 0.0;
};

inline double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}
inline Eigen::Vector2d Direction(const Rail<double>& rail) { return {rail.cosine, rail.sine}; }
inline Eigen::Vector2d Normal(const Rail<double>& rail) { return {-rail.sine, rail.cosine}; }
inline Eigen::Vector2d VectorOf(const Point<double>& p) { return {p.x, p.y}; }
inline Eigen::Vector2d SliderOn(const Rail<double>& rail, double position_mm) {
  return VectorOf(OnRail(rail, position_mm));
}

// Both singular values of a 2 x 2 matrix without an iteration; their product is |det|.
inline void SetSingularValues(Differential& d) {
  const double e = 0.5 * (d.J_q_x(0, 0) + d.J_q_x(1, 1));
  const double f = 0.5 * (d.J_q_x(0, 0) - d.J_q_x(1, 1));
  const double g = 0.5 * (d.J_q_x(1, 0) + d.J_q_x(0, 1));
  const double h = 0.5 * (d.J_q_x(1, 0) - d.J_q_x(0, 1));
  d.largest_singular_value = std::hypot(e, h) + std::hypot(f, g);
  d.smallest_singular_value =
      d.largest_singular_value > 0.0 ? std::abs(d.determinant) / d.largest_singular_value : 0.0;
}

inline void SetJacobians(const Geometry<double>& g, const Closure<double>& k, WorkingMode mode,
                         Differential& d) {
  const Eigen::Vector2d u_1 = Direction(g.rail_1);
  d.g_1 = u_1 + mode.s1 * (k.across_1_mm / k.root_1_mm) * Normal(g.rail_1);
  d.g_2 = Direction(g.rail_2) - mode.s2 * (k.across_2_mm / k.root_2_mm) * Normal(g.rail_2);
  d.J_q_x.row(0) = d.g_1.transpose();
  d.J_q_x.row(1) = (g.ratio * d.g_2 + (1.0 - g.ratio) * d.g_2.dot(u_1) * d.g_1).transpose();
  d.determinant = g.ratio * Cross(d.g_1, d.g_2);
  SetSingularValues(d);
  // Below the relative rounding of its terms a determinant is 0.
  d.invertible = std::abs(d.determinant) > 1e-13 * g.ratio * d.g_1.norm() * d.g_2.norm();
  if (d.invertible) {
    d.J_x_q << d.J_q_x(1, 1), -d.J_q_x(0, 1), -d.J_q_x(1, 0), d.J_q_x(0, 0);
    d.J_x_q /= d.determinant;
  }
}

// Distance to the line on which the second link is square to its rail, |a_2| = second, in rail 1's axes (x along it, a
// across it): with sin and cos of rail 2's angle against rail 1's, kappa = +-1 the sign of a_2,
//     f(x, a) = second - kappa (cos l a - sin (x - (1 - l) s1 sqrt(main^2 - a^2)) + a_2 of the origin).
// The nearest point is where the way to it is along grad f: repeatedly the tool is put onto the tangent at the point before.
// Nothing is found where the line ends before (the main link is square to its rail there, and nearer): the first step
// stands.
inline double NearestSecondLine(const Geometry<double>& g, const Closure<double>& k, double s1, double sine) {
  constexpr int kSteps = 30;
  const double cosine = g.rail_1.cosine * g.rail_2.cosine + g.rail_1.sine * g.rail_2.sine;
  const double kappa = k.across_2_mm < 0.0 ? -1.0 : 1.0;
  const double rest = (1.0 - g.ratio) * s1;
  const double f_tool = g.second_mm - std::abs(k.across_2_mm);
  double step_x = 0.0, step_a = 0.0;  // from the tool to the point
  double f = f_tool;
  double root = k.root_1_mm;
  double first = 0.0;
  double distance = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double slope_x = kappa * sine;
    const double slope_a = -kappa * (cosine * g.ratio - sine * rest * (k.across_1_mm + step_a) / root);
    const double slope2 = slope_x * slope_x + slope_a * slope_a;
    const double length = (f - slope_x * step_x - slope_a * step_a) / slope2;
    step_x = -length * slope_x;
    step_a = -length * slope_a;
    const double before = distance;
    distance = length * std::sqrt(slope2);
    first = i == 0 ? distance : first;
    if (std::abs(distance - before) <= 1e-12 * g.main_mm) {
      return distance;
    }
    const double a = k.across_1_mm + step_a;
    const double root2 = (g.main_mm - a) * (g.main_mm + a);
    if (!(root2 > 0.0)) {
      return first;
    }
    root = std::sqrt(root2);
    f = f_tool - kappa * (cosine * g.ratio * step_a - sine * (step_x - rest * (root - k.root_1_mm)));
  }
  return first;
}

inline void SetSerialDistances(const Geometry<double>& g, const Closure<double>& k, WorkingMode mode,
                               Differential& d) {
  d.main_distance_mm = g.main_mm - std::abs(k.across_1_mm);
  const double sine = Cross(Direction(g.rail_1), Direction(g.rail_2));
  // Across parallel rails the attachment moves by l of the tool's way.
  d.second_distance_mm = k.root_1_mm > 0.0 && sine != 0.0 ? NearestSecondLine(g, k, mode.s1, sine)
                                                          : (g.second_mm - std::abs(k.across_2_mm)) / g.ratio;
}

inline void SetParallelDistance(const Geometry<double>& g, const Closure<double>& k, bool rails_apart,
                                Differential& d) {
  const Eigen::Vector2d u_1 = Direction(g.rail_1);
  const Eigen::Vector2d u_2 = Direction(g.rail_2);
  const Eigen::Vector2d r = VectorOf(k.tool) - SliderOn(g.rail_1, k.position_1_mm);
  const Eigen::Vector2d sliders = SliderOn(g.rail_2, k.position_2_mm) - SliderOn(g.rail_1, k.position_1_mm);
  const Eigen::Vector2d arm = VectorOf(k.attachment) - SliderOn(g.rail_2, k.position_2_mm);
  d.parallel_determinant_mm2 = 4.0 * g.ratio * Cross(r, arm);
  d.slider_distance_mm = sliders.norm();
  if (!(d.slider_distance_mm > 0.0)) {
    return;
  }
  const double orientation = !rails_apart && sliders.dot(u_1) < 0.0 ? -1.0 : 1.0;
  const double f = Cross(sliders, r) / d.slider_distance_mm;
  d.side_mm = orientation * f;
  d.parallel_distance_mm = d.side_mm;
  if (!d.differentiable) {
    return;
  }
  const Eigen::Vector2d p_1 = d.J_q_x.row(0);
  const Eigen::Vector2d p_2 = d.J_q_x.row(1);
  const Eigen::Vector2d moment = Cross(u_2, r) * p_2 - (Cross(u_1, r) + Cross(sliders, u_1)) * p_1 +
                                 Eigen::Vector2d(-sliders.y(), sliders.x());
  const Eigen::Vector2d stretch = sliders.dot(u_2) * p_2 - sliders.dot(u_1) * p_1;
  d.parallel_gradient = orientation / d.slider_distance_mm * (moment - (f / d.slider_distance_mm) * stretch);
  const double slope = d.parallel_gradient.norm();
  if (slope > 0.0) {
    d.parallel_distance_mm = d.side_mm / slope;
  }
}

inline Differential Differentiate(const Geometry<double>& g, const Closure<double>& k, WorkingMode mode,
                                  bool rails_apart) {
  Differential d;
  d.differentiable = k.radicand_1_mm2 > 0.0 && k.radicand_2_mm2 > 0.0;
  if (d.differentiable) {
    SetJacobians(g, k, mode, d);
  }
  SetSerialDistances(g, k, mode, d);
  SetParallelDistance(g, k, rails_apart, d);
  return d;
}

// The part of the actuators' acceleration that is quadratic in the tool's velocity.
inline Eigen::Vector2d Curvature(const Geometry<double>& g, const Closure<double>& k, const Differential& d,
                                 WorkingMode mode, const Eigen::Vector2d& v) {
  const Eigen::Vector2d u_1 = Direction(g.rail_1);
  const double across_rate_1 = Normal(g.rail_1).dot(v);
  const double c3 = k.root_1_mm * k.root_1_mm * k.root_1_mm;
  const double first = mode.s1 * g.main_mm * g.main_mm / c3 * across_rate_1 * across_rate_1;
  const Eigen::Vector2d attachment_velocity = g.ratio * v + (1.0 - g.ratio) * d.g_1.dot(v) * u_1;
  const double across_rate_2 = Normal(g.rail_2).dot(attachment_velocity);
  const double d3 = k.root_2_mm * k.root_2_mm * k.root_2_mm;
  const double second = (1.0 - g.ratio) * d.g_2.dot(u_1) * first -
                        mode.s2 * g.second_mm * g.second_mm / d3 * across_rate_2 * across_rate_2;
  return {first, second};
}

// dq/dparameters with the tool held; columns in the order of foundation's parameter vector.
inline Eigen::Matrix<double, 2, 9> ToParameters(const Geometry<double>& g, const Closure<double>& k,
                                                const Differential& d, WorkingMode mode) {
  const Eigen::Vector2d u_1 = Direction(g.rail_1);
  const Eigen::Vector2d r = VectorOf(k.tool) - SliderOn(g.rail_1, k.position_1_mm);
  const double rest = 1.0 - g.ratio;
  Eigen::Matrix<double, 2, 9> J = Eigen::Matrix<double, 2, 9>::Zero();
  J(0, 0) = -mode.s1 * g.main_mm / k.root_1_mm;
  J(0, 3) = -mode.s1 * k.across_1_mm * k.position_1_mm / k.root_1_mm;
  J(0, 4) = -d.g_1.y();
  J(0, 7) = -1.0;
  // P = T - (1 - l) r: by l itself, by slider 1 along its rail, and by rail 1 under it.
  J(1, 0) = d.g_2.dot(-g.ratio / g.main_mm * r + rest * J(0, 0) * u_1);
  J(1, 1) = d.g_2.dot(r) / g.main_mm;
  J(1, 2) = mode.s2 * g.second_mm / k.root_2_mm;
  J(1, 3) = rest * d.g_2.dot(J(0, 3) * u_1 + k.position_1_mm * Normal(g.rail_1));
  J(1, 4) = rest * d.g_2.dot(J(0, 4) * u_1 + Eigen::Vector2d::UnitY());
  J(1, 5) = mode.s2 * k.across_2_mm * k.position_2_mm / k.root_2_mm;
  J(1, 6) = -d.g_2.y();
  J(1, 8) = -1.0;
  return J;
}

}  // namespace lambdajet::kinematics::lambda
