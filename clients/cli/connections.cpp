#include "clients/cli/connections.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <yaml-cpp/yaml.h>

#include <nlohmann/json.hpp>

#include "clients/cli/output.hpp"
#include "clients/cli/text_file.hpp"
#include "foundation/contract/trouble.hpp"

namespace lambdajet::cli {
namespace {

const std::map<std::string, int>& DefaultPorts() {
  static const std::map<std::string, int> ports = {
      {"kinematics", 50051}, {"calibration", 50052}, {"trajectory", 50053},  {"accuracy", 50054},
      {"cell", 50055},       {"drive", 50056},       {"main_motion", 50057}, {"inspection", 50058}};
  return ports;
}

absl::StatusOr<std::string> FromFile(const std::string& path, const std::string& service) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) {
    return text.status();
  }
  try {
    const YAML::Node address = YAML::Load(*text)[service];
    return address ? address.as<std::string>() : std::string();
  } catch (const YAML::Exception& error) {
    return Trouble(absl::StatusCode::kInvalidArgument, "BAD_SERVICES_FILE",
                   fmt::format("{}: {}; lines `service: host:port` are right", path, error.what()));
  }
}

absl::StatusOr<std::string> Announced(const std::string& folder, const std::string& service) {
  const std::string path = folder + "/" + service + ".announce.json";
  const auto text = ReadTextFile(path);
  if (!text.ok()) {
    return Trouble(
        absl::StatusCode::kUnavailable, "NOT_ANNOUNCED",
        fmt::format("{}; {} has not announced itself there", std::string(text.status().message()), service));
  }
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object() || !json.contains("rpc_port") || !json["rpc_port"].is_number_integer()) {
    return Trouble(absl::StatusCode::kInvalidArgument, "BAD_ANNOUNCE_FILE",
                   fmt::format("{}: no rpc_port in it", path));
  }
  return fmt::format("127.0.0.1:{}", json["rpc_port"].get<int>());
}

}  // namespace

void Connections::AddOptions(CLI::App& app) {
  app.add_option("--address", addresses_, "SERVICE=HOST:PORT, as often as needed")->group("Services");
  app.add_option("--services", services_file_, "YAML file of `service: host:port` lines")->group("Services");
  app.add_option("--announce-dir", announce_dir_, "folder of the announce files of running processes")
      ->group("Services");
  app.add_option("--timeout-s", timeout_s_, "how long to wait for an answer")
      ->group("Services")
      ->check(CLI::Range(0.01, 86400.0));
  app.add_option("--ca", tls_.ca_file, "PEM to trust the services' certificates; without it plaintext")
      ->group("Services");
  app.add_option("--certificate", tls_.certificate_file, "PEM, own certificate")->group("Services");
  app.add_option("--key", tls_.key_file, "PEM, its key")->group("Services");
}

absl::StatusOr<std::string> Connections::AddressOf(const std::string& service) const {
  for (const std::string& entry : addresses_) {
    const auto equals = entry.find('=');
    if (equals == std::string::npos || !DefaultPorts().contains(entry.substr(0, equals))) {
      return Trouble(absl::StatusCode::kInvalidArgument, "BAD_ADDRESS",
                     fmt::format("--address {}; SERVICE=HOST:PORT is right, as cell=127.0.0.1:50055", entry));
    }
    if (entry.substr(0, equals) == service) {
      return entry.substr(equals + 1);
    }
  }
  if (!announce_dir_.empty()) {
    return Announced(announce_dir_, service);
  }
  if (!services_file_.empty()) {
    auto address = FromFile(services_file_, service);
    if (!address.ok() || !address->empty()) {
      return address;
    }
  }
  return fmt::format("127.0.0.1:{}", DefaultPorts().at(service));
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> Connections::Open(const std::string& service) const {
  auto address = AddressOf(service);
  if (!address.ok()) {
    return address.status();
  }
  ChannelOptions options = tls_;
  options.address = *address;
  options.most_message_mib = 64;
  return OpenChannel(options);
}

absl::Status Connections::Named(const std::string& service, absl::Status status) const {
  const std::string reason = TroubleReason(status);
  if (status.code() == absl::StatusCode::kUnavailable && (reason.empty() || reason == "UNAVAILABLE")) {
    const auto address = AddressOf(service);
    return Trouble(
        absl::StatusCode::kUnavailable, "SERVICE_UNREACHABLE",
        fmt::format(
            "{0} at {1} does not answer; start it (deploy/demo --keep starts a whole cell), or say where it "
            "is with --address {0}=HOST:PORT ({2})",
            service, address.value_or("?"), std::string(status.message())));
  }
  if (status.code() == absl::StatusCode::kDeadlineExceeded &&
      (reason.empty() || reason == "DEADLINE_EXCEEDED")) {
    return Trouble(
        absl::StatusCode::kDeadlineExceeded, "TIMEOUT",
        fmt::format("{} has not answered in {} s; --timeout-s gives it longer", service, timeout_s_));
  }
  return status;
}

void PrintJson(const google::protobuf::Message& message, Output& output) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  std::string text;
  if (google::protobuf::util::MessageToJsonString(message, &text, options).ok()) {
    output.Json(nlohmann::json::parse(text, nullptr, false));
  }
}

CLI::App* AddServiceVerb(CLI::App& noun, const std::string& name, const std::string& what) {
  const auto taken = noun.get_subcommands([&](CLI::App* verb) { return verb->get_name() == name; });
  return noun.add_subcommand(taken.empty() ? name : "ask-" + name, what);
}

}  // namespace lambdajet::cli
