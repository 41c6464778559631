// Lists what a part program makes the machine do, in order, in millimetres and seconds, with the line each comes from.
//
// Model: the canonical operations of RS-274/NGC as far as a jet that stands still and a sheet that moves have them; units,
// distance modes, offsets and scaling of the program are resolved, so that every coordinate is in W.
// Frames: W; a machine without an axis leaves its coordinate at 0. Units: mm, mm/s, s, rad. Threads: values. Cost: 112 bytes
// an operation.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "foundation/motion/plan.hpp"

namespace lambdajet::trajectory {

enum class OperationKind : std::uint8_t {
  kTraverse,  // jet-off move, its shape is the planner's
  kFeedLine,
  kFeedArc,
  kDwell,      // value: s
  kPierce,     // value: s, 0: the machine's own pierce time; jet and abrasive on at its end
  kMeasure,    // value: id of the mark
  kStop,       // M0, M1: until the operator goes on
  kWaitInput,  // until `condition` holds; value: s, at most
  kJetOn,      // from here to kAbrasiveFlow: on the fly, keyed to path length
  kJetOff,
  kAbrasiveOn,
  kAbrasiveOff,
  kCameraTrackOn,  // value: id of the mark
  kCameraTrackOff,
  kAbrasiveFlow,      // value: g/min
  kFeedChange,        // feed_mm_per_s
  kUnitsChange,       // value: mm a unit
  kDistanceChange,    // value: 90 or 91
  kWorkOffsetChange,  // value: 54 … 59.3; x, y: the offset
  kPathTolerance,     // value: mm; 0: visit every corner exactly (G61)
  kEnd,
  kSpindleOn,  // value: turns a minute, clockwise positive; stands still until the spindle turns so
  kSpindleOff,
  kCoolantOn,  // on the fly, of a machine with a spindle
  kCoolantOff,
  kToolChange,  // M6 with another tool; value: its number. As kStop: until the operator goes on
  kToolNumber,  // M61; value: the tool that is mounted
};

// UPPER_SNAKE.
std::string_view OperationName(OperationKind kind);

// Whole, 0 … 99999; 0 is no tool.
bool IsTool(double number);

// Far beyond every machine; every notation can write what is below it and read it again.
inline constexpr double kFastestFeed_mm_per_s = 1e7;

// The plane an arc turns in; a helix moves along the plane's normal as it turns.
enum class ArcPlane : std::uint8_t {
  kXy,  // G17, normal Z
  kZx,  // G18, normal Y
  kYz,  // G19, normal X
};

// Which coordinates an operation speaks of: the axes of the machine the program was read for, one bit each.
enum AxisBit : std::uint8_t {
  kAxisX = 1,
  kAxisY = 2,
  kAxisZ = 4,
  kAxisA = 8,
  kAxisB = 16,
  kAxisC = 32,
};
inline constexpr std::uint8_t kPlanarAxes = kAxisX | kAxisY;
inline constexpr std::uint8_t kSixAxes = 63;

struct Operation {
  OperationKind kind = OperationKind::kEnd;
  ArcPlane plane = ArcPlane::kXy;  // arc
  std::uint8_t axes = kPlanarAxes;
  InputCondition condition;  // wait for an input
  std::uint32_t line = 0;    // of the program, 1 is the first
  double x_W_mm = 0.0;       // end of a motion
  double y_W_mm = 0.0;
  double z_W_mm = 0.0;
  double a_rad = 0.0;  // end of a motion: the programmed rotary words, about X, Y, Z
  double b_rad = 0.0;
  double c_rad = 0.0;
  double center_x_W_mm = 0.0;  // arc; along the plane's normal the centre is not used
  double center_y_W_mm = 0.0;
  double center_z_W_mm = 0.0;
  double sweep_rad = 0.0;       // arc: counter-clockwise positive, seen against the plane's normal
  double feed_mm_per_s = 0.0;   // feed line, arc and change: along the path in X, Y, Z
  double kerf_offset_mm = 0.0;  // motion: signed offset of the jet from the programmed contour, left positive
  double value = 0.0;           // as its kind says; feed line and arc: s, where it has a duration and no feed
};

// The speeds of a spindle. Machines that move Z have one, where others have a jet.
struct SpindleRange {
  double least_per_min = 0.0;
  double most_per_min = 1e6;  // 0: the machine has no spindle
};

// Something in a program that is not understood or cannot be done.
struct ProgramFault {
  std::uint32_t line = 0;
  std::uint32_t column = 0;  // 1 is the first; 0: the whole line
  std::string_view reason;   // UPPER_SNAKE, a literal
  std::string word;          // as written
  std::string message;       // what is wrong, and what would be right
};

struct PartProgram {
  std::vector<Operation> operations;  // valid only if there are no faults
  std::vector<ProgramFault> faults;
  std::uint32_t line_count = 0;
};

// One line for people and files: "12 FEED_LINE x=10 y=20 feed=50".
std::string FormatOperation(const Operation& operation);

}  // namespace lambdajet::trajectory
