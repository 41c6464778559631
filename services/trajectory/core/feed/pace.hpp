// Says how much slower than it could a plan is to run at each place of its feed moves.
//
// Model: a pace p in (0, 1] multiplies the speed that the limits alone allow at that place, and by p^2 the acceleration: the
// same time stretching that the planner itself applies where a limit is exceeded. Places are counted in run length, the
// length of all feed moves from the program's start on, which does not change with the speed (path length does, because
// idle moves are shaped by it). Idle moves have one pace each, so that the swing they leave behind can be made small.
// Units: mm. Shapes: cell i reaches from i cell_mm to (i + 1) cell_mm; `idle` by the element's number in the program; beyond
// the last: 1.
// Threads: a value.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace lambdajet::trajectory {

struct Pace {
  double cell_mm = 1.0;
  std::vector<double> cells;
  std::vector<double> idle;

  double OfIdle(std::size_t element) const { return element < idle.size() ? idle[element] : 1.0; }

  // Between the cells' middles straight lines, so that a plan answers a small change with a small change.
  double At(double run_mm) const {
    if (cells.empty()) {
      return 1.0;
    }
    const double place = std::max(0.0, run_mm / cell_mm - 0.5);
    const auto i = static_cast<std::size_t>(place);
    if (i + 1 >= cells.size()) {
      return i >= cells.size() + 1 ? 1.0 : cells.back();
    }
    const double share = place - static_cast<double>(i);
    return (1.0 - share) * cells[i] + share * cells[i + 1];
  }
};

}  // namespace lambdajet::trajectory
