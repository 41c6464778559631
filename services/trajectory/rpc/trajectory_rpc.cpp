#include "trajectory/rpc/trajectory_rpc.hpp"

#include <algorithm>
#include <cmath>

#include "foundation/contract/trouble.hpp"
#include "platform/rpc/argument_checks.hpp"
#include "platform/rpc/handlers.hpp"
#include "platform/rpc/streams.hpp"
#include "trajectory/rpc/admission.hpp"
#include "trajectory/rpc/program_streams.hpp"
#include "trajectory/rpc/spatial_admission.hpp"
#include "trajectory/rpc/spatial_wire.hpp"
#include "trajectory/rpc/wire.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kThreads = 2;
constexpr std::size_t kMostWaiting = 16;
constexpr std::size_t kMostListedOperations = 200000;
constexpr int kPointsPerBatch = 2000;
constexpr double kDefaultStep_s = 0.004;
constexpr double kDefaultPeriod_s = 0.1;
constexpr int kDefaultPage = 20;
constexpr std::size_t kLongestToken = 19;  // digits that fit into 64 bits
constexpr std::size_t kMostStepsWaiting = 64;

absl::Status UnknownPlan(std::uint64_t id) {
  return Trouble(
      absl::StatusCode::kNotFound, "UNKNOWN_PLAN",
      "plan " + std::to_string(id) + " is not known here; plan the program again, the id will be the same");
}

// Pages count from the newest; the token is the number of the last record shown.
std::uint64_t FromToken(const std::string& token) {
  return token.empty() ? UINT64_MAX : std::strtoull(token.c_str(), nullptr, 10);
}

}  // namespace

TrajectoryRpc::TrajectoryRpc(FindMachine find_machine, Streaming streaming, PlanDesk& desk,
                             std::shared_ptr<const HexapodModel> hexapod)
    : find_machine_(std::move(find_machine)),
      streaming_(std::move(streaming)),
      desk_(desk),
      hexapod_(std::move(hexapod)),
      pool_(kThreads, kMostWaiting),
      admissions_(kThreads, kMostWaiting) {}

TrajectoryRpc::~TrajectoryRpc() { closing_ = true; }

absl::StatusOr<std::shared_ptr<const MachineDescription>> TrajectoryRpc::MachineFor(
    const v1::PlanOptions& options) const {
  const auto active = find_machine_(std::nullopt);
  if (active == nullptr) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "NO_MACHINE_DESCRIPTION",
                   "no machine description has come from calibration yet; activate a version first");
  }
  if (!options.has_machine_version() || options.machine_version() == active->version) {
    return active;
  }
  const auto older = find_machine_(options.machine_version());
  if (older == nullptr) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "MACHINE_VERSION_NOT_HELD",
                   "version " + std::to_string(options.machine_version()) +
                       " is not held here; active is version " + std::to_string(active->version),
                   {{"active_version", std::to_string(active->version)}});
  }
  return older;
}

absl::StatusOr<std::shared_ptr<const PlanRecord>> TrajectoryRpc::DonePlan(std::uint64_t id) const {
  const auto record = desk_.Find(id);
  if (record == nullptr) {
    return UnknownPlan(id);
  }
  if (record->state != PlanState::kDone) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "PLAN_NOT_DONE",
                   "plan " + std::to_string(id) + " is not done; see GetPlan");
  }
  return record;
}

// A request's program, options and machine, or the first thing that is wrong.
template <typename Request>
absl::StatusOr<TrajectoryRpc::Asked> TrajectoryRpc::FromRequest(const Request& request) const {
  auto program = ProgramOf(request);
  if (!program.ok()) {
    return program.status();
  }
  auto hexapod = HexapodFor(request.options().mechanism(), hexapod_);
  if (!hexapod.ok() || *hexapod != nullptr) {
    return hexapod.ok() ? ForHexapod(std::move(*program), request.options(), std::move(*hexapod))
                        : hexapod.status();
  }
  auto options = FromWire(request.options());
  if (!options.ok()) {
    return options.status();
  }
  auto machine = MachineFor(request.options());
  if (!machine.ok()) {
    return machine.status();
  }
  return Asked{std::move(*program), std::move(*options), std::move(*machine), nullptr, {}};
}

absl::StatusOr<TrajectoryRpc::Asked> TrajectoryRpc::ForHexapod(SubmittedProgram program,
                                                               const v1::PlanOptions& options,
                                                               std::shared_ptr<const HexapodModel> hexapod) {
  if (program.drawing) {
    return DrawingForHexapod();
  }
  auto spatial = SpatialFromWire(options, program.notation);
  if (!spatial.ok()) {
    return spatial.status();
  }
  return Asked{std::move(program), {}, nullptr, std::move(hexapod), *spatial};
}

