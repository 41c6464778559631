#include "kinematics/core/swept_collision.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "foundation/contract/expects.hpp"

namespace lambdajet::kinematics {
namespace {

using Eigen::Vector2d;

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// True if some edge of `polygon` has all of `other` on its outside.
bool Separates(Corners polygon, const Vector2d& polygon_shift, Corners other, const Vector2d& other_shift) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d edge = polygon[(i + 1) % polygon.size()] - polygon[i];
    const bool outside = std::all_of(other.begin(), other.end(), [&](const Vector2d& p) {
      return Cross(edge, p + other_shift - polygon[i] - polygon_shift) < 0.0;
    });
    if (outside) {
      return true;
    }
  }
  return false;
}

double PointToEdge(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d edge = b - a;
  const double t = std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
  return (p - a - t * edge).norm();
}

// Between disjoint convex polygons a corner of one is nearest to an edge of the other.
double NearestCorner(Corners corners, const Vector2d& corner_shift, Corners edges,
                     const Vector2d& edge_shift) {
  double nearest = std::numeric_limits<double>::max();
  for (const Vector2d& p : corners) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
      nearest = std::min(nearest, PointToEdge(p + corner_shift, edges[i] + edge_shift,
                                              edges[(i + 1) % edges.size()] + edge_shift));
    }
  }
  return nearest;
}

}  // namespace

std::array<Vector2d, 4> SheetCorners(const PlanarPose& X_EW, double width_mm, double height_mm) {
  return {X_EW * Vector2d(0.0, 0.0), X_EW * Vector2d(width_mm, 0.0), X_EW * Vector2d(width_mm, height_mm),
          X_EW * Vector2d(0.0, height_mm)};
}

std::array<Vector2d, 4> BodyCorners(double x_min_mm, double y_min_mm, double x_max_mm, double y_max_mm) {
  return {Vector2d(x_min_mm, y_min_mm), Vector2d(x_max_mm, y_min_mm), Vector2d(x_max_mm, y_max_mm),
          Vector2d(x_min_mm, y_max_mm)};
}

bool IsConvex(Corners polygon) {
  if (polygon.size() < 3 || polygon.size() > 64) {
    return false;
  }
  double turn = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d a = polygon[(i + 1) % polygon.size()] - polygon[i];
    const Vector2d b = polygon[(i + 2) % polygon.size()] - polygon[(i + 1) % polygon.size()];
    if (!(Cross(a, b) > 0.0)) {
      return false;
    }
    turn += std::atan2(Cross(a, b), a.dot(b));
  }
  return turn < 7.0;  // once around, not twice
}

double Distance(Corners moving, const Vector2d& shift_mm, Corners fixed) {
  const Vector2d none = Vector2d::Zero();
  if (!Separates(moving, shift_mm, fixed, none) && !Separates(fixed, none, moving, shift_mm)) {
    return 0.0;
  }
  return std::min(NearestCorner(moving, shift_mm, fixed, none), NearestCorner(fixed, none, moving, shift_mm));
}

namespace {

// First fraction of the stretch at which the distance falls to the margin; above 1 if it never does. Keeps the smallest
// distance seen.
double FirstContact(Corners sheet, const Vector2d& from, const Vector2d& to, Corners body, double margin_mm,
                    double& nearest) {
  constexpr double kTouchMm = 1e-6;
  constexpr double kLeastStepMm = 1e-3;
  const double length = (to - from).norm();
  const auto at = [&](double fraction) { return Distance(sheet, from + fraction * (to - from), body); };
  double free = 0.0;  // the last fraction without contact
  double fraction = 0.0;
  while (true) {
    const double distance = at(fraction);
    nearest = std::min(nearest, distance);
    if (distance <= margin_mm + kTouchMm) {
      break;
    }
    if (fraction >= 1.0 || length == 0.0) {
      return 2.0;
    }
    // Half the distance beyond the margin, so that the smallest clearance is met to within a third; at least a micrometre,
    // which ends the search beside a body that is passed closely.
    free = fraction;
    fraction = std::min(1.0, fraction + std::max(0.5 * (distance - margin_mm), kLeastStepMm) / length);
  }
  for (int i = 0; i < 30 && (fraction - free) * length > kTouchMm; ++i) {
    const double middle = 0.5 * (free + fraction);
    (at(middle) <= margin_mm + kTouchMm ? fraction : free) = middle;
  }
  return fraction;
}

}  // namespace

SweptAnswer SweepSheet(Corners sheet, std::span<const Vector2d> path, std::span<const Corners> bodies,
                       double margin_mm) {
  Expects(IsConvex(sheet), "SweepSheet: a convex, counter-clockwise sheet");
  SweptAnswer answer;
  answer.clearance_mm = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Vector2d& from = path[i];
    const Vector2d& to = i + 1 < path.size() ? path[i + 1] : from;
    double earliest = 1.5;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      double nearest = answer.clearance_mm;
      const double contact = FirstContact(sheet, from, to, bodies[b], margin_mm, nearest);
      if (contact < earliest) {
        earliest = contact;
        answer = {true, i, contact, b, from + contact * (to - from), 0.0};
      } else if (!answer.collides && nearest < answer.clearance_mm) {
        answer = {false, i, 0.0, b, from, nearest};
      }
    }
    if (answer.collides) {
      return answer;
    }
  }
  return answer;
}

}  // namespace lambdajet::kinematics
