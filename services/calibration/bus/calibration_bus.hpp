// Brings looks from main motion to the desk, and the active machine from the desk to everyone.
//
// Model: looks wait in a bounded queue and are written to the store in batches, one transaction each, by a thread of this
// room; a look with a number that is not finite is counted and dropped. If the store cannot take a batch the room says so
// and tries again: nothing is lost while the queue has room. The description is written at once and on every activation.
// Threads: one of its own; Open() and the destructor in main. The desk must not activate after the destructor.
// Errors: those of the bus.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "calibration/desk/calibration_desk.hpp"

namespace lambdajet {
class Log;
class Metrics;
class Participant;
}  // namespace lambdajet

namespace lambdajet::calibration {

class CalibrationBus {
 public:
  static absl::StatusOr<std::unique_ptr<CalibrationBus>> Open(Participant& bus, CalibrationDesk& desk,
                                                              const Clock& clock, Log& log, Metrics& metrics);
  ~CalibrationBus();
  CalibrationBus(const CalibrationBus&) = delete;
  CalibrationBus& operator=(const CalibrationBus&) = delete;

 private:
  class Inside;
  CalibrationBus();
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet::calibration
