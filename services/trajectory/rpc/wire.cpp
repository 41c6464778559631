#include "trajectory/rpc/wire.hpp"

#include "platform/rpc/argument_checks.hpp"
#include "trajectory/core/feed/plan_samples.hpp"
#include "trajectory/rpc/answer_limits.hpp"
#include "trajectory/rpc/spatial_wire.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kLeastTolerance_mm = 1e-3;
constexpr double kMostTolerance_mm = 10.0;
constexpr std::size_t kMostTolerances = 1000;

std::string Word(std::string_view text) { return std::string(text); }

type::v1::OperationState StateToWire(PlanState state) {
  switch (state) {
    case PlanState::kRunning:
      return type::v1::OPERATION_STATE_RUNNING;
    case PlanState::kDone:
      return type::v1::OPERATION_STATE_DONE;
    case PlanState::kFailed:
      return type::v1::OPERATION_STATE_FAILED;
    case PlanState::kCancelled:
      return type::v1::OPERATION_STATE_CANCELLED;
  }
  return type::v1::OPERATION_STATE_UNSPECIFIED;
}

// A program's bytes outside UTF-8 stand in no word, but may in a fault that quotes it.
std::string Printable(std::string_view text) {
  std::string printable(text);
  for (char& c : printable) {
    c = c >= 0x20 && c < 0x7f ? c : '?';
  }
  return printable;
}

void CheckTolerances(const v1::PlanOptions& wire, ArgumentChecks& checks) {
  if (wire.has_tolerance_mm()) {
    checks.InRange("options.tolerance_mm", wire.tolerance_mm(), kLeastTolerance_mm, kMostTolerance_mm, "mm");
  }
  checks.CountInRange("options.tolerances", static_cast<std::size_t>(wire.tolerances_size()), 0,
                      kMostTolerances);
  for (int i = 0; i < wire.tolerances_size() && !checks.full(); ++i) {
    const v1::ToleranceWish& wish = wire.tolerances(i);
    const std::string field = "options.tolerances[" + std::to_string(i) + "]";
    checks.InRange(field + ".tolerance_mm", wish.tolerance_mm(), kLeastTolerance_mm, kMostTolerance_mm, "mm");
    checks.Require(wish.first_line() <= wish.last_line(), field + ".last_line", "LINES_REVERSED",
                   "the first line is beyond the last");
  }
}

}  // namespace

absl::StatusOr<PlanOptions> FromWire(const v1::PlanOptions& wire) {
  PlanOptions options;
  options.compensate = wire.compensate();
  if (wire.has_tolerance_mm()) {
    options.hold.push_back({wire.tolerance_mm()});
  }
  for (const v1::ToleranceWish& wish : wire.tolerances()) {
    options.hold.push_back({wish.tolerance_mm(), wish.first_line(), wish.last_line(), wish.contour()});
  }
  options.feed_scale = wire.has_feed_scale() ? wire.feed_scale() : options.feed_scale;
  options.overlap_mm = wire.has_overlap_mm() ? wire.overlap_mm() : options.overlap_mm;
  ArgumentChecks checks;
  CheckTolerances(wire, checks);
  checks.InRange("options.feed_scale", options.feed_scale, 0.01, 1.2);
  checks.InRange("options.overlap_mm", options.overlap_mm, 0.0, 100.0, "mm");
  if (wire.has_start_from_s_mm()) {
    checks.InRange("options.start_from_s_mm", wire.start_from_s_mm(), 0.0, 1e9, "mm");
    options.start_from_s_mm = wire.start_from_s_mm();
  }
  if (!checks.ok()) {
    return checks.status();
  }
  return options;
}

Admission AdmitMade(const MadeProgram& program, const MachineDescription& machine, PlanOptions options) {
  if (!program.faults.empty()) {
    Admission refused;
    refused.faults = program.faults;
    return refused;
  }
  options.notation = program.notation;
  return AdmitPartProgram(program.text, machine, options);
}

void ToWire(const MachineDescription& machine, machine::v1::ModelVersion& wire) {
  wire.set_machine_id(machine.machine_id);
  wire.set_version(machine.version);
  wire.set_hash(machine.hash);
}

void ToWire(const ProgramFault& fault, v1::ProgramFault& wire) {
  wire.set_line(fault.line);
  wire.set_column(fault.column);
  wire.set_reason(Word(fault.reason));
  wire.set_word(Printable(fault.word));
  wire.set_message(Printable(fault.message));
}

void ToWire(const Admission& admission, const MachineDescription& machine, v1::AdmitProgramResponse& wire) {
  wire.set_admitted(admission.faults.empty());
  for (const ProgramFault& fault : admission.faults) {
    ToWire(fault, *wire.add_faults());
  }
  ToWire(machine, *wire.mutable_model_version());
  wire.set_cutting_length_mm(admission.cutting_length_mm);
  wire.set_idle_length_mm(admission.idle_length_mm);
  wire.set_pierces(admission.pierce_count);
}

void ToWire(const PlanRecord& record, type::v1::Operation& wire) {
  const PlanState state = record.state;
  wire.set_id(std::to_string(record.id));
  wire.set_state(StateToWire(state));
  wire.set_progress(record.progress);
  wire.set_phase(state == PlanState::kRunning ? "planning" : "");
  if (state == PlanState::kCancelled) {
    wire.set_reason("CANCELLED");
    wire.set_message("planning was cancelled");
  } else if (state == PlanState::kFailed && !record.planned->faults.empty()) {
    const ProgramFault& fault = record.planned->faults.front();
    wire.set_reason(Word(fault.reason));
    wire.set_message("line " + std::to_string(fault.line) + ": " + Printable(fault.message));
  }
}

