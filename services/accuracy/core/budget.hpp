// Adds up the error budget of the open-base machine from its three sources, as the source paper does.
//
// Model: seed paper 000, (1) delta = sqrt(Db^2 + Dm^2 + Dn^2); (2) corrected: the skews act over a lever,
//     Db = sqrt(dx1^2 + dx2^2 + dy1^2 + dy2^2 + (R_a sin alpha)^2 + (R_b sin beta)^2).
// The printed (2) adds sin^2 of the angles, pure numbers, to mm^2. R_a is the distance of the cut from the
// turning point of the drive module, R_b from that of the sheet on its rollers. Units: mm, rad. Validity: any
// finite numbers. Threads: pure.
#pragma once

#include <array>
#include <cmath>

namespace lambdajet::accuracy {

struct SetUpShares {
  std::array<double, 4> shift_mm{};  // dx1, dx2, dy1, dy2
  double alpha_rad = 0.0;            // turn of the drive module
  double beta_rad = 0.0;             // turn of the sheet
  double radius_a_mm = 0.0;
  double radius_b_mm = 0.0;
};

// Equation (2), corrected.
inline double SetUpError(const SetUpShares& shares) {
  double square = 0.0;
  for (const double shift : shares.shift_mm) {
    square += shift * shift;
  }
  const double skew_a = shares.radius_a_mm * std::sin(shares.alpha_rad);
  const double skew_b = shares.radius_b_mm * std::sin(shares.beta_rad);
  return std::sqrt(square + skew_a * skew_a + skew_b * skew_b);
}

// Equation (1).
inline double TotalError(double base_mm, double drive_mm, double jet_mm) {
  return std::sqrt(base_mm * base_mm + drive_mm * drive_mm + jet_mm * jet_mm);
}

}  // namespace lambdajet::accuracy
