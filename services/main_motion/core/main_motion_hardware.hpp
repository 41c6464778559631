// Is all that the main-motion module's core knows of its iron: pump, two valves, abrasive feeder, head and camera.
//
// Model: the valves hang on *time-stamped outputs*, like the time-stamped digital outputs of fieldbus terminals: the core
// says at which instant an output is to switch, and the terminal's own clock switches it, between cycles. One switching
// may be pending per valve; a new one takes its place, and may be taken back until it has fired. An output whose instant
// has passed fires on arrival. What really happened, and when, comes back from a sensor at the valve.
// Units: mm, MPa, g/min; common time in ns. Threads: called from the control loop only; must not block or allocate.
#pragma once

#include <array>
#include <cstdint>

namespace lambdajet::main_motion {

// The feeder meters the abrasive that the valve lets through; its output is a flow.
enum class Valve : std::uint8_t { kJet, kAbrasive, kAbrasiveFeeder };
inline constexpr std::size_t kValveCount = 3;

enum class Feature : std::uint8_t { kMark, kHole };

// Water or abrasive began or ceased to arrive at the sheet; of the feeder: its new flow does, and `on` is true.
struct OutputEffect {
  Valve valve = Valve::kJet;
  bool on = false;
  std::int64_t effect_ns = 0;
};

struct Picture {
  std::uint32_t request = 0;
  std::int64_t exposure_ns = 0;
  bool seen = false;
  double x_C_mm = 0.0;
  double y_C_mm = 0.0;
};

inline constexpr std::size_t kEffectsPerCycle = 16;
inline constexpr std::size_t kPicturesPerCycle = 16;

struct MainMotionReadings {
  std::int64_t time_ns = 0;
  bool referenced = false;
  bool sensor_fault = false;
  bool jet_on = false;
  bool abrasive_on = false;
  double pump_pressure_mpa = 0.0;
  double abrasive_g_per_min = 0.0;
  bool abrasive_present = false;  // in the hopper
  double stand_off_mm = 0.0;
  std::size_t effect_count = 0;  // since the last reading
  std::array<OutputEffect, kEffectsPerCycle> effects{};
  std::size_t picture_count = 0;
  std::array<Picture, kPicturesPerCycle> pictures{};
};

class MainMotionHardware {
 public:
  virtual ~MainMotionHardware() = default;
  virtual MainMotionReadings ReadState(std::int64_t now_ns) = 0;
  virtual void ScheduleOutput(Valve valve, bool on, std::int64_t at_ns) = 0;
  virtual void ScheduleFlow(double abrasive_g_per_min, std::int64_t at_ns) = 0;  // the feeder's output
  virtual void CancelOutput(Valve valve) = 0;
  virtual void SetPump(bool on) = 0;  // off: idle, no pressure
  virtual void SetStandOff(double stand_off_mm) = 0;
  virtual void TakePicture(std::uint32_t request, Feature feature, std::int64_t exposure_ns) = 0;
  virtual void BeginHoming() = 0;
};

}  // namespace lambdajet::main_motion
