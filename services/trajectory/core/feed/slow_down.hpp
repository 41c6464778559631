// Slows the places of a run where its plan exceeds a limit.
//
// Model: stretching time by 1/f divides a derivative of order n by f^-n, so a measured share r of a limit on it is cured by the
// factor r^(-1/n) on speed. The smoothing ties a moment to those within half its width; every node whose time lies so near
// to an excess is slowed, wider from pass to pass, so that slowing one place does not push the excess to the next for ever.
// Units: s; factors without unit. Shapes: one factor a node. Threads: values. Cost: linear in nodes and excesses.
#pragma once

#include <span>
#include <vector>

#include "trajectory/core/feed/speed_profile.hpp"

namespace lambdajet::trajectory {

// What is exceeded most.
struct Excess {
  double factor = 1.0;  // on speed, that just cures it
  FeedLimit reason = FeedLimit::kFeed;

  void Take(double cure, FeedLimit why);
  // `share` of a limit that falls with speed to the power of 1/`power`.
  void Judge(double share, double power, FeedLimit why);
  bool any() const { return factor < 1.0; }
};

struct SlowPlace {
  double begin_time_s = 0.0;
  double end_time_s = 0.0;
  Excess excess;
};

// How much slower than its limits allow a run is driven, node by node.
struct RunPace {
  std::vector<double> slow;  // of speed
  std::vector<double> ease;  // of acceleration
  std::vector<FeedLimit> reason;

  void Reset(std::size_t nodes);
  // `places` by their begin; node k is passed at begin_time_s + node_time_s[k]. Answers the last node slowed, -1: none.
  std::ptrdiff_t Slow(std::span<const SlowPlace> places, double half_s, double begin_time_s,
                      std::span<const double> node_time_s);

  // Caps speeds and accelerations; `free_mm_per_s` is what the slowing counts from.
  template <class Node>
  void Cap(std::span<const double> free_mm_per_s, std::vector<Node>& nodes) const {
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      if (slow[k] < 1.0) {
        nodes[k].speed_cap_mm_per_s = slow[k] * free_mm_per_s[k];
        nodes[k].acceleration_mm_per_s2 *= ease[k];
        nodes[k].cap_reason = reason[k];
      }
    }
  }
};

}  // namespace lambdajet::trajectory
