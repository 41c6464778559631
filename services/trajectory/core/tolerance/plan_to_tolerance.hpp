// Plans a part program as fast as its predicted contour error allows: feed from tolerance.
//
// Model: PlanOptions::hold names the tolerances. PaceSearch finds the fastest pace at which every place's 95 % bound is inside
// its tolerance; then each group (what of a contour has one tolerance) is drawn as whole machines, and where its 95th
// percentile does not stay inside with 95 % probability its bounds are widened and the search goes on. The answer holds both.
// Refused with TOLERANCE_NOT_REACHED where what the feed cannot change is too much already, or no pace was found: with line,
// place, excess, the source to blame and what would help.
// A corner is missed by no more than its tolerance either, though the program's G64 P allows more.
// With a resume, the pace is found for the whole program and the rest planned with it.
// Progress never falls, moves with every plan that is tried (pass_progress.hpp), and is 1 when there is a plan.
// Frames: W. Units: mm, s. Threads: pure; same inputs, same plan. Cost: some 20 to 60 plans. Errors: faults, no plan then.
#pragma once

#include <string_view>
#include <vector>

#include "accuracy/core/error_chain.hpp"
#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::trajectory {

// What of one contour has one tolerance.
struct HeldTolerance {
  std::uint32_t contour = 0;  // 1 is the first cut
  std::uint32_t first_line = 0;
  std::uint32_t last_line = 0;
  double tolerance_mm = 0.0;
  double predicted_95_mm = 0.0;  // its 95th percentile stays below with 95 % probability
  double worst_mm = 0.0;         // largest 95 % bound of a place
  std::uint32_t worst_line = 0;
  double margin_mm = 0.0;  // tolerance less the larger of the two
  accuracy::Source worst_source = accuracy::Source::kBase;
};

// Where and why a tolerance cannot be held.
struct ToleranceBlame {
  std::uint32_t line = 0;
  Eigen::Vector2d p_W_mm = Eigen::Vector2d::Zero();
  double tolerance_mm = 0.0;
  double predicted_mm = 0.0;  // at creeping speed, or at the slowest pace tried
  accuracy::Source source = accuracy::Source::kBase;
  std::string_view remedy;      // UPPER_SNAKE: IDENTIFY, COMPENSATE, MOVE_PART, LOOSEN_TOLERANCE
  double with_remedy_mm = 0.0;  // what would be predicted then; 0 not known
};

struct ToleranceReport {
  bool asked = false;
  std::vector<HeldTolerance> held;
  std::vector<ToleranceBlame> blame;  // one, where refused
  double fastest_s = 0.0;             // program time as the limits alone allow
  int plans = 0;                      // made on the way
  Pace pace;                          // of the answer
};

struct TolerancePlan {
  PlannedProgram planned;
  ToleranceReport report;
};

// Without wishes in `options.hold` the plan of PlanPartProgram.
TolerancePlan PlanToTolerance(std::string_view program, const MachineDescription& machine,
                              const PlanOptions& options, const PlanProgress& progress = {});

}  // namespace lambdajet::trajectory
