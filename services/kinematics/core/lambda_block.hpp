// Solves a block of poses several at a time and says which of them are solved beyond doubt.
//
// A step computes positions and asks, without a branch, whether the poses are clear of every limit. Clearing
// is sufficient, never necessary: gradients are replaced by upper bounds, so no cleared pose would be refused
// by the single solve; a pose that is not cleared is to be solved again alone, which names its reason. Model:
// core/lambda_kernel.hpp and lambda_differential.hpp. This header is compiled once an instruction set
// (lambda_block_2.cpp, _4, _8), so it includes nothing that other files share as code. Shapes: pairs
// interleaved; `count` is a multiple of the number of lanes. Threads: pure. Cost: no allocation.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kinematics/core/lambda_kernel.hpp"
#include "kinematics/core/lambda_lanes.hpp"

namespace lambdajet::kinematics::lambda {

// A mechanism as a block needs it.
struct BlockMechanism {
  Geometry<double> geometry;
  double attach_mm;
  int s1, s2, assembly_mode;
  bool rails_apart;
  bool one_straight_rail;
  double singular_margin_mm;
  double q1_min_mm, q1_max_mm, q2_min_mm, q2_max_mm;
};

// True if every pose is clear; `clear` holds a mask a pose either way.
using BlockSolve = bool (*)(const BlockMechanism&, const double* in, std::size_t count, double* out,
                            std::int64_t* clear);

struct BlockSolvers {
  std::size_t lanes;
  BlockSolve inverse;
  BlockSolve forward;
};
BlockSolvers TwoLaneSolvers();
BlockSolvers FourLaneSolvers();   // needs AVX2 and FMA
BlockSolvers EightLaneSolvers();  // needs AVX-512 F, DQ, VL

namespace block {

inline constexpr double kLargestMm = 1e9;

template <class S>
Rail<S> Widen(const Rail<double>& r) {
  return {r.cosine, r.sine, r.offset_mm, r.zero_mm};
}

inline double Magnitude(double a) { return a < 0.0 ? -a : a; }
inline double Square(double a) { return a * a; }

// What a step needs, spread over all lanes once a block.
template <int N>
struct Step {
  using S = Lanes<N>;
  Geometry<S> g;
  int s1, s2, assembly;
  bool rails_apart;
  S margin_mm;  // the singular margin, wider by rounding
  S coincidence_mm;
  S skew;                           // |u_1 . n_2|
  S shortest_2_mm2, longest_2_mm2;  // of the sliders' distance, squared
  S q1_min_mm, q1_max_mm, q2_min_mm, q2_max_mm;

