#include <algorithm>
#include <array>
#include <cmath>

#include "foundation/contract/expects.hpp"
#include "kinematics/core/lambda_mechanism.hpp"

// The batch runs in blocks. A first loop computes positions and asks, without a branch so that it vectorises,
// whether the pose is solved beyond doubt; poses it cannot clear are solved again one by one, which names
// their reason. Clearing is sufficient, never necessary: gradients are replaced by upper bounds, so no
// cleared pose can be refused by the single solve.

namespace lambdajet::kinematics {
namespace {

using lambda::Geometry;
using lambda::Point;

constexpr std::size_t kBlock = 256;
constexpr double kLargestMm = 1e9;

struct Block {
  std::array<double, kBlock> first;
  std::array<double, kBlock> second;
  std::array<double, kBlock> clear;  // 1 where the pose is solved beyond doubt, else 0
};

// On one straight rail the distances to the singular lines are plain coordinates.
bool OneStraightRail(const LambdaMechanism& m) {
  const auto& a = m.geometry.rail_1;
  const auto& b = m.geometry.rail_2;
  return a.cosine == b.cosine && a.sine == b.sine && a.offset_mm == b.offset_mm;
}

struct Bounds {
  double margin_mm;  // the singular margin, wider by rounding
  double coincidence_mm;
  double skew;  // |u_1 . n_2|
  double q1_min_mm, q1_max_mm, q2_min_mm, q2_max_mm;
  bool rails_apart;
};

Bounds BoundsOf(const LambdaMechanism& m) {
  const Geometry<double>& g = m.geometry;
  const double skew = std::abs(g.rail_1.sine * g.rail_2.cosine - g.rail_1.cosine * g.rail_2.sine);
  return {m.singular_margin_mm + 1e-7 * g.main_mm,
          1e-6 * g.main_mm,
          skew,
          m.travel[0].min_mm,
          m.travel[0].max_mm,
          m.travel[1].min_mm,
          m.travel[1].max_mm,
          m.rails_apart};
}

bool WithinTravel(const Bounds& b, double q1, double q2) {
  return (q1 >= b.q1_min_mm) & (q1 <= b.q1_max_mm) & (q2 >= b.q2_min_mm) & (q2 <= b.q2_max_mm);
}

// A closed pose, as the clearing test needs it; c and d are the links' lengths along their rails, both
// positive.
struct Pose {
  Point<double> tool, slider_1, slider_2;
  double across_1_mm, across_2_mm, c_mm, d_mm;
};

template <bool kStraight>
inline bool ClearOfSingularities(const Geometry<double>& g, const Bounds& b, double assembly, const Pose& p) {
  const double link_1 = g.main_mm - std::abs(p.across_1_mm);
  const double link_2 = g.second_mm - std::abs(p.across_2_mm);
  const double dx = p.slider_2.x - p.slider_1.x;
  const double dy = p.slider_2.y - p.slider_1.y;
  const auto& rail_1 = g.rail_1;
  const double forward = dx * rail_1.cosine + dy * rail_1.sine;
  if constexpr (kStraight) {
    return (link_1 > b.margin_mm) & (link_2 > g.ratio * b.margin_mm) &
           (assembly * p.across_1_mm > b.margin_mm) & (std::abs(forward) > b.coincidence_mm);
  }
  // |grad a_2| <= l + (1 - l) skew |g_1| with |g_1| = main/c.
  const bool serial =
      (link_1 > b.margin_mm) &
      (link_2 * p.c_mm > b.margin_mm * (g.ratio * p.c_mm + (1.0 - g.ratio) * b.skew * g.main_mm));
  // grad f = (e.r)/|D| [(e x u_1) p_1 - (e x u_2) p_2] + e_perp - (e x u_1) p_1, bounded term by term.
  const auto& rail_2 = g.rail_2;
  const double rx = p.tool.x - p.slider_1.x;
  const double ry = p.tool.y - p.slider_1.y;
  const double distance = std::sqrt(dx * dx + dy * dy);
  const double inverse = 1.0 / distance;
  const double slope_1 = g.main_mm / p.c_mm;
  const double slope_2 = g.second_mm / p.d_mm * (g.ratio + (1.0 - g.ratio) * slope_1);
  const double tilt_1 = std::abs(dx * rail_1.sine - dy * rail_1.cosine) * inverse * slope_1;
  const double tilt_2 = std::abs(dx * rail_2.sine - dy * rail_2.cosine) * inverse * slope_2;
  const double lever = std::abs(dx * rx + dy * ry) * inverse * inverse;
  const double orientation = (!b.rails_apart) & (forward < 0.0) ? -assembly : assembly;
  const double side = orientation * (dx * ry - dy * rx) * inverse;
  return serial & (side > b.margin_mm * (1.0 + tilt_1 + lever * (tilt_1 + tilt_2))) &
         (distance > b.coincidence_mm);
}

template <bool kStraight>
void InverseBlock(const LambdaMechanism& mechanism, const double* xy, std::size_t n, Block& block) {
  const Geometry<double> g = mechanism.geometry;
  const Bounds b = BoundsOf(mechanism);
  const double s1 = mechanism.working_mode.s1;
  const double s2 = mechanism.working_mode.s2;
  const double assembly = mechanism.assembly_mode;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = xy[2 * i];
    const double y = xy[2 * i + 1];
    const auto k = lambda::CloseInverse<double>(g, {x, y}, s1, s2);
    const auto q = lambda::ReadingsOf(g, k);
    const Pose pose{k.tool,
                    lambda::OnRail(g.rail_1, k.position_1_mm),
                    lambda::OnRail(g.rail_2, k.position_2_mm),
                    k.across_1_mm,
                    k.across_2_mm,
                    k.root_1_mm,
                    k.root_2_mm};
    const bool clear = (std::abs(x) <= kLargestMm) & (std::abs(y) <= kLargestMm) & (k.root_1_mm > 0.0) &
                       (k.root_2_mm > 0.0) & ClearOfSingularities<kStraight>(g, b, assembly, pose) &
                       WithinTravel(b, q.q1_mm, q.q2_mm);
    block.first[i] = q.q1_mm;
    block.second[i] = q.q2_mm;
    block.clear[i] = clear ? 1.0 : 0.0;
  }
}

template <bool kStraight>
void ForwardBlock(const LambdaMechanism& mechanism, const double* q1q2, std::size_t n, Block& block) {
  const Geometry<double> g = mechanism.geometry;
  const Bounds b = BoundsOf(mechanism);
  const double s1 = mechanism.working_mode.s1;
  const double s2 = mechanism.working_mode.s2;
  const double assembly = mechanism.assembly_mode;
  const double shortest = std::abs(g.ratio * g.main_mm - g.second_mm) + b.coincidence_mm;
  const double longest = g.ratio * g.main_mm + g.second_mm - b.coincidence_mm;
  for (std::size_t i = 0; i < n; ++i) {
    const lambda::Readings<double> q{q1q2[2 * i], q1q2[2 * i + 1]};
    const auto a = lambda::Assemble(g, q, assembly, b.rails_apart);
    const double c =
        s1 * ((a.tool.x - a.slider_1.x) * g.rail_1.cosine + (a.tool.y - a.slider_1.y) * g.rail_1.sine);
    const double d = s2 * ((a.slider_2.x - a.attachment.x) * g.rail_2.cosine +
                           (a.slider_2.y - a.attachment.y) * g.rail_2.sine);
    const Pose pose{a.tool,
                    a.slider_1,
                    a.slider_2,
                    lambda::Across(g.rail_1, a.tool),
                    lambda::Across(g.rail_2, a.attachment),
                    c,
                    d};
    const bool clear = (std::abs(q.q1_mm) <= kLargestMm) & (std::abs(q.q2_mm) <= kLargestMm) & (c > 0.0) &
                       (d > 0.0) & (a.distance_mm > shortest) & (a.distance_mm < longest) &
                       ClearOfSingularities<kStraight>(g, b, assembly, pose) &
                       WithinTravel(b, q.q1_mm, q.q2_mm);
    block.first[i] = a.tool.x;
    block.second[i] = a.tool.y;
    block.clear[i] = clear ? 1.0 : 0.0;
  }
}

Eigen::Vector2d Positions(const InverseAnswer& answer) { return answer.actuator_position_mm; }
Eigen::Vector2d Positions(const ForwardAnswer& answer) { return answer.p_DE_mm; }

template <class BlockSolve, class SingleSolve>
void InBlocks(std::span<const double> in, std::span<double> out, std::span<Reason> reasons,
              BlockSolve solve_block, SingleSolve solve_single) {
  Expects(in.size() == 2 * reasons.size() && out.size() == in.size(),
          "a batch has two numbers in, two out and one reason a pose");
  Block block;
  for (std::size_t start = 0; start < reasons.size(); start += kBlock) {
    const std::size_t n = std::min(kBlock, reasons.size() - start);
    solve_block(in.data() + 2 * start, n, block);
    double* positions = out.data() + 2 * start;
    double cleared = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      positions[2 * i] = block.first[i];
      positions[2 * i + 1] = block.second[i];
      cleared += block.clear[i];
    }
    std::fill_n(reasons.data() + start, n, Reason::kSolved);
    if (cleared == static_cast<double>(n)) {
      continue;
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (block.clear[i] == 0.0) {
        const auto answer = solve_single(Eigen::Vector2d(in[2 * (start + i)], in[2 * (start + i) + 1]));
        positions[2 * i] = Positions(answer).x();
        positions[2 * i + 1] = Positions(answer).y();
        reasons[start + i] = answer.reason;
      }
    }
  }
}

}  // namespace