absl::Status TrajectoryRpc::Admit(const v1::AdmitProgramRequest& request,
                                  v1::AdmitProgramResponse& response) const {
  auto asked = FromRequest(request);
  if (!asked.ok()) {
    return asked.status();
  }
  if (asked->hexapod != nullptr) {
    ToWire(AdmitSpatialProgram(asked->program.text, *asked->hexapod, asked->spatial), *asked->hexapod,
           response);
    return absl::OkStatus();
  }
  const MadeProgram program = MakeProgram(std::move(asked->program), asked->machine.get());
  ToWire(AdmitMade(program, *asked->machine, asked->options), *asked->machine, response);
  return absl::OkStatus();
}

grpc::ServerUnaryReactor* TrajectoryRpc::AdmitProgram(grpc::CallbackServerContext* context,
                                                      const v1::AdmitProgramRequest* request,
                                                      v1::AdmitProgramResponse* response) {
  return AnswerOn(pool_, context,
                  [this, request, response](const Cancelled&) { return Admit(*request, *response); });
}

absl::Status TrajectoryRpc::BeginPlan(const v1::PlanProgramRequest& request,
                                      v1::PlanProgramResponse& response) {
  auto asked = FromRequest(request);
  if (!asked.ok()) {
    return asked.status();
  }
  const auto record = asked->hexapod != nullptr
                          ? desk_.BeginSpatial(std::move(asked->program.text), asked->spatial, asked->hexapod)
                          : desk_.Begin(MakeProgram(std::move(asked->program), asked->machine.get()),
                                        std::move(asked->options), asked->machine);
  if (!record.ok()) {
    return record.status();
  }
  response.set_plan_id((*record)->id);
  ToWire(**record, *response.mutable_operation());
  return absl::OkStatus();
}

// A drawing becomes a program first, which is work for the pool.
grpc::ServerUnaryReactor* TrajectoryRpc::PlanProgram(grpc::CallbackServerContext* context,
                                                     const v1::PlanProgramRequest* request,
                                                     v1::PlanProgramResponse* response) {
  if (request->format() != type::v1::PROGRAM_FORMAT_DXF) {
    return Answer(context, [&] { return BeginPlan(*request, *response); });
  }
  return AnswerOn(pool_, context,
                  [this, request, response](const Cancelled&) { return BeginPlan(*request, *response); });
}

grpc::ServerUnaryReactor* TrajectoryRpc::GetPlan(grpc::CallbackServerContext* context,
                                                 const v1::GetPlanRequest* request,
                                                 v1::GetPlanResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    const auto record = desk_.Find(request->plan_id());
    if (record == nullptr) {
      return UnknownPlan(request->plan_id());
    }
    ToWire(*record, *response);
    return absl::OkStatus();
  });
}

grpc::ServerWriteReactor<v1::GetPlanResponse>* TrajectoryRpc::WatchPlan(grpc::CallbackServerContext* context,
                                                                        const v1::WatchPlanRequest* request) {
  if (const absl::Status wanted = CheckStillWanted(*context); !wanted.ok()) {
    return RefuseStream<v1::GetPlanResponse>(wanted);
  }
  ArgumentChecks checks;
  const double period_s = request->has_period_s() ? request->period_s() : kDefaultPeriod_s;
  checks.InRange("period_s", period_s, 0.02, 10.0, "s");
  if (!checks.ok()) {
    return RefuseStream<v1::GetPlanResponse>(checks.status());
  }
  auto record = desk_.Find(request->plan_id());
  return record == nullptr ? RefuseStream<v1::GetPlanResponse>(UnknownPlan(request->plan_id()))
                           : watch_.Open(std::move(record), period_s);
}

grpc::ServerUnaryReactor* TrajectoryRpc::CancelPlan(grpc::CallbackServerContext* context,
                                                    const v1::CancelPlanRequest* request,
                                                    v1::CancelPlanResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    const auto record = desk_.Cancel(request->plan_id());
    if (record == nullptr) {
      return UnknownPlan(request->plan_id());
    }
    ToWire(*record, *response->mutable_operation());
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* TrajectoryRpc::ListPlans(grpc::CallbackServerContext* context,
                                                   const v1::ListPlansRequest* request,
                                                   v1::ListPlansResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    ArgumentChecks checks;
    checks.InRange("page_size", request->page_size(), 0, 100);
    checks.Require(request->page_token().size() <= kLongestToken &&
                       request->page_token().find_first_not_of("0123456789") == std::string::npos,
                   "page_token", "BAD_TOKEN", "must come from an earlier answer");
    if (!checks.ok()) {
      return checks.status();
    }
    const int page = request->page_size() == 0 ? kDefaultPage : request->page_size();
    const std::uint64_t before = FromToken(request->page_token());
    std::uint64_t last = 0;
    for (const auto& record : desk_.List()) {
      if (record->number >= before || record->state != PlanState::kDone) {
        continue;
      }
      if (response->plans_size() == page) {
        response->set_next_page_token(std::to_string(last));
        break;
      }
      ToWire(*record, *response->add_plans());
      last = record->number;
    }
    return absl::OkStatus();
  });
}

