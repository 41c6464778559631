#include "platform/rpc/roles.hpp"

#include <grpc/grpc_security_constants.h>
#include <grpcpp/security/auth_context.h>
#include <grpcpp/security/auth_metadata_processor.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "foundation/contract/trouble.hpp"
#include "platform/telemetry/log.hpp"

namespace lambdajet {
namespace {

constexpr std::array<std::string_view, 2> kEverybodys = {"/grpc.health.v1.Health/", "/grpc.reflection."};
constexpr std::array<std::string_view, 9> kReading = {"Get",  "List",  "Watch",   "Stream", "Solve",
                                                      "Find", "Check", "Predict", "Compare"};

// "/lambdajet.cell.v1.CellService/StartJob" to "CellService/StartJob".
std::string_view WithoutPackage(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  const std::size_t dot = path.rfind('.', slash);
  return path.substr(dot == std::string_view::npos ? std::min<std::size_t>(1, path.size()) : dot + 1);
}

bool Matches(std::string_view pattern, std::string_view method) {
  return pattern.ends_with('*') ? method.starts_with(pattern.substr(0, pattern.size() - 1))
                                : pattern == method;
}

bool Contains(const std::vector<std::string>& list, std::string_view text) {
  return std::ranges::find(list, text) != list.end();
}

bool OnlyReads(std::string_view path) {
  const std::string_view method = path.substr(path.rfind('/') + 1);
  return std::ranges::any_of(kReading, [&](std::string_view verb) { return method.starts_with(verb); });
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    text += (text.empty() ? "" : ", ") + word;
  }
  return text.empty() ? "none" : text;
}

absl::Status BadRole(const std::string& line, const std::string& what) {
  return Trouble(
      absl::StatusCode::kInvalidArgument, "BAD_ROLE",
      "rpc.roles: '" + line + "': " + what +
          "; \"operator: CN=panel-1 OU=operators -> CellService/* TrajectoryService/Get*\" is right",
      {{"line", line}});
}

class RoleGuard final : public grpc::AuthMetadataProcessor {
 public:
  RoleGuard(RoleTable table, Log* log) : table_(std::move(table)), log_(log) {}

  bool IsBlocking() const override { return false; }

  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext* context,
                       OutputMetadata* /*consumed*/, OutputMetadata* /*response*/) override {
    const auto found = metadata.find(":path");
    const std::string path =
        found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
    const auto subjects = context->FindPropertyValues(GRPC_X509_SUBJECT_PROPERTY_NAME);
    const std::string subject =
        subjects.empty() ? "" : std::string(subjects.front().data(), subjects.front().size());
    const RoleVerdict verdict = table_.Judge(CertificateName::FromSubject(subject), path);
    const std::string roles = Joined(verdict.roles);
    Audit(verdict.allowed, path, subject, roles);
    if (verdict.allowed) {
      return grpc::Status::OK;
    }
    return {grpc::StatusCode::PERMISSION_DENIED,
            "ROLE_NOT_ALLOWED: role " + roles + " (" + (subject.empty() ? "no certificate" : subject) +
                ") may not call " + std::string(WithoutPackage(path)) + "; a certificate of role " +
                Joined(verdict.may_call) + " is right"};
  }

 private:
  void Audit(bool allowed, const std::string& path, const std::string& subject, const std::string& roles) {
    if (log_ == nullptr || (allowed && OnlyReads(path))) {
      return;
    }
    if (allowed) {
      log_->Info("rpc_allowed", path, {{"client", subject}, {"role", roles}});
    } else {
      log_->Warning("rpc_role_refused", path,
                    {{"client", subject}, {"role", roles}, {"reason", "ROLE_NOT_ALLOWED"}});
    }
  }

  const RoleTable table_;
  Log* log_;
};

}  // namespace

CertificateName CertificateName::FromSubject(std::string_view subject) {
  CertificateName name;
  std::string part;
  const auto end_of_part = [&] {
    if (part.starts_with("CN=") && name.common_name.empty()) {
      name.common_name = part.substr(3);
    } else if (part.starts_with("OU=")) {
      name.organizational_units.push_back(part.substr(3));
    }
    part.clear();
  };
  for (std::size_t i = 0; i < subject.size(); ++i) {
    if (subject[i] == '\\' && i + 1 < subject.size()) {
      part += subject[++i];  // a comma in a name is not the end of it
    } else if (subject[i] == ',' || subject[i] == '+') {
      end_of_part();
    } else {
      part += subject[i];
    }
  }
  end_of_part();
  return name;
}

absl::StatusOr<RoleTable::Role> RoleTable::ParseLine(const std::string& line) {
  const std::size_t colon = line.find(':');
  const std::size_t arrow = line.find("->");
  if (colon == std::string::npos || colon == 0 || arrow == std::string::npos || arrow < colon) {
    return BadRole(line, "a role, a colon, who, an arrow and what are wanted");
  }
  Role role{line.substr(0, colon), {}, {}, {}};
  std::istringstream who(line.substr(colon + 1, arrow - colon - 1));
  for (std::string word; who >> word;) {
    if (word.size() < 4 || !(word.starts_with("CN=") || word.starts_with("OU="))) {
      return BadRole(line, "'" + word + "' names nobody");
    }
    (word.starts_with("CN=") ? role.common_names : role.organizational_units).push_back(word.substr(3));
  }
  std::istringstream what(line.substr(arrow + 2));
  for (std::string word; what >> word;) {
    if (word != "*" && word.find('/') == std::string::npos) {
      return BadRole(line, "'" + word + "' is no Service/Method");
    }
    role.methods.push_back(word);
  }
  if ((role.common_names.empty() && role.organizational_units.empty()) || role.methods.empty()) {
    return BadRole(line, "nobody, or nothing, is named");
  }
  return role;
}

absl::StatusOr<RoleTable> RoleTable::Parse(const std::vector<std::string>& lines) {
  RoleTable table;
  for (const std::string& line : lines) {
    auto role = ParseLine(line);
    if (!role.ok()) {
      return role.status();
    }
    table.roles_.push_back(std::move(*role));
  }
  return table;
}

RoleVerdict RoleTable::Judge(const CertificateName& client, std::string_view path) const {
  RoleVerdict verdict;
  verdict.allowed =
      std::ranges::any_of(kEverybodys, [&](std::string_view prefix) { return path.starts_with(prefix); });
  for (const Role& role : roles_) {
    const bool has = (!client.common_name.empty() && Contains(role.common_names, client.common_name)) ||
                     std::ranges::any_of(client.organizational_units, [&](const std::string& unit) {
                       return Contains(role.organizational_units, unit);
                     });
    const bool may = std::ranges::any_of(
        role.methods, [&](const std::string& pattern) { return Matches(pattern, WithoutPackage(path)); });
    verdict.allowed = verdict.allowed || (has && may);
    if (has) {
      verdict.roles.push_back(role.name);
    }
    if (may) {
      verdict.may_call.push_back(role.name);
    }
  }
  return verdict;
}

std::shared_ptr<grpc::AuthMetadataProcessor> MakeRoleGuard(RoleTable table, Log* log) {
  return std::make_shared<RoleGuard>(std::move(table), log);
}

}  // namespace lambdajet
