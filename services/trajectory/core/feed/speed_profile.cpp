#include "trajectory/core/feed/speed_profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lambdajet::trajectory {
namespace {

// A node's bounds with the slope of each actuator made positive: |slope u + bend x| <= limit.
struct ActuatorRow {
  double slope = 0.0;
  double bend = 0.0;
  double limit = 0.0;
};

ActuatorRow RowOf(const ProfileNode& node, const ActuatorBounds& bounds, std::size_t j) {
  const double sign = node.A[j] < 0.0 ? -1.0 : 1.0;
  return {sign * node.A[j], sign * node.B[j], bounds.acceleration_mm_per_s2[j]};
}

void Lower(ProfileNode& node, double x, FeedLimit reason) {
  if (x < node.x) {
    node.x = x;
    node.binding = reason;
  }
}

constexpr FeedLimit VelocityLimit(std::size_t j) {
  return j == 0 ? FeedLimit::kActuator1Velocity : FeedLimit::kActuator2Velocity;
}
constexpr FeedLimit AccelerationLimit(std::size_t j) {
  return j == 0 ? FeedLimit::kActuator1Acceleration : FeedLimit::kActuator2Acceleration;
}

// Largest x for which some u meets both the path's circle and the actuator's strip.
double CircleAndStrip(double a, double k, const ActuatorRow& row) {
  if (row.limit >= std::abs(row.slope) * a && row.bend == 0.0) {
    return std::numeric_limits<double>::infinity();
  }
  const double b = std::abs(row.bend);
  const double s = row.slope;
  // (b x - limit)^2 <= s^2 (a^2 - k^2 x^2), upper root.
  const double p = b * b + s * s * k * k;
  const double q = b * row.limit;
  const double r = row.limit * row.limit - s * s * a * a;
  const double d = q * q - p * r;
  return p > 0.0 && d >= 0.0 ? (q + std::sqrt(d)) / p : std::numeric_limits<double>::infinity();
}

// The maximum velocity curve at a node.
void CapNode(ProfileNode& node, const ActuatorBounds& bounds) {
  node.x = node.speed_cap_mm_per_s * node.speed_cap_mm_per_s;
  node.binding = node.cap_reason;
  const double a = node.acceleration_mm_per_s2;
  if (node.curvature > 0.0) {
    Lower(node, a / node.curvature, FeedLimit::kCurvature);
  }
  const ActuatorRow first = RowOf(node, bounds, 0), second = RowOf(node, bounds, 1);
  for (std::size_t j = 0; j < 2; ++j) {
    const double slope = std::abs(node.A[j]);
    const double v = bounds.velocity_mm_per_s[j];
    if (slope * slope * node.x > v * v) {
      Lower(node, v * v / (slope * slope), VelocityLimit(j));
    }
    Lower(node, CircleAndStrip(a, node.curvature, j == 0 ? first : second), AccelerationLimit(j));
  }
  // Both strips share a u only if |b1/s1 - b2/s2| x <= l1/s1 + l2/s2.
  const double apart = std::abs(first.bend * second.slope - second.bend * first.slope);
  const double room = first.limit * second.slope + second.limit * first.slope;
  if (apart * node.x > room) {
    Lower(node, room / apart, FeedLimit::kActuator1Acceleration);
  }
}

// Largest x at the cell's start from which u at its lower bound still reaches x_next or less.
double Backward(const ProfileNode& node, const ActuatorBounds& bounds, double cell_mm, double x_next,
                FeedLimit& reason) {
  const double a = node.acceleration_mm_per_s2;
  const double c = 2.0 * cell_mm * node.curvature;
  const double reach = 2.0 * cell_mm * a;
  const double d = (1.0 + c * c) * reach * reach - c * c * x_next * x_next;
  double x = (x_next + (d > 0.0 ? std::sqrt(d) : 0.0)) / (1.0 + c * c);
  x = std::max(x, std::min(x_next, node.x));
  reason = FeedLimit::kPathAcceleration;
  const double h = 0.5 / cell_mm;
  for (std::size_t j = 0; j < 2; ++j) {
    const ActuatorRow row = RowOf(node, bounds, j);
    const double slope = row.slope * h - row.bend;
    if (slope > 0.0) {
      const double limit = (row.limit + row.slope * h * x_next) / slope;
      if (limit < x) {
        x = limit;
        reason = AccelerationLimit(j);
      }
    }
  }
  return x;
}

double LargestAcceleration(const ProfileNode& node, const ActuatorBounds& bounds, FeedLimit& reason) {
  const double normal = node.curvature * node.x;
  const double a = node.acceleration_mm_per_s2;
  double u = std::sqrt(std::max(0.0, a * a - normal * normal));
  reason = FeedLimit::kPathAcceleration;
  for (std::size_t j = 0; j < 2; ++j) {
    const ActuatorRow row = RowOf(node, bounds, j);
    if (row.slope * u + row.bend * node.x > row.limit && row.slope > 0.0) {
      u = (row.limit - row.bend * node.x) / row.slope;
      reason = AccelerationLimit(j);
    }
  }
  return u;
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
                                                                           "PATH_JERK"};
  return kNames[static_cast<std::size_t>(limit)];
}

void SolveSpeedProfile(std::vector<ProfileNode>& nodes, const ActuatorBounds& bounds,
                       double begin_speed_mm_per_s, double end_speed_mm_per_s) {
  for (ProfileNode& node : nodes) {
    CapNode(node, bounds);
  }
  Lower(nodes.back(), end_speed_mm_per_s * end_speed_mm_per_s, FeedLimit::kPathAcceleration);
  for (std::size_t i = nodes.size() - 1; i-- > 0;) {
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

double ProfileDuration(const std::vector<ProfileNode>& nodes) {
  double time = 0.0;
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    const double v = std::sqrt(nodes[i].x) + std::sqrt(nodes[i + 1].x);
    time += 2.0 * (nodes[i + 1].offset_mm - nodes[i].offset_mm) / v;
  }
  return time;
}

}  // namespace lambdajet::trajectory
