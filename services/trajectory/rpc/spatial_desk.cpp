// Plans of a hexapod as resources of the same desk.
#include <chrono>

#include "trajectory/rpc/plan_desk.hpp"

namespace lambdajet::trajectory {

absl::StatusOr<std::shared_ptr<const PlanRecord>> PlanDesk::BeginSpatial(
    std::string program, const SpatialOptions& options, std::shared_ptr<const HexapodModel> hexapod) {
  const std::uint64_t id = SpatialPlanIdOf(program, *hexapod, options);
  const std::lock_guard lock(mutex_);
  if (auto there = There(id)) {
    return there;
  }
  PlanOptions kept;
  kept.feed_scale = options.feed_scale;
  kept.notation = options.notation;
  const auto record = NewRecord(id, std::move(kept), nullptr);
  record->hexapod = std::move(hexapod);
  record->spatial_options = options;
  record->program = std::move(program);
  if (const absl::Status queued = pool_.Submit([this, record] { WorkSpatial(record); }); !queued.ok()) {
    return queued;
  }
  Replace(record);
  return std::shared_ptr<const PlanRecord>(record);
}

// `planned` carries the faults, so that a refused plan is told like any other.
void PlanDesk::WorkSpatial(const std::shared_ptr<PlanRecord>& record) {
  const auto begin = std::chrono::steady_clock::now();
  auto faults = std::make_shared<PlannedProgram>();
  if (!record->cancel) {
    auto planned = std::make_shared<PlannedSpatialProgram>(PlanSpatialText(
        record->program, *record->hexapod, record->spatial_options, [&record](double progress) {
          record->progress = progress;
          return !record->cancel;
        }));
    faults->faults = planned->faults;
    record->spatial = std::move(planned);
  }
  Settle(record, std::move(faults), begin);
}

}  // namespace lambdajet::trajectory
