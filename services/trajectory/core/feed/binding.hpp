// Names the limit that binds, stretch by stretch, where the programmed feed is not held, from what the final plan does.
//
// Model: moments a fixed time apart, each with the limit that is nearest to being reached and its share of that limit. A
// limit is reached from 0.9 of it on, and its share is told: plans keep a little below their limits, a contour tolerance to
// 0.97, and a place that is slowed as much as the one next to it needs keeps a little more. The smoothing in time ties every moment to those
// within half its width: whoever drives faster here reaches the limit there. So a moment that reaches none is bound by the
// one reached next to it in time, as far as the smoothing ties. What is tied to none is SMOOTHING, and names the limit that
// it stays below, and by how much; where another one is the nearest for as long, another stretch begins.
// Units: mm, s. Threads: a value. Cost: linear; moments of one unbroken slow place are kept.
#pragma once

#include <cstdint>
#include <vector>

#include "trajectory/core/feed/speed_profile.hpp"

namespace lambdajet::trajectory {

struct FeedMoment {
  double s_mm = 0.0;
  double speed_mm_per_s = 0.0;
  double programmed_mm_per_s = 0.0;
  std::uint32_t line = 0;
  FeedLimit limit = FeedLimit::kFeed;
  double reached_share = 0.0;  // of that limit

  // Takes this limit instead where it is nearer to being reached.
  void Offer(FeedLimit other, double share);
};

// The feed counts as held from this share on.
inline constexpr double kFeedHeld = 0.99;

// A limit counts as reached from this share of it on; how much of it is used is told with it.
inline constexpr double kLimitReached = 0.9;

class BindingReport {
 public:
  // `reach_moments`: half the smoothing's width.
  BindingReport(std::size_t reach_moments, std::vector<SlowStretch>& slow)
      : reach_moments_(reach_moments), slow_(slow) {}

  void Take(const FeedMoment& moment) { moments_.push_back(moment); }
  // The feed is held from here on, or its run ends.
  void Close(double s_mm);

 private:
  struct Span {
    std::size_t begin = 0, end = 0;
    FeedLimit limit = FeedLimit::kSmoothing;
    FeedLimit nearest = FeedLimit::kFeed;
  };

  std::vector<FeedLimit> Labels() const;
  std::vector<Span> Spans() const;
  void Unreached(std::size_t begin, std::size_t end, std::vector<Span>& spans) const;
  void Tell(const Span& span, double end_s_mm);

  std::size_t reach_moments_;
  std::vector<SlowStretch>& slow_;
  std::vector<FeedMoment> moments_;
};

}  // namespace lambdajet::trajectory
