// Carries what the two machine modules and their commander say to each other, as plain values without a wire.
//
// Model: the samples of the electronic link; the doors of each house translate them to and from the IDL of the same names
// (idl/lambdajet/{drive,main_motion,cell,trajectory}/v1), which also says what each field means. Both module cores read
// the other's samples, so the words stand here and not in a house.
// Units: mm, s; *_ns: common time in ns. Shapes: fixed in size, so that handing one over allocates nothing.
// Threads: values.
#pragma once

#include <array>
#include <cstdint>

#include "foundation/motion/module_words.hpp"
#include "foundation/motion/plan.hpp"

namespace lambdajet {

inline constexpr std::uint32_t kSegmentsPerBatch = 8;
inline constexpr std::uint32_t kEventsPerBatch = 32;
inline constexpr std::uint32_t kTargetDrive = 1;  // bits of ModuleCommand::target
inline constexpr std::uint32_t kTargetMainMotion = 2;

// What every sample starts with: the writer's session is new at each start of its process.
struct SampleHeader {
  std::uint64_t session = 0;
  std::uint64_t sequence_number = 0;  // 1, 2, … within the session
  std::int64_t time_ns = 0;           // common time at which the sample was made
};

enum class CommandAnswer : std::uint32_t { kNone, kDone, kRefused };

// The last command a module took, and what it said to it.
struct CommandReceipt {
  std::uint64_t session = 0;
  std::uint64_t sequence_number = 0;
  CommandAnswer answer = CommandAnswer::kNone;
  ModuleReason reason = ModuleReason::kNone;
};

// What a module knows of the wire between the modules.
struct LinkFigures {
  double clock_error_bound_s = 0.0;  // the kernel's
  double clock_offset_s = 0.0;       // peer minus own
  double round_trip_s = 0.0;         // 0: not measured yet
};

struct DriveState {
  SampleHeader header;
  ModuleMode mode = ModuleMode::kOff;
  ModuleReason reason = ModuleReason::kNone;
  bool referenced = false;
  std::uint64_t plan = 0;
  std::uint32_t segment = 0;
  std::uint32_t next_segment = 0;
  double buffered_s = 0.0;
  double tau_s = 0.0;
  double tau_rate = 0.0;
  double tau_rate_per_s = 0.0;
  double s_mm = 0.0;
  double s_rate_mm_per_s = 0.0;
  double s_acceleration_mm_per_s2 = 0.0;
  std::uint32_t gate_waiting = 0;
  std::uint32_t gate_passed = 0;
  double feed_override = 1.0;
  std::array<double, kActuatorCount> actuator_position_mm{};
  std::array<double, kActuatorCount> actuator_velocity_mm_per_s{};
  std::array<double, kActuatorCount> actuator_setpoint_mm{};
  std::array<double, kActuatorCount> following_error_mm{};
  CommandReceipt command;
  std::uint64_t peer_session = 0;
  std::uint64_t peer_sequence_number = 0;
  std::uint32_t loop_overruns = 0;
  std::uint32_t dropped_samples = 0;
  LinkFigures link;
};

struct MainMotionState {
  SampleHeader header;
  ModuleMode mode = ModuleMode::kOff;
  ModuleReason reason = ModuleReason::kNone;
  std::uint64_t plan = 0;
  std::uint32_t next_event = 0;
  std::uint32_t events_executed = 0;
  std::uint32_t next_gate = 0;
  std::uint32_t gate_passed = 0;
  bool jet_on = false;
  bool abrasive_on = false;
  double pump_pressure_mpa = 0.0;
  double abrasive_g_per_min = 0.0;
  bool abrasive_present = false;
  double stand_off_mm = 0.0;
  double s_extrapolated_mm = 0.0;
  CommandReceipt command;
  std::uint64_t peer_session = 0;
  std::uint64_t peer_sequence_number = 0;
  double peer_age_s = 0.0;
  std::uint32_t loop_overruns = 0;
  std::uint32_t dropped_samples = 0;
  LinkFigures link;
};

struct ModuleCommand {
  SampleHeader header;
  std::uint32_t target = 0;
  Verb verb = Verb::kNone;
  std::uint64_t plan = 0;
  std::uint32_t segment_count = 0;
  std::uint32_t gate_total = 0;
  std::uint32_t event_total = 0;
  double duration_s = 0.0;
  double elastic_lag_s2 = 0.0;
  double value = 0.0;
  std::int64_t start_at_ns = 0;
};

struct SegmentBatch {
  SampleHeader header;
  std::uint64_t plan = 0;
  std::uint32_t segment_count = 0;  // of the whole plan
  double elastic_lag_s2 = 0.0;
  double duration_s = 0.0;  // of the whole plan
  std::uint32_t count = 0;
  std::array<Segment, kSegmentsPerBatch> segments;
};

struct ProcessBatch {
  SampleHeader header;
  std::uint64_t plan = 0;
  std::uint32_t gate_total = 0;
  std::uint32_t event_total = 0;
  std::uint32_t gate_count = 0;
  std::array<Gate, kEventsPerBatch> gates;
  std::uint32_t event_count = 0;
  std::array<ProcessEvent, kEventsPerBatch> events;
};

// One look of the camera, with the drive's readings at the instant of exposure.
struct Measurement {
  SampleHeader header;
  std::uint64_t plan = 0;
  std::uint32_t gate = 0;
  std::int32_t mark = 0;  // 1000 + n: the n-th hole pierced in this plan
  std::int64_t exposure_ns = 0;
  bool seen = false;
  double x_C_mm = 0.0;
  double y_C_mm = 0.0;
  std::array<double, kActuatorCount> actuator_position_mm{};
  std::array<double, kActuatorCount> actuator_velocity_mm_per_s{};
  std::array<double, kActuatorCount> actuator_acceleration_mm_per_s2{};
  std::array<double, kActuatorCount> jet_pierce_actuator_position_mm{};
};

// What became of one process event.
struct ProcessRecord {
  SampleHeader header;
  std::uint64_t plan = 0;
  std::uint32_t event = 0;
  ProcessAction action = ProcessAction::kJetOff;
  double argument = 0.0;
  double s_wanted_mm = 0.0;
  double s_rate_mm_per_s = 0.0;
  std::int64_t due_ns = 0;
  std::int64_t effect_ns = 0;
  double deviation_mm = 0.0;
  double peer_age_s = 0.0;
};

// A change of mode, for the log, the event topic and the journal.
struct ModeChange {
  std::int64_t time_ns = 0;
  ModuleMode from = ModuleMode::kOff;
  ModuleMode to = ModuleMode::kOff;
  ModuleReason reason = ModuleReason::kNone;
  std::uint64_t plan = 0;
  double s_mm = 0.0;
};

}  // namespace lambdajet
