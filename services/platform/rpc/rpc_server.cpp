#include "platform/rpc/rpc_server.hpp"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <chrono>
#include <mutex>

#include "foundation/contract/trouble.hpp"
#include "platform/rpc/call_watch.hpp"
#include "platform/rpc/certificates.hpp"
#include "platform/rpc/roles.hpp"
#include "platform/telemetry/log.hpp"
#include "platform/telemetry/metrics.hpp"

namespace lambdajet {
namespace {

constexpr unsigned kCertificateCheckS = 10;
constexpr int kKeepaliveMs = 30'000;
constexpr int kKeepaliveTimeoutMs = 10'000;
constexpr int kLeastClientPingMs = 10'000;

bool IsLoopbackAddress(const std::string& address) {
  return address.starts_with("127.") || address.starts_with("localhost:") || address.starts_with("[::1]") ||
         address.starts_with("unix:");
}

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> MakeCredentials(const RpcOptions& options,
                                                                         Log* log) {
  namespace tls = grpc::experimental;
  if (options.certificate_file.empty() && options.key_file.empty() && options.client_ca_file.empty()) {
    if (!IsLoopbackAddress(options.address) && !options.allow_plaintext) {
      return Trouble(
          absl::StatusCode::kFailedPrecondition, "PLAINTEXT_REFUSED",
          "rpc.address " + options.address +
              " is not loopback and rpc.certificate_file is empty: name a certificate and a key, or say "
              "rpc.allow_plaintext: true",
          {{"address", options.address}});
    }
    return grpc::InsecureServerCredentials();
  }
  if (absl::Status status = CheckKeyPair(options.certificate_file, options.key_file); !status.ok()) {
    return status;
  }
  if (!options.roles.empty() && options.client_ca_file.empty()) {
    return Trouble(absl::StatusCode::kInvalidArgument, "BAD_ROLE",
                   "rpc.roles needs rpc.client_ca_file: a client without a certificate has no role");
  }
  const auto roles = RoleTable::Parse(options.roles);
  if (!roles.ok()) {
    return roles.status();
  }
  if (options.client_ca_file.empty()) {
    tls::TlsServerCredentialsOptions credentials(std::make_shared<tls::FileWatcherCertificateProvider>(
        options.key_file, options.certificate_file, kCertificateCheckS));
    credentials.watch_identity_key_cert_pairs();
    return tls::TlsServerCredentials(credentials);
  }
  if (absl::Status status = CheckCertificates(options.client_ca_file); !status.ok()) {
    return status;
  }
  tls::TlsServerCredentialsOptions credentials(std::make_shared<tls::FileWatcherCertificateProvider>(
      options.key_file, options.certificate_file, options.client_ca_file, kCertificateCheckS));
  credentials.watch_identity_key_cert_pairs();
  credentials.watch_root_certs();
  credentials.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  auto server_credentials = tls::TlsServerCredentials(credentials);
  if (!options.roles.empty()) {
    server_credentials->SetAuthMetadataProcessor(MakeRoleGuard(*roles, log));
  }
  return server_credentials;
}

void SetLimits(grpc::ServerBuilder& builder, const RpcOptions& options) {
  builder.SetMaxReceiveMessageSize(options.most_message_mib << 20);
  builder.SetMaxSendMessageSize(options.most_message_mib << 20);
  builder.SetResourceQuota(
      grpc::ResourceQuota("lambdajet").Resize(static_cast<std::size_t>(options.most_memory_mib) << 20));
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, options.most_metadata_kib << 10);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, options.most_streams);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);  // a taken port is an error, not a shared one
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kLeastClientPingMs);
}

}  // namespace

class RpcServer::Inside {
 public:
  std::unique_ptr<grpc::Server> server;
  std::mutex health_mutex;
};

RpcServer::RpcServer(RpcOptions options, Log* log, Metrics* metrics)
    : options_(std::move(options)), log_(log), metrics_(metrics), inside_(std::make_unique<Inside>()) {}

RpcServer::~RpcServer() { Shutdown(); }

void RpcServer::Add(grpc::Service& service, const std::string& full_name) {
  services_.emplace_back(&service, full_name);
}

absl::Status RpcServer::Start() {
  const auto credentials = MakeCredentials(options_, log_);
  if (!credentials.ok()) {
    return credentials.status();
  }
  grpc::EnableDefaultHealthCheckService(true);
  if (options_.reflection) {
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  }
  grpc::ServerBuilder builder;
  builder.AddListeningPort(options_.address, *credentials, &port_);
  for (const auto& [service, name] : services_) {
    builder.RegisterService(service);
  }
  SetLimits(builder, options_);
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(MakeCallWatch(log_, metrics_));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  inside_->server = builder.BuildAndStart();
  if (inside_->server == nullptr || port_ == 0) {
    inside_->server.reset();
    return Trouble(
        absl::StatusCode::kUnavailable, "ADDRESS_IN_USE",
        "cannot serve gRPC on " + options_.address +
            ": another process listens there, or the address is not this host's; rpc.address may end in "
            "port 0 for a free port",
        {{"address", options_.address}});
  }
  SetServing(false);
  return absl::OkStatus();
}

void RpcServer::SetServing(bool serving) {
  const std::lock_guard lock(inside_->health_mutex);
  if (inside_->server == nullptr) {
    return;
  }
  auto* health = inside_->server->GetHealthCheckService();
  health->SetServingStatus("", serving);
  for (const auto& [service, name] : services_) {
    health->SetServingStatus(name, serving);
  }
}

void RpcServer::Shutdown() {
  std::unique_ptr<grpc::Server> server;
  {
    const std::lock_guard lock(inside_->health_mutex);
    server = std::move(inside_->server);
  }
  if (server == nullptr) {
    return;
  }
  server->GetHealthCheckService()->Shutdown();
  const auto deadline = std::chrono::system_clock::now() +
                        std::chrono::milliseconds(static_cast<long>(options_.shutdown_deadline_s * 1000.0));
  server->Shutdown(deadline);
  server->Wait();
}

}  // namespace lambdajet