grpc::ServerWriteReactor<v1::SampleBatch>* TrajectoryRpc::StreamSamples(
    grpc::CallbackServerContext* context, const v1::StreamSamplesRequest* request) {
  if (const absl::Status wanted = CheckStillWanted(*context); !wanted.ok()) {
    return RefuseStream<v1::SampleBatch>(wanted);
  }
  ArgumentChecks checks;
  const double step_s = request->has_step_s() ? request->step_s() : kDefaultStep_s;
  checks.InRange("step_s", step_s, 0.0005, 1.0, "s");
  if (!checks.ok()) {
    return RefuseStream<v1::SampleBatch>(checks.status());
  }
  const auto found = DonePlan(request->plan_id());
  if (!found.ok()) {
    return RefuseStream<v1::SampleBatch>(found.status());
  }
  const double duration_s =
      (*found)->spatial ? (*found)->spatial->plan.duration_s : (*found)->planned->plan.duration_s;
  const auto count = static_cast<std::int64_t>(std::floor(duration_s / step_s + 1e-9)) + 1;
  return NewPullStream<v1::SampleBatch>([record = *found, step_s, count, next = std::int64_t{0}](
                                            v1::SampleBatch& batch) mutable -> absl::StatusOr<bool> {
    if (next >= count) {
      return false;
    }
    for (int i = 0; i < kPointsPerBatch && next < count; ++i, ++next) {
      const double tau_s = static_cast<double>(next) * step_s;
      record->spatial ? AddSpatialPoint(*record->spatial, tau_s, batch)
                      : AddPoint(*record->planned, tau_s, batch);
    }
    return true;
  });
}

// What a list is made of; the machine is the active one, if there is one.
template <typename Wire>
absl::StatusOr<ListedProgram> TrajectoryRpc::ListedOf(const Wire& wire) const {
  auto program = ProgramOf(wire);
  if (!program.ok()) {
    return program.status();
  }
  auto hexapod = HexapodFor(wire.mechanism(), hexapod_);
  if (!hexapod.ok() || (*hexapod != nullptr && program->drawing)) {
    return hexapod.ok() ? DrawingForHexapod() : hexapod.status();
  }
  return ListedProgram{std::move(*program), find_machine_(std::nullopt), std::move(*hexapod), nullptr};
}

grpc::ServerUnaryReactor* TrajectoryRpc::ListOperations(grpc::CallbackServerContext* context,
                                                        const v1::ListOperationsRequest* request,
                                                        v1::ListOperationsResponse* response) {
  return AnswerOn(pool_, context, [this, request, response](const Cancelled&) -> absl::Status {
    auto listed = ListedOf(*request);
    if (!listed.ok()) {
      return listed.status();
    }
    const PartProgram program = ReadListed(std::move(*listed));
    for (const ProgramFault& fault : program.faults) {
      ToWire(fault, *response->add_faults());
    }
    if (!program.faults.empty()) {
      return absl::OkStatus();
    }
    if (program.operations.size() > kMostListedOperations) {
      return Trouble(absl::StatusCode::kOutOfRange, "TOO_MANY",
                     std::to_string(program.operations.size()) +
                         " operations; at most 200000 are listed over the wire, use "
                         "`lambdajet trajectory canon` on the file");
    }
    for (const Operation& operation : program.operations) {
      response->add_operations(FormatOperation(operation));
    }
    return absl::OkStatus();
  });
}

grpc::ServerWriteReactor<v1::AdmissionStep>* TrajectoryRpc::AdmitProgramInSteps(
    grpc::CallbackServerContext* context, const v1::AdmitProgramRequest* request) {
  if (const absl::Status wanted = CheckStillWanted(*context); !wanted.ok()) {
    return RefuseStream<v1::AdmissionStep>(wanted);
  }
  auto asked = FromRequest(*request);
  if (!asked.ok()) {
    return RefuseStream<v1::AdmissionStep>(asked.status());
  }
  return asked->hexapod != nullptr
             ? RunInSteps(std::make_shared<SpatialAdmissionInSteps>(
                   std::move(asked->program.text), asked->spatial, asked->hexapod, desk_, closing_))
             : RunInSteps(std::make_shared<AdmissionInSteps>(std::move(asked->program), asked->options,
                                                             asked->machine, desk_, closing_));
}

