// Runs the main-motion module's core on the bus: one cyclic loop, everything else hands over.
//
// Model: each cycle lets the caller bring his hardware up to date, drains the inboxes, steps the core, publishes
// main_motion/state every `state_every` cycles and measurements and process records as they come, and lets the caller
// look at the state (a simulated plant publishes its truth then). The loop asks the host for SCHED_FIFO and a CPU.
// Threads: Open() and destruction in main; the loop is a thread of its own. Errors: those of platform/bus.
#pragma once

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "main_motion/core/main_motion_core.hpp"
#include "platform/config/schema.hpp"

namespace lambdajet {
class CommonClock;
class Log;
class Metrics;
class Participant;
}  // namespace lambdajet

namespace lambdajet::main_motion {

struct NodeConfig {
  MainMotionConfig core;
  int fifo_priority = 50;
  int cpu = -1;
  bool lock_memory = false;
  int state_every = 4;  // control periods

  void Declare(ConfigSchema& schema);
};

struct NodeParts {
  Participant& bus;
  const CommonClock& clock;
  Log& log;
  Metrics& metrics;
};

class MainMotionNode {
 public:
  // All references outlive the node. `after_cycle` is called in the loop. `running` is called once, from the loop.
  static absl::StatusOr<std::unique_ptr<MainMotionNode>> Open(
      const NodeParts& parts, const NodeConfig& config, MainMotionHardware& hardware,
      std::function<void()> before_cycle, std::function<void(const MainMotionState&)> after_cycle,
      std::function<void()> running);
  ~MainMotionNode();  // stops the loop
  MainMotionNode(const MainMotionNode&) = delete;
  MainMotionNode& operator=(const MainMotionNode&) = delete;

  void UpdateMetrics();  // about once a second, from main

 private:
  class Inside;
  MainMotionNode();
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet::main_motion
