// Decides which part of a plan a module gets next, from what the module says it has.
//
// Model: the drive names the first segment it lacks and how far it plays; segments go out until `ahead_s` of program time lie
// before it. What is on its way is not sent again until the module's wish has stood still for `patience_ns`: then it was lost
// or refused, and sending starts anew from the wish. Events and gates likewise, by their numbers. A module that holds another
// plan gets nothing.
// Units: s, ns of any one clock. Threads: one. Cost: a comparison a call; no allocation.
#pragma once

#include <cstdint>
#include <optional>

#include "foundation/motion/plan.hpp"
#include "foundation/motion/plan_batches.hpp"

namespace lambdajet::trajectory {

struct PacerLimits {
  double ahead_s = 2.0;
  std::int64_t patience_ns = 60'000'000;
  std::uint32_t per_batch = kSegmentsPerBatch;
};

// What the drive says of itself.
struct DriveWish {
  std::uint64_t plan = 0;
  std::uint32_t next_segment = 0;
  double tau_s = 0.0;
};

class SegmentPacer {
 public:
  explicit SegmentPacer(const PacerLimits& limits = {}) : limits_(limits) {}

  // The next batch, or nothing for now. The caller says Sent() when it went out.
  std::optional<PlanRange> Next(const Plan& plan, const DriveWish& wish, std::int64_t now_ns);
  void Sent(const PlanRange& range, std::int64_t now_ns);

  std::uint64_t resent() const { return resent_; }

 private:
  PacerLimits limits_;
  std::uint32_t sent_ = 0;  // first not sent
  std::uint32_t wish_ = 0;
  std::int64_t moved_ns_ = 0;  // when the wish last moved or something was sent for it
  std::uint64_t resent_ = 0;
};

// What main motion says of itself.
struct ProcessWish {
  std::uint64_t plan = 0;
  std::uint32_t next_event = 0;
  std::uint32_t next_gate = 1;
};

class ProcessPacer {
 public:
  explicit ProcessPacer(const PacerLimits& limits = {.per_batch = kEventsPerBatch}) : limits_(limits) {}

  std::optional<ProcessRange> Next(const Plan& plan, const ProcessWish& wish, std::int64_t now_ns);
  void Sent(const ProcessWish& wish, std::int64_t now_ns);

 private:
  PacerLimits limits_;
  ProcessWish answered_;  // wish for which the last batch went out
  std::int64_t sent_ns_ = 0;
  bool sent_ = false;
};

}  // namespace lambdajet::trajectory
