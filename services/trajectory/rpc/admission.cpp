#include "trajectory/rpc/admission.hpp"

#include <array>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::trajectory {
namespace {

using Step = v1::AdmissionStep;

constexpr double kTellEvery_s = 0.1;
constexpr std::array<const char*, 3> kReadingSteps = {"PARSE", "PLACE", "REACH"};

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

// The step that a fault of AdmitPartProgram belongs to: words first, then place, then reach.
std::size_t ReadingStepOf(const ProgramFault& fault, bool laid_out) {
  return !laid_out ? 0 : fault.reason == "OUTSIDE_SHEET" ? 1 : 2;
}

bool IsOfAccuracy(const ProgramFault& fault) {
  return fault.reason == "TOLERANCE_NOT_REACHED" || fault.reason == "NOT_PREDICTED";
}

}  // namespace

absl::Status AdmissionInSteps::Run(const Tell& tell) {
  bool refused = false;
  absl::Status status = Read(tell, refused);
  return status.ok() && !refused ? Plan(tell) : status;
}

absl::Status AdmissionInSteps::Read(const Tell& tell, bool& refused) {
  if (!tell(MakeStep("PARSE", Step::STATE_RUNNING, 0.0))) {
    return NobodyListens();
  }
  program_ = MakeProgram(std::move(submitted_), machine_.get());
  const Admission admission = AdmitMade(program_, *machine_, options_);
  const bool laid_out = admission.cutting_length_mm + admission.idle_length_mm > 0.0;
  for (std::size_t s = 0; s < kReadingSteps.size(); ++s) {
    Step step = MakeStep(kReadingSteps[s], Step::STATE_PASSED, 1.0);
    for (const ProgramFault& fault : admission.faults) {
      if (ReadingStepOf(fault, laid_out) == s) {
        step.set_state(Step::STATE_REFUSED);
        ToWire(fault, *step.add_faults());
      }
    }
    refused = step.state() == Step::STATE_REFUSED;
    if (s + 1 == kReadingSteps.size() && !refused) {
      ToWire(admission, *machine_, *step.mutable_admission());
    }
    if (!tell(std::move(step))) {
      return NobodyListens();
    }
    if (refused) {
      break;
    }
  }
  return absl::OkStatus();
}

absl::Status AdmissionInSteps::Watch(const PlanRecord& record, const Tell& tell) {
  while (!desk_.Await(record, kTellEvery_s)) {
    if (closing_ || !tell(MakeStep("LIMITS", Step::STATE_RUNNING, record.progress))) {
      return NobodyListens();
    }
  }
  return absl::OkStatus();
}

absl::Status AdmissionInSteps::Plan(const Tell& tell) {
  const auto record = desk_.Begin(std::move(program_), options_, machine_);
  if (!record.ok()) {
    return record.status();
  }
  if (!tell(MakeStep("LIMITS", Step::STATE_RUNNING, 0.0))) {
    return NobodyListens();
  }
  if (const absl::Status status = Watch(**record, tell); !status.ok()) {
    return status;
  }
  const PlanRecord& plan = **record;
  if (plan.state == PlanState::kCancelled) {
    return Trouble(absl::StatusCode::kAborted, "PLAN_CANCELLED", "planning was cancelled by someone else");
  }
  const bool done = plan.state == PlanState::kDone;
  const bool accuracy = !done && IsOfAccuracy(plan.planned->faults.front());
  for (const char* name : {"LIMITS", "TIME", "ACCURACY"}) {
    const bool told_last = std::string_view(name) == (done || accuracy ? "ACCURACY" : "LIMITS");
    Step step = MakeStep(name, done || !told_last ? Step::STATE_PASSED : Step::STATE_REFUSED, 1.0);
    if (done && std::string_view(name) != "LIMITS") {
      ToWire(plan, *step.mutable_plan());
    }
    for (const ProgramFault& fault : plan.planned->faults) {
      if (told_last) {
        ToWire(fault, *step.add_faults());
      }
    }
    if (!tell(std::move(step))) {
      return NobodyListens();
    }
    if (told_last) {
      break;
    }
  }
  return absl::OkStatus();
}

}  // namespace lambdajet::trajectory
