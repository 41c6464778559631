// Tells clients how far their plans have come: a message at once, at every step of progress, and at the end.
//
// Model: one thread looks at all plans that are watched; each stream keeps its own pace. Of a slow client's waiting messages
// the oldest are dropped, never the last. Units: s. Threads: Open() from any.
// Errors: RESOURCE_EXHAUSTED TOO_MANY_WATCHERS above kMostWatchers; UNAVAILABLE CLOSING when the service ends.
#pragma once

#include <chrono>
#include <condition_variable>
#include <list>
#include <memory>
#include <mutex>
#include <thread>

#include "platform/rpc/streams.hpp"
#include "trajectory/rpc/wire.hpp"

namespace lambdajet::trajectory {

class PlanWatch {
 public:
  static constexpr std::size_t kMostWatchers = 64;

  PlanWatch();
  ~PlanWatch();  // ends every stream
  PlanWatch(const PlanWatch&) = delete;
  PlanWatch& operator=(const PlanWatch&) = delete;

  grpc::ServerWriteReactor<v1::GetPlanResponse>* Open(std::shared_ptr<const PlanRecord> record,
                                                      double period_s);

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;
  struct Watcher {
    std::shared_ptr<PushStream<v1::GetPlanResponse>> stream;
    std::shared_ptr<const PlanRecord> record;
    std::chrono::duration<double> period;
    SteadyTime next;
    double told_progress = -1.0;
  };

  static bool Tell(Watcher& watcher, SteadyTime now);  // false: this was the last
  void Work();

  std::mutex mutex_;
  std::condition_variable changed_;
  bool closed_ = false;
  std::list<Watcher> watchers_;
  std::thread thread_;
};

}  // namespace lambdajet::trajectory
