// Shortens the path through directed stops by exchanging stretches of it.
//
// Model: local search over 2-opt (a stretch reversed; each stop keeps its own direction, so all idle moves in it change) and
// the exchange of two neighbouring stretches (Or 1976: one of at most three stops; Or-3opt: both of any length), tried where
// a new move joins an exit with one of the nearest entries, with don't-look bits (Bentley, Fast algorithms for geometric
// travelling salesman problems, ORSA J. Computing 4, 1992). Then, on a fixed schedule without random numbers, two short
// stretches are exchanged, the place is searched again, and what became longer is taken back (Johnson and McGeoch 1997).
// Frames: any. Units: mm. Threads: pure. Cost: an exchange is priced in constant time but for one addition every 256 stops
// of a reversed stretch; 1000 stops took 0.2 s, 10 000 half a second. Of paths above 5000 stops only stretches of 25 * 10^6 / n are exchanged.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace lambdajet::trajectory {

struct Stop {
  Eigen::Vector2d entry_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d exit_mm = Eigen::Vector2d::Zero();
};

inline constexpr std::size_t kNoStop = static_cast<std::size_t>(-1);

// Reorders `sequence`, which names stops, from `before` to `after`, if there is one; true if it became shorter.
// `later[s]` stands after stop s, and did in `sequence`; kNoStop: none. Empty: no stop has one.
bool ShortenPath(const std::vector<Stop>& stops, const std::vector<std::size_t>& later,
                 const Eigen::Vector2d& before, const Eigen::Vector2d* after,
                 std::vector<std::size_t>& sequence);

}  // namespace lambdajet::trajectory
