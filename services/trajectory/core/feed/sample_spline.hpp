// Averages samples of a motion and reads them as a spline, whatever a sample holds.
//
// Model: the averages, the outward correction and the quintic B-spline of feed/smoothing.hpp. The first kPlace entries of a
// sample are its place; the correction moves only them. Units: mm, s. Shapes: samples one a knot. Threads: pure.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "trajectory/core/feed/smoothing.hpp"

namespace lambdajet::trajectory {

inline constexpr double kStanding2_mm2 = 1e-18;  // of way over two samples

// Samples either side of the middle one that count in full in an average over `width`.
inline std::ptrdiff_t WholeHalf(double width) { return static_cast<std::ptrdiff_t>(0.5 * (width - 1.0)); }

// Running mean over `width` samples about each, of which the two outermost count by the width's fraction; ends are held. The
// sum is taken anew now and then, so that rounding does not add up over a long program.
template <class Sample>
void MovingAverage(const std::vector<Sample>& in, double width, std::vector<Sample>& out) {
  constexpr std::size_t kFresh = 256;
  const auto n = static_cast<std::ptrdiff_t>(in.size());
  const std::ptrdiff_t half = WholeHalf(width);
  const double edge = 0.5 * (width - 1.0) - static_cast<double>(half);
  const auto at = [&](std::ptrdiff_t i) -> const Sample& {
    return in[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, n - 1))];
  };
  out.resize(in.size());
  Sample sum = Sample::Zero();
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    if (static_cast<std::size_t>(i) % kFresh == 0) {
      sum.setZero();
      for (std::ptrdiff_t j = i - half; j <= i + half; ++j) {
        sum += at(j);
      }
    } else {
      sum += at(i + half) - at(i - half - 1);
    }
    out[static_cast<std::size_t>(i)] = (sum + edge * (at(i - half - 1) + at(i + half + 1))) / width;
  }
}

// Outward correction by half the variance times the normal acceleration, averaged over `width` samples: where curvature
// jumps, the sharp correction's own jerk would be larger than that of the path. What stands stays where it is.
template <int kPlace, class Sample>
void CorrectOutwards(const std::vector<Sample>& in, double half_variance_samples, double width,
                     std::vector<Sample>& out) {
  using Place = Eigen::Matrix<double, kPlace, 1>;
  const auto along_at = [&](std::size_t i) -> Place {
    return (in[i + 1] - in[i - 1]).template head<kPlace>();
  };
  std::vector<Sample> averaged;
  out.assign(in.size(), Sample::Zero());
  for (std::size_t i = 1; i + 1 < in.size(); ++i) {
    const Place along = along_at(i);
    const double along2 = along.squaredNorm();
    if (along2 >= kStanding2_mm2) {
      const Place bend = (in[i + 1] - 2.0 * in[i] + in[i - 1]).template head<kPlace>();
      out[i].template head<kPlace>() = -half_variance_samples * (bend - along * (along.dot(bend) / along2));
    }
  }
  MovingAverage(out, width, averaged);
  out = in;
  for (std::size_t i = 1; i + 1 < in.size(); ++i) {
    if (along_at(i).squaredNorm() >= kStanding2_mm2) {
      out[i] += averaged[i];
    }
  }
}

// The control points of the smoothed motion; same count as `samples`.
template <int kPlace, class Sample>
std::vector<Sample> SmoothSamples(const SmoothingFilter& filter, const std::vector<Sample>& samples) {
  std::vector<Sample> a, b;
  CorrectOutwards<kPlace>(samples, 0.5 * filter.variance_s2() / (filter.knot_s * filter.knot_s),
                          filter.correction_s / filter.knot_s, a);
  MovingAverage(a, filter.first_s / filter.knot_s, b);
  MovingAverage(b, filter.second_s / filter.knot_s, a);
  if (filter.third_s <= filter.knot_s) {
    return a;
  }
  MovingAverage(a, filter.third_s / filter.knot_s, b);
  return b;
}

// Value and derivatives at a control point.
template <class Sample>
struct SplinePoint {
  Sample r = Sample::Zero();
  Sample first = Sample::Zero();
  Sample second = Sample::Zero();
  Sample third = Sample::Zero();
  Sample fourth = Sample::Zero();
};

// Needs two neighbours either side of `index`.
template <class Sample>
SplinePoint<Sample> SplineAt(const std::vector<Sample>& control, std::size_t index, double h) {
  const Sample& c = control[index];
  // Differences about the middle keep what is at rest exactly at rest.
  const Sample da = control[index - 2] - c, db = control[index - 1] - c, dd = control[index + 1] - c,
               de = control[index + 2] - c;
  SplinePoint<Sample> k;
  k.r = c + (da + 26.0 * db + 26.0 * dd + de) / 120.0;
  k.first = (de - da + 10.0 * (dd - db)) / (24.0 * h);
  k.second = (da + 2.0 * db + 2.0 * dd + de) / (6.0 * h * h);
  k.third = (de - da - 2.0 * (dd - db)) / (2.0 * h * h * h);
  k.fourth = (da - 4.0 * db - 4.0 * dd + de) / (h * h * h * h);
  return k;
}

}  // namespace lambdajet::trajectory
