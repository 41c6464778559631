// Holds what the cell last heard from both machine modules, and says what forbids a start.
//
// Model: each module's state sample in plain values with the time it was heard. A module not heard for
// kSilence_s is lost to the cell (which stops nothing: the modules watch each other themselves), if the cell's own loop
// has turned kSilentTurns times meanwhile: a host, or a disk under the journal, that stood still is no module's silence.
// Units: mm, s; times are common time in ns. Threads: values.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "foundation/motion/module_words.hpp"
#include "foundation/motion/plan.hpp"

namespace lambdajet::cell {

inline constexpr double kSilence_s = 2.0;
inline constexpr int kSilentTurns = 25;  // of the cell's loop; half a second of it
inline constexpr double kLargestClockOffset_s = 0.2e-3;
inline constexpr double kNanosecondsPerSecond = 1e9;

inline double SecondsBetween(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) / kNanosecondsPerSecond;
}
inline std::int64_t After(std::int64_t now_ns, double seconds) {
  return now_ns + static_cast<std::int64_t>(seconds * kNanosecondsPerSecond);
}

// The last command a module took, as its state tells.
struct CommandEcho {
  std::uint64_t session = 0;
  std::uint64_t sequence_number = 0;
  std::uint32_t answer = 0;  // 0 none, 1 done, 2 refused
  ModuleReason reason = ModuleReason::kNone;
};

// What both modules' states have in common.
struct ModuleView {
  std::int64_t heard_ns = 0;
  int quiet_turns = 0;  // of the cell's loop since then
  std::uint64_t session = 0;
  ModuleMode mode = ModuleMode::kOff;
  ModuleReason reason = ModuleReason::kNone;
  std::uint64_t plan = 0;
  std::uint32_t gate_passed = 0;
  CommandEcho echo;
  std::uint32_t loop_overruns = 0;
  double clock_offset_s = 0.0;
};

struct DriveView : ModuleView {
  bool referenced = false;
  std::uint32_t next_segment = 0;
  double buffered_s = 0.0;
  double tau_s = 0.0;
  double s_mm = 0.0;
  double s_rate_mm_per_s = 0.0;
  std::uint32_t gate_waiting = 0;
  double feed_override = 1.0;
  std::array<double, kActuatorCount> actuator_position_mm{};
  std::array<double, kActuatorCount> actuator_velocity_mm_per_s{};
};

struct MainMotionView : ModuleView {
  std::uint32_t next_event = 0;
  std::uint32_t events_executed = 0;
  std::uint32_t next_gate = 0;
  bool jet_on = false;
  double s_mm = 0.0;  // its idea of the path length
};

struct MachineView {
  std::optional<DriveView> drive;
  std::optional<MainMotionView> main_motion;
};

struct Veto {
  std::string reason;   // UPPER_SNAKE
  std::string message;  // what is wrong and what to do
};

bool Heard(const ModuleView& module, std::int64_t now_ns);
bool DriveHeard(const MachineView& machine, std::int64_t now_ns);
bool MainMotionHeard(const MachineView& machine, std::int64_t now_ns);

// Everything about the modules that forbids a start now; empty: may start.
std::vector<Veto> StartVetoes(const MachineView& machine, std::int64_t now_ns);

}  // namespace lambdajet::cell
