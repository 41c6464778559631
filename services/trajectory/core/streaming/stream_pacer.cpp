#include "trajectory/core/streaming/stream_pacer.hpp"

#include <algorithm>

namespace lambdajet::trajectory {

std::optional<PlanRange> SegmentPacer::Next(const Plan& plan, const DriveWish& wish, std::int64_t now_ns) {
  const auto total = static_cast<std::uint32_t>(plan.segments.size());
  if (wish.plan != plan.id || wish.next_segment >= total) {
    return std::nullopt;
  }
  if (wish.next_segment != wish_) {
    wish_ = wish.next_segment;
    moved_ns_ = now_ns;
  }
  const bool lost = sent_ > wish_ && now_ns - moved_ns_ > limits_.patience_ns;
  if (lost) {
    ++resent_;
    moved_ns_ = now_ns;
  }
  if (lost || sent_ < wish_) {
    sent_ = wish_;
  }
  if (sent_ >= total || plan.segments[sent_].start_s > wish.tau_s + limits_.ahead_s) {
    return std::nullopt;
  }
  return PlanRange{sent_, std::min(limits_.per_batch, total - sent_)};
}

void SegmentPacer::Sent(const PlanRange& range, std::int64_t now_ns) {
  if (sent_ == wish_) {
    moved_ns_ = now_ns;
  }
  sent_ = range.first + range.count;
}

std::optional<ProcessRange> ProcessPacer::Next(const Plan& plan, const ProcessWish& wish,
                                               std::int64_t now_ns) {
  const auto gates = static_cast<std::uint32_t>(plan.gates.size());
  const auto events = static_cast<std::uint32_t>(plan.events.size());
  const bool wants = wish.next_gate <= gates || wish.next_event < events;
  if (wish.plan != plan.id || !wants) {
    return std::nullopt;
  }
  const bool answered =
      sent_ && answered_.next_event == wish.next_event && answered_.next_gate == wish.next_gate;
  if (answered && now_ns - sent_ns_ < limits_.patience_ns) {
    return std::nullopt;
  }
  ProcessRange range;
  range.gates.first = wish.next_gate;
  range.gates.count = wish.next_gate <= gates ? std::min(limits_.per_batch, gates - wish.next_gate + 1) : 0;
  range.events.first = wish.next_event;
  range.events.count = wish.next_event < events ? std::min(limits_.per_batch, events - wish.next_event) : 0;
  return range;
}

void ProcessPacer::Sent(const ProcessWish& wish, std::int64_t now_ns) {
  answered_ = wish;
  sent_ns_ = now_ns;
  sent_ = true;
}

}  // namespace lambdajet::trajectory
