// Says what a module node is given by main and by its configuration, beside its core's own settings.
//
// Units: in the names. Threads: values.
#pragma once

#include "platform/config/schema.hpp"

namespace lambdajet {
class CommonClock;
class Log;
class Metrics;
class Participant;
}  // namespace lambdajet

namespace lambdajet::link {

struct LoopConfig {
  int fifo_priority = 50;
  int cpu = -1;
  bool lock_memory = false;
  int state_every = 2;  // control periods

  // `period_s` and `overruns_allowed` are the core's.
  void Declare(ConfigSchema& schema, double* period_s, int* overruns_allowed);
};

// All outlive the node.
struct NodeParts {
  Participant& bus;
  const CommonClock& clock;
  Log& log;
  Metrics& metrics;
};

}  // namespace lambdajet::link
