// Makes server streams of the callback API short: pulled from a function, or pushed by an event.
//
// Model: PullStream asks `next(message)` for one message after the other, at the client's pace, on gRPC's thread; for
// pages of a result that is there. PushStream takes messages from other threads and keeps at most `most_waiting` for a
// slow client, dropping the oldest (dropped() counts); for watching. A handler returns the stream's reactor:
//     return NewPullStream<v1::Row>([rows, i = 0u](v1::Row& row) mutable { …; return more; });
//     auto stream = PushStream<v1::JobEvent>::New(16); hub_.Add(stream); return stream->Begin();
// Threads: PushStream::Push and Finish from any. A push stream lives until both gRPC and its last shared_ptr have let go.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/status/statusor.h"
#include "platform/rpc/handlers.hpp"

namespace lambdajet {

// A stream that only says why there is none.
template <typename Message>
grpc::ServerWriteReactor<Message>* RefuseStream(const absl::Status& status) {
  class Refusal final : public grpc::ServerWriteReactor<Message> {
   public:
    explicit Refusal(const absl::Status& why) { this->Finish(ToWire(why)); }
    void OnDone() override { delete this; }
  };
  return new Refusal(status);
}

// `next` is false when there is no further message; its status ends the stream early.
template <typename Message>
grpc::ServerWriteReactor<Message>* NewPullStream(std::function<absl::StatusOr<bool>(Message&)> next) {
  class Pull final : public grpc::ServerWriteReactor<Message> {
   public:
    explicit Pull(std::function<absl::StatusOr<bool>(Message&)> source) : next_(std::move(source)) {
      Continue();
    }
    void OnWriteDone(bool ok) override {
      if (ok) {
        Continue();
      } else {
        this->Finish(grpc::Status(grpc::StatusCode::CANCELLED, "the client has gone"));
      }
    }
    void OnDone() override { delete this; }

   private:
    void Continue() {
      message_.Clear();
      bool more = false;
      const absl::Status status = Guarded([&] {
        const absl::StatusOr<bool> answer = next_(message_);
        more = answer.ok() && *answer;
        return answer.status();
      });
      if (more) {
        this->StartWrite(&message_);
      } else {
        this->Finish(ToWire(status));
      }
    }
    std::function<absl::StatusOr<bool>(Message&)> next_;
    Message message_;
  };
  return new Pull(std::move(next));
}

template <typename Message>
class PushStream final : public grpc::ServerWriteReactor<Message>,
                         public std::enable_shared_from_this<PushStream<Message>> {
 public:
  static std::shared_ptr<PushStream> New(std::size_t most_waiting) {
    return std::shared_ptr<PushStream>(new PushStream(most_waiting));
  }

  // What the handler returns; from here on gRPC holds the stream until it is done.
  grpc::ServerWriteReactor<Message>* Begin() {
    const std::lock_guard lock(mutex_);
    held_ = this->shared_from_this();
    return this;
  }

  // False when the stream is over and nothing more is taken.
  bool Push(Message message) {
    const std::lock_guard lock(mutex_);
    if (over_) {
      return false;
    }
    if (waiting_.size() >= most_waiting_) {
      waiting_.pop_front();
      ++dropped_;
    }
    waiting_.push_back(std::move(message));
    WriteNext();
    return true;
  }

  // Ends the stream after what waits has been written.
  void Finish(const absl::Status& status) {
    const std::lock_guard lock(mutex_);
    if (!over_) {
      over_ = true;
      end_ = ToWire(status);
      WriteNext();
    }
  }

  bool over() const {
    const std::lock_guard lock(mutex_);
    return over_;
  }
  std::uint64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (!ok) {
      GiveUp();
    }
    WriteNext();
  }
  void OnCancel() override {
    const std::lock_guard lock(mutex_);
    GiveUp();
    WriteNext();
  }
  void OnDone() override {
    std::shared_ptr<PushStream> last;  // outlives the lock
    const std::lock_guard lock(mutex_);
    over_ = true;
    last = std::move(held_);
  }

 private:
  explicit PushStream(std::size_t most_waiting) : most_waiting_(most_waiting) {}

  void GiveUp() {
    if (!over_) {
      end_ = grpc::Status(grpc::StatusCode::CANCELLED, "the client has gone");
    }
    over_ = true;
    waiting_.clear();
  }

  void WriteNext() {
    if (writing_ || finished_) {
      return;
    }
    if (!waiting_.empty()) {
      current_ = std::move(waiting_.front());
      waiting_.pop_front();
      writing_ = true;
      this->StartWrite(&current_);
    } else if (over_) {
      finished_ = true;
      grpc::ServerWriteReactor<Message>::Finish(end_);
    }
  }

  const std::size_t most_waiting_;
  mutable std::mutex mutex_;
  std::deque<Message> waiting_;
  Message current_;
  grpc::Status end_;
  bool writing_ = false;
  bool over_ = false;
  bool finished_ = false;
  std::uint64_t dropped_ = 0;
  std::shared_ptr<PushStream> held_;
};

}  // namespace lambdajet
