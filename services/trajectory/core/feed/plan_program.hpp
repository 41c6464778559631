// Plans a part program for one machine: from text or operations to segments, gates and process events the modules can play.
//
// Model: (1) geometry: runs of lines and arcs between gates (feed/program_path); (2) speed along each run, time-optimal under
// feed, path acceleration, curvature, kinks and the actuators' velocity and acceleration (feed/speed_profile); idle moves by
// the idle laws (idle_motion) or a straight trapezoid, whichever is quicker; (3) smoothing in time (feed/smoothing), which
// bounds jerk and keeps the contour; (4) inverse kinematics and its derivatives to quintic segments. The final polynomials
// are measured against every limit and the contour tolerance; where one is exceeded that stretch is slowed and planned again.
// Elastic feed-forward: the sheet follows r if the effector is driven by r + y with T y' + y = (m/k) r'', T = c/k (seed
// paper 000, elastic error; foundation/motion/plan.hpp).
// Frames: W in, actuators out. Units: mm, s. Threads: pure; the same inputs give the same plan bit for bit.
// Cost: about 1 us a millisecond of program time. Errors: faults with line and reason; no plan then.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "foundation/machine/machine_description.hpp"
#include "foundation/motion/plan.hpp"
#include "trajectory/core/feed/pace.hpp"
#include "trajectory/core/feed/program_path.hpp"
#include "trajectory/core/feed/speed_profile.hpp"
#include "trajectory/core/part_program/read_program.hpp"

namespace lambdajet::trajectory {

// A tolerance that the predicted contour error is to keep, asked of a part of the program; the tightest governs.
struct ToleranceWish {
  double tolerance_mm = 0.0;
  std::uint32_t first_line = 0;  // of the program; 0 and 0: any line
  std::uint32_t last_line = 0;
  std::uint32_t contour = 0;  // 1 is the first cut, from its pierce to jet off; 0: any
  bool operator==(const ToleranceWish&) const = default;
};

struct PlanOptions {
  bool compensate = false;                // elastic feed-forward, and feed from predicted error
  double tolerance_mm = 0.05;             // predicted error allowed where compensate is set
  double feed_scale = 1.0;                // of programmed feeds, (0, 1.2]
  std::optional<double> start_from_s_mm;  // resume: path length already cut
  double overlap_mm = 3.0;                // resume: backed up by this
  double sample_s = 0.004;                // distance of PlanSamples
  double knot_s = 0.002;
  int knots_per_segment = 4;
  std::vector<ToleranceWish> hold;  // feed from tolerance (core/tolerance); empty: not asked
  ProgramNotation notation = ProgramNotation::kByContent;
  std::shared_ptr<const Pace> pace;  // slower than the limits allow, place by place; none: as fast as they do
};

// How an idle move is made.
struct IdleReport {
  std::uint32_t line = 0;
  std::string_view law;  // UPPER_SNAKE
  std::string_view reason;
  double duration_s = 0.0;
  double start_speed_mm_per_s = 0.0;
  double peak_acceleration_mm_per_s2 = 0.0;
};

struct PlannedProgram {
  Plan plan;
  std::vector<PlanSample> samples;
  std::vector<ProgramFault> faults;
  std::vector<BindingLength> binding;  // longest first
  std::vector<SlowStretch> slow;
  std::vector<IdleReport> idle;
  std::vector<double> element_begin_s_mm;  // of the program's path, one an element
  Eigen::Vector2d start_W_mm = Eigen::Vector2d::Zero();
  double contour_deviation_mm = 0.0;  // largest distance of planned from programmed contour
  double cutting_length_mm = 0.0;
  double idle_length_mm = 0.0;
  double cutting_time_s = 0.0;  // moving with the jet on
  double gate_time_s = 0.0;
  std::uint32_t pierce_count = 0;
};

// Told how far planning has come, 0 … 1; false cancels.
using PlanProgress = std::function<bool(double)>;

// Same program, options and machine: same id. Never 0.
std::uint64_t PlanIdOf(std::string_view program, const PlanOptions& options,
                       const MachineDescription& machine);

PlannedProgram PlanPartProgram(std::string_view program, const MachineDescription& machine,
                               const PlanOptions& options, const PlanProgress& progress = {});

// The first half of that: reads the program, lays its path out, and checks its place. Faults are added; no path then.
ProgramPath LayOutProgram(std::string_view program, const MachineDescription& machine,
                          const PlanOptions& options, std::vector<ProgramFault>& faults);
// The second half, without the plan's id; resumes if the options say so.
PlannedProgram PlanLaidOutProgram(const ProgramPath& path, const MachineDescription& machine,
                                  const PlanOptions& options, const PlanProgress& progress = {});

// Reads and checks only: syntax, place on the sheet, reach, singular margin, travel.
struct Admission {
  std::vector<ProgramFault> faults;
  double cutting_length_mm = 0.0;
  double idle_length_mm = 0.0;
  std::uint32_t pierce_count = 0;
};
Admission AdmitPartProgram(std::string_view program, const MachineDescription& machine,
                           const PlanOptions& options);

}  // namespace lambdajet::trajectory
