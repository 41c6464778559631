// Names the limit that binds, stretch by stretch, where the programmed feed is not held, from what the final plan does.
//
// Model: moments a fixed time apart, each with the limit that is nearest to being reached and its share of that limit. A
// limit is reached from 0.991 of it on, so that whoever measures elsewhere finds 0.99; a contour tolerance from 0.95, because
// plans are held to 0.97 of it between the places where it is measured. Moments that reach the same limit, one after the
// other, are a stretch. Between two limits the smoothing needs a while to change the jerk; so much of what reaches none is
// shared between the stretches before and behind. What reaches none for longer is SMOOTHING, and names the limit that it
// stays below, and by how much; where another one is the nearest for as long, another stretch begins.
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

// From here on a limit counts as reached.
double ReachedFrom(FeedLimit limit);

class BindingReport {
 public:
  // `change_moments`: what the smoothing needs to go from one limit to another.
  BindingReport(std::size_t change_moments, std::vector<SlowStretch>& slow)
      : change_moments_(change_moments), slow_(slow) {}

  void Take(const FeedMoment& moment) { moments_.push_back(moment); }
  // The feed is held from here on, or its run ends.
  void Close(double s_mm);

 private:
  struct Span {
    std::size_t begin = 0, end = 0;
    FeedLimit limit = FeedLimit::kSmoothing;
    FeedLimit nearest = FeedLimit::kFeed;
  };

  std::vector<Span> Spans() const;
  std::vector<Span> WithoutGaps(const std::vector<Span>& spans) const;
  void Unreached(std::size_t begin, std::size_t end, std::vector<Span>& spans) const;
  void Tell(const Span& span, double end_s_mm);

  std::size_t change_moments_;
  std::vector<SlowStretch>& slow_;
  std::vector<FeedMoment> moments_;
};

}  // namespace lambdajet::trajectory
