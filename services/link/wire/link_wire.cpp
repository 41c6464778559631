#include "link/wire/link_wire.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>

#include "foundation/contract/expects.hpp"
#include "lambdajet/cell/v1/command.h"
#include "lambdajet/drive/v1/state.h"
#include "lambdajet/link/v1/header.h"
#include "lambdajet/main_motion/v1/state.h"
#include "lambdajet/trajectory/v1/plan.h"

namespace lambdajet::link {
namespace {

constexpr std::uint32_t kModes = static_cast<std::uint32_t>(ModuleMode::kFault) + 1;
constexpr std::uint32_t kVerbs = static_cast<std::uint32_t>(Verb::kJog) + 1;
constexpr std::uint32_t kReasons = static_cast<std::uint32_t>(ModuleReason::kJetNotClosed) + 1;
constexpr std::uint32_t kAnswers = static_cast<std::uint32_t>(CommandAnswer::kRefused) + 1;
constexpr std::uint32_t kGateKinds = static_cast<std::uint32_t>(GateKind::kInput) + 1;
constexpr std::uint32_t kActions = static_cast<std::uint32_t>(ProcessAction::kAbrasiveFlow) + 1;

bool Finite(std::initializer_list<double> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); });
}

template <typename Array>
bool AllFinite(const Array& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); });
}

template <typename Enum>
bool Take(std::uint32_t wire, std::uint32_t count, Enum& value) {
  value = static_cast<Enum>(wire);
  return wire < count;
}

template <typename Enum>
std::uint32_t Number(Enum value) {
  return static_cast<std::uint32_t>(value);
}

template <typename Wire>
void ReceiptToWire(const CommandReceipt& receipt, Wire& wire) {
  wire.command_session(receipt.session);
  wire.command_sequence_number(receipt.sequence_number);
  wire.command_answer(Number(receipt.answer));
  wire.command_reason(Number(receipt.reason));
}

template <typename Wire>
bool ReceiptFromWire(const Wire& wire, CommandReceipt& receipt) {
  receipt.session = wire.command_session();
  receipt.sequence_number = wire.command_sequence_number();
  return Take(wire.command_answer(), kAnswers, receipt.answer) &&
         Take(wire.command_reason(), kReasons, receipt.reason);
}

template <typename Wire>
void LinkToWire(const LinkFigures& figures, Wire& wire) {
  wire.clock_error_bound_s(figures.clock_error_bound_s);
  wire.clock_offset_s(figures.clock_offset_s);
  wire.link_round_trip_s(figures.round_trip_s);
}

template <typename Wire>
bool LinkFromWire(const Wire& wire, LinkFigures& figures) {
  figures = {wire.clock_error_bound_s(), wire.clock_offset_s(), wire.link_round_trip_s()};
  return Finite({figures.clock_error_bound_s, figures.clock_offset_s, figures.round_trip_s});
}

// A gate of an input that does not say what of the input it waits for would never open.
bool TakeCondition(const idl::trajectory::v1::Gate& wire, GateKind kind, InputCondition& condition) {
  ProcessInput input{};
  InputEvent event{};
  if (!Take(wire.input(), kProcessInputs, input) || !Take(wire.input_event(), kInputEvents, event)) {
    return false;
  }
  condition = InputCondition::Of(input, event);
  return kind != GateKind::kInput || event != InputEvent::kNone;
}

void ToWire(const Segment& segment, idl::trajectory::v1::Segment& wire) {
  const auto& [index, start_s, duration_s, q_mm, lead_mm, s_mm, gate_at_end] = segment;
  wire.index(index);
  wire.start_s(start_s);
  wire.duration_s(duration_s);
  for (std::size_t a = 0; a < kActuatorCount; ++a) {
    for (std::size_t c = 0; c < kPolynomialSize; ++c) {
      wire.q_mm()[a * kPolynomialSize + c] = q_mm[a].c[c];
      wire.lead_mm()[a * kPolynomialSize + c] = lead_mm[a].c[c];
    }
  }
  wire.s_mm() = s_mm.c;
  wire.gate_at_end(gate_at_end);
}

