// Tells how far a search of an unknown number of passes has come.
//
// Model: the search says before each pass how many it expects to be left, this one among them; the pass then moves the ratio by
// its part of what is left, p' = p + (1 - p)/left, evenly with its own progress. So the ratio never falls and never stands for
// a whole pass, whatever the search had expected before, and grows evenly with the passes where it expects rightly.
// Threads: one. Cost: a few additions.
#pragma once

#include <algorithm>

#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::trajectory {

class PassProgress {
 public:
  // `told` outlives it and may be empty.
  explicit PassProgress(const PlanProgress& told) : told_(told) {}

  // `left` is at least 2 unless this is the last pass of all. False: not wanted any more.
  bool Begin(double left) {
    ratio_ = end_;
    end_ = ratio_ + (1.0 - ratio_) / std::max(1.0, left);
    return Within(0.0);
  }
  // Of the pass under way, 0 … 1.
  bool Within(double share) {
    told_share_ = std::max(told_share_, ratio_ + (end_ - ratio_) * std::clamp(share, 0.0, 1.0));
    return !told_ || told_(told_share_);
  }

 private:
  const PlanProgress& told_;
  double ratio_ = 0.0;
  double end_ = 0.0;
  double told_share_ = 0.0;
};

}  // namespace lambdajet::trajectory
