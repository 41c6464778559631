#include "trajectory/core/idle_motion/jerk_limited_move.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

constexpr int kMostNewtonSteps = 60;

// Quotients of the limits, taken once: divisions are most of what a move costs.
struct Bounds {
  explicit Bounds(const MoveLimits& l)
      : top(l.velocity_mm_per_s),
        a(l.acceleration_mm_per_s2),
        j(l.jerk_mm_per_s3),
        by_a(1.0 / a),
        by_j(1.0 / j),
        ramp(a * by_j),
        knee(a * ramp) {}
  double top, a, j, by_a, by_j;
  double ramp;  // time from no acceleration to the limit
  double knee;  // change of velocity from which the limit is reached
};

double TimeOf(double change, const Bounds& b) {
  return change >= b.knee ? change * b.by_a + b.ramp : 2.0 * std::sqrt(change * b.by_j);
}

double Way(double p, double v_n, double v_k, const Bounds& b) {
  return v_n == v_k ? (p + v_n) * TimeOf(p - v_n, b)
                    : 0.5 * ((p + v_n) * TimeOf(p - v_n, b) + (p + v_k) * TimeOf(p - v_k, b));
}

// The peak is found as its excess over the higher end velocity, which a short move needs to more digits than the peak has.

// Both changes of velocity reach the acceleration limit: p^2/a + p a/j + K = way.
bool PeakWithBothPlateaus(double way, double v_n, double v_k, const Bounds& b, double& excess) {
  const double half = 0.5 * b.knee;
  const double square =
      half * half + b.a * (way - 0.5 * (v_n + v_k) * b.ramp) + 0.5 * (v_n * v_n + v_k * v_k);
  if (square < 0.0) {
    return false;
  }
  excess = std::sqrt(square) - half - std::max(v_n, v_k);
  return excess >= 2.0 * half;
}

// w = sqrt(p - v) solves w^3 + 2 v w = way sqrt(j)/2; way > 0 leaves one positive root.
double PeakWithoutPlateau(double way, double v, double j) {
  const double half = 0.25 * way * std::sqrt(j), third = 2.0 * v / 3.0;
  if (v == 0.0) {
    const double w = std::cbrt(2.0 * half);
    return w * w;
  }
  const double square = half * half + third * third * third;
  double w;
  if (square >= 0.0) {
    const double u = std::cbrt(half + std::sqrt(square));
    w = u - third / u;
  } else {
    w = 2.0 * std::sqrt(-third) * std::cos(std::acos(half / std::sqrt(-third * third * third)) / 3.0);
  }
  for (int i = 0; i < 2; ++i) {  // what the difference of two cube roots has lost
    w -= (w * (w * w + 2.0 * v) - 2.0 * half) / (3.0 * w * w + 2.0 * v);
  }
  return w * w;
}

// In w = sqrt(p - m), m the higher end velocity, the way is smooth and, from where it exceeds the direct one, increasing.
double PeakByNewton(double way, double v_n, double v_k, const Bounds& b) {
  const double m = std::max(v_n, v_k);
  double low = 0.0, high = std::sqrt(b.top - m), w = high;
  for (int i = 0; i < kMostNewtonSteps; ++i) {
    const double p = m + w * w;
    const double error = Way(p, v_n, v_k, b) - way;
    (error > 0.0 ? high : low) = w;
    double slope = 0.0;
    for (const double v : {v_n, v_k}) {
      const double x = p - v;
      const bool plateau = x >= b.knee;
      const double root = std::sqrt(x * b.j);
      // w over the root is 1/sqrt(j) at the higher velocity, whatever w is.
      const double ratio = v == m ? std::sqrt(b.by_j) : w / root;
      slope += plateau ? w * (TimeOf(x, b) + (p + v) * b.by_a) : w * TimeOf(x, b) + (p + v) * ratio;
    }
    const double next = w - error / slope;
    const double step = next > low && next < high ? next : 0.5 * (low + high);
    if (std::abs(step - w) <= 1e-15 * high) {
      return step * step;
    }
    w = step;
  }
  return w * w;
}

struct Change {
  double ramp_s = 0.0;
  double hold_s = 0.0;
  double duration_s() const { return 2.0 * ramp_s + hold_s; }
};

Change ChangeOf(double change, const Bounds& b) {
  return change >= b.knee ? Change{b.ramp, change * b.by_a - b.ramp}
                          : Change{std::sqrt(change * b.by_j), 0.0};
}

