#include "link/bus/node_config.hpp"

namespace lambdajet::link {

void LoopConfig::Declare(ConfigSchema& schema, double* period_s, int* overruns_allowed) {
  schema.Add("control.period_s", period_s, {0.0005, 0.02}, "control period");
  schema.Add("control.fifo_priority", &fifo_priority, {0, 90},
             "SCHED_FIFO priority of the loop; 0 leaves it alone");
  schema.Add("control.cpu", &cpu, {-1, 1023}, "CPU the loop is pinned to; -1 any");
  schema.Add("control.lock_memory", &lock_memory, "mlockall");
  schema.Add("control.state_every", &state_every, {1, 20}, "control periods between two states on the bus");
  schema.Add("watch.overruns_allowed", overruns_allowed, {0, 100},
             "late cycles in a hundred before a controlled stop");
}

}  // namespace lambdajet::link
