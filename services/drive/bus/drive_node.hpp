// Runs the drive module's core on the bus: one cyclic loop, everything else hands over.
//
// Model: each cycle drains the inboxes, steps the core, publishes drive/state every `state_every` cycles, and lets the
// caller look at the state (a simulated plant publishes its truth then). The loop asks the host for SCHED_FIFO and a CPU.
// Threads: Open() and destruction in main; the loop is a thread of its own. Errors: those of platform/bus.
#pragma once

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "drive/core/drive_core.hpp"
#include "link/bus/node_config.hpp"

namespace lambdajet::drive {

struct NodeConfig {
  DriveConfig core;
  link::LoopConfig loop;

  void Declare(ConfigSchema& schema);
};

class DriveNode {
 public:
  // All references outlive the node. `after_cycle` is called in the loop. `running` is called once, from the loop.
  static absl::StatusOr<std::unique_ptr<DriveNode>> Open(const link::NodeParts& parts,
                                                         const NodeConfig& config, DriveHardware& hardware,
                                                         std::function<void(const DriveState&)> after_cycle,
                                                         std::function<void()> running);
  ~DriveNode();  // stops the loop
  DriveNode(const DriveNode&) = delete;
  DriveNode& operator=(const DriveNode&) = delete;

  void UpdateMetrics();  // about once a second, from main

 private:
  class Inside;
  DriveNode();
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet::drive