  explicit Step(const BlockMechanism& m)
      : g{m.geometry.main_mm, m.geometry.second_mm, m.geometry.ratio, Widen<S>(m.geometry.rail_1),
          Widen<S>(m.geometry.rail_2)},
        s1(m.s1),
        s2(m.s2),
        assembly(m.assembly_mode),
        rails_apart(m.rails_apart),
        margin_mm(m.singular_margin_mm + 1e-7 * m.geometry.main_mm),
        coincidence_mm(1e-6 * m.geometry.main_mm),
        skew(Magnitude(m.geometry.rail_1.sine * m.geometry.rail_2.cosine -
                       m.geometry.rail_1.cosine * m.geometry.rail_2.sine)),
        shortest_2_mm2(Square(Magnitude(m.attach_mm - m.geometry.second_mm) + 1e-6 * m.geometry.main_mm)),
        longest_2_mm2(Square(m.attach_mm + m.geometry.second_mm - 1e-6 * m.geometry.main_mm)),
        q1_min_mm(m.q1_min_mm),
        q1_max_mm(m.q1_max_mm),
        q2_min_mm(m.q2_min_mm),
        q2_max_mm(m.q2_max_mm) {}
};

// A closed pose, as the clearing test needs it; c and d are the links' lengths along their rails, both
// positive.
template <class S>
struct Pose {
  Point<S> tool, slider_1, slider_2;
  S across_1_mm, across_2_mm, c_mm, d_mm;
};

template <class S>
auto Finite(S a, S b) {
  return (Abs(a) <= S(kLargestMm)) & (Abs(b) <= S(kLargestMm));
}

template <int N>
LaneMask<N> WithinTravel(const Step<N>& t, Lanes<N> q1, Lanes<N> q2) {
  return (q1 >= t.q1_min_mm) & (q1 <= t.q1_max_mm) & (q2 >= t.q2_min_mm) & (q2 <= t.q2_max_mm);
}

template <int N>
LaneMask<N> ClearOnStraightRail(const Step<N>& t, const Pose<Lanes<N>>& p) {
  const auto dx = p.slider_2.x - p.slider_1.x;
  const auto dy = p.slider_2.y - p.slider_1.y;
  const auto forward = dx * t.g.rail_1.cosine + dy * t.g.rail_1.sine;
  return (t.g.main_mm - Abs(p.across_1_mm) > t.margin_mm) &
         (t.g.second_mm - Abs(p.across_2_mm) > t.g.ratio * t.margin_mm) &
         (Lanes<N>(t.assembly) * p.across_1_mm > t.margin_mm) & (Abs(forward) > t.coincidence_mm);
}

// On the way to the second link's type 1 line |grad a_2| <= l + (1 - l) skew main/c, and within the margin m of a tool whose
// main link is e short of its line c is no less than c (e - m)/e. For type 2, f being the tool's distance from the line of
// the sliders, D from slider 1 to 2 and e its direction,
//     grad f = (e.r)/|D| [(e x u_1) p_1 - (e x u_2) p_2] + e_perp - (e x u_1) p_1,
// bounded term by term with |p_1| <= main/c and |p_2| <= second/d (l + (1 - l) main/c). Both sides are multiplied by c d, and
// |D| is replaced by bounds, so that neither root nor division is needed.
template <int N>
LaneMask<N> ClearOnAnyRails(const Step<N>& t, const Pose<Lanes<N>>& p) {
  const auto& rail_1 = t.g.rail_1;
  const auto& rail_2 = t.g.rail_2;
  const auto rest = Lanes<N>(1.0) - t.g.ratio;
  const auto link_1 = t.g.main_mm - Abs(p.across_1_mm);
  const auto link_2 = t.g.second_mm - Abs(p.across_2_mm);
  const auto serial =
      (link_1 > t.margin_mm) & ((link_2 - t.margin_mm * t.g.ratio) * p.c_mm * (link_1 - t.margin_mm) >
                                t.margin_mm * rest * t.skew * t.g.main_mm * link_1);
  const auto dx = p.slider_2.x - p.slider_1.x;
  const auto dy = p.slider_2.y - p.slider_1.y;
  const auto rx = p.tool.x - p.slider_1.x;
  const auto ry = p.tool.y - p.slider_1.y;
  const auto forward = dx * rail_1.cosine + dy * rail_1.sine;
  const auto off_1 = Abs(dx * rail_1.sine - dy * rail_1.cosine);
  const auto off_2 = Abs(dx * rail_2.sine - dy * rail_2.cosine);
  const auto least = Select(Abs(forward) > off_1, Abs(forward), off_1);
  const auto most = Abs(forward) + off_1;
  const auto cd = p.c_mm * p.d_mm;
  const auto tilt_1 = off_1 * t.g.main_mm * p.d_mm;                                       // times |D| c d
  const auto tilt_2 = off_2 * t.g.second_mm * (t.g.ratio * p.c_mm + rest * t.g.main_mm);  // likewise
  const auto lever = Abs(dx * rx + dy * ry);                                              // times |D|^2
  const auto least_2 = least * least;
  const auto moment = SideOf(forward, t.assembly, t.rails_apart) * (dx * ry - dy * rx);  // f |D|
  return serial &
         (moment * cd * least_2 * least >
          t.margin_mm * most * (cd * least_2 * least + tilt_1 * least_2 + lever * (tilt_1 + tilt_2))) &
         (least > t.coincidence_mm);
}

template <bool kStraight, int N>
LaneMask<N> ClearOfSingularities(const Step<N>& t, const Pose<Lanes<N>>& p) {
  if constexpr (kStraight) {
    return ClearOnStraightRail(t, p);
  } else {
    return ClearOnAnyRails(t, p);
  }
}

template <bool kStraight, int N>
LaneMask<N> InverseStep(const Step<N>& t, const Pairs<N>& tool, Pairs<N>& readings) {
  using S = Lanes<N>;
  const auto k = CloseInverse<S>(t.g, {tool.first, tool.second}, t.s1, t.s2);
  const auto q = ReadingsOf(t.g, k);
  readings = {q.q1_mm, q.q2_mm};
  const Pose<S> pose{k.tool,
                     OnRail(t.g.rail_1, k.position_1_mm),
                     OnRail(t.g.rail_2, k.position_2_mm),
                     k.across_1_mm,
                     k.across_2_mm,
                     k.root_1_mm,
                     k.root_2_mm};
  const auto closed = (k.radicand_1_mm2 > S(0.0)) & (k.radicand_2_mm2 > S(0.0));
  return Finite(tool.first, tool.second) & closed & ClearOfSingularities<kStraight>(t, pose) &
         WithinTravel(t, q.q1_mm, q.q2_mm);
}

template <bool kStraight, int N>
LaneMask<N> ForwardStep(const Step<N>& t, const Pairs<N>& readings, Pairs<N>& tool) {
  using S = Lanes<N>;
  const auto a = Assemble<S>(t.g, {readings.first, readings.second}, t.assembly, t.rails_apart);
  tool = {a.tool.x, a.tool.y};
  const auto& rail_1 = t.g.rail_1;
  const auto& rail_2 = t.g.rail_2;
  const S c = S(t.s1) * ((a.tool.x - a.slider_1.x) * rail_1.cosine + (a.tool.y - a.slider_1.y) * rail_1.sine);
  const S d = S(t.s2) * ((a.slider_2.x - a.attachment.x) * rail_2.cosine +
                         (a.slider_2.y - a.attachment.y) * rail_2.sine);
  const Pose<S> pose{a.tool, a.slider_1, a.slider_2, Across(rail_1, a.tool), Across(rail_2, a.attachment),
                     c,      d};
  const auto closed = (c > S(0.0)) & (d > S(0.0)) & (a.distance_2_mm2 > t.shortest_2_mm2) &
                      (a.distance_2_mm2 < t.longest_2_mm2);
  return Finite(readings.first, readings.second) & closed & ClearOfSingularities<kStraight>(t, pose) &
         WithinTravel(t, readings.first, readings.second);
}

template <int N, class OneStep>
bool ForEachStep(const BlockMechanism& m, const double* in, std::size_t count, double* out,
                 std::int64_t* clear, OneStep one_step) {
  const Step<N> step(m);
  LaneMask<N> all{typename LaneMask<N>::Bits{} - 1};
  for (std::size_t i = 0; i < count; i += N) {
    Pairs<N> solved;
    const LaneMask<N> mask = one_step(step, LoadPairs<N>(in + 2 * i), solved);
    StorePairs(solved, out + 2 * i);
    std::memcpy(clear + i, &mask.bits, sizeof(mask.bits));
    all = all & mask;
  }
  return all.AllSet();
}

template <int N>
bool Inverse(const BlockMechanism& m, const double* in, std::size_t count, double* out, std::int64_t* clear) {
  return m.one_straight_rail ? ForEachStep<N>(m, in, count, out, clear, InverseStep<true, N>)
                             : ForEachStep<N>(m, in, count, out, clear, InverseStep<false, N>);
}

template <int N>
bool Forward(const BlockMechanism& m, const double* in, std::size_t count, double* out, std::int64_t* clear) {
  return m.one_straight_rail ? ForEachStep<N>(m, in, count, out, clear, ForwardStep<true, N>)
                             : ForEachStep<N>(m, in, count, out, clear, ForwardStep<false, N>);
}

}  // namespace block
}  // namespace lambdajet::kinematics::lambda
