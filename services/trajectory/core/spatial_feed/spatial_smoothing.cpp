#include "trajectory/core/spatial_feed/spatial_smoothing.hpp"

#include "trajectory/core/feed/sample_spline.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond QuaternionOf(const SpatialSample& r) { return {r[3], r[4], r[5], r[6]}; }

// With Q = |Q| q: omega = 2 Vec(Q' Q*) / |Q|^2, and its two derivatives.
void Turning(const SplinePoint<SpatialSample>& k, SpatialKnot& knot) {
  const Quaterniond Q = QuaternionOf(k.r), Q1 = QuaternionOf(k.first), Q2 = QuaternionOf(k.second),
                    Q3 = QuaternionOf(k.third);
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
  return SmoothSamples<3>(filter, samples);
}

SpatialKnot EvaluateKnot(const std::vector<SpatialSample>& control, std::size_t index, double knot_s) {
  const SplinePoint<SpatialSample> k = SplineAt(control, index, knot_s);
  SpatialKnot knot;
  knot.tool.p_mm = k.r.head<3>();
  knot.tool.twist.v_mm_per_s = k.first.head<3>();
  knot.tool.rate.a_mm_per_s2 = k.second.head<3>();
  knot.jerk_mm_per_s3 = k.third.head<3>();
  knot.s_mm = k.r[7], knot.path_speed_mm_per_s = k.first[7], knot.path_acceleration_mm_per_s2 = k.second[7];
  Turning(k, knot);
  return knot;
}

}  // namespace lambdajet::trajectory
