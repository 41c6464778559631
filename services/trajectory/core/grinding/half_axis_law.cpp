#include "trajectory/core/grinding/half_axis_law.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kDegree = 5;

// De Boor's algorithm in the span [knots[span], knots[span + 1]].
double DeBoor(const std::vector<double>& knots, const std::vector<double>& control, std::size_t degree,
              std::size_t span, double x) {
  std::array<double, kDegree + 1> d{};
  for (std::size_t j = 0; j <= degree; ++j) {
    d[j] = control[j + span - degree];
  }
  for (std::size_t r = 1; r <= degree; ++r) {
    for (std::size_t j = degree; j >= r; --j) {
      const double low = knots[j + span - degree], high = knots[j + 1 + span - r];
      const double part = (x - low) / (high - low);
      d[j] = (1.0 - part) * d[j - 1] + part * d[j];
    }
  }
  return d[degree];
}

// The span that holds x; the first or last one for what lies outside, which is extrapolated.
std::size_t SpanOf(const std::vector<double>& knots, std::size_t degree, double x) {
  const auto last = knots.end() - static_cast<std::ptrdiff_t>(degree) - 1;
  const auto above = std::upper_bound(knots.begin() + static_cast<std::ptrdiff_t>(degree) + 1, last, x);
  return static_cast<std::size_t>(above - knots.begin()) - 1;
}

std::vector<double> AveragedKnots(const std::vector<double>& x, std::size_t degree) {
  std::vector<double> knots(degree + 1, x.front());
  for (std::size_t j = 1; j + degree < x.size(); ++j) {
    double sum = 0.0;
    for (std::size_t k = j; k < j + degree; ++k) {
      sum += x[k];
    }
    knots.push_back(sum / static_cast<double>(degree));
  }
  knots.insert(knots.end(), degree + 1, x.back());
  return knots;
}

std::vector<double> Interpolate(const std::vector<double>& knots, std::size_t degree,
                                const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<Eigen::Index>(x.size());
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(n, n);
  std::vector<double> unit(x.size(), 0.0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t span = SpanOf(knots, degree, x[i]);
    for (std::size_t k = span - degree; k <= span; ++k) {
      unit[k] = 1.0;
      basis(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          DeBoor(knots, unit, degree, span, x[i]);
      unit[k] = 0.0;
    }
  }
  const Eigen::VectorXd control = basis.partialPivLu().solve(Eigen::Map<const Eigen::VectorXd>(y.data(), n));
  return {control.data(), control.data() + n};
}

// Control points of the derivative, on the same knots without the outermost pair.
std::vector<double> Derived(const std::vector<double>& knots, std::size_t order, std::size_t degree,
                            const std::vector<double>& control) {
  std::vector<double> derived;
  for (std::size_t i = 0; i + 1 < control.size(); ++i) {
    const double width = knots[i + degree + 1 + order] - knots[i + 1 + order];
    derived.push_back(static_cast<double>(degree) * (control[i + 1] - control[i]) / width);
  }
  return derived;
}

}  // namespace

std::optional<HalfAxisLaw> HalfAxisLaw::MakeTable(const std::vector<double>& angle_rad,
                                                  const std::vector<double>& half_axis_mm) {
  bool sound = angle_rad.size() == half_axis_mm.size() && angle_rad.size() >= kFewestRows &&
               angle_rad.size() <= kMostRows;
  for (std::size_t i = 0; sound && i < angle_rad.size(); ++i) {
    sound = std::isfinite(angle_rad[i]) && std::isfinite(half_axis_mm[i]) &&
            (i == 0 || angle_rad[i] > angle_rad[i - 1]);
  }
  if (!sound) {
    return std::nullopt;
  }
  HalfAxisLaw law;
  law.kind_ = Kind::kTable;
  law.degree_ = std::min(kDegree, angle_rad.size() - 1);
  law.knots_rad_ = AveragedKnots(angle_rad, law.degree_);
  law.control_[0] = Interpolate(law.knots_rad_, law.degree_, angle_rad, half_axis_mm);
  for (std::size_t k = 1; k < 4 && k <= law.degree_; ++k) {
    law.control_[k] = Derived(law.knots_rad_, k - 1, law.degree_ - k + 1, law.control_[k - 1]);
  }
  return law;
}

HalfAxisLaw HalfAxisLaw::MakePolynomial(double zone_rad, std::vector<double> coefficients_mm) {
  HalfAxisLaw law;
  law.zone_rad_ = zone_rad;
  law.coefficients_mm_ = std::move(coefficients_mm);
  return law;
}

HalfAxisLaw HalfAxisLaw::MakePower(double zone_rad, double from_mm, double to_mm, double exponent) {
  HalfAxisLaw law;
  law.kind_ = Kind::kPower;
  law.zone_rad_ = zone_rad;
  law.coefficients_mm_ = {from_mm - to_mm};
  law.to_mm_ = to_mm;
  law.exponent_ = exponent;
  return law;
}

std::array<double, 4> HalfAxisLaw::SplineAt(double angle_rad) const {
  std::array<double, 4> at{};
  const std::size_t span = SpanOf(knots_rad_, degree_, angle_rad);
  for (std::size_t k = 0; k < 4 && k <= degree_; ++k) {
    // The derivative's own knots lack k at each end; the same span lies k lower there.
    const std::vector<double> knots(knots_rad_.begin() + static_cast<std::ptrdiff_t>(k),
                                    knots_rad_.end() - static_cast<std::ptrdiff_t>(k));
    at[k] = DeBoor(knots, control_[k], degree_ - k, span - k, angle_rad);
  }
  return at;
}

std::array<double, 4> HalfAxisLaw::At(double angle_rad) const {
  if (kind_ == Kind::kTable) {
    return SplineAt(angle_rad);
  }
  const double u = angle_rad / zone_rad_;
  std::array<double, 4> at{};
  if (kind_ == Kind::kPower) {
    const double left = std::max(0.0, 1.0 - u);
    double factor = coefficients_mm_[0];
    for (std::size_t k = 0; k < 4; ++k) {
      const double power = exponent_ - static_cast<double>(k);
      at[k] = (k == 0 ? to_mm_ : 0.0) + (factor == 0.0 ? 0.0 : factor * std::pow(left, power));
      factor *= -power / zone_rad_;
    }
    return at;
  }
  for (std::size_t i = coefficients_mm_.size(); i-- > 0;) {
    for (std::size_t k = 3; k > 0; --k) {
      at[k] = at[k] * u + static_cast<double>(k) * at[k - 1];
    }
    at[0] = at[0] * u + coefficients_mm_[i];
  }
  double scale = 1.0;
  for (std::size_t k = 1; k < 4; ++k) {
    scale *= zone_rad_;
    at[k] /= scale;
  }
  return at;
}

}  // namespace lambdajet::trajectory
