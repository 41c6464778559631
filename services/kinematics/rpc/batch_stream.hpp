// Answers a stream of batches in order: while one answer is written, the next batch is read and computed.
//
// Model: two slots for answers; a batch that cannot be understood ends the stream with its status.
// Threads: gRPC's reactions, made one at a time by a lock. Cost: messages are reused, so a long stream stops allocating.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <array>
#include <mutex>

#include "kinematics/rpc/kinematics_answers.hpp"
#include "platform/rpc/handlers.hpp"

namespace lambdajet::kinematics {

template <class Request, class Response>
class BatchStream final : public grpc::ServerBidiReactor<Request, Response> {
 public:
  explicit BatchStream(const KinematicsAnswers& answers) : answers_(answers) { this->StartRead(&request_); }

  void OnReadDone(bool ok) override {
    absl::Status status;
    const std::size_t slot = next_slot_;
    if (ok) {
      // Only the read that is outstanding gets here, so the slot is nobody else's: the one being written is the other.
      responses_[slot].Clear();
      status = Guarded([&] { return answers_.AnswerBatch(request_, responses_[slot]); });
    }
    const std::lock_guard lock(mutex_);
    if (ended_) {
      return;
    }
    if (!ok || !status.ok()) {
      end_ = lambdajet::ToWire(status);
      ended_ = true;
      return FinishWhenWritten();
    }
    next_slot_ = 1 - slot;
    if (writing_) {
      waiting_ = &responses_[slot];  // read on when there is a slot again
      return;
    }
    Write(responses_[slot]);
  }

  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (!ok) {
      end_ = grpc::Status(grpc::StatusCode::CANCELLED, "the client has gone");
      ended_ = true;
    }
    if (!ended_ && waiting_ != nullptr) {
      Response* const response = waiting_;
      waiting_ = nullptr;
      return Write(*response);
    }
    FinishWhenWritten();
  }

  void OnDone() override { delete this; }

 private:
  void Write(const Response& response) {
    writing_ = true;
    this->StartWrite(&response);
    this->StartRead(&request_);
  }

  void FinishWhenWritten() {
    if (ended_ && !writing_ && !finished_) {
      finished_ = true;
      this->Finish(end_);
    }
  }

  const KinematicsAnswers& answers_;
  Request request_;
  std::array<Response, 2> responses_;
  std::size_t next_slot_ = 0;
  std::mutex mutex_;
  Response* waiting_ = nullptr;
  bool writing_ = false;
  bool ended_ = false;
  bool finished_ = false;
  grpc::Status end_;
};

}  // namespace lambdajet::kinematics
