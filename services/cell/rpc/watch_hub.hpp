// Serves WatchJobs: every journal record after a token, at the client's own pace, and live progress in between.
//
// Model: a watcher keeps the last token it has written and reads on from the journal, so a slow client loses nothing and
// costs no memory; progress is made fresh when it is written, never queued. One thread looks every 50 ms which idle watchers
// have something to hear.
// Threads: Open() from gRPC's, the rest inside. Errors: RESOURCE_EXHAUSTED TOO_MANY_WATCHERS over kMostWatchers.
#pragma once

#include <condition_variable>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "cell/desk/job_desk.hpp"
#include "lambdajet/cell/v1/cell.grpc.pb.h"

namespace lambdajet::cell {

class WatchHub {
 public:
  static constexpr std::size_t kMostWatchers = 500;

  explicit WatchHub(JobDesk& desk);
  ~WatchHub();
  void Close();

  // A stream; one that only tells `refusal` if that is not OK.
  grpc::ServerWriteReactor<v1::JobEvent>* Open(std::uint64_t token, const std::string& job_id,
                                               double period_s, const absl::Status& refusal);

 private:
  class Watcher;
  void Work();

  JobDesk& desk_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::list<std::shared_ptr<Watcher>> watchers_;
  bool closed_ = false;
  std::thread thread_;
};

}  // namespace lambdajet::cell
