// Cuts corners: the front of the cut trails the jet, so arcs come out smaller and corners rounder than the
// jet's path.
//
// Model: first-order lag T f' + f = p of the cut front f behind the jet p. On a circle of radius R at speed v
// the front runs on R/sqrt(1 + (v T/R)^2); in general the cut lies towards the inside by T^2 a_n/2 to second
// order. Through a sharp corner of turning angle phi at constant speed the front leaves the first edge at the
// corner and nears the second as exp(-t/T); it passes the corner point itself at a distance below v T. Units:
// mm, s, rad. Validity: T >= 0, v >= 0, R > 0. Threads: pure.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace lambdajet::accuracy {

// How far inside the jet's circle the cut runs; exact.
inline double ArcLagInsetMm(double radius_mm, double speed_mm_per_s, double lag_time_s) {
  const double ratio = speed_mm_per_s * lag_time_s / radius_mm;
  return radius_mm * (1.0 - 1.0 / std::sqrt(1.0 + ratio * ratio));
}

// Shortest distance of the cut front from a sharp corner that the jet passes at constant speed.
// Front after the corner, with x = e^{-t/T}: f = vT (-x u1 + (t/T - 1 + x) u2), the unit being v T.
inline double CornerLagMm(double turning_angle_rad, double speed_mm_per_s, double lag_time_s) {
  const double cosine = std::cos(turning_angle_rad);
  double nearest = 1.0;
  double low = 0.0;
  double high = 3.0;
  const auto distance = [cosine](double t) {
    const double x = std::exp(-t);
    const double along = t - 1.0 + x;
    return std::sqrt(std::max(0.0, x * x + along * along - 2.0 * x * along * cosine));
  };
  for (int i = 0; i < 60; ++i) {  // the distance falls, then rises: golden section is not needed for 1e-9
    const double left = low + (high - low) / 3.0;
    const double right = high - (high - low) / 3.0;
    if (distance(left) < distance(right)) {
      high = right;
    } else {
      low = left;
    }
  }
  nearest = std::min(nearest, distance(0.5 * (low + high)));
  return nearest * speed_mm_per_s * lag_time_s;
}

// Plays the lag exactly for a jet that moves straight over each step.
class CutFront {
 public:
  explicit CutFront(double lag_time_s) : lag_time_s_(lag_time_s) {}

  const Eigen::Vector2d& place() const { return front_; }

  // Water on: the front starts under the jet.
  void Start(const Eigen::Vector2d& jet_mm) { front_ = jet_ = jet_mm; }

  void Advance(double step_s, const Eigen::Vector2d& jet_mm) {
    if (lag_time_s_ <= 0.0) {
      front_ = jet_ = jet_mm;
      return;
    }
    if (step_s <= 0.0) {
      return;
    }
    const double ratio = step_s / lag_time_s_;
    const double decay = std::exp(-ratio);
    const Eigen::Vector2d trail =
        (jet_mm - jet_) / ratio;  // v T, where the front would settle behind the jet
    front_ = jet_mm - trail + decay * (front_ - jet_ + trail);
    jet_ = jet_mm;
  }

 private:
  double lag_time_s_;
  Eigen::Vector2d front_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d jet_ = Eigen::Vector2d::Zero();
};

}  // namespace lambdajet::accuracy
