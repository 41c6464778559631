// Turns a canonical operation list into geometry: runs of lines and arcs along which the feed is planned, idle moves between
// them, gates at standstill and events keyed to the path.
//
// Model: a run is what is cut (or moved at feed) without a stop; it ends where a gate, an idle move, an exact corner (G61, or a
// tolerance of micrometres, within which a corner would be crossed more slowly than a stop) or the program's end stands. Frames: W. Units: mm, mm/s, rad. Threads: values and pure functions.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "foundation/motion/plan.hpp"
#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

// One line or arc; offset counts along it from its start.
struct PathPiece {
  double begin_mm = 0.0;  // offset of its start within its run
  double length_mm = 0.0;
  Eigen::Vector2d origin_mm = Eigen::Vector2d::Zero();  // line: start; arc: centre
  Eigen::Vector2d direction =
      Eigen::Vector2d::UnitX();  // line: unit tangent; arc: from the centre to the start
  double radius_mm = 0.0;        // 0: line; positive: counter-clockwise
  double feed_mm_per_s = 0.0;
  double tolerance_mm = 0.0;
  std::uint32_t line = 0;

  double curvature() const { return radius_mm == 0.0 ? 0.0 : 1.0 / radius_mm; }
};

struct PathPoint {
  Eigen::Vector2d p_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d tangent = Eigen::Vector2d::UnitX();
};

PathPoint PointOn(const PathPiece& piece, double offset_mm);
// Distance of a point from the piece, ends included.
double DistanceTo(const PathPiece& piece, const Eigen::Vector2d& p_mm);

enum class ElementKind : std::uint8_t { kRun, kIdle, kGate };

struct PathEvent {
  ProcessAction action = ProcessAction::kJetOff;
  double offset_mm = 0.0;  // within its element
  double argument = 0.0;
  std::uint32_t line = 0;
};

struct PathElement {
  ElementKind kind = ElementKind::kRun;
  std::uint32_t line = 0;
  bool jet_on = false;            // at its beginning; a gate: before it
  bool flush_after = false;       // run: comes to a full stop so that its end is met exactly
  std::vector<PathPiece> pieces;  // run
  Eigen::Vector2d from_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_mm = Eigen::Vector2d::Zero();
  std::vector<PathEvent> events;
  GateKind gate = GateKind::kNone;
  double gate_argument = 0.0;
  InputCondition gate_condition;
  std::size_t number = 0;     // in the whole program's path
  double run_begin_mm = 0.0;  // run: length of all runs before it, from the program's start

  double length_mm() const { return pieces.empty() ? 0.0 : pieces.back().begin_mm + pieces.back().length_mm; }
};

struct ProgramPath {
  Eigen::Vector2d start_mm = Eigen::Vector2d::Zero();
  std::vector<PathElement> elements;
  double begin_s_mm = 0.0;     // path length at its start; above 0 after a resume
  double cut_length_mm = 0.0;  // feed moves with the jet on
  std::uint32_t pierce_count = 0;
};

struct PathDefaults {
  double tolerance_mm = 0.02;  // before the program's first G64
  double pierce_time_s = 1.0;  // M3 without P
  double feed_scale = 1.0;
  double fastest_feed_mm_per_s = 1e9;
};

// The path begins at the end of the first traverse if the program opens with one, else in W's origin.
ProgramPath MakeProgramPath(const std::vector<Operation>& operations, const PathDefaults& defaults);

}  // namespace lambdajet::trajectory