// way >= that of the direct change; sign undoes the mirroring.
JerkLimitedMove Upward(double way, double direct, double v_n, double v_k, const Bounds& b, double sign) {
  const double longest = Way(b.top, v_n, v_k, b);
  const double m = std::max(v_n, v_k);
  double excess = b.top - m, cruise_s = 0.0;
  if (way <= direct) {
    excess =
        0.0;  // from a negative velocity any longer way begins with a turn: not the limit of the cases below
  } else if (way >= longest) {
    cruise_s = (way - longest) / b.top;
  } else if (!PeakWithBothPlateaus(way, v_n, v_k, b, excess)) {
    excess = v_n == v_k ? PeakWithoutPlateau(way, v_n, b.j) : PeakByNewton(way, v_n, v_k, b);
  }
  excess = std::clamp(excess, 0.0, b.top - m);
  const Change first = ChangeOf(excess + (m - v_n), b);
  const Change last = v_n == v_k ? first : ChangeOf(excess + (m - v_k), b);
  JerkLimitedMove move;
  move.stretch_s = {first.ramp_s, first.hold_s, first.ramp_s, cruise_s,
                    last.ramp_s,  last.hold_s,  last.ramp_s};
  move.jerk_mm_per_s3 = {sign * b.j, 0.0, -sign * b.j, 0.0, -sign * b.j, 0.0, sign * b.j};
  move.start_mm_per_s = sign * v_n;
  move.peak_mm_per_s = sign * (m + excess);
  move.duration_s = first.duration_s() + cruise_s + last.duration_s();
  return move;
}

MoveVerdict Judge(const MoveEnds& e, const MoveLimits& l) {
  const double sum = e.distance_mm + e.start_mm_per_s + e.end_mm_per_s + l.velocity_mm_per_s +
                     l.acceleration_mm_per_s2 + l.jerk_mm_per_s3;
  if (!std::isfinite(sum)) {
    return MoveVerdict::kNotFinite;
  }
  if (!(l.velocity_mm_per_s > 0.0 && l.acceleration_mm_per_s2 > 0.0 && l.jerk_mm_per_s3 > 0.0)) {
    return MoveVerdict::kLimitNotPositive;
  }
  return std::max(std::abs(e.start_mm_per_s), std::abs(e.end_mm_per_s)) > l.velocity_mm_per_s
             ? MoveVerdict::kVelocityBeyondLimit
             : MoveVerdict::kMoves;
}

}  // namespace

std::string_view MoveVerdictName(MoveVerdict verdict) {
  static constexpr std::array<std::string_view, 4> kNames = {"MOVES", "LIMIT_NOT_POSITIVE",
                                                             "VELOCITY_BEYOND_LIMIT", "NOT_FINITE"};
  return kNames[static_cast<std::size_t>(verdict)];
}

MovePoint JerkLimitedMove::At(double t_s) const {
  MovePoint point{0.0, start_mm_per_s, 0.0};
  double left = std::clamp(t_s, 0.0, duration_s);
  for (std::size_t i = 0; i < stretch_s.size(); ++i) {
    const double t = std::min(left, stretch_s[i]), j = jerk_mm_per_s3[i];
    point.way_mm += t * (point.velocity_mm_per_s + t * (0.5 * point.acceleration_mm_per_s2 + t * j / 6.0));
    point.velocity_mm_per_s += t * (point.acceleration_mm_per_s2 + 0.5 * j * t);
    point.acceleration_mm_per_s2 += j * t;
    left -= t;
  }
  return point;
}

JerkLimitedMove SolveMove(const MoveEnds& ends, const MoveLimits& limits) {
  JerkLimitedMove refused;
  refused.verdict = Judge(ends, limits);
  if (refused.verdict != MoveVerdict::kMoves) {
    return refused;
  }
  const double v_n = ends.start_mm_per_s, v_k = ends.end_mm_per_s;
  const Bounds bounds(limits);
  const double direct = v_n == v_k ? 0.0 : 0.5 * (v_n + v_k) * TimeOf(std::abs(v_k - v_n), bounds);
  return ends.distance_mm >= direct ? Upward(ends.distance_mm, direct, v_n, v_k, bounds, 1.0)
                                    : Upward(-ends.distance_mm, -direct, -v_n, -v_k, bounds, -1.0);
}

JerkLimitedMove SolvePairMove(const std::array<double, 2>& distance_mm,
                              const std::array<MoveLimits, 2>& limits) {
  double velocity = 1e300, acceleration = 1e300, jerk = 1e300;
  for (std::size_t i = 0; i < 2; ++i) {
    const double length = std::abs(distance_mm[i]);
    if (length > 0.0) {
      const double by_length = 1.0 / length;
      velocity = std::min(velocity, limits[i].velocity_mm_per_s * by_length);
      acceleration = std::min(acceleration, limits[i].acceleration_mm_per_s2 * by_length);
      jerk = std::min(jerk, limits[i].jerk_mm_per_s3 * by_length);
    }
  }
  if (distance_mm[0] == 0.0 && distance_mm[1] == 0.0) {
    return {};
  }
  return SolveMove({.distance_mm = 1.0}, {velocity, acceleration, jerk});
}

}  // namespace lambdajet::trajectory
