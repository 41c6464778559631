// Reads a CLDATA part program (APT cutter location data) into the canonical operation list and names every word that it
// cannot obey.
//
// Model: the words of ISO 4343 as CAM posts write them; see services/trajectory/README.md for the table. GOTO gives the end
// of a motion in the part's coordinates, RAPID makes the next one a traverse. CIRCLE governs the GOTOs that follow without
// another statement between, as far as they lie on it: each is reached the shorter way round from the one before, which
// gives the direction (posts disagree on what the axis' sign means); half a turn or more between two points is refused.
// MOVARC says direction (right-handed about its axis) and angle itself. MULTAX lets GOTO carry the tool's axis (i, j, k),
// kept as the rotary words A and B that the machine means by it (tool_axis.hpp). CYCLE makes every GOTO a hole, written out as
// the G-code reader writes out G81, G82 and G83, along the tool's axis (cldata_cycle.hpp). The first way to a hole is at the
// height where the tool is, or at the cycle's, whichever is higher; where it has to rise it does so along its axis first.
// Frames: part coordinates are W. Units: as UNITS says in (millimetres before it), mm and mm/s out. Threads: pure.
// Cost: about 0.5 us a line. Errors: as the G-code reader, the same reasons for the same troubles.
#pragma once

#include <cstddef>
#include <string_view>

#include "trajectory/core/part_program/operation.hpp"
#include "trajectory/core/part_program/tool_axis.hpp"

namespace lambdajet::trajectory {

struct CldataOptions {
  std::uint8_t axes = kPlanarAxes;  // of the machine: kPlanarAxes or kSixAxes
  ToolAngles tool_angles = ToolAngles::kRotaryHead;
  double arc_radius_tolerance_mm = 0.0127;  // how far a point may lie from its circle
  double largest_coordinate_mm = 1e6;
  SpindleRange spindle = {};  // of a machine that moves Z
  std::size_t fault_limit = 100;
  std::size_t operation_limit = 20'000'000;
};

PartProgram ReadCldata(std::string_view text, const CldataOptions& options = {});

// Whether the text begins as CLDATA does: its first statement is one of the words, or its first comment is "$$".
bool LooksLikeCldata(std::string_view text);

}  // namespace lambdajet::trajectory
