// Carries a planned motion of six struts from the planner to what plays it: segments, gates and process events.
//
// Model: as foundation/motion/plan.hpp without elastic lead: in local time t = tau - start_s a segment holds what each strut's
// encoder is to read, q(t), and the path length s(t), all polynomials of degree 5 that meet the next segment's in value and
// first and second derivative. Played with a rate w = d tau/dt, a hold or override never leaves the path.
// Path length s counts sqrt(dp^2 + (l d phi)^2): the tip's way, and the tool's turning as its shift at the radius l.
// Units: mm, s. Threads: values.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "foundation/motion/plan.hpp"

namespace lambdajet {

inline constexpr int kStrutCount = 6;

struct SpatialSegment {
  std::uint32_t index = 0;
  double start_s = 0.0;  // program time tau
  double duration_s = 0.0;
  std::array<Polynomial, kStrutCount> q_mm;
  Polynomial s_mm;
  std::uint32_t gate_at_end = 0;  // id of the gate that closes at this segment's end; 0: none
};

enum class SpatialAction : std::uint8_t {
  kSpindle,  // argument: turns a minute, clockwise positive; 0 stops it
  kCoolantOn,
  kCoolantOff,
  kCameraTrackOn,  // argument: id of the mark
  kCameraTrackOff
};

// Something beside the struts that happens when the path length reaches s_mm. A spindle's way to its speed is waited for at
// the dwell that stands there.
struct SpatialProcessEvent {
  std::uint32_t index = 0;  // 0, 1, … in path order
  SpatialAction action = SpatialAction::kSpindle;
  double s_mm = 0.0;
  double argument = 0.0;
  std::uint32_t source_line = 0;
};

struct SpatialPlan {
  std::uint64_t id = 0;  // hash of program, options and machine: the same inputs, the same plan
  std::string machine_id;
  double turn_radius_mm = 0.0;  // l
  double duration_s = 0.0;
  double length_mm = 0.0;
  std::vector<SpatialSegment> segments;
  std::vector<Gate> gates;
  std::vector<SpatialProcessEvent> events;
};

}  // namespace lambdajet
