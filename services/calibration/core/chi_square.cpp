#include "calibration/core/chi_square.hpp"

#include <cmath>

namespace lambdajet::calibration {
namespace {

constexpr int kMaxSteps = 100000;
constexpr double kEpsilon = 1e-15;

double LowerBySeries(double a, double x) {
  double term = 1.0 / a;
  double sum = term;
  for (int n = 1; n < kMaxSteps && std::abs(term) > kEpsilon * std::abs(sum); ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return sum * std::exp(a * std::log(x) - x - std::lgamma(a));
}

double UpperByFraction(double a, double x) {
  constexpr double kTiny = 1e-300;
  double b = x + 1.0 - a;
  double c = 1.0 / kTiny;
  double d = 1.0 / b;
  double h = d;
  for (int i = 1; i < kMaxSteps; ++i) {
    const double an = -i * (i - a);
    b += 2.0;
    d = an * d + b;
    d = 1.0 / (std::abs(d) < kTiny ? kTiny : d);
    c = b + an / c;
    c = std::abs(c) < kTiny ? kTiny : c;
    h *= d * c;
    if (std::abs(d * c - 1.0) < kEpsilon) {
      break;
    }
  }
  return h * std::exp(a * std::log(x) - x - std::lgamma(a));
}

}  // namespace

double ChiSquareUpperTail(double chi_square, double degrees_of_freedom) {
  const double a = 0.5 * degrees_of_freedom;
  const double x = 0.5 * chi_square;
  if (!(x > 0.0) || !(a > 0.0)) {
    return 1.0;
  }
  return x < a + 1.0 ? 1.0 - LowerBySeries(a, x) : UpperByFraction(a, x);
}

}  // namespace lambdajet::calibration
