#include "platform/house/common_config.hpp"

namespace lambdajet {
namespace {

void DeclareRpc(ConfigSchema& schema, RpcOptions& rpc) {
  schema.Add("rpc.address", &rpc.address, "where gRPC listens; port 0 takes a free one");
  schema.AddPath("rpc.certificate_file", &rpc.certificate_file, "PEM certificate chain; empty: plaintext");
  schema.AddPath("rpc.key_file", &rpc.key_file, "PEM private key of the certificate");
  schema.AddPath("rpc.client_ca_file", &rpc.client_ca_file,
                 "PEM certificates; if named, a client must show a certificate of one of them");
  schema.Add("rpc.roles", &rpc.roles,
             "who may call what, \"ROLE: CN=name OU=name -> Service/Method Service/*\" each; empty: "
             "everybody everything");
  schema.Add("rpc.allow_plaintext", &rpc.allow_plaintext, "plaintext beyond loopback");
  schema.Add("rpc.reflection", &rpc.reflection, "let tools list the services");
  schema.Add("rpc.most_message_mib", &rpc.most_message_mib, {1, 1024}, "largest message");
  schema.Add("rpc.most_metadata_kib", &rpc.most_metadata_kib, {1, 64}, "largest metadata of a call");
  schema.Add("rpc.most_memory_mib", &rpc.most_memory_mib, {16, 65536}, "memory for gRPC's buffers");
  schema.Add("rpc.most_streams", &rpc.most_streams, {1, 100'000}, "calls at once on one connection");
  schema.Add("rpc.shutdown_deadline_s", &rpc.shutdown_deadline_s, {0.0, 600.0},
             "how long running calls may go on after a stop");
}

void DeclareBus(ConfigSchema& schema, BusOptions& bus) {
  schema.Add("bus.domain", &bus.domain, {0, 232}, "DDS domain; the machine id is the partition in it");
  schema.Add("bus.interfaces", &bus.interfaces, "addresses or names of the interfaces to use; empty: all");
  schema.Add("bus.initial_peers", &bus.initial_peers,
             "hosts of the other processes; empty: multicast, or this host if only loopback is used");
  schema.Add("bus.peers_per_host", &bus.peers_per_host, {1, 100},
             "processes looked for on each of these hosts");
  schema.AddPath("bus.key_file", &bus.key_file,
                 "keys that authenticate every datagram; empty: no guard, loopback only");
  schema.Add("bus.allow_unguarded", &bus.allow_unguarded, "no guard beyond loopback; for a laboratory");
  schema.AddPath("bus.profile_file", &bus.profile_file, "QoS profiles");
  schema.Add("bus.faults.drop_ratio", &bus.faults.drop_ratio, {0.0, 1.0}, "test: datagrams lost");
  schema.Add("bus.faults.duplicate_ratio", &bus.faults.duplicate_ratio, {0.0, 1.0},
             "test: datagrams doubled");
  schema.Add("bus.faults.delay_ratio", &bus.faults.delay_ratio, {0.0, 1.0}, "test: datagrams delayed");
  schema.Add("bus.faults.delay_s", &bus.faults.delay_s, {0.0, 10.0}, "test: by how much");
}

}  // namespace

void CommonConfig::Declare(ConfigSchema& schema) {
  schema.Add("machine_id", &machine_id, "which machine this house belongs to: 1 to 63 of a-z, 0-9 and '-'");
  schema.AddChoice("log_level", &log_level, {"debug", "info", "warning", "error"}, "least level written");
  schema.AddPath("announce_file", &announce_file,
                 "JSON with pid, rpc_port and metrics_port, written when the house is ready; empty: none");
  schema.Add("metrics.address", &metrics_address, "where Prometheus reads /metrics; port 0 takes a free one");
  DeclareRpc(schema, rpc);
  DeclareBus(schema, bus);
}

}  // namespace lambdajet
