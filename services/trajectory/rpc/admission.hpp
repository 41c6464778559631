// Admits a program in named steps: PARSE, PLACE, REACH, LIMITS, TIME, ACCURACY.
//
// Model: reading and place in one look (AdmitPartProgram), told as three steps; then the program is planned at the desk, where
// the plan stays, and its time and prediction are told. Stops after the first step that refuses.
// Threads: Run() on one. Errors: CANCELLED when nobody listens any more; the desk's own when it takes no more plans.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "trajectory/rpc/wire.hpp"

namespace lambdajet::trajectory {

class AdmissionInSteps {
 public:
  using Tell = std::function<bool(v1::AdmissionStep)>;  // false: nobody listens

  // `desk` and `closing` outlive it.
  AdmissionInSteps(SubmittedProgram program, const PlanOptions& options,
                   std::shared_ptr<const MachineDescription> machine, PlanDesk& desk,
                   const std::atomic<bool>& closing)
      : submitted_(std::move(program)),
        options_(options),
        machine_(std::move(machine)),
        desk_(desk),
        closing_(closing) {}

  absl::Status Run(const Tell& tell);

 private:
  absl::Status Read(const Tell& tell, bool& refused);
  absl::Status Plan(const Tell& tell);
  absl::Status Watch(const PlanRecord& record, const Tell& tell);

  SubmittedProgram submitted_;
  MadeProgram program_;
  PlanOptions options_;
  std::shared_ptr<const MachineDescription> machine_;
  PlanDesk& desk_;
  const std::atomic<bool>& closing_;
};

}  // namespace lambdajet::trajectory
