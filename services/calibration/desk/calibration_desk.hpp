// Does the calibration house's work behind its doors: takes looks in, plans runs, identifies, keeps and activates versions.
//
// Model: the store (store/calibration_store.hpp) is the truth; the active machine is kept beside it as a shared value. The
// prior of every identification is version 0, as designed: modules are moved between runs, and what an old run said of the
// base says nothing of the new one. An identification runs on a thread of its own and is an operation with a state that
// survives a restart (a killed one is FAILED INTERRUPTED).
// Threads: any.
// Cost: planning and verifying below some milliseconds; identification some 100 ms on its own thread.
// Errors: NOT_FOUND UNKNOWN_RUN, UNKNOWN_VERSION, UNKNOWN_OPERATION; FAILED_PRECONDITION NO_MACHINE_FILE, OTHER_MACHINE,
// PLAN_REFUSED reasons of the core; those of the store.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "calibration/core/measuring_plan.hpp"
#include "calibration/core/verification.hpp"
#include "calibration/desk/identification_report.hpp"
#include "calibration/store/calibration_store.hpp"
#include "foundation/machine/machine_description.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/rpc/work_pool.hpp"

namespace lambdajet::calibration {

struct OperationView {
  std::string id;
  OperationState state = OperationState::kRunning;
  double progress = 0.0;
  std::string phase;
  std::string reason;
  std::string message;
  std::optional<IdentificationReport> report;
};

using SharedMachine = std::shared_ptr<const MachineDescription>;
using MachineListener =
    std::function<void(const MachineDescription& active, const std::string& as_designed_yaml)>;

class CalibrationDesk {
 public:
  // `machine_file` may be empty if the store has a version 0 already.
  static absl::StatusOr<std::unique_ptr<CalibrationDesk>> Open(const std::string& store_path,
                                                               const std::string& machine_file,
                                                               const std::string& machine_id,
                                                               const Clock& clock);
  ~CalibrationDesk();

  // Called at once with the active machine and again on every activation, under the desk's lock: hand over and return.
  void Listen(MachineListener listener);
  // Called before a run is read, so that looks on their way to the store are not missed; set before the doors open.
  void BeforeReading(std::function<void()> wait) { before_reading_ = std::move(wait); }
  SharedMachine active() const;
  SharedMachine as_designed() const { return as_designed_; }

  absl::StatusOr<int> TakeLooks(const std::vector<RecordedLook>& looks) { return store_->AddLooks(looks); }
  absl::StatusOr<std::vector<RunHead>> Runs(int most, std::int64_t before_row) {
    return store_->Runs(most, before_row);
  }
  absl::StatusOr<std::vector<RecordedLook>> Run(std::uint64_t plan);

  absl::StatusOr<MeasuringPlan> PlanRun(const MeasuringPlanOptions& options) const;
  absl::StatusOr<MeasuringPlan> PlanShortRun(int looks) const;
  // With the machine compared against.
  absl::StatusOr<std::pair<Verification, SharedMachine>> Verify(std::uint64_t plan);

  absl::StatusOr<OperationView> StartIdentification(std::uint64_t plan, const std::string& author);
  absl::StatusOr<OperationView> FindOperation(const std::string& id);
  absl::StatusOr<OperationView> Cancel(const std::string& id);

  absl::StatusOr<Version> FindVersion(std::optional<std::uint32_t> number);
  absl::StatusOr<std::vector<Version>> Versions(int most, std::optional<std::uint32_t> before) {
    return store_->Versions(most, before);
  }
  absl::StatusOr<SharedMachine> Activate(std::uint32_t number, const std::string& author);
  MachineDescription MachineOf(const Version& version) const;

  // Cancels what runs and waits for it.
  void Close();

 private:
  struct Running {
    std::atomic<bool> cancelled = false;
    std::mutex mutex;
    double progress = 0.0;
    std::string phase;
  };

  CalibrationDesk(std::unique_ptr<CalibrationStore> store, MachineDescription as_designed, std::string yaml,
                  const Clock& clock);
  void IdentifyRun(StoredOperation operation, std::vector<Measurement> looks,
                   std::shared_ptr<Running> running);
  absl::Status Keep(const Identification& found, StoredOperation& operation);
  void SetActive(const Version& version);

  std::unique_ptr<CalibrationStore> store_;
  SharedMachine as_designed_;
  std::string as_designed_yaml_;
  const Clock& clock_;
  mutable std::mutex mutex_;
  SharedMachine active_;
  std::vector<MachineListener> listeners_;
  std::function<void()> before_reading_;
  std::map<std::string, std::shared_ptr<Running>> running_;
  std::unique_ptr<WorkPool> worker_;  // last: its threads use the rest
};

}  // namespace lambdajet::calibration
