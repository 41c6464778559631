// Compares the cut with the drawing: how far the edge of the part is from where it was drawn, every tenth of
// a millimetre.
//
// Model: at a point of the outline with its normal n towards the jet's side, the cut's centre line crosses n
// at t; the edge left standing is at t - kerf/2, and that is the deviation: positive, too much material left.
// Of several crossings where the cut, over half a millimetre, runs in the feature's sense within 45 degrees (60, where there is
// none: a cut may swing) and that have their edge within kSearchMm, the one that went deepest into the part made the edge, so
// lead-ins, overlaps and neighbours do not matter. Within a kerf of a sharp corner, where normals miss, the deviation is the distance to the
// centre line minus kerf/2. A point with no cut within reach is NOT_CUT, counted, and fails its feature.
// Figures are of |deviation| unless they say signed, weighted by length. Nothing is aligned or fitted away.
// Frames: W. Units: mm. Shapes: deviations in the drawing's order.
// Threads: pure. Cost: some 2 us an outline point. Errors: the drawing must have passed ValidateDrawing.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "inspection/core/cut_path.hpp"
#include "inspection/core/drawing.hpp"

namespace lambdajet::inspection {

inline constexpr double kPointSpacingMm = 0.1;
inline constexpr double kSearchMm = 3.0;

struct Deviation {
  Eigen::Vector2d p_W_mm = Eigen::Vector2d::Zero();  // nominal
  Eigen::Vector2d n_W = Eigen::Vector2d::Zero();     // towards the jet's side
  double deviation_mm = 0.0;                         // signed; 0 where not cut
  double weight_mm = 0.0;
  std::uint32_t feature = 0;
  bool cut = false;
};

// The circle that the edge of a round hole or disc comes nearest to, for the report only.
struct FittedCircle {
  bool fitted = false;
  Eigen::Vector2d center_W_mm = Eigen::Vector2d::Zero();
  double radius_mm = 0.0;
  double position_error_mm = 0.0;  // distance of the centres
  double diameter_error_mm = 0.0;  // signed
  double roundness_mm = 0.0;       // largest minus smallest radius
};

struct FeatureResult {
  std::string name;
  double p50_mm = 0.0;
  double p95_mm = 0.0;
  double max_mm = 0.0;
  double mean_mm = 0.0;  // signed
  double rms_mm = 0.0;
  double tolerance_mm = 0.0;  // the smallest of all, for the whole part
  double conforming = 0.0;    // share of the length within its feature's tolerance
  std::uint32_t not_cut = 0;
  std::uint32_t points = 0;
  bool passed = false;  // all cut, all within tolerance
  FittedCircle circle;
};

struct Inspection {
  FeatureResult all;
  std::vector<FeatureResult> features;
  std::vector<Deviation> deviations;
};

Inspection CompareWithDrawing(const CutPath& path, const Drawing& drawing);

}  // namespace lambdajet::inspection
