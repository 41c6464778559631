#include "trajectory/core/spatial_feed/drilling_cycle.hpp"

#include <algorithm>
#include <cmath>

#include "foundation/contract/expects.hpp"
#include "foundation/geometry/pose.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kChipGap_mm = 0.254;

Operation MoveTo(const DrilledHole& hole, double height_mm, OperationKind kind) {
  const Eigen::Vector3d p = hole.entry_W_mm + height_mm * ToolAxis_W(hole.a_rad, hole.b_rad, hole.c_rad);
  Operation move;
  move.kind = kind;
  move.axes = kSixAxes;
  move.line = hole.line;
  move.x_W_mm = p.x();
  move.y_W_mm = p.y();
  move.z_W_mm = p.z();
  move.a_rad = hole.a_rad;
  move.b_rad = hole.b_rad;
  move.c_rad = hole.c_rad;
  move.feed_mm_per_s = kind == OperationKind::kFeedLine ? hole.feed_mm_per_s : 0.0;
  return move;
}

}  // namespace

Eigen::Vector3d ToolAxis_W(double a_rad, double b_rad, double c_rad) {
  return RollPitchYaw{a_rad, b_rad, c_rad}.Rotation().col(2);
}

void AlignWithTool(std::span<Operation> moves, double surface_W_mm) {
  for (Operation& o : moves) {
    const bool moves_tool = o.kind == OperationKind::kTraverse || o.kind == OperationKind::kFeedLine;
    if (moves_tool && (o.a_rad != 0.0 || o.b_rad != 0.0)) {
      const Eigen::Vector3d entry(o.x_W_mm, o.y_W_mm, surface_W_mm);
      const Eigen::Vector3d p = entry + (o.z_W_mm - surface_W_mm) * ToolAxis_W(o.a_rad, o.b_rad, o.c_rad);
      o.x_W_mm = p.x(), o.y_W_mm = p.y(), o.z_W_mm = p.z();
    }
  }
}

std::vector<HoleStep> StepsOf(const HoleHeights& h) {
  Expects(h.bottom_mm < h.retract_mm && h.clear_mm >= h.retract_mm && h.peck_mm >= 0.0,
          "StepsOf: the bottom lies below R, R not above the clear height, and pecks go down");
  std::vector<HoleStep> steps = {{h.clear_mm, false}};
  if (h.clear_mm > h.retract_mm) {
    steps.push_back({h.retract_mm, false});
  }
  const double peck = h.peck_mm > 0.0 ? h.peck_mm : h.retract_mm - h.bottom_mm;
  // Counted, not summed up, so that the last peck is not a splinter of rounding.
  const auto pecks = static_cast<int>(std::ceil((h.retract_mm - h.bottom_mm) / peck - 1e-9));
  for (int i = 1; i < pecks; ++i) {
    const double depth = h.retract_mm - i * peck;
    steps.push_back({depth, true});
    if (h.chip_break) {
      steps.push_back({depth + kChipGap_mm, false});
    } else {
      steps.push_back({h.retract_mm, false});
      steps.push_back({std::min(h.retract_mm, depth + kChipGap_mm), false});
    }
  }
  steps.push_back({h.bottom_mm, true});
  steps.push_back({h.clear_mm, false});
  return steps;
}

void AppendDrilledHole(const DrilledHole& hole, std::vector<Operation>& operations) {
  const std::vector<HoleStep> steps =
      StepsOf({hole.clear_mm, hole.retract_mm, hole.bottom_mm, hole.peck_mm, hole.chip_break});
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i + 1 == steps.size() && hole.dwell_s > 0.0) {
      Operation dwell;
      dwell.kind = OperationKind::kDwell;
      dwell.axes = kSixAxes;
      dwell.line = hole.line;
      dwell.value = hole.dwell_s;
      operations.push_back(dwell);
    }
    operations.push_back(MoveTo(hole, steps[i].height_mm,
                                steps[i].feeds ? OperationKind::kFeedLine : OperationKind::kTraverse));
  }
}

}  // namespace lambdajet::trajectory
