// S, M3, M4 and M5 of a machine with a spindle: the speed is taken before the spindle is switched, as LinuxCNC does; a new S
// changes the speed of a spindle that turns.
#include <cmath>

#include "trajectory/core/part_program/gcode_reading.hpp"

namespace lambdajet::trajectory {
namespace {

bool TakeSpeed(Reading& r) {
  if (!r.block.has('S')) {
    return true;
  }
  const SpindleRange& range = r.options.spindle;
  const double speed = r.block.Take('S');
  if (!(range.most_per_min > 0.0)) {
    return r.FaultAt('S', "SPINDLE_MISSING", "this machine has no spindle");
  }
  if (!(speed > 0.0)) {
    return r.FaultAt('S', "SPINDLE_SPEED_NOT_POSITIVE", "a spindle's speed is above 0; M5 stops it");
  }
  if (!(speed >= range.least_per_min && speed <= range.most_per_min)) {
    return r.FaultAt('S', "SPINDLE_SPEED_OUT_OF_RANGE",
                     "this spindle turns " + ShortNumber(range.least_per_min) + " to " +
                         ShortNumber(range.most_per_min) + " times a minute");
  }
  r.state.spindle_per_min = speed;
  return true;
}

}  // namespace

bool ObeySpindle(Reading& r) {
  if (!TakeSpeed(r)) {
    return false;
  }
  const int m = r.code(kJet);
  if (m == 50) {
    StopSpindle(r);
    return true;
  }
  const double now = r.state.turns_per_min;
  const bool starts = m == 30 || m == 40;
  if (!starts && now == 0.0) {
    return true;
  }
  if (!(r.options.spindle.most_per_min > 0.0)) {
    return r.FaultAt(kJet, "SPINDLE_MISSING", "this machine has no spindle");
  }
  if (!(r.state.spindle_per_min > 0.0)) {
    return r.FaultAt(kJet, "SPINDLE_SPEED_MISSING", "S must give the speed first, as in S3000 M3");
  }
  const bool backwards = starts ? m == 40 : now < 0.0;
  r.state.turns_per_min = backwards ? -r.state.spindle_per_min : r.state.spindle_per_min;
  if (r.state.turns_per_min != now) {
    r.Add(OperationKind::kSpindleOn).value = r.state.turns_per_min;
  }
  return true;
}

void StopSpindle(Reading& r) {
  if (r.state.turns_per_min != 0.0) {
    r.Add(OperationKind::kSpindleOff);
  }
  r.state.turns_per_min = 0.0;
}

}  // namespace lambdajet::trajectory
