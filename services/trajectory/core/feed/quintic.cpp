#include "trajectory/core/feed/quintic.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;

constexpr int kChecks = 16;

double Fourth(const Polynomial& p, double t) { return 120 * p.c[5] * t + 24 * p.c[4]; }

}  // namespace

Polynomial QuinticBetween(const QuinticEnd& a, const QuinticEnd& b, double T) {
  const double h = b.value - a.value - a.first_per_s * T - 0.5 * a.second_per_s2 * T * T;
  const double g = (b.first_per_s - a.first_per_s - a.second_per_s2 * T) * T;
  const double m = (b.second_per_s2 - a.second_per_s2) * T * T;
  const double T3 = T * T * T;
  return {{a.value, a.first_per_s, 0.5 * a.second_per_s2, (10 * h - 4 * g + 0.5 * m) / T3,
           (-15 * h + 7 * g - m) / (T3 * T), (6 * h - 3 * g + 0.5 * m) / (T3 * T * T)}};
}

DerivativePeaks PeaksOf(const Polynomial& p, double T) {
  DerivativePeaks peaks;
  const double h = T / kChecks;
  for (int k = 0; k <= kChecks; ++k) {
    peaks.first_per_s = std::max(peaks.first_per_s, std::abs(p.first(h * k)));
    peaks.second_per_s2 = std::max(peaks.second_per_s2, std::abs(p.second(h * k)));
  }
  peaks.third_per_s3 = std::max(std::abs(p.third(0.0)), std::abs(p.third(T)));
  const double turn = p.c[5] == 0.0 ? -1.0 : -p.c[4] / (5.0 * p.c[5]);
  peaks.third_per_s3 =
      turn > 0.0 && turn < T ? std::max(peaks.third_per_s3, std::abs(p.third(turn))) : peaks.third_per_s3;
  peaks.first_per_s += h * h / 8 * peaks.third_per_s3;
  peaks.second_per_s2 += h * h / 8 * std::max(std::abs(Fourth(p, 0.0)), std::abs(Fourth(p, T)));
  return peaks;
}

DerivativePeaks PeaksOf(const PlanarQuintic& p, double T) {
  DerivativePeaks peaks;
  const double h = T / kChecks;
  for (int k = 0; k <= kChecks; ++k) {
    peaks.second_per_s2 = std::max(peaks.second_per_s2, p.second(h * k).norm());
    peaks.third_per_s3 = std::max(peaks.third_per_s3, p.third(h * k).norm());
  }
  peaks.second_per_s2 += h * h / 8 *
                         std::max(Vector2d(Fourth(p.x, 0.0), Fourth(p.y, 0.0)).norm(),
                                  Vector2d(Fourth(p.x, T), Fourth(p.y, T)).norm());
  peaks.third_per_s3 += h * h / 8 * 120 * Vector2d(p.x.c[5], p.y.c[5]).norm();
  return peaks;
}

}  // namespace lambdajet::trajectory
