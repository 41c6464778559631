#include "calibration/rpc/calibration_rpc.hpp"

#include <algorithm>

#include "calibration/rpc/wire.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/rpc/handlers.hpp"

namespace lambdajet::calibration {

CalibrationRpc::CalibrationRpc(CalibrationDesk& desk) : desk_(desk) {}

CalibrationRpc::~CalibrationRpc() = default;

grpc::ServerUnaryReactor* CalibrationRpc::PlanMeasuringRun(grpc::CallbackServerContext* context,
                                                           const v1::PlanMeasuringRunRequest* request,
                                                           v1::PlanMeasuringRunResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    const auto options = FromWire(*request);
    if (!options.ok()) return options.status();
    auto plan = desk_.PlanRun(*options);
    if (!plan.ok()) return plan.status();
    response->set_program(plan->program);
    response->set_expectation(plan->explanation);
    ToWire(*desk_.active(), *response->mutable_model_version());
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* CalibrationRpc::PlanVerification(grpc::CallbackServerContext* context,
                                                           const v1::PlanVerificationRequest* request,
                                                           v1::PlanVerificationResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    const auto looks = FromWire(*request);
    if (!looks.ok()) return looks.status();
    auto plan = desk_.PlanShortRun(*looks);
    if (!plan.ok()) return plan.status();
    response->set_program(plan->program);
    ToWire(*desk_.active(), *response->mutable_model_version());
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* CalibrationRpc::ListRuns(grpc::CallbackServerContext* context,
                                                   const v1::ListRunsRequest* request,
                                                   v1::ListRunsResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    const auto page = PageFromWire(request->page_size(), request->page_token());
    if (!page.ok()) return page.status();
    const auto runs =
        desk_.Runs(page->size + 1, page->before.value_or(0));  // one more tells whether there are more
    if (!runs.ok()) return runs.status();
    for (std::size_t i = 0; i < runs->size() && i < static_cast<std::size_t>(page->size); ++i) {
      ToWire((*runs)[i], *response->add_runs());
      if (i + 1 == static_cast<std::size_t>(page->size) && runs->size() > i + 1) {
        response->set_next_page_token(std::to_string((*runs)[i].row));
      }
    }
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* CalibrationRpc::GetRun(grpc::CallbackServerContext* context,
                                                 const v1::GetRunRequest* request,
                                                 v1::GetRunResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    if (const absl::Status named = CheckPlan(request->plan_id()); !named.ok()) return named;
    const auto looks = desk_.Run(request->plan_id());
    if (!looks.ok()) return looks.status();
    RunHead head{request->plan_id(), 0, static_cast<std::uint32_t>(looks->size()), 0, INT64_MAX, 0};
    for (const RecordedLook& look : *looks) {
      head.unseen += look.look.seen ? 0 : 1;
      head.first_exposure_ns = std::min(head.first_exposure_ns, look.look.exposure_ns);
      ToWire(look, *response->add_looks());
    }
    ToWire(head, *response->mutable_run());
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* CalibrationRpc::VerifyBase(grpc::CallbackServerContext* context,
                                                     const v1::VerifyBaseRequest* request,
                                                     v1::VerifyBaseResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    if (const absl::Status named = CheckPlan(request->plan_id()); !named.ok()) return named;
    const auto found = desk_.Verify(request->plan_id());
    if (!found.ok()) return found.status();
    ToWire(found->first, *found->second, *response);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* CalibrationRpc::StartIdentification(grpc::CallbackServerContext* context,
                                                              const v1::StartIdentificationRequest* request,
                                                              v1::StartIdentificationResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    if (const absl::Status named = CheckPlan(request->plan_id()); !named.ok()) return named;
    if (const absl::Status named = CheckAuthor(request->author()); !named.ok()) return named;
    const auto operation = desk_.StartIdentification(request->plan_id(), request->author());
    if (!operation.ok()) return operation.status();
    ToWire(*operation, *response->mutable_operation());
    return absl::OkStatus();
  });
}

absl::Status CalibrationRpc::AnswerIdentification(const std::string& id,
                                                  v1::GetIdentificationResponse& response) {
  if (const absl::Status named = CheckOperationId(id); !named.ok()) return named;
  const auto operation = desk_.FindOperation(id);
  if (!operation.ok()) return operation.status();
  ToWire(*operation, *response.mutable_operation());
  if (operation->report) {
    const auto made = desk_.FindVersion(operation->report->version);
    if (!made.ok()) return made.status();
    const auto parent = desk_.FindVersion(made->parent);
    if (!parent.ok()) return parent.status();
    ToWire(*operation->report, *parent, *made, *response.mutable_result());
  }
  return absl::OkStatus();
}

grpc::ServerUnaryReactor* CalibrationRpc::GetIdentification(grpc::CallbackServerContext* context,
                                                            const v1::GetIdentificationRequest* request,
                                                            v1::GetIdentificationResponse* response) {
  return Answer(context, [&] { return AnswerIdentification(request->operation_id(), *response); });
}

grpc::ServerUnaryReactor* CalibrationRpc::CancelIdentification(grpc::CallbackServerContext* context,
                                                               const v1::CancelIdentificationRequest* request,
                                                               v1::CancelIdentificationResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    if (const absl::Status named = CheckOperationId(request->operation_id()); !named.ok()) return named;
    const auto operation = desk_.Cancel(request->operation_id());
    if (!operation.ok()) return operation.status();
    ToWire(*operation, *response->mutable_operation());
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* CalibrationRpc::ActivateVersion(grpc::CallbackServerContext* context,
                                                          const v1::ActivateVersionRequest* request,
                                                          v1::ActivateVersionResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    if (const absl::Status named = CheckAuthor(request->author()); !named.ok()) return named;
    const auto machine = desk_.Activate(request->version(), request->author());
    if (!machine.ok()) return machine.status();
    ToWire(**machine, *response->mutable_model_version());
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* CalibrationRpc::ListVersions(grpc::CallbackServerContext* context,
                                                       const v1::ListVersionsRequest* request,
                                                       v1::ListVersionsResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    const auto page = PageFromWire(request->page_size(), request->page_token());
    if (!page.ok()) return page.status();
    std::optional<std::uint32_t> before;
    if (page->before) before = static_cast<std::uint32_t>(std::min<std::int64_t>(*page->before, UINT32_MAX));
    const auto versions = desk_.Versions(page->size, before);
    if (!versions.ok()) return versions.status();
    const std::uint32_t active = desk_.active()->version;
    for (const Version& version : *versions) {
      ToWire(version, desk_.MachineOf(version), version.number == active, *response->add_versions());
    }
    if (static_cast<int>(versions->size()) == page->size && versions->back().number > 0) {
      response->set_next_page_token(std::to_string(versions->back().number));
    }
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* CalibrationRpc::GetVersion(grpc::CallbackServerContext* context,
                                                     const v1::GetVersionRequest* request,
                                                     v1::GetVersionResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    const auto version =
        desk_.FindVersion(request->has_version() ? std::optional(request->version()) : std::nullopt);
    if (!version.ok()) return version.status();
    const auto parent = desk_.FindVersion(version->parent);
    if (!parent.ok()) return parent.status();
    const MachineDescription machine = desk_.MachineOf(*version);
    ToWire(*version, machine, desk_.active()->version == version->number, *response->mutable_version());
    response->set_machine_yaml(MachineText(machine));
    for (const ParameterChange& change : Compare(*parent, *version)) {
      ToWire(change, *response->add_parameters());
    }
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* CalibrationRpc::DiffVersions(grpc::CallbackServerContext* context,
                                                       const v1::DiffVersionsRequest* request,
                                                       v1::DiffVersionsResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    const auto before = desk_.FindVersion(request->before());
    if (!before.ok()) return before.status();
    const auto after = desk_.FindVersion(request->after());
    if (!after.ok()) return after.status();
    for (const ParameterChange& change : Compare(*before, *after)) {
      ToWire(change, *response->add_parameters());
    }
    return absl::OkStatus();
  });
}

}  // namespace lambdajet::calibration
