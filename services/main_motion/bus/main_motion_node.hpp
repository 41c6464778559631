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
#include "link/bus/node_config.hpp"
#include "main_motion/core/main_motion_core.hpp"

namespace lambdajet::main_motion {

struct NodeConfig {
  MainMotionConfig core;
  link::LoopConfig loop{.state_every = 4};

  void Declare(ConfigSchema& schema);
};

class MainMotionNode {
 public:
  // All references outlive the node. `after_cycle` is called in the loop. `running` is called once, from the loop.
  static absl::StatusOr<std::unique_ptr<MainMotionNode>> Open(
      const link::NodeParts& parts, const NodeConfig& config, MainMotionHardware& hardware,
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
