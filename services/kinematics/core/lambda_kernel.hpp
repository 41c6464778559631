// Writes the closure equations of the lambda mechanism once, for doubles, complex steps and automatic
// derivatives alike.
//
// Model: seed paper 000, (57)-(61) as corrected: the paper's (59) lacks the second link's length. Slider i
// stands at
//     b_i = (0, offset_i) + (q_i + zero_i) u_i,   u_i = (cos angle_i, sin angle_i),  n_i = u_i turned by +90
//     degrees,
// the main link joins slider 1 to the tool T, |T - b_1| = main; the second link joins slider 2 to P = b_1 + l
// (T - b_1), l = attach/main, |P - b_2| = second. Attach = main is the biglide. With a_i the distance across
// rail i,
//     inverse: c = sqrt(main^2 - a_1^2), p_1 = u_1.(T - o_1) - s1 c;  d = sqrt(second^2 - a_2^2), p_2 =
//     u_2.(P - o_2) + s2 d forward: P from the triangle (b_1, b_2, P) on the side the assembly mode names, T
//     = b_1 + (P - b_1)/l.
// Frames: everything in D. Units: mm, rad. s1, s2: the working mode of foundation/machine.
// Assembly mode: on a common rail the sign of the tool's distance from rail 1, in D's sense (the sign of y);
// on rails set apart the side of the line from slider 1 to slider 2 (+1: left). Which of the two a mechanism
// uses is fixed by RailsApart(). Shapes: the scalar S is double, std::complex<double>, a Ceres Jet or
// lambda_lanes.hpp's pair of doubles; branches are taken on the real part only. Validity: roots of negative
// numbers are taken as 0; the caller asks `radicand` first. Cost: inverse two roots and no division; no
// allocation.
#pragma once

#include <cmath>
#include <complex>
#include <concepts>

