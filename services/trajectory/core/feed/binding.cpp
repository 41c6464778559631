#include "trajectory/core/feed/binding.hpp"

#include <algorithm>

namespace lambdajet::trajectory {

void FeedMoment::Offer(FeedLimit other, double share) {
  if (share > reached_share) {
    limit = other;
    reached_share = share;
  }
}

namespace {

FeedLimit LabelOf(const FeedMoment& m) {
  return m.reached_share >= kLimitReached ? m.limit : FeedLimit::kSmoothing;
}

}  // namespace

void BindingReport::Close(double s_mm) {
  for (const Span& span : Spans()) {
    Tell(span, span.end < moments_.size() ? moments_[span.end].s_mm : s_mm);
  }
  moments_.clear();
}

// The limit that a moment reaches, or else the one reached next before or after it that the smoothing ties it to.
std::vector<FeedLimit> BindingReport::Labels() const {
  const std::size_t count = moments_.size();
  std::vector<FeedLimit> labels;
  std::vector<std::size_t> after(count);  // moments until the next that reaches one
  std::size_t away = reach_moments_ + 1;
  for (std::size_t k = count; k-- > 0;) {
    away = LabelOf(moments_[k]) != FeedLimit::kSmoothing ? 0 : away + 1;
    after[k] = away;
  }
  std::size_t before = reach_moments_ + 1;
  for (std::size_t k = 0; k < count; ++k) {
    before = after[k] == 0 ? 0 : before + 1;
    const std::size_t nearest = std::min(before, after[k]);
    const std::size_t source = nearest == before ? k - nearest : k + nearest;
    labels.push_back(nearest <= reach_moments_ ? LabelOf(moments_[source]) : FeedLimit::kSmoothing);
  }
  return labels;
}

std::vector<BindingReport::Span> BindingReport::Spans() const {
  const std::vector<FeedLimit> labels = Labels();
  std::vector<Span> spans;
  for (std::size_t k = 0; k < labels.size();) {
    std::size_t end = k;
    while (end < labels.size() && labels[end] == labels[k]) {
      ++end;
    }
    if (labels[k] == FeedLimit::kSmoothing) {
      Unreached(k, end, spans);
    } else {
      spans.push_back({k, end, labels[k], labels[k]});
    }
    k = end;
  }
  return spans;
}

// By the limit that is nearest, each for at least as long as the smoothing reaches.
void BindingReport::Unreached(std::size_t begin, std::size_t end, std::vector<Span>& spans) const {
  const std::size_t first = spans.size();
  for (std::size_t k = begin; k < end;) {
    std::size_t same = k;
    while (same < end && moments_[same].limit == moments_[k].limit) {
      ++same;
    }
    const bool joins =
        spans.size() > first && (same - k <= reach_moments_ || spans.back().nearest == moments_[k].limit);
    if (joins) {
      spans.back().end = same;
    } else {
      spans.push_back({k, same, FeedLimit::kSmoothing, moments_[k].limit});
    }
    k = same;
  }
}

void BindingReport::Tell(const Span& span, double end_s_mm) {
  const FeedMoment& first = moments_[span.begin];
  SlowStretch told;
  told.from_s_mm = std::min(first.s_mm, end_s_mm);
  told.to_s_mm = end_s_mm;
  told.limit = span.limit;
  told.nearest = span.nearest;
  told.lowest_mm_per_s = first.speed_mm_per_s;
  told.programmed_mm_per_s = first.programmed_mm_per_s;
  told.line = first.line;
  double at_limit_mm = 0.0;
  for (std::size_t k = span.begin; k < span.end; ++k) {
    const FeedMoment& m = moments_[k];
    if (m.speed_mm_per_s < told.lowest_mm_per_s) {
      told.lowest_mm_per_s = m.speed_mm_per_s;
      told.programmed_mm_per_s = m.programmed_mm_per_s;
      told.line = m.line;
    }
    if (m.limit == span.nearest && m.reached_share > told.reached_share) {
      told.reached_share = m.reached_share;
      told.at_s_mm = std::clamp(m.s_mm, told.from_s_mm, told.to_s_mm);
    }
    if (LabelOf(m) == span.limit) {
      at_limit_mm += (k + 1 < span.end ? moments_[k + 1].s_mm : end_s_mm) - m.s_mm;
    }
  }
  const double length = told.to_s_mm - told.from_s_mm;
  told.share = length > 0.0 ? at_limit_mm / length : 1.0;
  slow_.push_back(told);
}

}  // namespace lambdajet::trajectory
