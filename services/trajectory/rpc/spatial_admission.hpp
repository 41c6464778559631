// Admits a hexapod's program in named steps: PARSE, PLACE, REACH, LIMITS, TIME.
//
// Model: the checks of AdmitSpatialProgram one after another, then the plan at the desk, where it stays. Stops after the first
// step that refuses. Threads: Run() on one. Errors: as AdmissionInSteps.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "trajectory/rpc/plan_desk.hpp"
#include "trajectory/rpc/spatial_wire.hpp"

namespace lambdajet::trajectory {

class SpatialAdmissionInSteps {
 public:
  using Tell = std::function<bool(v1::AdmissionStep)>;  // false: nobody listens

  // `desk` and `closing` outlive it.
  SpatialAdmissionInSteps(std::string program, const SpatialOptions& options,
                          std::shared_ptr<const HexapodModel> hexapod, PlanDesk& desk,
                          const std::atomic<bool>& closing)
      : program_(std::move(program)),
        options_(options),
        hexapod_(std::move(hexapod)),
        desk_(desk),
        closing_(closing) {}

  absl::Status Run(const Tell& tell);

 private:
  absl::Status Check(const Tell& tell, bool& refused);
  absl::Status Plan(const Tell& tell);
  absl::Status End(const PlanRecord& record, const Tell& tell);

  std::string program_;
  SpatialOptions options_;
  std::shared_ptr<const HexapodModel> hexapod_;
  PlanDesk& desk_;
  const std::atomic<bool>& closing_;
};

}  // namespace lambdajet::trajectory
