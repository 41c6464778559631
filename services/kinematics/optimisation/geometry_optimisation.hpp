// Chooses link lengths and the rails' offset of a lambda or a biglide for a wanted zone.
//
// Model: four unknowns, main, attach and second link and the offset of both rails along D's y, each between bounds. Either
// the worst gain of actuator error to tool error over the zone is made small, 1/s_min(J_q_x) (seed paper 000's |J| judges
// only the product of both singular values), or the largest usable rectangle is made large. Poses of the zone that are not
// usable cost their worst shortfall, so the search finds its way from a geometry that does not serve the zone. NLopt: DIRECT-L
// over the whole box for half of the evaluations, then Subplex from the best.
// Frames: D. Units: mm; error gain mm/mm, rectangle mm^2. A biglide (attach = main) stays one.
// Threads: pure but for NLopt's own state, one an object. Cost: `evaluations` times 10 us (gain) or 3 ms (rectangle).
// Errors: answers: kBadGeometry, kActuatorLimit (no travel limits), kOutOfReach (nothing found serves the zone),
// kNotConverged (cancelled).
#pragma once

#include <functional>

#include "kinematics/core/workspace.hpp"

namespace lambdajet::kinematics {

enum class Objective { kErrorGain, kRectangle };

struct OptimisationTask {
  LambdaMechanism start;
  Rectangle zone;
  Objective objective = Objective::kErrorGain;
  double lowest_ratio = 0.5;  // of the starting lengths
  double highest_ratio = 2.0;
  int evaluations = 2000;
  std::function<bool()> cancelled;
};

struct OptimisationAnswer {
  Reason reason = Reason::kBadGeometry;
  LambdaMechanism found;
  double before = 0.0;  // objective of the start; 0 where the start does not serve the zone
  double after = 0.0;
  int evaluations = 0;
};

OptimisationAnswer OptimiseGeometry(const OptimisationTask& task);

// The worst error gain over the zone, on a raster of 17 x 17 poses; 0 if a pose is not usable, and the worst shortfall then.
struct ZoneGain {
  double gain = 0.0;
  double shortfall_mm = 0.0;
};
ZoneGain WorstErrorGain(const LambdaMechanism& mechanism, const Rectangle& zone);

}  // namespace lambdajet::kinematics