bool FromWire(const idl::trajectory::v1::Segment& wire, Segment& segment) {
  auto& [index, start_s, duration_s, q_mm, lead_mm, s_mm, gate_at_end] = segment;
  index = wire.index();
  start_s = wire.start_s();
  duration_s = wire.duration_s();
  for (std::size_t a = 0; a < kActuatorCount; ++a) {
    for (std::size_t c = 0; c < kPolynomialSize; ++c) {
      q_mm[a].c[c] = wire.q_mm()[a * kPolynomialSize + c];
      lead_mm[a].c[c] = wire.lead_mm()[a * kPolynomialSize + c];
    }
  }
  s_mm.c = wire.s_mm();
  gate_at_end = wire.gate_at_end();
  return Finite({start_s, duration_s}) && AllFinite(wire.q_mm()) && AllFinite(wire.lead_mm()) &&
         AllFinite(wire.s_mm());
}

void ToWire(const Gate& gate, idl::trajectory::v1::Gate& wire) {
  const auto& [id, kind, s_mm, argument, source_line, condition] = gate;
  wire.id(id);
  wire.kind(Number(kind));
  wire.s_mm(s_mm);
  wire.argument(argument);
  wire.input(Number(condition.input()));
  wire.input_event(Number(condition.event()));
}

bool FromWire(const idl::trajectory::v1::Gate& wire, Gate& gate) {
  auto& [id, kind, s_mm, argument, source_line, condition] = gate;
  id = wire.id();
  s_mm = wire.s_mm();
  argument = wire.argument();
  source_line = 0;
  return Take(wire.kind(), kGateKinds, kind) && TakeCondition(wire, kind, condition) &&
         Finite({s_mm, argument});
}

void ToWire(const ProcessEvent& event, idl::trajectory::v1::ProcessEvent& wire) {
  const auto& [index, action, s_mm, argument, source_line] = event;
  wire.index(index);
  wire.action(Number(action));
  wire.s_mm(s_mm);
  wire.argument(argument);
}

bool FromWire(const idl::trajectory::v1::ProcessEvent& wire, ProcessEvent& event) {
  auto& [index, action, s_mm, argument, source_line] = event;
  index = wire.index();
  s_mm = wire.s_mm();
  argument = wire.argument();
  source_line = 0;
  return Take(wire.action(), kActions, action) && Finite({s_mm, argument});
}

}  // namespace

void ToWire(const SampleHeader& sample, idl::link::v1::Header& wire) {
  wire.session(sample.session);
  wire.sequence_number(sample.sequence_number);
  wire.time_ns(sample.time_ns);
}

SampleHeader FromWire(const idl::link::v1::Header& wire) {
  return {wire.session(), wire.sequence_number(), wire.time_ns()};
}

void ToWire(const DriveState& sample, idl::drive::v1::State& wire) {
  ToWire(sample.header, wire.header());
  wire.mode(Number(sample.mode));
  wire.reason(Number(sample.reason));
  wire.referenced(sample.referenced);
  wire.plan(sample.plan);
  wire.segment(sample.segment);
  wire.next_segment(sample.next_segment);
  wire.buffered_s(sample.buffered_s);
  wire.tau_s(sample.tau_s);
  wire.tau_rate(sample.tau_rate);
  wire.tau_rate_per_s(sample.tau_rate_per_s);
  wire.s_mm(sample.s_mm);
  wire.s_rate_mm_per_s(sample.s_rate_mm_per_s);
  wire.s_acceleration_mm_per_s2(sample.s_acceleration_mm_per_s2);
  wire.gate_waiting(sample.gate_waiting);
  wire.gate_passed(sample.gate_passed);
  wire.feed_override(sample.feed_override);
  wire.peer_session(sample.peer_session);
  wire.peer_sequence_number(sample.peer_sequence_number);
  wire.loop_overruns(sample.loop_overruns);
  wire.dropped_samples(sample.dropped_samples);
  wire.actuator_position_mm() = sample.actuator_position_mm;
  wire.actuator_velocity_mm_per_s() = sample.actuator_velocity_mm_per_s;
  wire.actuator_setpoint_mm() = sample.actuator_setpoint_mm;
  wire.following_error_mm() = sample.following_error_mm;
  ReceiptToWire(sample.command, wire);
  LinkToWire(sample.link, wire);
}