void SolveInverseBatch(const LambdaMechanism& m, std::span<const double> p_DE_mm,
                       std::span<double> actuator_position_mm, std::span<Reason> reasons) {
  const bool straight = m.valid && OneStraightRail(m);
  InBlocks(
      p_DE_mm, actuator_position_mm, reasons,
      [&](const double* xy, std::size_t n, Block& block) {
        straight ? InverseBlock<true>(m, xy, n, block) : InverseBlock<false>(m, xy, n, block);
        if (!m.valid) block.clear.fill(0.0);
      },
      [&](const Eigen::Vector2d& p) { return SolveInverse(m, p); });
}

void SolveForwardBatch(const LambdaMechanism& m, std::span<const double> actuator_position_mm,
                       std::span<double> p_DE_mm, std::span<Reason> reasons) {
  const bool straight = m.valid && OneStraightRail(m);
  InBlocks(
      actuator_position_mm, p_DE_mm, reasons,
      [&](const double* q, std::size_t n, Block& block) {
        straight ? ForwardBlock<true>(m, q, n, block) : ForwardBlock<false>(m, q, n, block);
        if (!m.valid) block.clear.fill(0.0);
      },
      [&](const Eigen::Vector2d& q) { return SolveForward(m, q); });
}

}  // namespace lambdajet::kinematics
