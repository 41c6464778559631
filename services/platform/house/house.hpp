// Makes a house's main a list of introductions: settings, log, metrics, bus, RPC, readiness, orderly stop.
//
// Model: Open() reads the settings (the common ones below and those the house declares), blocks the stop signals, and
// starts log, metrics and bus. The house then makes its doors, adds its services to rpc(), says what happens on stop, and
// calls Run(): RPC starts; when every requirement of readiness is met, health turns SERVING and the announce file is
// written; on SIGTERM or SIGINT health turns NOT_SERVING, the stop actions run in reverse order, RPC ends within its
// deadline, and Run() returns the exit code. Once a second Run() follows the clock and brings counters to the metrics.
// Example, a whole main:
//   int main(int argc, char** argv) {
//     lambdajet::House house("kinematics", "solves the mechanism for people, programs and the bus");
//     lambdajet::kinematics::Config config;
//     config.Declare(house.schema());
//     if (const auto exit_code = house.Open(argc, argv)) return *exit_code;
//     lambdajet::kinematics::PoseRoom poses(house.bus(), house.log());      // its doors
//     lambdajet::kinematics::Rpc rpc(poses);
//     house.rpc().Add(rpc, v1::KinematicsService::service_full_name());
//     house.OnStop([&] { poses.Stop(); });
//     return house.Run();
//   }
// Threads: Open(), Run() and OnStop() in main; Require(), Met(), Unmet() and Fail() from any.
// Errors: Open() and Run() print and log what is wrong and give the exit code: 78 settings, 69 a port or the bus.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "platform/config/schema.hpp"
#include "platform/process/common_clock.hpp"

namespace lambdajet {

class Log;
class Metrics;
class Participant;
class RpcServer;

inline constexpr int kExitUnavailable = 69;  // EX_UNAVAILABLE of sysexits.h
inline constexpr int kExitSoftware = 70;     // EX_SOFTWARE

class House {
 public:
  House(std::string name, std::string about);
  ~House();
  House(const House&) = delete;
  House& operator=(const House&) = delete;

  ConfigSchema& schema();

  // Nothing: go on. Otherwise the exit code to return from main (0 after --help).
  std::optional<int> Open(int argc, const char* const* argv);

  const std::string& machine_id() const;
  Log& log();
  Metrics& metrics();
  Participant& bus();
  RpcServer& rpc();
  const CommonClock& clock() const;

  // Names something this house must have before it is ready ("machine_description"); Met() when it has it, Unmet() when
  // it has lost it again. A house that names nothing is ready as soon as it runs.
  void Require(const std::string& requirement);
  void Met(const std::string& requirement);
  void Unmet(const std::string& requirement);

  // Called on stop before RPC ends, the last one added first.
  void OnStop(std::function<void()> action);

  // Called by Run() about once a second, in main.
  void EverySecond(std::function<void()> action);

  // Ends Run() from inside with this exit code.
  void Fail(const absl::Status& why, int exit_code = kExitSoftware);

  int Run();

  // Prints and logs what a part of the house could not do, for `return house.Refuse(status)` in main.
  int Refuse(const absl::Status& why, int exit_code = kExitUnavailable);

 private:
  class Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet
