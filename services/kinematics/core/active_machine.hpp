// Holds the machine that a running house calculates with, and lets it be exchanged under readers' hands.
//
// Model: a version is immutable; Publish() swaps the pointer, so a question that began with a version ends with it, and no
// question ever sees half of one and half of another. A hexapod is the house's own from its start on and does not change.
// Threads: Current() and Publish() from any. Cost: Current() one atomic load and a reference count.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include "kinematics/core/hexapod.hpp"
#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::kinematics {

struct ActiveMachine {
  MachineDescription description;
  LambdaMechanism mechanism;
};

struct OwnHexapod {
  std::string machine_id;
  std::string hash;
  Hexapod hexapod;
};

class MachineSlot {
 public:
  MachineSlot() = default;
  // With the hexapod this house was started with; null: none.
  explicit MachineSlot(std::shared_ptr<const OwnHexapod> hexapod) : hexapod_(std::move(hexapod)) {}

  void Publish(MachineDescription description) {
    auto next = std::make_shared<ActiveMachine>();
    next->mechanism = LambdaMechanism::FromDescription(description);
    next->description = std::move(description);
    current_.store(std::move(next));
  }

  // Null until the first description has arrived.
  std::shared_ptr<const ActiveMachine> Current() const { return current_.load(); }
  const OwnHexapod* hexapod() const { return hexapod_.get(); }

 private:
  std::shared_ptr<const OwnHexapod> hexapod_;
  std::atomic<std::shared_ptr<const ActiveMachine>> current_;
};

}  // namespace lambdajet::kinematics
