// Plays cell, trajectory and calibration for two real module processes on the bus, as far as a test needs them.
//
// Model: publishes the machine description, sends commands and waits for the modules' echo, streams a plan by the
// modules' back-pressure from a thread of its own, and keeps what comes back. Threads: the public members from the test's
// thread. Errors: what cannot be opened aborts the test.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "foundation/machine/machine_description.hpp"
#include "foundation/motion/link_samples.hpp"

namespace lambdajet::tests {

class BusCell {
 public:
  BusCell(int domain, const MachineDescription& machine);
  ~BusCell();
  BusCell(const BusCell&) = delete;
  BusCell& operator=(const BusCell&) = delete;

  void PublishDescription();
  void Send(Verb verb, std::uint32_t target, double value = 0.0, std::int64_t start_at_ns = 0);
  // Sends and waits until each target has answered; false if one refused or was silent.
  bool Obeyed(Verb verb, std::uint32_t target, double value = 0.0, std::int64_t start_at_ns = 0);
  // Home, load, arm, start; true when both modules play the plan.
  bool Begin(const Plan& plan);
  void StopStreaming() { streaming_.store(false); }

  DriveState drive() const;
  MainMotionState main_motion() const;
  std::int64_t now_ns() const;
  std::int64_t drive_heard_ns() const;  // when its newest state came
  std::vector<ProcessRecord> records() const;
  std::vector<Measurement> measurements() const;
  struct Switch {
    std::int64_t time_ns = 0;
    bool on = false;
  };
  std::vector<Switch> switches() const;  // of the true jet
  std::size_t sheet_samples() const;

 private:
  struct Wires;
  void Stream();

  MachineDescription machine_;
  Plan plan_;
  mutable std::mutex mutex_;
  std::unique_ptr<Wires> wires_;
  std::uint64_t commands_ = 0;
  std::atomic<bool> stop_ = false;
  std::atomic<bool> streaming_ = true;
  std::thread streamer_;
};

}  // namespace lambdajet::tests
