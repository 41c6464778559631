// Opens a gRPC channel and makes calls with a deadline, their status read back as trouble.
//
// Model: ChannelOptions name the server and, where it serves TLS, the files to trust it and to be trusted. Call() makes
// one unary call through a generated stub:
//     auto channel = OpenChannel({.address = "127.0.0.1:50051"});
//     v1::KinematicsService::Stub stub(*channel);
//     v1::SolveInverseResponse response;
//     absl::Status status = Call(&v1::KinematicsService::Stub::SolveInverse, stub, request, response, 2.0);
// Units: s. Threads: a channel is safe for any number.
// Errors: INVALID_ARGUMENT BAD_CERTIFICATE and the like for the files; a call's own status otherwise; UNAVAILABLE when
// nobody answers.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "platform/rpc/status_mapping.hpp"

namespace lambdajet {

struct ChannelOptions {
  std::string address = {};
  std::string ca_file = {};           // PEM; empty: plaintext
  std::string certificate_file = {};  // our own, for mTLS
  std::string key_file = {};
  std::string server_name = {};  // in the server's certificate, if not the address
  int most_message_mib = 128;
};

absl::StatusOr<std::shared_ptr<grpc::Channel>> OpenChannel(const ChannelOptions& options);

inline constexpr double kDefaultCallDeadlineS = 5.0;

inline void SetDeadline(grpc::ClientContext& context, double seconds) {
  context.set_deadline(std::chrono::system_clock::now() +
                       std::chrono::microseconds(static_cast<std::int64_t>(seconds * 1e6)));
}

template <typename Stub, typename Request, typename Response>
absl::Status Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*), Stub& stub,
                  const Request& request, Response& response, double deadline_s = kDefaultCallDeadlineS) {
  grpc::ClientContext context;
  SetDeadline(context, deadline_s);
  return FromWire((stub.*method)(&context, request, &response));
}

// What the health service says of "" or of one service; an error if it cannot be asked.
absl::StatusOr<bool> AskServing(const std::shared_ptr<grpc::Channel>& channel, const std::string& service,
                                double deadline_s);

}  // namespace lambdajet
