// Levels the tops of a speed profile, so that acceleration never turns into braking within the smoothing's first average.
//
// Model: the average of T1 = a / j makes a jump of acceleration to jerk, a jump / T1. Where speeding up at u1 meets braking at
// u2 with u1 + u2 above a, that would be more than j; kept level for T1 between them, both jumps are made one after the other,
// which is the quickest that jerk allows: from a to -a takes 2 T1 at j.
// Units: mm, s. Threads: pure. Cost: linear in the nodes.
#pragma once

#include <vector>

#include "trajectory/core/feed/speed_profile.hpp"

namespace lambdajet::trajectory {

// Lowers x about every top of a solved profile; the reason there is PATH_JERK.
void LevelTops(std::vector<ProfileNode>& nodes, double level_s, double acceleration_mm_per_s2);

}  // namespace lambdajet::trajectory
