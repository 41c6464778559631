// Keeps the truth of the plans that somebody asked to have kept, until it is inspected.
//
// Model: a recording is named by its first plan and takes the truth of that plan and of its resumes; batches of another
// plan are let go. A batch missing in a writer's sequence is counted as lost, with the samples it would have held.
// Units: as core/cut_path.hpp. Validity: at most kMostRecordings, the oldest goes; kMostSamples of each stream, then no more
// is taken and the loss is counted. Threads: any. Cost: one lock a batch.
// Errors: NOT_FOUND NO_RECORDING.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "inspection/core/cut_path.hpp"

namespace lambdajet::inspection {

inline constexpr std::size_t kMostRecordings = 6;
inline constexpr std::size_t kMostSamples = 600000;  // ten minutes at 1 kHz, 34 MB with both streams

// Which writer, and which of its samples.
struct BatchOrigin {
  std::uint64_t session = 0;
  std::uint64_t sequence_number = 0;
  std::uint64_t plan = 0;
};

struct RecordingSize {
  std::uint64_t samples = 0;  // of the sheet
  std::uint64_t missing = 0;  // sample periods lost on the way, both streams
};

class Recorder {
 public:
  // Anew; or, with further plans while the recording is open, these are added to it and nothing is forgotten.
  void Begin(std::uint64_t plan, std::span<const std::uint64_t> further_plans);
  absl::StatusOr<RecordingSize> End(std::uint64_t plan);

  void TakeSheet(const BatchOrigin& origin, std::span<const SheetTruth> samples);
  void TakeJet(const BatchOrigin& origin, std::span<const JetTruth> samples,
               std::span<const WaterSwitch> switches, bool jet_on_after, double lag_time_s);

  // A copy; may be taken while the recording goes on.
  absl::StatusOr<Truth> TruthOf(std::uint64_t plan) const;

 private:
  struct Stream {
    std::uint64_t session = 0;
    std::uint64_t last = 0;
    std::uint64_t Lost(const BatchOrigin& origin);  // batches between the last one and this
  };
  struct Recording {
    std::uint64_t plan = 0;
    std::vector<std::uint64_t> plans;
    bool open = true;
    bool saw_jet = false;
    std::uint64_t missing = 0;
    Truth truth;
  };
  Recording* OpenFor(std::uint64_t plan);
  Recording* Named(std::uint64_t plan);
  void CountLost(std::uint64_t batches);

  mutable std::mutex mutex_;
  std::deque<Recording> recordings_;
  Stream sheet_;
  Stream jet_;
};

}  // namespace lambdajet::inspection
