#include "platform/house/house.hpp"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <vector>

#include "foundation/contract/expects.hpp"
#include "foundation/contract/trouble.hpp"
#include "platform/bus/participant.hpp"
#include "platform/config/load.hpp"
#include "platform/house/common_config.hpp"
#include "platform/process/atomic_file.hpp"
#include "platform/process/stop_signal.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "platform/telemetry/log.hpp"
#include "platform/telemetry/metrics.hpp"

namespace lambdajet {
namespace {

#ifndef LAMBDAJET_VERSION
#error "LAMBDAJET_VERSION comes from CMake"
#endif

constexpr char kAnnounceAdvice[] =
    "; name a file in a folder that exists and that this user may write, or leave announce_file empty";

LogLevel LevelOf(const std::string& word) {
  return word == "debug"     ? LogLevel::kDebug
         : word == "warning" ? LogLevel::kWarning
         : word == "error"   ? LogLevel::kError
                             : LogLevel::kInfo;
}

bool IsId(const std::string& text) {
  return !text.empty() && text.size() <= 63 &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos;
}

}  // namespace

class House::Inside {
 public:
  Inside(std::string house, std::string says) : name(std::move(house)), about(std::move(says)) {
    config.bus.house = name;
    config.Declare(schema);
  }

  // Members are destroyed in reverse order: RPC before the bus, the log last.
  const std::string name;
  const std::string about;
  const StopSignal stop;  // first, so that every thread inherits its mask
  ConfigSchema schema;
  CommonConfig config;
  CommonClock clock;
  std::unique_ptr<Log> log;
  std::unique_ptr<Metrics> metrics;
  std::unique_ptr<MetricsExporter> exporter;
  std::unique_ptr<Participant> bus;
  std::unique_ptr<RpcServer> rpc;

  std::mutex mutex;
  std::map<std::string, bool> requirements;
  bool running = false;
  bool serving = false;
  bool announced = false;
  std::vector<std::function<void()>> stop_actions;
  std::vector<std::function<void()>> second_actions;
  std::atomic<int> exit_code = 0;

  Gauge ready_gauge;
  Gauge clock_bound_gauge;
  Gauge clock_offset_gauge;
  Counter clock_steps;

