// Holds a drawing as it was drawn, in exact curves, and says what was found to be wrong with it.
//
// Model: three kinds of curve, closed under the affine maps that insertions make: lines; conic arcs c + u cos t + v sin t
// (circle, arc, bulge, ellipse); rational B-splines. Frames: the drawing's. Units: the drawing's until ToMillimetres, then mm.
// Threads: values. Errors: findings with UPPER_SNAKE reason and place; one that blocks leaves no toolpath.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "trajectory/core/toolpath/piece.hpp"

namespace lambdajet::trajectory {

struct LineCurve {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
};
struct ConicCurve {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  Eigen::Vector2d u = Eigen::Vector2d::UnitX();  // conjugate half diameters
  Eigen::Vector2d v = Eigen::Vector2d::UnitY();
  double start_rad = 0.0;  // of the parameter
  double sweep_rad = 0.0;
};
struct SplineCurve {
  int degree = 3;
  std::vector<double> knots;
  std::vector<Eigen::Vector2d> points;
  std::vector<double> weights;  // none: all 1
};
using Curve = std::variant<LineCurve, ConicCurve, SplineCurve>;

struct DrawingEntity {
  std::string type;  // LINE, LWPOLYLINE, …
  std::string layer;
  std::uint32_t line = 0;        // of the file, where it begins
  std::vector<Curve> curves;     // each begins where the one before ends
  std::uint64_t dxf_handle = 0;  // what CAD programs find it by; 0: none
};

// Something wrong, or worth knowing, with its place.
struct Finding {
  std::string_view reason;  // UPPER_SNAKE, a literal
  bool blocks = true;       // no toolpath while it stands
  std::string layer;
  std::string entity;      // "LINE", "LWPOLYLINE", …; empty: the whole file
  std::uint32_t line = 0;  // of the file; 0: unknown
  // In the drawing's unit until FindContours; (0, 0) where the reader knows none.
  Eigen::Vector2d at_mm = Eigen::Vector2d::Zero();
  double size_mm = 0.0;  // gap, overlap, radius that would be right: as the reason says
  std::string message;
  std::uint64_t dxf_handle = 0;  // 0: none
};
// "CIRCLE 2F on layer CUT", the handle in the digits that CAD programs show; empty for the whole file.
std::string EntityText(const Finding& finding);

struct Drawing {
  double unit_mm = 0.0;  // of the coordinates; 0: the file does not say
  std::vector<DrawingEntity> entities;
  std::vector<Finding> findings;
};

// x' = linear x + offset.
struct AffineMap {
  Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();
};
AffineMap operator*(const AffineMap& outer, const AffineMap& inner);
Curve Mapped(const AffineMap& map, const Curve& curve);

// Appends the curve as lines and arcs. Circular arcs stay exact; ellipses and splines become biarcs (tangent-continuous pairs
// of arcs) that stay within the tolerance. False: the curve cannot be followed (too many pieces, not finite).
bool AppendPieces(const Curve& curve, double tolerance_mm, std::uint32_t source, Pieces& pieces);

}  // namespace lambdajet::trajectory
