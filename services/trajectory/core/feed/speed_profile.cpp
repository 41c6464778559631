#include "trajectory/core/feed/speed_profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lambdajet::trajectory {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

// One actuator's bound with its slope made positive: |slope u + bend x| <= limit.
struct ActuatorRow {
  double slope = 0.0;
  double bend = 0.0;
  double limit = 0.0;
};

template <std::size_t N>
ActuatorRow RowOf(const ProfileNodeOf<N>& node, const ActuatorBoundsOf<N>& bounds, std::size_t j) {
  const double sign = node.A[j] < 0.0 ? -1.0 : 1.0;
  return {sign * node.A[j], sign * node.B[j], bounds.acceleration_mm_per_s2[j]};
}

template <std::size_t N>
void Lower(ProfileNodeOf<N>& node, double x, FeedLimit reason) {
  if (x < node.x) {
    node.x = x;
    node.binding = reason;
  }
}

// Largest x for which some u meets both the path's circle and the actuator's strip.
double CircleAndStrip(double a, double k, const ActuatorRow& row) {
  const double b = std::abs(row.bend);
  if (b == 0.0) {
    return kNone;
  }
  const double s = row.slope;
  // b x - limit <= s sqrt(a^2 - k^2 x^2): the upper root of its square, which is that of b x > limit unless the circle ends
  // before.
  const double p = b * b + s * s * k * k;
  const double q = b * row.limit;
  const double r = row.limit * row.limit - s * s * a * a;
  const double d = q * q - p * r;
  return d >= 0.0 ? std::max((q + std::sqrt(d)) / p, row.limit / b) : kNone;
}

// Largest x for which two strips share a u: |b1/s1 - b2/s2| x <= l1/s1 + l2/s2.
double StripAndStrip(const ActuatorRow& first, const ActuatorRow& second) {
  const double apart = std::abs(first.bend * second.slope - second.bend * first.slope);
  const double room = first.limit * second.slope + second.limit * first.slope;
  return apart > 0.0 ? room / apart : kNone;
}

// Whether some u meets all bounds at the node's x: the fast answer for nearly every node.
template <std::size_t N>
bool HasAcceleration(const ProfileNodeOf<N>& node, const ActuatorBoundsOf<N>& bounds) {
  const double x = node.x, normal = node.curvature * x;
  const double room2 = node.acceleration_mm_per_s2 * node.acceleration_mm_per_s2 - normal * normal;
  const double along = std::sqrt(std::max(0.0, room2));
  double from = -along, to = along;
  bool bent = false;
  for (std::size_t j = 0; j < N; ++j) {
    const double limit = bounds.acceleration_mm_per_s2[j], b = node.B[j] * x;
    const double slope = std::abs(node.A[j]), at = node.A[j] < 0.0 ? -b : b;
    const double inverse = 1.0 / std::max(slope, 1e-12);
    from = std::max(from, (-limit - at) * inverse);
    to = std::min(to, (limit - at) * inverse);
    bent |= slope < 1e-12 && std::abs(b) > limit;
  }
  return from <= to && !bent;
}

// The maximum velocity curve at a node.
template <std::size_t N>
void CapNode(ProfileNodeOf<N>& node, const ActuatorBoundsOf<N>& bounds) {
  node.x = node.speed_cap_mm_per_s * node.speed_cap_mm_per_s;
  node.binding = node.cap_reason;
  const double a = node.acceleration_mm_per_s2;
  if (node.curvature * node.x > a) {
    Lower(node, a / node.curvature, FeedLimit::kCurvature);
  }
  for (std::size_t j = 0; j < N; ++j) {
    const double slope2 = node.A[j] * node.A[j];
    const double v = bounds.velocity_mm_per_s[j];
    if (slope2 * node.x > v * v) {
      Lower(node, v * v / slope2, ActuatorVelocityLimit(j));
    }
  }
  if (HasAcceleration(node, bounds)) {
    return;
  }
  for (std::size_t j = 0; j < N; ++j) {
    const ActuatorRow row = RowOf(node, bounds, j);
    Lower(node, CircleAndStrip(a, node.curvature, row), ActuatorAccelerationLimit(j));
    for (std::size_t i = 0; i < j; ++i) {
      Lower(node, StripAndStrip(RowOf(node, bounds, i), row), ActuatorAccelerationLimit(i));
    }
  }
}

// Largest x at the cell's start from which u at its lower bound still reaches x_next or less.
template <std::size_t N>
double Backward(const ProfileNodeOf<N>& node, const ActuatorBoundsOf<N>& bounds, double cell_mm,
                double x_next, FeedLimit& reason) {
  const double a = node.acceleration_mm_per_s2;
  const double c = 2.0 * cell_mm * node.curvature;
  const double reach = 2.0 * cell_mm * a;
  const double d = (1.0 + c * c) * reach * reach - c * c * x_next * x_next;
  double x = (x_next + (d > 0.0 ? std::sqrt(d) : 0.0)) / (1.0 + c * c);
  x = std::max(x, std::min(x_next, node.x));
  reason = FeedLimit::kPathAcceleration;
  const double h = 0.5 / cell_mm;
  // limit + s h x_next >= (s h - b) x; only a bound that x breaks is worth a division.
  for (std::size_t j = 0; j < N; ++j) {
    const double A = node.A[j], step = std::abs(A) * h;
    const double slope = step - (A < 0.0 ? -node.B[j] : node.B[j]);
    const double room = bounds.acceleration_mm_per_s2[j] + step * x_next;
    if (slope * x > room) {
      x = room / slope;
      reason = ActuatorAccelerationLimit(j);
    }
  }
  return x;
}

