// Listens to two real module processes on the bus, and plays cell, trajectory and calibration for them as far as a test needs.
//
// Model: BusEar keeps what the modules say of themselves. BusCell publishes the machine description, sends commands and waits for the modules' echo, streams a plan by the
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

namespace lambdajet {
class Participant;
}

namespace lambdajet::tests {

class BusEar {
 public:
  BusEar(int domain, const std::string& machine_id);
  ~BusEar();
  BusEar(const BusEar&) = delete;
  BusEar& operator=(const BusEar&) = delete;

  DriveState drive() const;
  MainMotionState main_motion() const;
  std::int64_t now_ns() const;
  std::int64_t drive_heard_ns() const;  // when its newest state came
  std::vector<ProcessRecord> records() const;
  // Called with each state of main motion, in the bus's thread; set before the modules start.
  std::function<void(const MainMotionState&)> on_main_motion;
  Participant& bus();

 private:
  struct Readers;
  std::unique_ptr<Readers> readers_;
};

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

  DriveState drive() const { return ear_.drive(); }
  MainMotionState main_motion() const { return ear_.main_motion(); }
  std::int64_t now_ns() const { return ear_.now_ns(); }
  std::int64_t drive_heard_ns() const { return ear_.drive_heard_ns(); }
  std::vector<ProcessRecord> records() const { return ear_.records(); }
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

  BusEar ear_;
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
