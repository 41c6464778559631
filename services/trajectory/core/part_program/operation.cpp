#include "trajectory/core/part_program/operation.hpp"

#include <array>
#include <cmath>
#include <cstdio>

namespace lambdajet::trajectory {
namespace {

constexpr std::array<std::string_view, 27> kNames = {"TRAVERSE",
                                                     "FEED_LINE",
                                                     "FEED_ARC",
                                                     "DWELL",
                                                     "PIERCE",
                                                     "MEASURE",
                                                     "STOP",
                                                     "WAIT_INPUT",
                                                     "JET_ON",
                                                     "JET_OFF",
                                                     "ABRASIVE_ON",
                                                     "ABRASIVE_OFF",
                                                     "CAMERA_TRACK_ON",
                                                     "CAMERA_TRACK_OFF",
                                                     "ABRASIVE_FLOW",
                                                     "FEED_CHANGE",
                                                     "UNITS_CHANGE",
                                                     "DISTANCE_CHANGE",
                                                     "WORK_OFFSET_CHANGE",
                                                     "PATH_TOLERANCE",
                                                     "END",
                                                     "SPINDLE_ON",
                                                     "SPINDLE_OFF",
                                                     "COOLANT_ON",
                                                     "COOLANT_OFF",
                                                     "TOOL_CHANGE",
                                                     "TOOL_NUMBER"};

void Append(std::string& text, const char* key, double value) {
  char number[48];
  std::snprintf(number, sizeof number, " %s=%.9g", key, value);
  text += number;
}

void AppendEnd(std::string& text, const Operation& o) {
  const std::array<double, 6> end = {o.x_W_mm, o.y_W_mm, o.z_W_mm, o.a_rad, o.b_rad, o.c_rad};
  static constexpr std::array<const char*, 6> kKeys = {"x_mm", "y_mm", "z_mm", "a_rad", "b_rad", "c_rad"};
  for (std::size_t i = 0; i < end.size(); ++i) {
    if ((o.axes >> i & 1u) != 0) {
      Append(text, kKeys[i], end[i]);
    }
  }
}

void AppendArc(std::string& text, const Operation& o) {
  if (o.plane != ArcPlane::kYz) {
    Append(text, "center_x_mm", o.center_x_W_mm);
  }
  if (o.plane != ArcPlane::kZx) {
    Append(text, "center_y_mm", o.center_y_W_mm);
  }
  if (o.plane != ArcPlane::kXy) {
    Append(text, "center_z_mm", o.center_z_W_mm);
  }
  Append(text, "sweep_rad", o.sweep_rad);
}

void AppendFeed(std::string& text, const Operation& o) {
  if (o.value != 0.0) {
    Append(text, "time_s", o.value);
  } else {
    Append(text, "feed_mm_per_s", o.feed_mm_per_s);
  }
}

void AppendCondition(std::string& text, InputCondition condition) {
  static constexpr std::array<const char*, kProcessInputs> kInputs = {"pump_at_pressure", "abrasive_present"};
  static constexpr std::array<const char*, 5> kEvents = {"none", "rise", "fall", "high", "low"};
  text += std::string(" input=") + kInputs[static_cast<std::size_t>(condition.input())] +
          " event=" + kEvents[static_cast<std::size_t>(condition.event())];
}

void AppendKerf(std::string& text, const Operation& o) {
  if (o.kerf_offset_mm != 0.0) {
    Append(text, "kerf_offset_mm", o.kerf_offset_mm);
  }
}

// Of operations that have no other.
const char* KeyOf(OperationKind kind) {
  switch (kind) {
    case OperationKind::kAbrasiveFlow:
      return "flow_g_per_min";
    case OperationKind::kMeasure:
    case OperationKind::kCameraTrackOn:
      return "mark";
    case OperationKind::kToolChange:
    case OperationKind::kToolNumber:
      return "tool";
    case OperationKind::kSpindleOn:
      return "speed_per_min";
    case OperationKind::kUnitsChange:
      return "unit_mm";
    case OperationKind::kDistanceChange:
      return "g";
    case OperationKind::kPathTolerance:
      return "tolerance_mm";
    default:
      return nullptr;
  }
}

void AppendOneNumber(std::string& text, const Operation& o) {
  if (const char* key = KeyOf(o.kind)) {
    Append(text, key, o.value);
  }
}

}  // namespace

bool IsTool(double number) {
  constexpr double kLargest = 99999.0;
  return number >= 0.0 && number <= kLargest && number == std::floor(number);
}

std::string_view OperationName(OperationKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

std::string FormatOperation(const Operation& o) {
  std::string text = std::to_string(o.line) + " " + std::string(OperationName(o.kind));
  switch (o.kind) {
    case OperationKind::kFeedArc:
      AppendEnd(text, o);
      AppendArc(text, o);
      AppendFeed(text, o);
      AppendKerf(text, o);
      break;
    case OperationKind::kFeedLine:
      AppendEnd(text, o);
      AppendFeed(text, o);
      AppendKerf(text, o);
      break;
    case OperationKind::kTraverse:
      AppendEnd(text, o);
      AppendKerf(text, o);
      break;
    case OperationKind::kFeedChange:
      Append(text, "feed_mm_per_s", o.feed_mm_per_s);
      break;
    case OperationKind::kWorkOffsetChange:
      Append(text, "g", o.value);
      AppendEnd(text, o);
      break;
    case OperationKind::kDwell:
    case OperationKind::kPierce:
      Append(text, "time_s", o.value);
      break;
    case OperationKind::kWaitInput:
      AppendCondition(text, o.condition);
      Append(text, "timeout_s", o.value);
      break;
    default:
      AppendOneNumber(text, o);
  }
  return text;
}

}  // namespace lambdajet::trajectory
