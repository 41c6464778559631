// Holds a drawing: what the part must be, feature by feature, in the sheet's frame.
//
// Model: a feature is one closed outline of lines and arcs, each starting where the one before ends. The
// cut's centre line must run half a kerf beside it: outside an outer contour, inside a hole. Nothing is ever
// aligned: the drawing stands in W. Frames: W. Units: mm; angles in degrees in the file, rad here. Sweeps are
// positive counter-clockwise. Threads: values. Errors: ValidateDrawing names what is wrong.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace lambdajet::inspection {

enum class FeatureKind : std::uint8_t { kContour, kHole };
// On which side of the outline the jet runs.
enum class Side : std::uint8_t { kInside, kOutside };

struct Line {
  Eigen::Vector2d from_W_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_W_mm = Eigen::Vector2d::Zero();
};

struct Arc {
  Eigen::Vector2d center_W_mm = Eigen::Vector2d::Zero();
  double radius_mm = 0.0;
  double start_rad = 0.0;
  double sweep_rad = 0.0;
};

using OutlineElement = std::variant<Line, Arc>;

struct Feature {
  std::string name;
  FeatureKind kind = FeatureKind::kContour;
  Side side = Side::kOutside;
  double tolerance_mm = 0.0;
  std::vector<OutlineElement> outline;
};

struct Drawing {
  std::string name;
  double kerf_width_mm = 0.0;
  std::vector<Feature> features;
};

double LengthMm(const OutlineElement& element);

// At `along_mm` from the element's start.
Eigen::Vector2d PlaceAt(const OutlineElement& element, double along_mm);
// Unit, in the outline's sense.
Eigen::Vector2d TangentAt(const OutlineElement& element, double along_mm);

// Twice the area enclosed, positive when the outline runs counter-clockwise.
double SignedAreaMm2(const std::vector<OutlineElement>& outline);

struct DrawingFault {
  std::string key;      // dotted, as features[2].outline[0]
  std::string reason;   // UPPER_SNAKE
  std::string message;  // the value and what would be right
};
std::vector<DrawingFault> ValidateDrawing(const Drawing& drawing);

}  // namespace lambdajet::inspection