template <typename Admission>
grpc::ServerWriteReactor<v1::AdmissionStep>* TrajectoryRpc::RunInSteps(std::shared_ptr<Admission> admission) {
  auto stream = PushStream<v1::AdmissionStep>::New(kMostStepsWaiting);
  const absl::Status queued = admissions_.Submit([stream, admission] {
    stream->Finish(Guarded([&] {
      return admission->Run([&stream](v1::AdmissionStep step) { return stream->Push(std::move(step)); });
    }));
  });
  return queued.ok() ? stream->Begin() : RefuseStream<v1::AdmissionStep>(queued);
}

grpc::ServerWriteReactor<v1::OperationBatch>* TrajectoryRpc::StreamOperations(
    grpc::CallbackServerContext* context, const v1::ListOperationsRequest* request) {
  if (const absl::Status wanted = CheckStillWanted(*context); !wanted.ok()) {
    return RefuseStream<v1::OperationBatch>(wanted);
  }
  auto listed = ListedOf(*request);
  return listed.ok() ? NewPullStream<v1::OperationBatch>(OperationBatches(std::move(*listed)))
                     : RefuseStream<v1::OperationBatch>(listed.status());
}

// The program that an export is made from: the plan's, or the request's own.
absl::StatusOr<ListedProgram> TrajectoryRpc::ExportedProgram(const v1::ExportRequest& request) const {
  if (request.plan_id() == 0) {
    auto program =
        FromWire(request.program(), request.program_format(), request.has_toolpath(), request.toolpath());
    auto hexapod = HexapodFor(request.mechanism(), hexapod_);
    if (!program.ok() || !hexapod.ok()) {
      return program.ok() ? hexapod.status() : program.status();
    }
    if (*hexapod != nullptr && program->drawing) {
      return DrawingForHexapod();
    }
    return ListedProgram{std::move(*program), find_machine_(std::nullopt), std::move(*hexapod), nullptr};
  }
  const auto record = DonePlan(request.plan_id());
  if (!record.ok()) {
    return record.status();
  }
  return ListedProgram{
      {{}, (*record)->options.notation, std::nullopt}, (*record)->machine, (*record)->hexapod, *record};
}

grpc::ServerWriteReactor<v1::ExportPiece>* TrajectoryRpc::Export(grpc::CallbackServerContext* context,
                                                                 const v1::ExportRequest* request) {
  if (const absl::Status wanted = CheckStillWanted(*context); !wanted.ok()) {
    return RefuseStream<v1::ExportPiece>(wanted);
  }
  ArgumentChecks checks;
  const double step_s = request->has_step_s() ? request->step_s() : kDefaultStep_s;
  checks.InRange("step_s", step_s, 0.0005, 1.0, "s");
  checks.Require(v1::ExportRequest::Format_IsValid(request->format()) &&
                     request->format() != v1::ExportRequest::FORMAT_UNSPECIFIED,
                 "format", "UNKNOWN_FORMAT", "must be one of the formats that the request names");
  if (!checks.ok()) {
    return RefuseStream<v1::ExportPiece>(checks.status());
  }
  if (request->format() != v1::ExportRequest::FORMAT_SAMPLES_CSV) {
    auto listed = ExportedProgram(*request);
    return listed.ok() ? NewPullStream<v1::ExportPiece>(ProgramPieces(std::move(*listed), request->format()))
                       : RefuseStream<v1::ExportPiece>(listed.status());
  }
  const auto found = DonePlan(request->plan_id());
  if (!found.ok()) {
    return RefuseStream<v1::ExportPiece>(found.status());
  }
  return NewPullStream<v1::ExportPiece>((*found)->spatial ? SpatialSamplePieces((*found)->spatial, step_s)
                                                          : SamplePieces((*found)->planned, step_s));
}

grpc::ServerUnaryReactor* TrajectoryRpc::StartStreaming(grpc::CallbackServerContext* context,
                                                        const v1::StartStreamingRequest* request,
                                                        v1::StartStreamingResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    const auto record = DonePlan(request->plan_id());
    if (!record.ok()) {
      return record.status();
    }
    if ((*record)->spatial != nullptr) {
      return Trouble(absl::StatusCode::kFailedPrecondition, "MECHANISM_NOT_PLAYED",
                     "the modules play plans of the open-base machine; plan " +
                         std::to_string((*record)->id) + " is a hexapod's, see StreamSamples");
    }
    desk_.KeepFor((*record)->id);
    streaming_.start(std::shared_ptr<const Plan>((*record)->planned, &(*record)->planned->plan));
    ToWire(**record, *response->mutable_summary());
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* TrajectoryRpc::StopStreaming(grpc::CallbackServerContext* context,
                                                       const v1::StopStreamingRequest* request,
                                                       v1::StopStreamingResponse* response) {
  return Answer(context, [&]() -> absl::Status {
    const std::uint64_t was = streaming_.stop(request->plan_id());
    if (was != 0) {
      desk_.KeepFor(0);
    }
    response->set_plan_id(was);
    return absl::OkStatus();
  });
}

}  // namespace lambdajet::trajectory
