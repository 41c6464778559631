// Turns canonical operations in six axes into geometry: runs along which speed is planned, and gates at standstill between.
//
// Model: the tip moves on a line, an arc or a helix; the tool turns about one fixed axis, from the block's first to its last
// orientation the short way, in step with the tip. Path length counts sqrt(dp^2 + (l dphi)^2), l the turn radius: a turn
// counts as the shift it makes at that radius, so that pure turns have a length, too. A feed is the tip's speed; a block that
// only turns takes the duration that the program says, or moves at the feed at the turn radius.
// A run ends where the machine stands still: at gates, at exact corners (G61), where the path turns back by more than 100
// degrees, and at the end. Such places are met exactly; other corners are rounded within the tolerances.
// The rotary words are roll, pitch, yaw about the fixed axes x, y, z of W (LinuxCNC's hexapods have the same).
// At a change of the spindle's speed the machine stands still for as long as its description says that it takes.
// Frames: W, z from the part to the spindle. Units: mm, rad, mm/s, s. Threads: values and pure functions.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "foundation/machine/hexapod_motion.hpp"
#include "foundation/motion/spatial_plan.hpp"
#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

struct SpatialPiece {
  double begin_mm = 0.0;  // offset of its start within its run
  double length_mm = 0.0;
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();  // line: start; arc: centre
  Eigen::Vector3d along = Eigen::Vector3d::Zero();      // line: to the end; arc: from the centre to the start
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();    // arc: turns about it, counter-clockwise
  double radius_mm = 0.0;                               // 0: line
  double growth_mm = 0.0;  // arc: of the radius, within the reader's arc tolerance
  double sweep_rad = 0.0;
  double rise_mm = 0.0;  // helix: along the normal
  double tip_length_mm = 0.0;
  Eigen::Quaterniond q_start = Eigen::Quaterniond::Identity();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // of the turn, in W
  double turn_rad = 0.0;
  double programmed_mm_per_s = 0.0;  // along the path length
  double feed_mm_per_s = 0.0;        // the same, within the machine's
  double tolerance_mm = 0.0;
  bool cutting = false;  // feed move
  std::uint32_t line = 0;
};

// Place and direction at an offset; derivatives by path length.
struct SpatialPoint {
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d tangent = Eigen::Vector3d::Zero();  // of the tip
  Eigen::Vector3d bend = Eigen::Vector3d::Zero();     // second derivative of the tip
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();     // rad a mm
};
SpatialPoint PointOn(const SpatialPiece& piece, double offset_mm);

struct SpatialEvent {
  SpatialAction action = SpatialAction::kSpindle;
  double offset_mm = 0.0;
  double argument = 0.0;
  std::uint32_t line = 0;
};

// What happens between two standstills, and then the gate, if any.
struct SpatialRun {
  std::vector<SpatialPiece> pieces;  // may be empty
  std::vector<SpatialEvent> events;
  GateKind gate = GateKind::kNone;
  double gate_argument = 0.0;
  std::uint32_t gate_line = 0;
  double length_mm() const { return pieces.empty() ? 0.0 : pieces.back().begin_mm + pieces.back().length_mm; }
};

struct SpatialPath {
  SpatialPoint start;
  std::vector<SpatialRun> runs;
  std::vector<ProgramFault> faults;
};

// Begins at the end of the first traverse if the program opens with one, else at X0 Y0 Z0 A0 B0 C0.
SpatialPath MakeSpatialPath(const std::vector<Operation>& operations, const HexapodMotion& motion,
                            double turn_radius_mm, double feed_scale);

}  // namespace lambdajet::trajectory
