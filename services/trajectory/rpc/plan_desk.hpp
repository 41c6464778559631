// Keeps plans as resources: begun, watched, cancelled, found again by id.
//
// Model: one plan an id; the same request under the same machine finds the plan that is there. Planning runs on threads of
// its own; finished plans stay until kMostPlans others are newer (one that is being streamed is not given up), each with its
// program, so that it can be written out.
// Units: s, mm. Threads: any. Errors: RESOURCE_EXHAUSTED OVERLOADED when too many plans wait.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "foundation/machine/machine_description.hpp"
#include "platform/process/kept_text.hpp"
#include "platform/rpc/work_pool.hpp"
#include "platform/telemetry/metrics.hpp"
#include "trajectory/core/spatial_feed/spatial_program.hpp"
#include "trajectory/core/tolerance/plan_to_tolerance.hpp"
#include "trajectory/rpc/submitted_program.hpp"

namespace lambdajet::trajectory {

enum class PlanState : std::uint8_t { kRunning, kDone, kFailed, kCancelled };

// One plan. The result is set once, before the state leaves kRunning.
struct PlanRecord {
  std::uint64_t id = 0;
  std::uint64_t number = 0;  // counts up; newest is highest
  std::shared_ptr<const MachineDescription> machine;
  PlanOptions options;
  std::string program;  // until planning ends
  KeptText kept;        // the same after it, of a plan that is done
  std::atomic<PlanState> state = PlanState::kRunning;
  std::atomic<double> progress = 0.0;
  std::atomic<bool> cancel = false;
  std::shared_ptr<const PlannedProgram> planned;
  ToleranceReport tolerance;
  double predicted_95_mm = 0.0;
  // Of a hexapod's plan: `machine` is null, and `planned` has the faults only.
  std::shared_ptr<const HexapodModel> hexapod;
  SpatialOptions spatial_options;
  std::shared_ptr<const PlannedSpatialProgram> spatial;
};

class PlanDesk {
 public:
  static constexpr std::size_t kMostPlans = 12;  // that have ended
  static constexpr std::size_t kMostKeptBytes =
      2u << 20;  // of a program in memory; longer ones are kept in a file

  explicit PlanDesk(Metrics& metrics);

  // A program with faults is a plan that has failed.
  absl::StatusOr<std::shared_ptr<const PlanRecord>> Begin(MadeProgram program, PlanOptions options,
                                                          std::shared_ptr<const MachineDescription> machine);
  absl::StatusOr<std::shared_ptr<const PlanRecord>> BeginSpatial(std::string program,
                                                                 const SpatialOptions& options,
                                                                 std::shared_ptr<const HexapodModel> hexapod);
  std::shared_ptr<const PlanRecord> Find(std::uint64_t id) const;  // null: not known
  std::shared_ptr<const PlanRecord> Cancel(std::uint64_t id);
  // Waits until the plan is no longer running, at most so long; true if it is not.
  bool Await(const PlanRecord& record, double most_s) const;
  std::vector<std::shared_ptr<const PlanRecord>> List() const;  // newest first
  void KeepFor(std::uint64_t id);                               // this one is being streamed; 0 none
  void CancelAll();

 private:
  std::shared_ptr<PlanRecord> NewRecord(std::uint64_t id, PlanOptions options,
                                        std::shared_ptr<const MachineDescription> machine);
  void Replace(std::shared_ptr<PlanRecord> record);
  std::shared_ptr<const PlanRecord> There(std::uint64_t id) const;  // null: none, or one that was cancelled
  void Work(const std::shared_ptr<PlanRecord>& record);
  void WorkSpatial(const std::shared_ptr<PlanRecord>& record);
  void Settle(const std::shared_ptr<PlanRecord>& record, std::shared_ptr<const PlannedProgram> planned,
              std::chrono::steady_clock::time_point begin);
  void GiveUpOldest();

  mutable std::mutex mutex_;
  mutable std::condition_variable ended_;
  std::vector<std::shared_ptr<PlanRecord>> records_;
  std::uint64_t numbers_ = 0;
  std::uint64_t kept_ = 0;
  Counter plans_done_, plans_failed_;
  Histogram planning_time_;
  WorkPool pool_;  // last: its threads end first
};

}  // namespace lambdajet::trajectory