bool FromWire(const idl::drive::v1::State& wire, DriveState& sample) {
  sample.header = FromWire(wire.header());
  sample.referenced = wire.referenced();
  sample.plan = wire.plan();
  sample.segment = wire.segment();
  sample.next_segment = wire.next_segment();
  sample.buffered_s = wire.buffered_s();
  sample.tau_s = wire.tau_s();
  sample.tau_rate = wire.tau_rate();
  sample.tau_rate_per_s = wire.tau_rate_per_s();
  sample.s_mm = wire.s_mm();
  sample.s_rate_mm_per_s = wire.s_rate_mm_per_s();
  sample.s_acceleration_mm_per_s2 = wire.s_acceleration_mm_per_s2();
  sample.gate_waiting = wire.gate_waiting();
  sample.gate_passed = wire.gate_passed();
  sample.feed_override = wire.feed_override();
  sample.peer_session = wire.peer_session();
  sample.peer_sequence_number = wire.peer_sequence_number();
  sample.loop_overruns = wire.loop_overruns();
  sample.dropped_samples = wire.dropped_samples();
  sample.actuator_position_mm = wire.actuator_position_mm();
  sample.actuator_velocity_mm_per_s = wire.actuator_velocity_mm_per_s();
  sample.actuator_setpoint_mm = wire.actuator_setpoint_mm();
  sample.following_error_mm = wire.following_error_mm();
  return Take(wire.mode(), kModes, sample.mode) && Take(wire.reason(), kReasons, sample.reason) &&
         ReceiptFromWire(wire, sample.command) && LinkFromWire(wire, sample.link) &&
         Finite({sample.buffered_s, sample.tau_s, sample.tau_rate, sample.tau_rate_per_s, sample.s_mm,
                 sample.s_rate_mm_per_s, sample.s_acceleration_mm_per_s2, sample.feed_override}) &&
         AllFinite(sample.actuator_position_mm) && AllFinite(sample.actuator_velocity_mm_per_s) &&
         AllFinite(sample.actuator_setpoint_mm) && AllFinite(sample.following_error_mm);
}

void ToWire(const MainMotionState& sample, idl::main_motion::v1::State& wire) {
  ToWire(sample.header, wire.header());
  wire.mode(Number(sample.mode));
  wire.reason(Number(sample.reason));
  wire.plan(sample.plan);
  wire.next_event(sample.next_event);
  wire.events_executed(sample.events_executed);
  wire.next_gate(sample.next_gate);
  wire.gate_passed(sample.gate_passed);
  wire.jet_on(sample.jet_on);
  wire.abrasive_on(sample.abrasive_on);
  wire.pump_pressure_mpa(sample.pump_pressure_mpa);
  wire.abrasive_g_per_min(sample.abrasive_g_per_min);
  wire.abrasive_present(sample.abrasive_present);
  wire.stand_off_mm(sample.stand_off_mm);
  wire.s_extrapolated_mm(sample.s_extrapolated_mm);
  wire.peer_session(sample.peer_session);
  wire.peer_sequence_number(sample.peer_sequence_number);
  wire.peer_age_s(sample.peer_age_s);
  wire.loop_overruns(sample.loop_overruns);
  wire.dropped_samples(sample.dropped_samples);
  ReceiptToWire(sample.command, wire);
  LinkToWire(sample.link, wire);
}

bool FromWire(const idl::main_motion::v1::State& wire, MainMotionState& sample) {
  sample.header = FromWire(wire.header());
  sample.plan = wire.plan();
  sample.next_event = wire.next_event();
  sample.events_executed = wire.events_executed();
  sample.next_gate = wire.next_gate();
  sample.gate_passed = wire.gate_passed();
  sample.jet_on = wire.jet_on();
  sample.abrasive_on = wire.abrasive_on();
  sample.pump_pressure_mpa = wire.pump_pressure_mpa();
  sample.abrasive_g_per_min = wire.abrasive_g_per_min();
  sample.abrasive_present = wire.abrasive_present();
  sample.stand_off_mm = wire.stand_off_mm();
  sample.s_extrapolated_mm = wire.s_extrapolated_mm();
  sample.peer_session = wire.peer_session();
  sample.peer_sequence_number = wire.peer_sequence_number();
  sample.peer_age_s = wire.peer_age_s();
  sample.loop_overruns = wire.loop_overruns();
  sample.dropped_samples = wire.dropped_samples();
  return Take(wire.mode(), kModes, sample.mode) && Take(wire.reason(), kReasons, sample.reason) &&
         ReceiptFromWire(wire, sample.command) && LinkFromWire(wire, sample.link) &&
         Finite({sample.pump_pressure_mpa, sample.abrasive_g_per_min, sample.stand_off_mm,
                 sample.s_extrapolated_mm, sample.peer_age_s});
}

