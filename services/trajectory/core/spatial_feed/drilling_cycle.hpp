// Writes drilling cycles (G81, G82, G83, G73 and CYCLE of CLDATA) out as moves along a tool axis that may be tilted.
//
// Model: LinuxCNC's canned cycles with heights measured along the tool's axis from the place where it enters the part, so
// that at A0 B0 they are LinuxCNC's own: traverse over the hole at the higher of where the tool is and the clear height,
// traverse to R, feed to the bottom, dwell, traverse out. A peck goes out to R and traverses back to 0.254 mm (0.010 inch)
// above where it stopped; a chip break (G73) goes back by as much only. The tool's axis from tip to spindle is
// Rz(C) Ry(B) Rx(A) z_W. Frames: W. Units: mm, mm/s, s, rad. Threads: pure.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

// Heights along the tool's axis over the place where it enters the part.
struct HoleHeights {
  double clear_mm = 0.0;    // where the cycle begins and ends, not below R
  double retract_mm = 0.0;  // R, where it begins to feed
  double bottom_mm = 0.0;   // Z, below R
  double peck_mm = 0.0;     // Q; 0: in one go
  bool chip_break = false;  // G73: back by 0.254 mm instead of out to R
};

struct HoleStep {
  double height_mm = 0.0;
  bool feeds = false;
};

inline constexpr double kMostPecks = 10'000.0;

// The moves of one hole, the first over it; a dwell belongs behind the last that feeds.
std::vector<HoleStep> StepsOf(const HoleHeights& heights);

struct DrilledHole {
  Eigen::Vector3d entry_W_mm = Eigen::Vector3d::Zero();  // the axis goes through it; heights count from it
  double a_rad = 0.0;
  double b_rad = 0.0;
  double c_rad = 0.0;
  double retract_mm = 0.0;  // R
  double bottom_mm = 0.0;   // Z, below R
  double clear_mm = 0.0;    // where the cycle ends: R (G99) or the height before the cycle (G98), not below R
  double peck_mm = 0.0;     // Q; 0: in one go
  bool chip_break = false;  // G73: back by 0.254 mm instead of out to R
  double dwell_s = 0.0;     // P at the bottom
  double feed_mm_per_s = 0.0;
  std::uint32_t line = 0;
};

// Unit vector from tip to spindle.
Eigen::Vector3d ToolAxis_W(double a_rad, double b_rad, double c_rad);

// Lays the moves of cycles that were written out along z_W along their tools' axes: a move to X Y Z goes to the place at height
// Z - surface along the tool's axis through X Y at the surface. Nothing changes where the tool stands upright.
void AlignWithTool(std::span<Operation> moves, double surface_W_mm);

void AppendDrilledHole(const DrilledHole& hole, std::vector<Operation>& operations);

}  // namespace lambdajet::trajectory