namespace lambdajet::kinematics::lambda {

inline double ValueOf(double s) { return s; }
inline double ValueOf(const std::complex<double>& s) { return s.real(); }
template <class S>
requires requires(const S& s) {
  { s.a } -> std::convertible_to<double>;
}
double ValueOf(const S& s) { return ValueOf(s.a); }

template <class S>
S RootOrZero(const S& radicand) {
  using std::sqrt;
  return ValueOf(radicand) > 0.0 ? sqrt(radicand) : S(0.0);
}

template <class S>
struct Point {
  S x;
  S y;
};

template <class S>
struct Rail {
  S cosine;
  S sine;
  S offset_mm;
  S zero_mm;
};

template <class S>
struct Geometry {
  S main_mm;
  S second_mm;
  S ratio;  // l = attach / main
  Rail<S> rail_1;
  Rail<S> rail_2;
};

// The nine mechanism parameters, in the order of foundation's parameter vector.
template <class S>
Geometry<S> MakeGeometry(const S* parameters) {
  using std::cos;
  using std::sin;
  const S* p = parameters;
  return {p[0], p[2], p[1] / p[0], {cos(p[3]), sin(p[3]), p[4], p[7]}, {cos(p[5]), sin(p[5]), p[6], p[8]}};
}

// Rails whose offsets differ by more than a tenth of the main link are set apart; otherwise they are one rail
// with errors.
inline bool RailsApart(double main_mm, double offset_1_mm, double offset_2_mm) {
  return std::abs(offset_2_mm - offset_1_mm) > 0.1 * main_mm;
}

template <class S>
S Along(const Rail<S>& rail, const Point<S>& p) {
  return p.x * rail.cosine + (p.y - rail.offset_mm) * rail.sine;
}

template <class S>
S Across(const Rail<S>& rail, const Point<S>& p) {
  return (p.y - rail.offset_mm) * rail.cosine - p.x * rail.sine;
}

template <class S>
Point<S> OnRail(const Rail<S>& rail, const S& position) {
  return {position * rail.cosine, rail.offset_mm + position * rail.sine};
}

// A closed mechanism: the pose with everything its derivatives need.
template <class S>
struct Closure {
  Point<S> tool;
  Point<S> attachment;
  S position_1_mm;  // along rail 1, encoder reading plus zero
  S position_2_mm;
  S across_1_mm;
  S across_2_mm;
  S radicand_1_mm2;  // main^2 - across_1^2; below 0 the tool is out of slider 1's reach
  S radicand_2_mm2;
  S root_1_mm;  // c
  S root_2_mm;  // d
};

template <class S>
Closure<S> CloseInverse(const Geometry<S>& g, const Point<S>& tool, double s1, double s2) {
  Closure<S> k;
  k.tool = tool;
  k.across_1_mm = Across(g.rail_1, tool);
  k.radicand_1_mm2 = (g.main_mm - k.across_1_mm) * (g.main_mm + k.across_1_mm);
  k.root_1_mm = RootOrZero(k.radicand_1_mm2);
  const S along_link = s1 * k.root_1_mm;
  k.position_1_mm = Along(g.rail_1, tool) - along_link;
  const S rest = 1.0 - g.ratio;  // P = T - (1 - l)(T - b_1), T - b_1 = s1 c u_1 + a_1 n_1
  k.attachment = {tool.x - rest * (along_link * g.rail_1.cosine - k.across_1_mm * g.rail_1.sine),
                  tool.y - rest * (along_link * g.rail_1.sine + k.across_1_mm * g.rail_1.cosine)};
  k.across_2_mm = Across(g.rail_2, k.attachment);
  k.radicand_2_mm2 = (g.second_mm - k.across_2_mm) * (g.second_mm + k.across_2_mm);
  k.root_2_mm = RootOrZero(k.radicand_2_mm2);
  k.position_2_mm = Along(g.rail_2, k.attachment) + s2 * k.root_2_mm;
  return k;
}

template <class S>
struct Readings {
  S q1_mm;
  S q2_mm;
};

template <class S>
Readings<S> ReadingsOf(const Geometry<S>& g, const Closure<S>& k) {
  return {k.position_1_mm - g.rail_1.zero_mm, k.position_2_mm - g.rail_2.zero_mm};
}

// +1 or -1: on which side of the line from slider 1 to slider 2 the assembly mode puts the tool. On a common
// rail the line is read in the rail's sense, whichever slider comes first.
template <class S>
double SideOf(const S& forward_mm, double assembly_mode, bool rails_apart) {
  return !rails_apart && ValueOf(forward_mm) < 0.0 ? -assembly_mode : assembly_mode;
}

// The triangle slider 1, slider 2, attachment.
template <class S>
struct Assembly {
  Point<S> tool;
  Point<S> attachment;
  Point<S> slider_1;
  Point<S> slider_2;
  S distance_2_mm2;  // |b_2 - b_1|^2
  S height_2;        // (height / distance)^2; below 0 the triangle cannot be closed
};

// P = b_1 + k (b_2 - b_1) + h (b_2 - b_1 turned by +90 degrees): shares of the sliders' distance, so one root and one division
// do.
template <class S>
Assembly<S> Assemble(const Geometry<S>& g, const Readings<S>& q, double assembly_mode, bool rails_apart) {
  Assembly<S> a;
  a.slider_1 = OnRail(g.rail_1, S(q.q1_mm + g.rail_1.zero_mm));
  a.slider_2 = OnRail(g.rail_2, S(q.q2_mm + g.rail_2.zero_mm));
  const S dx = a.slider_2.x - a.slider_1.x;
  const S dy = a.slider_2.y - a.slider_1.y;
  a.distance_2_mm2 = dx * dx + dy * dy;
  const S inverse = 1.0 / a.distance_2_mm2;
  const S attach = g.ratio * g.main_mm;
  const S k = 0.5 + 0.5 * (attach - g.second_mm) * (attach + g.second_mm) * inverse;
  a.height_2 = attach * attach * inverse - k * k;
  const S h = SideOf(S(dx * g.rail_1.cosine + dy * g.rail_1.sine), assembly_mode, rails_apart) *
              RootOrZero(a.height_2);
  const S ax = k * dx - h * dy;
  const S ay = k * dy + h * dx;
  a.attachment = {a.slider_1.x + ax, a.slider_1.y + ay};
  const S stretch = 1.0 / g.ratio;
  a.tool = {a.slider_1.x + ax * stretch, a.slider_1.y + ay * stretch};
  return a;
}

}  // namespace lambdajet::kinematics::lambda
