// Says how long one half-axis of a groove's ellipse is at each angle along the die.
//
// Model: a table is interpolated by a spline of degree five (lower with fewer rows) through every row, so that three
// derivatives are continuous and the wheel's acceleration has no break inside the zone; a formula is a polynomial in
// u = angle / zone, or to + (from - to)(1 - u)^n, the usual run-out of a pilger die.
// Units: rad, mm. Threads: values. Cost: a table about 0.1 us. Errors: MakeTable answers nothing if its rows are too few,
// not finite or not in rising order.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace lambdajet::trajectory {

class HalfAxisLaw {
 public:
  static constexpr std::size_t kFewestRows = 2;
  static constexpr std::size_t kMostRows = 500;

  static std::optional<HalfAxisLaw> MakeTable(const std::vector<double>& angle_rad,
                                              const std::vector<double>& half_axis_mm);
  // Coefficients of 1, u, u^2, …
  static HalfAxisLaw MakePolynomial(double zone_rad, std::vector<double> coefficients_mm);
  // Exponent 1 or from 3 up: between, a third derivative is infinite at the zone's end.
  static HalfAxisLaw MakePower(double zone_rad, double from_mm, double to_mm, double exponent);

  // Length and its first three derivatives by the angle.
  std::array<double, 4> At(double angle_rad) const;

 private:
  enum class Kind : std::uint8_t { kTable, kPolynomial, kPower };

  std::array<double, 4> SplineAt(double angle_rad) const;

  Kind kind_ = Kind::kPolynomial;
  double zone_rad_ = 1.0;
  std::vector<double> coefficients_mm_;
  double to_mm_ = 0.0, exponent_ = 1.0;
  std::size_t degree_ = 0;
  std::vector<double> knots_rad_;
  std::array<std::vector<double>, 4> control_;  // of the spline and of its derivatives
};

}  // namespace lambdajet::trajectory
