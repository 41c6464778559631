// Cuts a plan into the batches in which it travels to the modules.
//
// Model: a batch repeats what the modules must know of the whole plan and holds the entries from a first one on: as many as
// asked for, as the plan has and as the batch holds. The header is the sender's.
// Threads: pure. Cost: a copy; no allocation.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "foundation/motion/link_samples.hpp"

namespace lambdajet {

struct PlanRange {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};

struct ProcessRange {
  PlanRange gates;  // by id, from 1
  PlanRange events;
};

// Answers how many entries were copied.
template <typename Entry, std::size_t kMost>
std::uint32_t CopyEntries(const std::vector<Entry>& from, std::size_t first, std::size_t count,
                          std::array<Entry, kMost>& to) {
  count = first < from.size() ? std::min({count, from.size() - first, kMost}) : 0;
  std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(count > 0 ? first : 0), count, to.begin());
  return static_cast<std::uint32_t>(count);
}

inline void FillBatch(const Plan& plan, const PlanRange& range, SegmentBatch& batch) {
  batch.plan = plan.id;
  batch.segment_count = static_cast<std::uint32_t>(plan.segments.size());
  batch.elastic_lag_s2 = plan.elastic_lag_s2;
  batch.duration_s = plan.duration_s;
  batch.count = CopyEntries(plan.segments, range.first, range.count, batch.segments);
}

inline void FillBatch(const Plan& plan, const ProcessRange& range, ProcessBatch& batch) {
  batch.plan = plan.id;
  batch.gate_total = static_cast<std::uint32_t>(plan.gates.size());
  batch.event_total = static_cast<std::uint32_t>(plan.events.size());
  // Id 0 is no gate: a module without a plan names it.
  const std::uint32_t gates = range.gates.first > 0 ? range.gates.count : 0;
  batch.gate_count = CopyEntries(plan.gates, std::max(range.gates.first, 1U) - 1, gates, batch.gates);
  batch.event_count = CopyEntries(plan.events, range.events.first, range.events.count, batch.events);
}

}  // namespace lambdajet
