// Keeps a job's record while the machine plays it: times, overruns, the slider trace, what became of process events.
//
// Model: sums over the cell's own cycles; module counters are differences, and start anew with a module's session.
// Units: mm, s; common time in ns. Threads: one. Cost: an addition a cycle; ten trace points a second.
#pragma once

#include <cstdint>
#include <utility>

#include "cell/core/job.hpp"
#include "cell/core/machine_view.hpp"
#include "cell/core/report.hpp"

namespace lambdajet::cell {

class Recorder {
 public:
  // Forgets everything; the next cycles belong to a job that started then.
  void Begin(std::int64_t started_ns);
  void Cycle(const MachineView& machine, JobState state, std::int64_t now_ns);
  void Add(const EventDeviation& event) { gathered_.events.push_back(event); }

  const JobRecord& gathered() const { return gathered_; }
  // Hands over what was gathered since the last time.
  JobRecord Take() { return std::exchange(gathered_, {}); }

 private:
  struct Counter {
    std::uint64_t session = 0;
    std::uint32_t last = 0;
    std::uint32_t NewSince(const ModuleView& module);
  };
  JobRecord gathered_;
  std::int64_t started_ns_ = 0;
  std::int64_t last_ns_ = 0;
  std::int64_t next_trace_ns_ = 0;
  Counter drive_;
  Counter main_motion_;
};

// Adds a later part of the same job's record.
void Append(JobRecord& record, const JobRecord& later);

}  // namespace lambdajet::cell
