#include <algorithm>
#include <array>

#include "foundation/contract/expects.hpp"
#include "kinematics/core/lambda_block.hpp"
#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr std::size_t kBlock = 256;

// The widest instruction set that this processor has; asked once a batch, which costs a few nanoseconds.
lambda::BlockSolvers WidestSolvers() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl")) {
    return lambda::EightLaneSolvers();
  }
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    return lambda::FourLaneSolvers();
  }
#endif
  return lambda::TwoLaneSolvers();
}

// On one straight rail the distances to the singular lines are plain coordinates.
bool OneStraightRail(const LambdaMechanism& m) {
  const auto& a = m.geometry.rail_1;
  const auto& b = m.geometry.rail_2;
  return a.cosine == b.cosine && a.sine == b.sine && a.offset_mm == b.offset_mm;
}

lambda::BlockMechanism ForBlocks(const LambdaMechanism& m) {
  return {m.geometry,         m.geometry.ratio * m.geometry.main_mm,
          m.working_mode.s1,  m.working_mode.s2,
          m.assembly_mode,    m.rails_apart,
          OneStraightRail(m), m.singular_margin_mm,
          m.travel[0].min_mm, m.travel[0].max_mm,
          m.travel[1].min_mm, m.travel[1].max_mm};
}

Eigen::Vector2d Positions(const InverseAnswer& answer) { return answer.actuator_position_mm; }
Eigen::Vector2d Positions(const ForwardAnswer& answer) { return answer.p_DE_mm; }

// The reason of one pose, and its positions as the single solve gives them.
template <class SolveOne>
void Alone(SolveOne solve_one, const double* in, double* out, Reason& reason) {
  const auto answer = solve_one(Eigen::Vector2d(in[0], in[1]));
  out[0] = Positions(answer).x();
  out[1] = Positions(answer).y();
  reason = answer.reason;
}

template <class SolveOne>
void InBlocks(const LambdaMechanism& m, std::span<const double> in, std::span<double> out,
              std::span<Reason> reasons, lambda::BlockSolve solve_block, std::size_t lanes,
              SolveOne solve_one) {
  const lambda::BlockMechanism mechanism = ForBlocks(m);
  std::array<std::int64_t, kBlock> clear;
  std::fill(reasons.begin(), reasons.end(), Reason::kSolved);
  const std::size_t whole = reasons.size() / lanes * lanes;
  for (std::size_t start = 0; start < whole; start += kBlock) {
    const std::size_t n = std::min(kBlock, whole - start);
    if (solve_block(mechanism, in.data() + 2 * start, n, out.data() + 2 * start, clear.data())) {
      continue;
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (clear[i] == 0) {
        Alone(solve_one, &in[2 * (start + i)], &out[2 * (start + i)], reasons[start + i]);
      }
    }
  }
  for (std::size_t i = whole; i < reasons.size(); ++i) {
    Alone(solve_one, &in[2 * i], &out[2 * i], reasons[i]);
  }
}

bool Refused(const LambdaMechanism& m, std::span<const double> in, std::span<double> out,
             std::span<Reason> reasons) {
  Expects(in.size() == 2 * reasons.size() && out.size() == in.size(),
          "a batch has two numbers in, two out and one reason a pose");
  if (!m.valid) {
    std::fill(out.begin(), out.end(), 0.0);
    std::fill(reasons.begin(), reasons.end(), Reason::kBadGeometry);
  }
  return !m.valid;
}

}  // namespace

void SolveInverseBatch(const LambdaMechanism& m, std::span<const double> p_DE_mm,
                       std::span<double> actuator_position_mm, std::span<Reason> reasons) {
  if (Refused(m, p_DE_mm, actuator_position_mm, reasons)) {
    return;
  }
  const lambda::BlockSolvers solvers = WidestSolvers();
  InBlocks(m, p_DE_mm, actuator_position_mm, reasons, solvers.inverse, solvers.lanes,
           [&](const Eigen::Vector2d& p) { return SolveInverse(m, p); });
}

void SolveForwardBatch(const LambdaMechanism& m, std::span<const double> actuator_position_mm,
                       std::span<double> p_DE_mm, std::span<Reason> reasons) {
  if (Refused(m, actuator_position_mm, p_DE_mm, reasons)) {
    return;
  }
  const lambda::BlockSolvers solvers = WidestSolvers();
  InBlocks(m, actuator_position_mm, p_DE_mm, reasons, solvers.forward, solvers.lanes,
           [&](const Eigen::Vector2d& q) { return SolveForward(m, q); });
}

}  // namespace lambdajet::kinematics
