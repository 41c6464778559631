#include "accuracy/core/jet_stack.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "accuracy/core/counter_random.hpp"

namespace lambdajet::accuracy {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

struct Radii {
  double a, b, e;
};

Radii RadiiOf(const JetStack& stack) {
  return {stack.nozzle_tilt_rad * stack.nozzle_to_exit_mm, stack.tube_tilt_rad * stack.tube_length_mm,
          stack.radial_offset_mm};
}

double DeviationAt(const Radii& r, double azimuth_1_rad, double azimuth_2_rad) {
  return std::abs(r.a + std::polar(r.b, azimuth_1_rad) + std::polar(r.e, azimuth_2_rad));
}

double Triangular(const BoreRadius& bore, double u) {
  const double width = bore.max_mm - bore.min_mm;
  const double rise = bore.mode_mm - bore.min_mm;
  if (width <= 0.0) {
    return bore.mode_mm;
  }
  return u < rise / width ? bore.min_mm + std::sqrt(u * width * rise)
                          : bore.max_mm - std::sqrt((1.0 - u) * width * (bore.max_mm - bore.mode_mm));
}

}  // namespace

Spread AxisDeviation(const JetStack& stack) {
  const Radii r = RadiiOf(stack);
  constexpr int kAzimuths = 256;
  double sum = 0.0;
  for (int i = 0; i < kAzimuths; ++i) {
    for (int j = 0; j < kAzimuths; ++j) {
      sum += DeviationAt(r, kTurn * i / kAzimuths, kTurn * j / kAzimuths);
    }
  }
  const double longest = std::max({r.a, r.b, r.e});
  const double rest = r.a + r.b + r.e - longest;
  return {sum / (kAzimuths * kAzimuths), std::sqrt(r.a * r.a + r.b * r.b + r.e * r.e),
          std::max(0.0, longest - rest), longest + rest};
}

Spread EdgeDeviation(const JetStack& stack, const BoreRadius& bore, std::uint64_t seed, int draws) {
  const Radii r = RadiiOf(stack);
  const CounterStream random(seed, 0);
  Spread spread{0.0, 0.0, INFINITY, 0.0};
  for (int i = 0; i < draws; ++i) {
    const auto n = static_cast<std::uint64_t>(3 * i);
    const double axis = DeviationAt(r, kTurn * random.Uniform(n), kTurn * random.Uniform(n + 1));
    const double edge = axis + Triangular(bore, random.Uniform(n + 2));
    spread.mean_mm += edge / draws;
    spread.rms_mm += edge * edge / draws;
    spread.min_mm = std::min(spread.min_mm, edge);
    spread.max_mm = std::max(spread.max_mm, edge);
  }
  spread.rms_mm = std::sqrt(spread.rms_mm);
  return draws > 0 ? spread : Spread{};
}

}  // namespace lambdajet::accuracy
