// The plainest time-optimal timing of a path that is surely right: intervals of acceleration at every place, bisection for
// the largest speed that can still be followed by the rest, then the largest step; on as fine a grid as one likes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

#include "trajectory/core/feed/speed_profile.hpp"

namespace lambdajet::trajectory {

template <std::size_t N>
struct TimedPath {  // q_j = sum of sines of s; its first two derivatives are what timing needs
  double length_mm = 0.0;
  double speed_mm_per_s = 0.0;
  double acceleration_mm_per_s2 = 0.0;
  double curvature = 0.0;
  std::array<std::array<double, 9>, N> waves{};  // three of amplitude, wave number, phase
  ActuatorBoundsOf<N> bounds;

  static TimedPath Random(std::mt19937_64& random, double length_mm) {
    const auto draw = [&](double a, double b) { return std::uniform_real_distribution<>(a, b)(random); };
    TimedPath path;
    path.length_mm = length_mm;
    path.speed_mm_per_s = draw(100, 500);
    path.acceleration_mm_per_s2 = draw(800, 3000);
    path.curvature = draw(0.0, 0.02);
    for (std::size_t j = 0; j < N; ++j) {
      for (std::size_t m = 0; m < 3; ++m) {
        const double wave = draw(0.02, 0.06);
        path.waves[j][3 * m] = draw(0.2, 0.8) / wave;
        path.waves[j][3 * m + 1] = wave;
        path.waves[j][3 * m + 2] = draw(0.0, 2.0 * std::numbers::pi);
      }
      path.bounds.velocity_mm_per_s[j] = draw(150, 500);
      path.bounds.acceleration_mm_per_s2[j] = draw(500, 3000);
    }
    return path;
  }

  ProfileNodeOf<N> At(double s_mm) const {
    ProfileNodeOf<N> node;
    node.offset_mm = s_mm;
    node.speed_cap_mm_per_s = speed_mm_per_s;
    node.acceleration_mm_per_s2 = acceleration_mm_per_s2;
    node.curvature = curvature;
    for (std::size_t j = 0; j < N; ++j) {
      for (std::size_t m = 0; m < 3; ++m) {
        const double c = waves[j][3 * m], w = waves[j][3 * m + 1], phase = waves[j][3 * m + 2];
        node.A[j] += c * w * std::cos(w * s_mm + phase);
        node.B[j] -= c * w * w * std::sin(w * s_mm + phase);
      }
    }
    return node;
  }

  std::vector<ProfileNodeOf<N>> Nodes(std::size_t cells) const {
    std::vector<ProfileNodeOf<N>> nodes;
    for (std::size_t i = 0; i <= cells; ++i) {
      nodes.push_back(At(length_mm * static_cast<double>(i) / static_cast<double>(cells)));
    }
    return nodes;
  }
};

struct AccelerationInterval {
  double from = 0.0, to = 0.0;
};

// All u that the bounds allow at speed squared x.
template <std::size_t N>
AccelerationInterval Allowed(const ProfileNodeOf<N>& node, const ActuatorBoundsOf<N>& bounds, double x) {
  const double normal = node.curvature * x;
  const double room = node.acceleration_mm_per_s2 * node.acceleration_mm_per_s2 - normal * normal;
  if (x > node.speed_cap_mm_per_s * node.speed_cap_mm_per_s || room < 0.0) {
    return {1.0, -1.0};
  }
  AccelerationInterval u{-std::sqrt(room), std::sqrt(room)};
  for (std::size_t j = 0; j < N; ++j) {
    if (std::abs(node.A[j]) * std::sqrt(x) > bounds.velocity_mm_per_s[j]) {
      return {1.0, -1.0};
    }
    const double one = (-bounds.acceleration_mm_per_s2[j] - node.B[j] * x) / node.A[j];
    const double other = (bounds.acceleration_mm_per_s2[j] - node.B[j] * x) / node.A[j];
    u.from = std::max(u.from, std::min(one, other));
    u.to = std::min(u.to, std::max(one, other));
  }
  return u;
}

template <std::size_t N>
double ReferenceDuration(const std::vector<ProfileNodeOf<N>>& nodes, const ActuatorBoundsOf<N>& bounds) {
  std::vector<double> x(nodes.size(), 0.0);
  for (std::size_t i = nodes.size() - 1; i-- > 0;) {
    const double twice_cell = 2.0 * (nodes[i + 1].offset_mm - nodes[i].offset_mm);
    double good = 0.0, bad = nodes[i].speed_cap_mm_per_s * nodes[i].speed_cap_mm_per_s * 1.01;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (good + bad);
      const AccelerationInterval u = Allowed(nodes[i], bounds, middle);
      (u.from <= u.to && middle + twice_cell * u.from <= x[i + 1] ? good : bad) = middle;
    }
    x[i] = good;
  }
  x[0] = 0.0;
  double time = 0.0;
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    const double cell = nodes[i + 1].offset_mm - nodes[i].offset_mm;
    x[i + 1] = std::min(x[i + 1], x[i] + 2.0 * cell * Allowed(nodes[i], bounds, x[i]).to);
    time += 2.0 * cell / (std::sqrt(x[i]) + std::sqrt(x[i + 1]));
  }
  return time;
}

}  // namespace lambdajet::trajectory
