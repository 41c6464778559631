#include "platform/rpc/channel.hpp"

#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include <condition_variable>
#include <mutex>

#include "foundation/contract/trouble.hpp"
#include "platform/rpc/certificates.hpp"

namespace lambdajet {
namespace {

absl::Status ReadInto(const std::string& file, std::string& pem) {
  auto text = ReadPem(file);
  if (text.ok()) {
    pem = *std::move(text);
  }
  return text.status();
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeCredentials(const ChannelOptions& options) {
  if (options.ca_file.empty()) {
    return grpc::InsecureChannelCredentials();
  }
  if (absl::Status status = CheckCertificates(options.ca_file); !status.ok()) {
    return status;
  }
  grpc::SslCredentialsOptions ssl;
  if (absl::Status status = ReadInto(options.ca_file, ssl.pem_root_certs); !status.ok()) {
    return status;
  }
  if (!options.certificate_file.empty()) {
    if (absl::Status status = CheckKeyPair(options.certificate_file, options.key_file); !status.ok()) {
      return status;
    }
    if (absl::Status status = ReadInto(options.certificate_file, ssl.pem_cert_chain); !status.ok()) {
      return status;
    }
    if (absl::Status status = ReadInto(options.key_file, ssl.pem_private_key); !status.ok()) {
      return status;
    }
  }
  return grpc::SslCredentials(ssl);
}

// grpc.health.v1 by hand, because Debian ships its code but not its .proto: HealthCheckRequest{service=1} and
// HealthCheckResponse{status=1, SERVING=1}.
grpc::ByteBuffer HealthRequest(const std::string& service) {
  std::string bytes;
  if (!service.empty()) {
    bytes.push_back('\x0a');
    bytes.push_back(static_cast<char>(service.size()));
    bytes.append(service);
  }
  const grpc::Slice slice(bytes);
  return {&slice, 1};
}

bool SaysServing(const grpc::ByteBuffer& response) {
  grpc::Slice slice;
  return response.DumpToSingleSlice(&slice).ok() && slice.size() == 2 && slice.begin()[0] == 0x08 &&
         slice.begin()[1] == 0x01;
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::Channel>> OpenChannel(const ChannelOptions& options) {
  const auto credentials = MakeCredentials(options);
  if (!credentials.ok()) {
    return credentials.status();
  }
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(options.most_message_mib << 20);
  arguments.SetMaxSendMessageSize(options.most_message_mib << 20);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2'000);
  if (!options.server_name.empty()) {
    arguments.SetSslTargetNameOverride(options.server_name);
  }
  return grpc::CreateCustomChannel(options.address, *credentials, arguments);
}

absl::StatusOr<bool> AskServing(const std::shared_ptr<grpc::Channel>& channel, const std::string& service,
                                double deadline_s) {
  if (service.size() > 127) {
    return Trouble(absl::StatusCode::kInvalidArgument, "TOO_LARGE", "a service's name has at most 127 bytes");
  }
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  SetDeadline(context, deadline_s);
  const grpc::ByteBuffer request = HealthRequest(service);
  grpc::ByteBuffer response;
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  grpc::Status status;
  stub.UnaryCall(&context, "/grpc.health.v1.Health/Check", {}, &request, &response, [&](grpc::Status answer) {
    const std::lock_guard lock(mutex);
    status = std::move(answer);
    done = true;
    changed.notify_one();
  });
  std::unique_lock lock(mutex);
  changed.wait(lock, [&] { return done; });
  if (!status.ok()) {
    return FromWire(status);
  }
  return SaysServing(response);
}

}  // namespace lambdajet