void ToWire(const Measurement& sample, idl::main_motion::v1::Measurement& wire) {
  ToWire(sample.header, wire.header());
  wire.plan(sample.plan);
  wire.gate(sample.gate);
  wire.mark(sample.mark);
  wire.exposure_ns(sample.exposure_ns);
  wire.seen(sample.seen);
  wire.x_C_mm(sample.x_C_mm);
  wire.y_C_mm(sample.y_C_mm);
  wire.actuator_position_mm() = sample.actuator_position_mm;
  wire.actuator_velocity_mm_per_s() = sample.actuator_velocity_mm_per_s;
  wire.actuator_acceleration_mm_per_s2() = sample.actuator_acceleration_mm_per_s2;
  wire.jet_pierce_actuator_position_mm() = sample.jet_pierce_actuator_position_mm;
}

bool FromWire(const idl::main_motion::v1::Measurement& wire, Measurement& sample) {
  sample.header = FromWire(wire.header());
  sample.plan = wire.plan();
  sample.gate = wire.gate();
  sample.mark = wire.mark();
  sample.exposure_ns = wire.exposure_ns();
  sample.seen = wire.seen();
  sample.x_C_mm = wire.x_C_mm();
  sample.y_C_mm = wire.y_C_mm();
  sample.actuator_position_mm = wire.actuator_position_mm();
  sample.actuator_velocity_mm_per_s = wire.actuator_velocity_mm_per_s();
  sample.actuator_acceleration_mm_per_s2 = wire.actuator_acceleration_mm_per_s2();
  sample.jet_pierce_actuator_position_mm = wire.jet_pierce_actuator_position_mm();
  return Finite({sample.x_C_mm, sample.y_C_mm}) && AllFinite(sample.actuator_position_mm) &&
         AllFinite(sample.actuator_velocity_mm_per_s) && AllFinite(sample.actuator_acceleration_mm_per_s2) &&
         AllFinite(sample.jet_pierce_actuator_position_mm);
}

void ToWire(const ProcessRecord& sample, idl::main_motion::v1::ProcessRecord& wire) {
  ToWire(sample.header, wire.header());
  wire.plan(sample.plan);
  wire.event(sample.event);
  wire.s_wanted_mm(sample.s_wanted_mm);
  wire.s_rate_mm_per_s(sample.s_rate_mm_per_s);
  wire.due_ns(sample.due_ns);
  wire.effect_ns(sample.effect_ns);
  wire.deviation_mm(sample.deviation_mm);
  wire.peer_age_s(sample.peer_age_s);
  wire.action(Number(sample.action));
  wire.argument(sample.argument);
}

bool FromWire(const idl::main_motion::v1::ProcessRecord& wire, ProcessRecord& sample) {
  sample.header = FromWire(wire.header());
  sample.plan = wire.plan();
  sample.event = wire.event();
  sample.argument = wire.argument();
  sample.s_wanted_mm = wire.s_wanted_mm();
  sample.s_rate_mm_per_s = wire.s_rate_mm_per_s();
  sample.due_ns = wire.due_ns();
  sample.effect_ns = wire.effect_ns();
  sample.deviation_mm = wire.deviation_mm();
  sample.peer_age_s = wire.peer_age_s();
  return Take(wire.action(), kActions, sample.action) &&
         Finite({sample.argument, sample.s_wanted_mm, sample.s_rate_mm_per_s, sample.deviation_mm,
                 sample.peer_age_s});
}

