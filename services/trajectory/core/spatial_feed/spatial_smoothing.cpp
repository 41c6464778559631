#include "trajectory/core/spatial_feed/spatial_smoothing.hpp"

#include <algorithm>

namespace lambdajet::trajectory {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kStanding2_mm2 = 1e-18;  // of way over two samples

// Running mean over an odd number of samples; ends are held; the sum is taken anew now and then.
void MovingAverage(const std::vector<SpatialSample>& in, int width, std::vector<SpatialSample>& out) {
  constexpr std::size_t kFresh = 256;
  const auto n = static_cast<std::ptrdiff_t>(in.size());
  const std::ptrdiff_t half = width / 2;
  const auto at = [&](std::ptrdiff_t i) -> const SpatialSample& {
    return in[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, n - 1))];
  };
  out.resize(in.size());
  SpatialSample sum = SpatialSample::Zero();
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    if (static_cast<std::size_t>(i) % kFresh == 0) {
      sum.setZero();
      for (std::ptrdiff_t j = i - half; j <= i + half; ++j) {
        sum += at(j);
      }
    } else {
      sum += at(i + half) - at(i - half - 1);
    }
    out[static_cast<std::size_t>(i)] = sum / width;
  }
}

// Half the variance times the normal acceleration, averaged itself; what stands stays where it is.
void CorrectOutwards(const std::vector<SpatialSample>& in, double half_variance_samples, int width,
                     std::vector<SpatialSample>& out) {
  std::vector<SpatialSample> averaged;
  const auto along_at = [&](std::size_t i) -> Vector3d { return (in[i + 1] - in[i - 1]).head<3>(); };
  out.assign(in.size(), SpatialSample::Zero());
  for (std::size_t i = 1; i + 1 < in.size(); ++i) {
    const Vector3d along = along_at(i);
    if (along.squaredNorm() >= kStanding2_mm2) {
      const Vector3d bend = (in[i + 1] - 2.0 * in[i] + in[i - 1]).head<3>();
      out[i].head<3>() = -half_variance_samples * (bend - along * (along.dot(bend) / along.squaredNorm()));
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

Quaterniond QuaternionOf(const SpatialSample& r) { return {r[3], r[4], r[5], r[6]}; }

// With Q = |Q| q: omega = 2 Vec(Q' Q*) / |Q|^2, and its two derivatives.
void Turning(const SpatialSample& value, const SpatialSample& first, const SpatialSample& second,
             const SpatialSample& third, SpatialKnot& knot) {
  const Quaterniond Q = QuaternionOf(value), Q1 = QuaternionOf(first), Q2 = QuaternionOf(second),
                    Q3 = QuaternionOf(third);
  const double n = Q.squaredNorm(), n1 = 2.0 * Q.dot(Q1), n2 = 2.0 * (Q1.squaredNorm() + Q.dot(Q2));
  const Vector3d b1 = 2.0 * (Q1 * Q.conjugate()).vec();
  const Vector3d b2 = 2.0 * (Q2 * Q.conjugate()).vec();
  const Vector3d b3 = 2.0 * ((Q3 * Q.conjugate()).vec() + (Q2 * Q1.conjugate()).vec());
  const Vector3d w = b1 / n, alpha = (b2 - w * n1) / n;
  knot.tool.q = Q.normalized();
  knot.tool.twist.w_rad_per_s = w;
  knot.tool.rate.alpha_rad_per_s2 = alpha;
  knot.turn_jerk_rad_per_s3 = (b3 - 2.0 * alpha * n1 - w * n2) / n;
}

}  // namespace

std::vector<SpatialSample> Smooth(const SmoothingFilter& filter, const std::vector<SpatialSample>& samples) {
  std::vector<SpatialSample> a, b;
  CorrectOutwards(samples, 0.5 * filter.variance_s2() / (filter.knot_s * filter.knot_s),
                  filter.correction_width, a);
  MovingAverage(a, filter.first_width, b);
  MovingAverage(b, filter.second_width, a);
  return a;
}

SpatialKnot EvaluateKnot(const std::vector<SpatialSample>& control, std::size_t index, double h) {
  const SpatialSample& c = control[index];
  // Differences about the middle keep what is at rest exactly at rest.
  const SpatialSample da = control[index - 2] - c, db = control[index - 1] - c, dd = control[index + 1] - c,
                      de = control[index + 2] - c;
  const SpatialSample value = c + (da + 26.0 * db + 26.0 * dd + de) / 120.0;
  const SpatialSample first = (de - da + 10.0 * (dd - db)) / (24.0 * h);
  const SpatialSample second = (da + 2.0 * db + 2.0 * dd + de) / (6.0 * h * h);
  const SpatialSample third = (de - da - 2.0 * (dd - db)) / (2.0 * h * h * h);
  SpatialKnot knot;
  knot.tool.p_mm = value.head<3>();
  knot.tool.twist.v_mm_per_s = first.head<3>();
  knot.tool.rate.a_mm_per_s2 = second.head<3>();
  knot.jerk_mm_per_s3 = third.head<3>();
  knot.s_mm = value[7], knot.path_speed_mm_per_s = first[7], knot.path_acceleration_mm_per_s2 = second[7];
  Turning(value, first, second, third, knot);
  return knot;
}

}  // namespace lambdajet::trajectory