  absl::Status Start();
  absl::Status CheckAnnounceFile() const;
  void UpdateReadiness();
  void Announce();
  void Second();
  void FollowClock();
  void Stop();
};

// Whoever waits for the announce file would wait for ever if it could not be written when the time comes.
absl::Status House::Inside::CheckAnnounceFile() const {
  if (config.announce_file.empty()) {
    return absl::OkStatus();
  }
  const absl::Status status = CheckFileCanBeWritten(config.announce_file);
  return status.ok() ? status
                     : Trouble(status.code(), TroubleReason(status),
                               "announce_file: " + std::string(status.message()) + kAnnounceAdvice,
                               {{"path", config.announce_file}});
}

absl::Status House::Inside::Start() {
  if (!IsId(config.machine_id)) {
    return Trouble(
        absl::StatusCode::kInvalidArgument, "BAD_ID",
        "machine_id is '" + config.machine_id.substr(0, 64) + "'; right is 1 to 63 of a-z, 0-9 and '-'");
  }
  if (absl::Status status = CheckAnnounceFile(); !status.ok()) {
    return status;
  }
  metrics->AddBuildInfo(name, LAMBDAJET_VERSION);
  ready_gauge = metrics->AddGauge("lambdajet_ready", "1 when this house is ready.");
  clock_bound_gauge =
      metrics->AddGauge("lambdajet_clock_error_bound_seconds", "The kernel's bound of its clock's error.");
  clock_offset_gauge = metrics->AddGauge("lambdajet_clock_difference_seconds",
                                         "CLOCK_REALTIME against the common time of this process.");
  clock_steps =
      metrics->AddCounter("lambdajet_clock_steps_total", "Seconds in which the clock stood off by a step.");
  auto serving_metrics = MetricsExporter::Start(*metrics, config.metrics_address);
  if (!serving_metrics.ok()) {
    return serving_metrics.status();
  }
  exporter = std::move(*serving_metrics);
  config.bus.partition = config.machine_id;
  auto joined = Participant::Open(config.bus, log.get(), metrics.get());
  if (!joined.ok()) {
    return joined.status();
  }
  bus = std::move(*joined);
  rpc = std::make_unique<RpcServer>(config.rpc, log.get(), metrics.get());
  return absl::OkStatus();
}

void House::Inside::Announce() {
  if (config.announce_file.empty()) {
    return;
  }
  const nlohmann::json json = {{"house", name},
                               {"machine_id", config.machine_id},
                               {"pid", getpid()},
                               {"rpc_port", rpc->port()},
                               {"metrics_port", exporter->port()}};
  if (const absl::Status status = WriteFileAtomically(config.announce_file, json.dump() + "\n");
      !status.ok()) {
    log->Error("announce_failed", "announce_file: " + std::string(status.message()) + kAnnounceAdvice,
               {{"reason", TroubleReason(status)}});
    exit_code.store(kExitUnavailable);
    StopSignal::Request();
  }
}

// Called with the mutex held.
void House::Inside::UpdateReadiness() {
  bool ready = running;
  std::string missing;
  for (const auto& [requirement, met] : requirements) {
    ready = ready && met;
    missing += met ? "" : (missing.empty() ? "" : ", ") + requirement;
  }
  if (ready == serving) {
    return;
  }
  serving = ready;
  rpc->SetServing(ready);
  ready_gauge.Set(ready ? 1.0 : 0.0);
  if (ready) {
    log->Info("ready", "this house is ready",
              {{"rpc_port", rpc->port()}, {"metrics_port", exporter->port()}});
  } else if (running) {
    log->Warning("not_ready", "this house is no longer ready", {{"missing", missing}});
  }
  if (ready && !announced) {
    announced = true;
    Announce();
  }
}

void House::Inside::FollowClock() {
  const ClockCorrection correction = clock.Follow();
  clock_offset_gauge.Set(1e-9 * static_cast<double>(correction.difference_ns));
  clock_bound_gauge.Set(1e-9 * static_cast<double>(ReadKernelClockError().bound_ns));
  if (correction.step) {
    clock_steps.Increment();
    log->Warning("clock_step",
                 "the system's clock has stepped; this process keeps its time until it is restarted",
                 {{"difference_s", 1e-9 * static_cast<double>(correction.difference_ns)}});
  }
}

void House::Inside::Second() {
  FollowClock();
  bus->UpdateMetrics();
  for (const auto& action : second_actions) {
    action();
  }
}

void House::Inside::Stop() {
  {
    const std::lock_guard lock(mutex);
    running = false;
    UpdateReadiness();
  }
  for (auto action = stop_actions.rbegin(); action != stop_actions.rend(); ++action) {
    (*action)();
  }
  rpc->Shutdown();
}

House::House(std::string name, std::string about)
    : inside_(std::make_unique<Inside>(std::move(name), std::move(about))) {}
House::~House() = default;

ConfigSchema& House::schema() { return inside_->schema; }

std::optional<int> House::Open(int argc, const char* const* argv) {
  if (const auto exit_code = LoadConfig(inside_->schema, argc, argv, inside_->about)) {
    return exit_code;
  }
  inside_->log = std::make_unique<Log>(LogOptions{inside_->name, LevelOf(inside_->config.log_level)});
  inside_->metrics = std::make_unique<Metrics>();
  if (const absl::Status status = inside_->Start(); !status.ok()) {
    const bool settings = status.code() != absl::StatusCode::kUnavailable;
    return Refuse(status, settings ? kExitConfig : kExitUnavailable);
  }
  return std::nullopt;
}

const std::string& House::machine_id() const { return inside_->config.machine_id; }
Log& House::log() { return *inside_->log; }
Metrics& House::metrics() { return *inside_->metrics; }
Participant& House::bus() { return *inside_->bus; }
RpcServer& House::rpc() { return *inside_->rpc; }
const CommonClock& House::clock() const { return inside_->clock; }

void House::Require(const std::string& requirement) {
  const std::lock_guard lock(inside_->mutex);
  inside_->requirements.emplace(requirement, false);
  inside_->UpdateReadiness();
}

void House::Met(const std::string& requirement) {
  const std::lock_guard lock(inside_->mutex);
  inside_->requirements[requirement] = true;
  inside_->UpdateReadiness();
}

void House::Unmet(const std::string& requirement) {
  const std::lock_guard lock(inside_->mutex);
  inside_->requirements[requirement] = false;
  inside_->UpdateReadiness();
}

void House::OnStop(std::function<void()> action) { inside_->stop_actions.push_back(std::move(action)); }
void House::EverySecond(std::function<void()> action) {
  inside_->second_actions.push_back(std::move(action));
}

void House::Fail(const absl::Status& why, int exit_code) {
  inside_->exit_code.store(exit_code);
  inside_->log->Error("house_failed", std::string(why.message()), {{"reason", TroubleReason(why)}});
  StopSignal::Request();
}

int House::Refuse(const absl::Status& why, int exit_code) {
  std::fprintf(stderr, "%s: %s\n", inside_->name.c_str(), std::string(why.message()).c_str());
  inside_->log->Error("start_refused", std::string(why.message()),
                      {{"reason", TroubleReason(why)}, {"exit_code", exit_code}});
  return exit_code;
}

int House::Run() {
  Inside& in = *inside_;
  Expects(in.rpc != nullptr, "Open() has gone well before Run()");
  if (const absl::Status status = in.rpc->Start(); !status.ok()) {
    in.Stop();
    return Refuse(status, status.code() == absl::StatusCode::kUnavailable ? kExitUnavailable : kExitConfig);
  }
  in.log->Info("started", "serving",
               {{"rpc_port", in.rpc->port()},
                {"metrics_port", in.exporter->port()},
                {"pid", getpid()},
                {"machine_id", in.config.machine_id},
                {"domain", in.config.bus.domain}});
  {
    const std::lock_guard lock(in.mutex);
    in.running = true;
    in.UpdateReadiness();
  }
  std::optional<int> signal;
  while (!(signal = in.stop.WaitFor(std::chrono::seconds(1)))) {
    in.Second();
  }
  in.log->Info("stopping", "told to stop", {{"signal", *signal}});
  in.Stop();
  in.log->Info("stopped", "stopped in order", {{"exit_code", in.exit_code.load()}});
  return in.exit_code.load();
}

}  // namespace lambdajet
