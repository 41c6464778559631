// Orders cuts for the shortest idle travel, part by part, holes before the outline around them.
//
// Model: a travelling salesman's path with precedence: parts in sequence, a part inside another's hole before that part; in a
// part the holes, then the outline. Nearest neighbour and the drawing's own order are both shortened (`shorten_path`), parts
// and the holes of each in turn, until neither gains, and the shorter is taken; so the result is never longer than the
// drawing's order. No random numbers: the same cuts give the same order.
// Frames: W. Units: mm. Threads: pure. Cost: as `shorten_path`, and again for every round in which a part or its holes gained.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace lambdajet::trajectory {

struct CutStop {
  Eigen::Vector2d entry_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d exit_mm = Eigen::Vector2d::Zero();
  int part = 0;
  int enclosing_part = 0;  // whose hole it lies in; 0: none
  bool hole = false;
};

struct CutOrder {
  std::vector<std::size_t> sequence;
  double idle_mm = 0.0;
  double drawing_idle_mm = 0.0;  // had the drawing's order been kept
};

// `shortest` false keeps the drawing's order as far as inner before outer allows.
CutOrder OrderCuts(const std::vector<CutStop>& cuts, const Eigen::Vector2d& home_mm, bool shortest);

}  // namespace lambdajet::trajectory
