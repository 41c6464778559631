// Runs long work of RPCs on threads of its own, so that gRPC's few stay free.
//
// Model: a bounded queue before a fixed number of threads. Work that does not fit is refused at once: RESOURCE_EXHAUSTED
// OVERLOADED, to be tried again later.
// Threads: Submit() from any. The destructor runs what is queued, so owners cancel first.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "absl/status/status.h"

namespace lambdajet {

class WorkPool {
 public:
  WorkPool(std::size_t threads, std::size_t most_waiting);
  ~WorkPool();
  WorkPool(const WorkPool&) = delete;
  WorkPool& operator=(const WorkPool&) = delete;

  absl::Status Submit(std::function<void()> work);

 private:
  void Work();

  const std::size_t most_waiting_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> waiting_;
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace lambdajet
