// Knows where the services of a cell listen and asks them.
//
// Model: defaults on loopback (50051 kinematics, 50052 calibration, 50053 trajectory, 50054 accuracy, 50055 cell, 50058
// inspection); over them a file of `service: host:port` lines (--services), the announce files of running processes
// (--announce-dir), and --address service=host:port. TLS where --ca names a certificate.
// Units: s. Threads: one.
// Errors: UNAVAILABLE SERVICE_UNREACHABLE with the service and its address; what the service says otherwise.
#pragma once

#include <grpcpp/client_context.h>

#include <CLI/App.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "platform/rpc/channel.hpp"

namespace google::protobuf {
class Message;
}

namespace lambdajet::cli {

class Output;

class Connections {
 public:
  void AddOptions(CLI::App& app);

  absl::StatusOr<std::string> AddressOf(const std::string& service) const;
  absl::StatusOr<std::shared_ptr<grpc::Channel>> Open(const std::string& service) const;
  // The same trouble, saying which service at which address if it was not reached.
  absl::Status Named(const std::string& service, absl::Status status) const;
  double timeout_s() const { return timeout_s_; }

  // One unary call: Ask<CellService>("cell", &CellService::Stub::GetJob, request, response).
  template <typename Service, typename Request, typename Response>
  absl::Status Ask(const std::string& service,
                   grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                   const Request& request, Response& response, double timeout_s = 0.0) const {
    const auto channel = Open(service);
    if (!channel.ok()) {
      return channel.status();
    }
    typename Service::Stub stub(*channel);
    return Named(service, Call(method, stub, request, response, timeout_s > 0.0 ? timeout_s : timeout_s_));
  }

 private:
  std::vector<std::string> addresses_;
  std::string services_file_;
  std::string announce_dir_;
  ChannelOptions tls_;
  double timeout_s_ = 30.0;
};

// Prints the message as --json does: field names as in the proto, one line.
void PrintJson(const google::protobuf::Message& message, Output& output);

// A verb that asks a service. Where a verb of that name works on files already, this one is called `ask-NAME`.
CLI::App* AddServiceVerb(CLI::App& noun, const std::string& name, const std::string& what);

}  // namespace lambdajet::cli
