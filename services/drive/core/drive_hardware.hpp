// Is all that the drive module's core knows of its iron: two actuators with encoders, and set-points with a time.
//
// Model: a set-point says *when* it holds. The servo keeps a short queue and interpolates between neighbours at their own
// times, so a late wake-up of the control loop does not bend the path. A set-point replaces whatever is queued at its
// time or later; one whose time has passed is dropped and counted, never executed late. When the queue runs dry the servo
// brakes by itself. Implementations: the simulated plant; a fieldbus master.
// Units: mm, s; common time in ns. Threads: called from the control loop only; must not block or allocate.
#pragma once

#include <array>
#include <cstdint>

#include "foundation/motion/plan.hpp"

namespace lambdajet::drive {

struct DriveReadings {
  std::int64_t time_ns = 0;
  std::array<double, kActuatorCount> position_mm{};
  std::array<double, kActuatorCount> velocity_mm_per_s{};
  bool referenced = false;
  bool sensor_fault = false;            // the encoder itself says so
  std::uint32_t setpoints_late = 0;     // dropped since start
  std::uint32_t setpoints_missing = 0;  // times the queue ran dry since start
};

struct Setpoint {
  std::int64_t execute_at_ns = 0;
  std::array<double, kActuatorCount> position_mm{};
  std::array<double, kActuatorCount> velocity_mm_per_s{};
};

class DriveHardware {
 public:
  virtual ~DriveHardware() = default;
  virtual DriveReadings ReadState(std::int64_t now_ns) = 0;
  virtual void WriteSetpoint(const Setpoint& setpoint) = 0;
  virtual void SetEnabled(bool enabled) = 0;  // power to the actuators; off brakes at once
  virtual void BeginHoming() = 0;             // `referenced` turns false, and true when it is done
};

}  // namespace lambdajet::drive