namespace {

void ToWire(const SlowStretch& slow, v1::SlowStretch& wire) {
  wire.set_from_s_mm(slow.from_s_mm);
  wire.set_to_s_mm(slow.to_s_mm);
  wire.set_line(slow.line);
  wire.set_limit(Word(FeedLimitName(slow.limit)));
  wire.set_programmed_mm_per_s(slow.programmed_mm_per_s);
  wire.set_lowest_mm_per_s(slow.lowest_mm_per_s);
  if (slow.reached_share > 0.0) {  // measured
    wire.set_nearest(Word(FeedLimitName(slow.nearest)));
    wire.set_reached_share(slow.reached_share);
    wire.set_at_s_mm(slow.at_s_mm);
    wire.set_share(slow.share);
  }
}

void ToWire(const HeldTolerance& held, v1::HeldTolerance& wire) {
  wire.set_contour(held.contour);
  wire.set_first_line(held.first_line);
  wire.set_last_line(held.last_line);
  wire.set_tolerance_mm(held.tolerance_mm);
  wire.set_predicted_95_mm(held.predicted_95_mm);
  wire.set_worst_mm(held.worst_mm);
  wire.set_worst_line(held.worst_line);
  wire.set_margin_mm(held.margin_mm);
  wire.set_worst_source(Word(accuracy::SourceName(held.worst_source)));
}

}  // namespace

void ToWire(const std::vector<SlowStretch>& slow, v1::PlanSummary& wire) {
  for (std::size_t i = 0; i < slow.size() && i < kMostSlowStretches; ++i) {
    ToWire(slow[i], *wire.add_slow_stretches());
  }
  wire.set_slow_stretch_count(static_cast<std::uint32_t>(slow.size()));
}

void ToWire(const PlanRecord& record, v1::PlanSummary& wire) {
  const PlannedProgram& p = *record.planned;
  wire.set_plan_id(record.id);
  if (record.spatial != nullptr) {
    return ToWire(*record.spatial, *record.hexapod, wire);
  }
  ToWire(*record.machine, *wire.mutable_model_version());
  wire.set_compensated(p.plan.compensated);
  wire.set_duration_s(p.plan.duration_s);
  wire.set_gate_time_s(p.gate_time_s);
  wire.set_cutting_time_s(p.cutting_time_s);
  wire.set_length_mm(p.plan.length_mm);
  wire.set_cutting_length_mm(p.cutting_length_mm);
  wire.set_segment_count(static_cast<std::uint32_t>(p.plan.segments.size()));
  wire.set_gate_count(static_cast<std::uint32_t>(p.plan.gates.size()));
  wire.set_event_count(static_cast<std::uint32_t>(p.plan.events.size()));
  wire.set_elastic_lag_s2(p.plan.elastic_lag_s2);
  wire.set_contour_tolerance_used_mm(p.contour_deviation_mm);
  double total_mm = 0.0;
  for (const BindingLength& binding : p.binding) {
    total_mm += binding.length_mm;
  }
  for (const BindingLength& binding : p.binding) {
    v1::BindingLimit& to = *wire.add_binding_limits();
    to.set_limit(Word(FeedLimitName(binding.limit)));
    to.set_length_mm(binding.length_mm);
    to.set_share(total_mm > 0.0 ? binding.length_mm / total_mm : 0.0);
  }
  wire.set_predicted_95_mm(record.predicted_95_mm);
  ToWire(p.slow, wire);
  wire.set_fastest_s(record.tolerance.fastest_s);
  for (const HeldTolerance& held : record.tolerance.held) {
    ToWire(held, *wire.add_held_tolerances());
  }
}

void ToWire(const ToleranceBlame& blame, v1::ToleranceBlame& wire) {
  wire.set_line(blame.line);
  wire.set_x_w_mm(blame.p_W_mm.x());
  wire.set_y_w_mm(blame.p_W_mm.y());
  wire.set_tolerance_mm(blame.tolerance_mm);
  wire.set_predicted_mm(blame.predicted_mm);
  wire.set_source(Word(accuracy::SourceName(blame.source)));
  wire.set_remedy(Word(blame.remedy));
  wire.set_with_remedy_mm(blame.with_remedy_mm);
}

void ToWire(const PlanRecord& record, v1::GetPlanResponse& wire) {
  ToWire(record, *wire.mutable_operation());
  const PlanState state = record.state;  // after the operation: what that says to be done has its summary
  if (state == PlanState::kDone) {
    ToWire(record, *wire.mutable_summary());
  } else if (state == PlanState::kFailed) {
    for (const ProgramFault& fault : record.planned->faults) {
      ToWire(fault, *wire.add_faults());
    }
    if (!record.tolerance.blame.empty()) {
      ToWire(record.tolerance.blame.front(), *wire.mutable_blame());
    }
  }
}

void AddPoint(const PlannedProgram& planned, double tau_s, v1::SampleBatch& wire) {
  const FullSample s = SampleAt(planned, tau_s);
  for (const double v : {s.jet.tau_s, s.jet.s_mm, s.jet.x_W_mm, s.jet.y_W_mm, s.jet.vx_W_mm_per_s,
                         s.jet.vy_W_mm_per_s, s.jet.ax_W_mm_per_s2, s.jet.ay_W_mm_per_s2, s.actuator_mm[0],
                         s.actuator_mm[1], s.actuator_mm_per_s[0], s.actuator_mm_per_s[1]}) {
    wire.add_values(v);
  }
  wire.add_cutting(s.jet.cutting ? 1 : 0);
  wire.add_source_line(s.jet.source_line);
}

}  // namespace lambdajet::trajectory
