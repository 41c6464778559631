// Hears the truth of both simulated modules and hands it to the recorder.
//
// Model: reliable readers of plant/drive_truth and plant/jet_truth; a batch is ten 1 ms samples. Counts and flags that do
// not fit a batch, and numbers that are not finite, make the whole batch refused and counted.
// Threads: samples come on the bus's threads. Errors: those of platform/bus.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "inspection/recording/recorder.hpp"

namespace lambdajet {
class Participant;
}

namespace lambdajet::inspection {

class TruthReader {
 public:
  // Both outlive the reader.
  static absl::StatusOr<std::unique_ptr<TruthReader>> Open(Participant& bus, Recorder& recorder);
  ~TruthReader();

  std::uint64_t refused() const { return refused_.load(std::memory_order_relaxed); }
  int writers() const;  // of both topics, now

 private:
  struct Readers;
  TruthReader();
  std::atomic<std::uint64_t> refused_ = 0;
  std::unique_ptr<Readers> readers_;
};

}  // namespace lambdajet::inspection
