// Says which client may call what: a role by the name in the client's certificate, and RPCs by role.
//
// Model: each line of `rpc.roles` is "ROLE: WHO… -> RPC…". WHO is CN=name or OU=name of the certificate's subject; RPC is
// Service/Method without its package, and may end in *. A client has every role that names it, and may call what any of
// them allows; health and reflection are everybody's. A house that asks another (the cell asks trajectory) is a client like any
// other and needs a role there; deploy/config/trajectory.yaml shows the cell's. Refused calls never reach a handler: PERMISSION_DENIED
// ROLE_NOT_ALLOWED, with the roles and what would be right. The guard writes one audit line for each refused call, and for
// each allowed one that does more than read.
// Threads: the table is immutable; the guard is asked from gRPC's threads. Cost: some comparisons of short texts a call.
// Errors: INVALID_ARGUMENT BAD_ROLE names the line.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace grpc {
class AuthMetadataProcessor;
}

namespace lambdajet {

class Log;

// Whom a certificate names; from its subject as RFC 2253 writes it ("CN=panel-1,OU=operators").
struct CertificateName {
  std::string common_name;
  std::vector<std::string> organizational_units;
  static CertificateName FromSubject(std::string_view subject);
};

struct RoleVerdict {
  bool allowed = false;
  std::vector<std::string> roles;     // the client's
  std::vector<std::string> may_call;  // roles that would be right
};

class RoleTable {
 public:
  static absl::StatusOr<RoleTable> Parse(const std::vector<std::string>& lines);
  // `path` as on the wire: "/lambdajet.cell.v1.CellService/StartJob".
  RoleVerdict Judge(const CertificateName& client, std::string_view path) const;

 private:
  struct Role {
    std::string name;
    std::vector<std::string> common_names;
    std::vector<std::string> organizational_units;
    std::vector<std::string> methods;
  };
  static absl::StatusOr<Role> ParseLine(const std::string& line);
  std::vector<Role> roles_;
};

// For TLS credentials with client certificates. `log` may be null; otherwise it outlives the guard.
std::shared_ptr<grpc::AuthMetadataProcessor> MakeRoleGuard(RoleTable table, Log* log);

}  // namespace lambdajet
