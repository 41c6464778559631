// Hands out the first segments of a plan long before the whole program is planned, and the rest as it is made.
//
// Model: a program is read line by line and a speed profile depends on what comes no further than the way to a stop. So the
// program's first lines, ended there, give a plan that comes to rest at their end, and all of it but the last seconds is the
// whole plan's, bit for bit. First lines are planned, handed out but for those seconds, then four times as many, until they
// are all. Each longer plan is compared with what has been handed out before anything is added; what has been handed out can
// always be played to rest on the path, by the plan it came from. First lines that cannot stand alone (a loop not closed)
// give no early segments.
// Units: s. Threads: pure; the sink is called from the caller's thread. Cost: a third on top of the whole plan at most; the
// first call comes after the first lines are planned, whatever the program's length.
// Errors: those of PlanPartProgram; EARLY_SEGMENTS_DIFFER if a longer plan is not the continuation (the caller stops using
// what it was given), CANCELLED if the sink says so.
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::trajectory {

// Segments in order, none twice, each as soon as nothing can change it any more; false cancels.
using SegmentSink = std::function<bool(std::span<const Segment>)>;

struct EarlyLook {
  std::size_t first_lines = 12'288;
  std::size_t growth = 4;
  double withheld_s = 2.0;  // before the end of first lines: what lies behind them could still change it
};

// As PlanPartProgram, the whole plan is the answer.
PlannedProgram PlanWithEarlySegments(std::string_view program, const MachineDescription& machine,
                                     const PlanOptions& options, const SegmentSink& sink,
                                     const EarlyLook& look = {}, const PlanProgress& progress = {});

}  // namespace lambdajet::trajectory
