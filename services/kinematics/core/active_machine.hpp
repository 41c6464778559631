// Holds the machine that a running house calculates with, and lets it be exchanged under readers' hands.
//
// Model: a version is immutable; Publish() swaps the pointer, so a question that began with a version ends with it, and no
// question ever sees half of one and half of another.
// Threads: Current() and Publish() from any. Cost: Current() one atomic load and a reference count.
#pragma once

#include <atomic>
#include <memory>
#include <utility>

#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::kinematics {

struct ActiveMachine {
  MachineDescription description;
  LambdaMechanism mechanism;
};

class MachineSlot {
 public:
  void Publish(MachineDescription description) {
    auto next = std::make_shared<ActiveMachine>();
    next->mechanism = LambdaMechanism::FromDescription(description);
    next->description = std::move(description);
    current_.store(std::move(next));
  }

  // Null until the first description has arrived.
  std::shared_ptr<const ActiveMachine> Current() const { return current_.load(); }

 private:
  std::atomic<std::shared_ptr<const ActiveMachine>> current_;
};

}  // namespace lambdajet::kinematics