void ToWire(const ModuleCommand& sample, idl::cell::v1::Command& wire) {
  ToWire(sample.header, wire.header());
  wire.target(sample.target);
  wire.plan(sample.plan);
  wire.segment_count(sample.segment_count);
  wire.gate_total(sample.gate_total);
  wire.event_total(sample.event_total);
  wire.duration_s(sample.duration_s);
  wire.elastic_lag_s2(sample.elastic_lag_s2);
  wire.value(sample.value);
  wire.start_at_ns(sample.start_at_ns);
  wire.verb(Number(sample.verb));
}

bool FromWire(const idl::cell::v1::Command& wire, ModuleCommand& sample) {
  sample.header = FromWire(wire.header());
  sample.target = wire.target();
  sample.plan = wire.plan();
  sample.segment_count = wire.segment_count();
  sample.gate_total = wire.gate_total();
  sample.event_total = wire.event_total();
  sample.duration_s = wire.duration_s();
  sample.elastic_lag_s2 = wire.elastic_lag_s2();
  sample.value = wire.value();
  sample.start_at_ns = wire.start_at_ns();
  return Take(wire.verb(), kVerbs, sample.verb) &&
         Finite({sample.duration_s, sample.elastic_lag_s2, sample.value});
}

void ToWire(const SegmentBatch& sample, idl::trajectory::v1::SegmentBatch& wire) {
  const auto& [header, plan, segment_count, elastic_lag_s2, duration_s, count, segments] = sample;
  Expects(count <= kSegmentsPerBatch, "a batch of segments holds no more than its array");
  ToWire(header, wire.header());
  wire.plan(plan);
  wire.segment_count(segment_count);
  wire.elastic_lag_s2(elastic_lag_s2);
  wire.duration_s(duration_s);
  wire.count(count);
  for (std::size_t i = 0; i < count; ++i) {
    ToWire(segments[i], wire.segments()[i]);
  }
}

bool FromWire(const idl::trajectory::v1::SegmentBatch& wire, SegmentBatch& sample) {
  auto& [header, plan, segment_count, elastic_lag_s2, duration_s, count, segments] = sample;
  header = FromWire(wire.header());
  plan = wire.plan();
  segment_count = wire.segment_count();
  elastic_lag_s2 = wire.elastic_lag_s2();
  duration_s = wire.duration_s();
  count = wire.count();
  if (count > kSegmentsPerBatch || !Finite({elastic_lag_s2, duration_s})) {
    return false;
  }
  bool sound = true;
  for (std::size_t i = 0; i < count; ++i) {
    sound = FromWire(wire.segments()[i], segments[i]) && sound;
  }
  return sound;
}

void ToWire(const ProcessBatch& sample, idl::trajectory::v1::ProcessBatch& wire) {
  const auto& [header, plan, gate_total, event_total, gate_count, gates, event_count, events] = sample;
  Expects(gate_count <= kEventsPerBatch && event_count <= kEventsPerBatch,
          "a batch of gates and events holds no more than its arrays");
  ToWire(header, wire.header());
  wire.plan(plan);
  wire.gate_total(gate_total);
  wire.event_total(event_total);
  wire.gate_count(gate_count);
  for (std::size_t i = 0; i < gate_count; ++i) {
    ToWire(gates[i], wire.gates()[i]);
  }
  wire.event_count(event_count);
  for (std::size_t i = 0; i < event_count; ++i) {
    ToWire(events[i], wire.events()[i]);
  }
}

bool FromWire(const idl::trajectory::v1::ProcessBatch& wire, ProcessBatch& sample) {
  auto& [header, plan, gate_total, event_total, gate_count, gates, event_count, events] = sample;
  header = FromWire(wire.header());
  plan = wire.plan();
  gate_total = wire.gate_total();
  event_total = wire.event_total();
  gate_count = wire.gate_count();
  event_count = wire.event_count();
  if (gate_count > kEventsPerBatch || event_count > kEventsPerBatch) {
    return false;
  }
  bool sound = true;
  for (std::size_t i = 0; i < gate_count; ++i) {
    sound = FromWire(wire.gates()[i], gates[i]) && sound;
  }
  for (std::size_t i = 0; i < event_count; ++i) {
    sound = FromWire(wire.events()[i], events[i]) && sound;
  }
  return sound;
}

}  // namespace lambdajet::link
