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

void AppendDrilledHole(const DrilledHole& hole, std::vector<Operation>& operations) {
  Expects(hole.bottom_mm < hole.retract_mm && hole.clear_mm >= hole.retract_mm && hole.peck_mm >= 0.0,
          "AppendDrilledHole: the bottom lies below R, R not above the clear height, and pecks go down");
  const auto add = [&](double height_mm, OperationKind kind) {
    operations.push_back(MoveTo(hole, height_mm, kind));
  };
  add(hole.clear_mm, OperationKind::kTraverse);
  if (hole.clear_mm > hole.retract_mm) {
    add(hole.retract_mm, OperationKind::kTraverse);
  }
  const double peck = hole.peck_mm > 0.0 ? hole.peck_mm : hole.retract_mm - hole.bottom_mm;
  // Counted, not summed up, so that the last peck is not a splinter of rounding.
  const auto pecks = static_cast<int>(std::ceil((hole.retract_mm - hole.bottom_mm) / peck - 1e-9));
  for (int i = 1; i < pecks; ++i) {
    const double depth = hole.retract_mm - i * peck;
    add(depth, OperationKind::kFeedLine);
    if (hole.chip_break) {
      add(depth + kChipGap_mm, OperationKind::kTraverse);
    } else {
      add(hole.retract_mm, OperationKind::kTraverse);
      add(std::min(hole.retract_mm, depth + kChipGap_mm), OperationKind::kTraverse);
    }
  }
  add(hole.bottom_mm, OperationKind::kFeedLine);
  if (hole.dwell_s > 0.0) {
    Operation dwell;
    dwell.kind = OperationKind::kDwell;
    dwell.axes = kSixAxes;
    dwell.line = hole.line;
    dwell.value = hole.dwell_s;
    operations.push_back(dwell);
  }
  add(hole.clear_mm, OperationKind::kTraverse);
}

}  // namespace lambdajet::trajectory
