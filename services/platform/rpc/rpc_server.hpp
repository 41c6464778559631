// Serves a house's gRPC services, with TLS, limits, health, metrics and an orderly end.
//
// Model: a thin value over grpc::Server with the callback API (handlers.hpp). Plaintext only on loopback unless
// allow_plaintext says so; with client_ca_file a client must show a certificate of that CA (mTLS), and with roles it may call what its role allows (roles.hpp; plaintext knows no roles). Certificate files are
// watched, so a rotated certificate is used without a restart. Health is NOT_SERVING, for each service and for "", until
// SetServing(true). Every RPC is counted and timed by an interceptor; failures are logged with their reason.
// Threads: Start() and Shutdown() from main; SetServing() from any.
// Errors: FAILED_PRECONDITION PLAINTEXT_REFUSED, INVALID_ARGUMENT BAD_CERTIFICATE, BAD_ROLE or BAD_ADDRESS, UNAVAILABLE
// ADDRESS_IN_USE.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace grpc {
class Service;
}

namespace lambdajet {

class Log;
class Metrics;

struct RpcOptions {
  std::string address = "127.0.0.1:0";  // port 0 takes a free one
  std::string certificate_file;         // PEM chain; empty: plaintext
  std::string key_file;                 // PEM
  std::string client_ca_file;           // PEM; empty: clients need no certificate
  std::vector<std::string> roles;       // as roles.hpp reads them; empty: every client may call everything
  bool allow_plaintext = false;         // beyond loopback
  bool reflection = false;
  int most_message_mib = 128;  // so that a program too large for its house is refused by it, with its reason
  int most_metadata_kib = 8;
  int most_memory_mib = 256;
  int most_streams = 200;            // at once, on one connection
  double shutdown_deadline_s = 5.0;  // then running calls are cancelled
};

class RpcServer {
 public:
  // `log` and `metrics` may be null; otherwise they outlive the server.
  RpcServer(RpcOptions options, Log* log, Metrics* metrics);
  ~RpcServer();
  RpcServer(const RpcServer&) = delete;
  RpcServer& operator=(const RpcServer&) = delete;

  // Before Start(). The service outlives the server; full_name is v1::XService::service_full_name().
  void Add(grpc::Service& service, const std::string& full_name);

  absl::Status Start();
  int port() const { return port_; }
  void SetServing(bool serving);

  // Says NOT_SERVING, refuses new calls, waits for running ones until the deadline, then cancels them.
  void Shutdown();

 private:
  class Inside;
  RpcOptions options_;
  Log* log_;
  Metrics* metrics_;
  std::vector<std::pair<grpc::Service*, std::string>> services_;
  std::unique_ptr<Inside> inside_;
  int port_ = 0;
};

}  // namespace lambdajet
