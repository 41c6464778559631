#include "trajectory/core/feed/binding.hpp"

#include <algorithm>

namespace lambdajet::trajectory {

double ReachedFrom(FeedLimit limit) {
  return limit == FeedLimit::kCorner || limit == FeedLimit::kContourTolerance ? 0.95 : 0.991;
}

void FeedMoment::Offer(FeedLimit other, double share) {
  if (share * ReachedFrom(limit) > reached_share * ReachedFrom(other)) {
    limit = other;
    reached_share = share;
  }
}

namespace {

FeedLimit LabelOf(const FeedMoment& m) {
  return m.reached_share >= ReachedFrom(m.limit) ? m.limit : FeedLimit::kSmoothing;
}

}  // namespace

void BindingReport::Close(double s_mm) {
  const std::vector<Span> spans = WithoutGaps(Spans());
  for (const Span& span : spans) {
    Tell(span, span.end < moments_.size() ? moments_[span.end].s_mm : s_mm);
  }
  moments_.clear();
}

// By limit reached; one span for all that reaches none.
std::vector<BindingReport::Span> BindingReport::Spans() const {
  std::vector<Span> spans;
  for (std::size_t k = 0; k < moments_.size(); ++k) {
    const FeedLimit label = LabelOf(moments_[k]);
    if (spans.empty() || spans.back().limit != label) {
      spans.push_back({k, k, label, label});
    }
    spans.back().end = k + 1;
  }
  return spans;
}

std::vector<BindingReport::Span> BindingReport::WithoutGaps(const std::vector<Span>& spans) const {
  std::vector<Span> kept;
  std::size_t begin = 0;  // of the next span, which may take over a part of the gap before it
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const bool last = i + 1 == spans.size();
    if (spans[i].limit != FeedLimit::kSmoothing) {
      if (!kept.empty() && kept.back().limit == spans[i].limit) {
        kept.back().end = spans[i].end;
      } else {
        kept.push_back({begin, spans[i].end, spans[i].limit, spans[i].limit});
      }
      begin = spans[i].end;
    } else if (spans[i].end - spans[i].begin > change_moments_ || spans.size() == 1) {
      Unreached(spans[i].begin, spans[i].end, kept);
      begin = spans[i].end;
    } else if (!kept.empty()) {
      begin = last ? spans[i].end : (spans[i].begin + spans[i].end) / 2;
      kept.back().end = begin;
    }
  }
  return kept;
}

// By the limit that is nearest, each for at least the time of a change.
void BindingReport::Unreached(std::size_t begin, std::size_t end, std::vector<Span>& spans) const {
  const std::size_t first = spans.size();
  for (std::size_t k = begin; k < end;) {
    std::size_t same = k;
    while (same < end && moments_[same].limit == moments_[k].limit) {
      ++same;
    }
    const bool joins =
        spans.size() > first && (same - k <= change_moments_ || spans.back().nearest == moments_[k].limit);
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
