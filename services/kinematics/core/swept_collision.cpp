#include "kinematics/core/swept_collision.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "foundation/contract/expects.hpp"

namespace lambdajet::kinematics {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kMostCorners = 64;

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double PointToEdge(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d edge = b - a;
  const double t = std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
  return (p - a - t * edge).norm();
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
  if (polygon.size() < 3 || polygon.size() > kMostCorners) {
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

namespace {

// Two polygons are taken to touch at this distance; rounding is a thousandth of it.
constexpr double kTouchMm = 1e-6;

// The places of the tool at which the sheet overlaps one body: the body's Minkowski sum with the mirrored sheet, convex
// again.
struct Obstacle {
  std::array<Vector2d, 2 * kMostCorners> corners;
  std::size_t count = 0;

  const Vector2d& At(std::size_t i) const { return corners[i < count ? i : i - count]; }
};

std::size_t Lowest(Corners polygon, double sign) {
  const auto below = [sign](const Vector2d& a, const Vector2d& b) {
    return sign * a.y() < sign * b.y() || (a.y() == b.y() && sign * a.x() < sign * b.x());
  };
  return static_cast<std::size_t>(std::min_element(polygon.begin(), polygon.end(), below) - polygon.begin());
}

// Edges of both polygons in the order of their directions, from the lowest corner on; a mirrored polygon turns the same way.
Obstacle ObstacleOf(Corners sheet, Corners body) {
  const std::size_t first_body = Lowest(body, 1.0), first_sheet = Lowest(sheet, -1.0);
  const auto body_at = [&](std::size_t i) { return body[(first_body + i) % body.size()]; };
  const auto mirrored_at = [&](std::size_t i) { return Vector2d(-sheet[(first_sheet + i) % sheet.size()]); };
  Obstacle obstacle;
  std::size_t b = 0, s = 0;
  while (b < body.size() || s < sheet.size()) {
    obstacle.corners[obstacle.count++] = body_at(b) + mirrored_at(s);
    const Vector2d body_edge = body_at(b + 1) - body_at(b);
    const Vector2d sheet_edge = mirrored_at(s + 1) - mirrored_at(s);
    const double turn = Cross(body_edge, sheet_edge);
    const bool take_body = b < body.size() && (s == sheet.size() || turn >= 0.0);
    const bool take_sheet = s < sheet.size() && (b == body.size() || turn <= 0.0);
    b += take_body ? 1 : 0;
    s += take_sheet ? 1 : 0;
  }
  return obstacle;
}

double DistanceOf(const Obstacle& obstacle, const Vector2d& p) {
  double nearest = std::numeric_limits<double>::max();
  bool inside = true;
  for (std::size_t i = 0; i < obstacle.count; ++i) {
    const Vector2d& a = obstacle.At(i);
    const Vector2d& b = obstacle.At(i + 1);
    inside = inside && Cross(b - a, p - a) >= 0.0;
    nearest = std::min(nearest, PointToEdge(p, a, b));
  }
  return inside ? 0.0 : nearest;
}

// Fractions of the way from `from` along `way` at which the tool is `reach` from a corner or an edge of the obstacle. Each
// such place is no farther from the obstacle than that, so the least of them is the first contact.
double FirstWithin(const Obstacle& obstacle, const Vector2d& from, const Vector2d& way, double reach) {
  constexpr double kNever = std::numeric_limits<double>::max();
  double first = kNever;
  const double a = way.squaredNorm();
  for (std::size_t i = 0; i < obstacle.count; ++i) {
    const Vector2d& corner = obstacle.At(i);
    const Vector2d edge = obstacle.At(i + 1) - corner;
    const Vector2d outward = Vector2d(edge.y(), -edge.x()).normalized();
    const double approach = -outward.dot(way);
    if (approach > 0.0) {
      const double t = (outward.dot(from - corner) - reach) / approach;
      const double along = (from + t * way - corner).dot(edge);
      if (t >= 0.0 && along >= 0.0 && along <= edge.squaredNorm()) {
        first = std::min(first, t);
      }
    }
    const double half_b = way.dot(from - corner);
    const double root2 = half_b * half_b - a * ((from - corner).squaredNorm() - reach * reach);
    if (a > 0.0 && root2 >= 0.0) {
      const double t = (-half_b - std::sqrt(root2)) / a;
      first = t >= 0.0 ? std::min(first, t) : first;
    }
  }
  return first;
}

// Where the way comes nearest to an obstacle that it does not meet: at an end, or beside a corner.
struct Nearest {
  double distance_mm = 0.0;
  double fraction = 0.0;
};
Nearest NearestOn(const Obstacle& obstacle, const Vector2d& from, const Vector2d& way) {
  Nearest nearest{DistanceOf(obstacle, from), 0.0};
  const auto take = [&](double distance, double fraction) {
    if (distance < nearest.distance_mm) {
      nearest = {distance, fraction};
    }
  };
  take(DistanceOf(obstacle, from + way), 1.0);
  const double length2 = way.squaredNorm();
  for (std::size_t i = 0; length2 > 0.0 && i < obstacle.count; ++i) {
    const double t = std::clamp((obstacle.At(i) - from).dot(way) / length2, 0.0, 1.0);
    take((from + t * way - obstacle.At(i)).norm(), t);
  }
  return nearest;
}

// Goes along the path until the first contact, which replaces a later one, or keeps where it comes nearest.
void SweepPast(const Obstacle& obstacle, std::size_t body, std::span<const Vector2d> path, double reach_mm,
               SweptAnswer& answer) {
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (answer.collides && i > answer.stretch) {
      return;
    }
    const Vector2d way = (i + 1 < path.size() ? path[i + 1] : path[i]) - path[i];
    const bool at_once = DistanceOf(obstacle, path[i]) <= reach_mm;
    const double contact = at_once ? 0.0 : FirstWithin(obstacle, path[i], way, reach_mm);
    if (contact <= 1.0) {
      if (!answer.collides || i < answer.stretch || contact < answer.fraction) {
        answer = {true, i, contact, body, path[i] + contact * way, 0.0};
      }
      return;
    }
    const Nearest nearest = NearestOn(obstacle, path[i], way);
    if (!answer.collides && nearest.distance_mm < answer.clearance_mm) {
      answer = {false, i, nearest.fraction, body, path[i] + nearest.fraction * way, nearest.distance_mm};
    }
  }
}

}  // namespace

SweptAnswer SweepSheet(Corners sheet, std::span<const Vector2d> path, std::span<const Corners> bodies,
                       double margin_mm) {
  Expects(IsConvex(sheet), "SweepSheet: a convex, counter-clockwise sheet");
  SweptAnswer answer;
  answer.clearance_mm = std::numeric_limits<double>::max();
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    Expects(IsConvex(bodies[b]), "SweepSheet: convex, counter-clockwise bodies");
    SweepPast(ObstacleOf(sheet, bodies[b]), b, path, margin_mm + kTouchMm, answer);
  }
  return answer;
}

}  // namespace lambdajet::kinematics
