#include "trajectory/core/part_program/cldata_verification.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "trajectory/core/part_program/cldata_verification_walks.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kPi = std::numbers::pi;

// A wheel's program: the tool lies along X rather than standing, and its points go round X by more than a turn.
bool TurnsWorkpiece(const std::vector<Operation>& operations) {
  double turned = 0.0, last = 0.0;
  std::size_t lying = 0, moves = 0;
  for (const Operation& o : operations) {
    if (Moves(o)) {
      const double angle = std::atan2(-o.y_W_mm, o.z_W_mm);
      turned += moves == 0 ? 0.0 : std::remainder(angle - last, 2.0 * kPi);
      last = angle;
      ++moves;
      lying += std::abs(std::sin(o.b_rad)) > 1e-6 ? 1 : 0;
    }
  }
  return moves > 8 && lying * 2 > moves && turned > kPi / 2;
}

}  // namespace

ProgramVerification VerifyProgram(const std::vector<Operation>& operations, VerifyArgument argument) {
  ProgramVerification result;
  const bool turn = argument == VerifyArgument::kTurn ||
                    (argument == VerifyArgument::kByContent && TurnsWorkpiece(operations));
  result.over = turn ? VerifyArgument::kTurn : VerifyArgument::kPathLength;
  if (turn) {
    WalkTurn(operations, result);
  } else {
    WalkPath(operations, result);
  }
  std::stable_sort(result.breaks.begin(), result.breaks.end(),
                   [](const ProgramBreak& a, const ProgramBreak& b) { return a.argument < b.argument; });
  return result;
}

}  // namespace lambdajet::trajectory
