// Asks at a fixed rate whatever the answers do, and measures each answer from when the question was due.
//
// Model: open loop: question n is due at start + n/rate. If the generator or the service is late, the wait counts: latency
// is answer minus due time (no coordinated omission). Questions are asynchronous; more than `most_outstanding` at once are
// not sent and count as errors, so an overload cannot eat the machine.
// Units: s. Threads: Run() blocks; answers come on any thread. Errors: counted by their reason.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "tests/load/latency_histogram.hpp"

namespace lambdajet::load {

struct Pace {
  double rate_per_s = 100.0;
  double duration_s = 10.0;
  int most_outstanding = 2000;
};

struct Measured {
  std::string what;
  double rate_per_s = 0.0;
  double duration_s = 0.0;
  LatencyHistogram latency;  // of answers without trouble, from the due time
  LatencyHistogram timer;    // how late this machine woke the generator itself
  std::map<std::string, std::uint64_t> errors;
  std::map<std::string, double> further;  // counts of the scenario's own

  std::uint64_t error_count() const;
};

// Sends question n and calls `answered` once, from anywhere.
using Question = std::function<void(std::uint64_t n, std::function<void(const absl::Status&)> answered)>;

Measured RunOpenLoop(const std::string& what, const Pace& pace, const Question& question);

}  // namespace lambdajet::load
