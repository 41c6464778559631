// Writes the part program of a measuring run: which marks to look at, where to pierce on trial, how to shake the sheet.
//
// Model: looks are chosen one by one from the marks in reach so that each adds most to log det(I + information) of the 19
// parameters scaled to their priors (Bayesian D-optimal design, greedy: Chaloner and Verdinelli, Statistical Science 10,
// 1995, section 2), then put into a short order (nearest neighbour and 2-opt). Trial pierces stand in the sheet's corners,
// clear of marks; the camera looks at each hole. Shaking: strokes and circles about a mark at nine tenths of the path's
// acceleration in x and in y, then a rest during which the sheet swings out; the camera follows the mark throughout.
// Frames: the program is written in W; its coordinates are the jet's nominal place, so that the mark stands in the picture.
// Each place is watched from the stop on for some swings of the sheet (core/look_system.hpp takes the swing out).
// Words: M100 P<mark> takes a look at rest, M101 P<mark> … M102 follows a mark, M3 P<s> … M5 pierces; as
// services/trajectory/README.md.
// Units: mm, s; mm/min in the program.
// Threads: pure.
// Cost: looks times marks times a 19 x 19 solve.
// Errors: the answer's reason.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/core/look_model.hpp"

namespace lambdajet::calibration {

enum class PlanReason : std::uint8_t { kPlanned, kMarksOutOfReach, kNoPlaceToPierce };
std::string_view PlanReasonName(PlanReason reason);  // UPPER_SNAKE

struct MeasuringPlanOptions {
  int looks = 16;
  int trial_pierces = 3;
  double pierce_time_s = 0.5;
  bool elasticity = true;
  double longest_time_s = 40.0;
  // The only corner of the sheet to pierce in; without it all four are used in turn.
  std::optional<Eigen::Vector2d> scrap_W_mm;
};

struct MeasuringPlan {
  PlanReason reason = PlanReason::kMarksOutOfReach;
  std::string explanation;
  std::string program;
  std::vector<int> marks;  // in order
  std::vector<Eigen::Vector2d> pierces_W_mm;
  int tracked_mark = 0;
  double machine_time_s = 0.0;      // estimate
  double expected_before_mm = 0.0;  // jet's place on the sheet, 95 %, worst over the sheet
  double expected_mm = 0.0;
};

MeasuringPlan PlanMeasuringRun(const MachineDescription& machine, const MeasuringPlanOptions& options = {});

// A short program of looks that tells best whether the base has moved.
MeasuringPlan PlanVerification(const MachineDescription& machine, int looks = 3);

}  // namespace lambdajet::calibration
