#include "trajectory/rpc/spatial_admission.hpp"

#include <array>

#include "foundation/contract/trouble.hpp"
#include "trajectory/rpc/wire.hpp"

namespace lambdajet::trajectory {
namespace {

using Step = v1::AdmissionStep;

constexpr double kTellEvery_s = 0.1;
constexpr std::array<const char*, 3> kChecks = {"PARSE", "PLACE", "REACH"};  // in the order of AdmissionCheck

absl::Status NobodyListens() {
  return Trouble(absl::StatusCode::kCancelled, "CANCELLED", "the client has gone");
}

Step MakeStep(const char* name, Step::State state, double progress) {
  Step step;
  step.set_step(name);
  step.set_state(state);
  step.set_progress(progress);
  return step;
}

}  // namespace

absl::Status SpatialAdmissionInSteps::Run(const Tell& tell) {
  bool refused = false;
  const absl::Status status = Check(tell, refused);
  return status.ok() && !refused ? Plan(tell) : status;
}

absl::Status SpatialAdmissionInSteps::Check(const Tell& tell, bool& refused) {
  if (!tell(MakeStep("PARSE", Step::STATE_RUNNING, 0.0))) {
    return NobodyListens();
  }
  const SpatialAdmission admission = AdmitSpatialProgram(program_, *hexapod_, options_);
  refused = !admission.faults.empty();
  const auto last = static_cast<std::size_t>(admission.check);
  for (std::size_t i = 0; i <= last; ++i) {
    Step step = MakeStep(kChecks[i], i == last && refused ? Step::STATE_REFUSED : Step::STATE_PASSED, 1.0);
    for (const ProgramFault& fault : admission.faults) {
      if (i == last) {
        ToWire(fault, *step.add_faults());
      }
    }
    if (i == last && !refused) {
      ToWire(admission, *hexapod_, *step.mutable_admission());
    }
    if (!tell(std::move(step))) {
      return NobodyListens();
    }
  }
  return absl::OkStatus();
}

absl::Status SpatialAdmissionInSteps::Plan(const Tell& tell) {
  const auto record = desk_.BeginSpatial(std::move(program_), options_, hexapod_);
  if (!record.ok()) {
    return record.status();
  }
  if (!tell(MakeStep("LIMITS", Step::STATE_RUNNING, 0.0))) {
    return NobodyListens();
  }
  while (!desk_.Await(**record, kTellEvery_s)) {
    if (closing_ || !tell(MakeStep("LIMITS", Step::STATE_RUNNING, (*record)->progress))) {
      return NobodyListens();
    }
  }
  return End(**record, tell);
}

absl::Status SpatialAdmissionInSteps::End(const PlanRecord& plan, const Tell& tell) {
  if (plan.state == PlanState::kCancelled) {
    return Trouble(absl::StatusCode::kAborted, "PLAN_CANCELLED", "planning was cancelled by someone else");
  }
  const bool done = plan.state == PlanState::kDone;
  Step limits = MakeStep("LIMITS", done ? Step::STATE_PASSED : Step::STATE_REFUSED, 1.0);
  for (const ProgramFault& fault : plan.planned->faults) {
    ToWire(fault, *limits.add_faults());
  }
  if (!tell(std::move(limits))) {
    return NobodyListens();
  }
  if (!done) {
    return absl::OkStatus();
  }
  Step time = MakeStep("TIME", Step::STATE_PASSED, 1.0);
  ToWire(plan, *time.mutable_plan());
  return tell(std::move(time)) ? absl::OkStatus() : NobodyListens();
}

}  // namespace lambdajet::trajectory
