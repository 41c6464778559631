// Says whether a sheet that the mechanism carries along a path runs into a fixed body: the head's stand, a module's base.
//
// Model: E stays parallel to D (foundation/geometry/frames.md), so the sheet is carried without turning, and it overlaps a
// body exactly where the tool lies in the body's Minkowski sum with the mirrored sheet. Contact and clearance of a stretch
// are those of a straight line and that convex polygon, in closed form.
// Frames: the sheet's corners in E, bodies and path in D. Units: mm.
// Shapes: polygons convex, counter-clockwise, 3 to 64 corners. Threads: pure.
// Cost: about 0.2 us a stretch and body of four corners each; no allocation.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

#include "foundation/geometry/planar_pose.hpp"

namespace lambdajet::kinematics {

using Corners = std::span<const Eigen::Vector2d>;

// The sheet in E from where it lies in its clamp.
std::array<Eigen::Vector2d, 4> SheetCorners(const PlanarPose& X_EW, double width_mm, double height_mm);
// A body with sides along D's axes.
std::array<Eigen::Vector2d, 4> BodyCorners(double x_min_mm, double y_min_mm, double x_max_mm,
                                           double y_max_mm);

// Counter-clockwise, convex, with an area.
bool IsConvex(Corners polygon);

struct SweptAnswer {
  bool collides = false;
  std::size_t stretch =
      0;                  // of the first contact, or the nearest place: from path point `stretch` to the next
  double fraction = 0.0;  // of that stretch
  std::size_t body = 0;   // the body met first, or the one that comes nearest
  Eigen::Vector2d p_DE_mm = Eigen::Vector2d::Zero();  // tool there
  double clearance_mm = 0.0;                          // smallest distance on the way; 0 if it collides
};

// Contact counts from `margin_mm` on. A path of one point is a pose.
SweptAnswer SweepSheet(Corners sheet_E_mm, std::span<const Eigen::Vector2d> path_DE_mm,
                       std::span<const Corners> bodies_D_mm, double margin_mm = 0.0);

}  // namespace lambdajet::kinematics