template <std::size_t N>
double LargestAcceleration(const ProfileNodeOf<N>& node, const ActuatorBoundsOf<N>& bounds,
                           FeedLimit& reason) {
  const double normal = node.curvature * node.x;
  const double a = node.acceleration_mm_per_s2;
  double u = std::sqrt(std::max(0.0, a * a - normal * normal));
  reason = FeedLimit::kPathAcceleration;
  for (std::size_t j = 0; j < N; ++j) {
    const double A = node.A[j], slope = std::abs(A), bend = A < 0.0 ? -node.B[j] : node.B[j];
    if (slope * u + bend * node.x > bounds.acceleration_mm_per_s2[j] && slope > 0.0) {
      u = (bounds.acceleration_mm_per_s2[j] - bend * node.x) / slope;
      reason = ActuatorAccelerationLimit(j);
    }
  }
  return u;
}

template <std::size_t N>
void Solve(std::vector<ProfileNodeOf<N>>& nodes, const ActuatorBoundsOf<N>& bounds,
           double begin_speed_mm_per_s, double end_speed_mm_per_s) {
  CapNode(nodes.back(), bounds);
  Lower(nodes.back(), end_speed_mm_per_s * end_speed_mm_per_s, FeedLimit::kPathAcceleration);
  for (std::size_t i = nodes.size() - 1; i-- > 0;) {
    CapNode(nodes[i], bounds);
    FeedLimit reason;
    const double cell = nodes[i + 1].offset_mm - nodes[i].offset_mm;
    const double x = Backward(nodes[i], bounds, cell, nodes[i + 1].x, reason);
    Lower(nodes[i], x, reason);
  }
  Lower(nodes.front(), begin_speed_mm_per_s * begin_speed_mm_per_s, FeedLimit::kPathAcceleration);
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    FeedLimit reason;
    const double u = LargestAcceleration(nodes[i], bounds, reason);
    const double cell = nodes[i + 1].offset_mm - nodes[i].offset_mm;
    Lower(nodes[i + 1], std::max(0.0, nodes[i].x + 2.0 * cell * u), reason);
  }
}

template <std::size_t N>
double Duration(const std::vector<ProfileNodeOf<N>>& nodes) {
  double time = 0.0;
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    const double v = std::sqrt(nodes[i].x) + std::sqrt(nodes[i + 1].x);
    time += 2.0 * (nodes[i + 1].offset_mm - nodes[i].offset_mm) / v;
  }
  return time;
}

}  // namespace

std::string_view FeedLimitName(FeedLimit limit) {
  static constexpr std::array<std::string_view, kFeedLimitCount> kNames = {"FEED",
                                                                           "CURVATURE",
                                                                           "CORNER",
                                                                           "PATH_ACCELERATION",
                                                                           "ACTUATOR_1_VELOCITY",
                                                                           "ACTUATOR_2_VELOCITY",
                                                                           "ACTUATOR_1_ACCELERATION",
                                                                           "ACTUATOR_2_ACCELERATION",
                                                                           "CONTOUR_TOLERANCE",
                                                                           "PREDICTED_ERROR",
                                                                           "ACTUATOR_JERK",
                                                                           "PATH_JERK",
                                                                           "ACTUATOR_3_VELOCITY",
                                                                           "ACTUATOR_4_VELOCITY",
                                                                           "ACTUATOR_5_VELOCITY",
                                                                           "ACTUATOR_6_VELOCITY",
                                                                           "ACTUATOR_3_ACCELERATION",
                                                                           "ACTUATOR_4_ACCELERATION",
                                                                           "ACTUATOR_5_ACCELERATION",
                                                                           "ACTUATOR_6_ACCELERATION",
                                                                           "SMOOTHING"};
  return kNames[static_cast<std::size_t>(limit)];
}

FeedLimit ActuatorVelocityLimit(std::size_t j) {
  const FeedLimit first = j < 2 ? FeedLimit::kActuator1Velocity : FeedLimit::kActuator3Velocity;
  return static_cast<FeedLimit>(static_cast<std::size_t>(first) + (j < 2 ? j : j - 2));
}

FeedLimit ActuatorAccelerationLimit(std::size_t j) {
  const FeedLimit first = j < 2 ? FeedLimit::kActuator1Acceleration : FeedLimit::kActuator3Acceleration;
  return static_cast<FeedLimit>(static_cast<std::size_t>(first) + (j < 2 ? j : j - 2));
}

void SolveSpeedProfile(std::vector<ProfileNode>& nodes, const ActuatorBounds& bounds,
                       double begin_speed_mm_per_s, double end_speed_mm_per_s) {
  Solve(nodes, bounds, begin_speed_mm_per_s, end_speed_mm_per_s);
}

void SolveSpeedProfile(std::vector<ProfileNodeOf<6>>& nodes, const ActuatorBoundsOf<6>& bounds,
                       double begin_speed_mm_per_s, double end_speed_mm_per_s) {
  Solve(nodes, bounds, begin_speed_mm_per_s, end_speed_mm_per_s);
}

double ProfileDuration(const std::vector<ProfileNode>& nodes) { return Duration(nodes); }

double ProfileDuration(const std::vector<ProfileNodeOf<6>>& nodes) { return Duration(nodes); }

}  // namespace lambdajet::trajectory
