#include "trajectory/core/part_program/operation.hpp"

#include <array>
#include <cstdio>

namespace lambdajet::trajectory {
namespace {

constexpr std::array<std::string_view, 19> kNames = {"TRAVERSE",
                                                     "FEED_LINE",
                                                     "FEED_ARC",
                                                     "DWELL",
                                                     "PIERCE",
                                                     "MEASURE",
                                                     "STOP",
                                                     "JET_ON",
                                                     "JET_OFF",
                                                     "ABRASIVE_ON",
                                                     "ABRASIVE_OFF",
                                                     "CAMERA_TRACK_ON",
                                                     "CAMERA_TRACK_OFF",
                                                     "FEED_CHANGE",
                                                     "UNITS_CHANGE",
                                                     "DISTANCE_CHANGE",
                                                     "WORK_OFFSET_CHANGE",
                                                     "PATH_TOLERANCE",
                                                     "END"};

void Append(std::string& text, const char* key, double value) {
  char number[48];
  std::snprintf(number, sizeof number, " %s=%.9g", key, value);
  text += number;
}

}  // namespace

std::string_view OperationName(OperationKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

std::string FormatOperation(const Operation& o) {
  std::string text = std::to_string(o.line) + " " + std::string(OperationName(o.kind));
  switch (o.kind) {
    case OperationKind::kFeedArc:
      Append(text, "x_mm", o.x_W_mm);
      Append(text, "y_mm", o.y_W_mm);
      Append(text, "center_x_mm", o.center_x_W_mm);
      Append(text, "center_y_mm", o.center_y_W_mm);
      Append(text, "sweep_rad", o.sweep_rad);
      Append(text, "feed_mm_per_s", o.feed_mm_per_s);
      break;
    case OperationKind::kFeedLine:
      Append(text, "x_mm", o.x_W_mm);
      Append(text, "y_mm", o.y_W_mm);
      Append(text, "feed_mm_per_s", o.feed_mm_per_s);
      break;
    case OperationKind::kTraverse:
      Append(text, "x_mm", o.x_W_mm);
      Append(text, "y_mm", o.y_W_mm);
      break;
    case OperationKind::kFeedChange:
      Append(text, "feed_mm_per_s", o.feed_mm_per_s);
      break;
    case OperationKind::kWorkOffsetChange:
      Append(text, "g", o.value);
      Append(text, "x_mm", o.x_W_mm);
      Append(text, "y_mm", o.y_W_mm);
      break;
    case OperationKind::kDwell:
    case OperationKind::kPierce:
      Append(text, "time_s", o.value);
      break;
    case OperationKind::kMeasure:
    case OperationKind::kCameraTrackOn:
      Append(text, "mark", o.value);
      break;
    case OperationKind::kUnitsChange:
      Append(text, "unit_mm", o.value);
      break;
    case OperationKind::kDistanceChange:
      Append(text, "g", o.value);
      break;
    case OperationKind::kPathTolerance:
      Append(text, "tolerance_mm", o.value);
      break;
    default:
      break;
  }
  return text;
}

}  // namespace lambdajet::trajectory
