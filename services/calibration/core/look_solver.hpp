// Solves a system of looks with Ceres and accounts for what the looks alone have told.
//
// Model: core/identification.hpp.
// Frames, units: of core/look_system.hpp, everything scaled to N(0, I) priors.
// Threads: one solver, one thread; Ceres runs single-threaded, so results repeat to the bit.
// Cost: a normal matrix of 19 + 2 a mark + 6 a tracking run, a few iterations.
// Errors: SolveEnd.
#pragma once

#include <functional>
#include <vector>

#include "calibration/core/look_system.hpp"

namespace lambdajet::calibration {

enum class RobustLoss { kNone, kHuber, kCauchy };
enum class SolveEnd { kConverged, kNotConverged, kCancelled };

struct SolveReport {
  SolveEnd end = SolveEnd::kNotConverged;
  int iterations = 0;
};

// Minimises over the looks whose `active` is not zero, from `at` and into it.
SolveReport SolveLooks(LookSystem& system, const std::vector<char>& active, RobustLoss loss,
                       int max_iterations, const std::function<bool()>& go_on, LookUnknowns& at);

// Information of the active looks on z with marks and runs eliminated, at the point last evaluated.
ParameterCovariance InformationOfLooks(const LookSystem& system, const std::vector<char>& active);

// The whole minimum: looks, z, marks and runs.
double SumOfSquares(const LookSystem& system, const std::vector<char>& active, const LookUnknowns& at);

}  // namespace lambdajet::calibration
