#include "inspection/rpc/inspection_rpc.hpp"

#include <memory>
#include <vector>

#include "foundation/contract/trouble.hpp"
#include "inspection/core/comparison.hpp"
#include "inspection/drawing_file/drawing_file.hpp"
#include "platform/rpc/argument_checks.hpp"
#include "platform/rpc/handlers.hpp"
#include "platform/rpc/streams.hpp"

namespace lambdajet::inspection {
namespace {

constexpr std::size_t kThreads = 1;
constexpr std::size_t kMostWaiting = 8;
constexpr int kMostFurtherPlans = 100;
constexpr std::size_t kPathPointsPerBatch = 4096;

absl::Status CheckPlan(std::uint64_t plan) {
  ArgumentChecks checks;
  checks.Require(plan != 0, "plan_id", "MUST_BE_POSITIVE", "0 names no plan");
  return checks.status();
}

absl::StatusOr<CutPath> JoinRecording(const Recorder& recorder, std::uint64_t plan) {
  if (const absl::Status status = CheckPlan(plan); !status.ok()) {
    return status;
  }
  absl::StatusOr<Truth> truth = recorder.TruthOf(plan);
  if (!truth.ok()) {
    return truth.status();
  }
  if (truth->sheet.empty() || truth->jet.empty()) {
    return Trouble(absl::StatusCode::kNotFound, "NOTHING_RECORDED",
                   "the recording holds " + std::to_string(truth->sheet.size()) +
                       " samples of the sheet and " + std::to_string(truth->jet.size()) +
                       " of the jet; both simulated modules must run while it is open");
  }
  return JoinTruth(std::move(*truth));
}

void ToWire(const FittedCircle& circle, v1::FittedCircle& wire) {
  wire.set_center_x_w_mm(circle.center_W_mm.x());
  wire.set_center_y_w_mm(circle.center_W_mm.y());
  wire.set_radius_mm(circle.radius_mm);
  wire.set_position_error_mm(circle.position_error_mm);
  wire.set_diameter_error_mm(circle.diameter_error_mm);
  wire.set_roundness_mm(circle.roundness_mm);
}

void ToWire(const FeatureResult& result, v1::FeatureResult& wire) {
  wire.set_name(result.name);
  wire.set_p50_mm(result.p50_mm);
  wire.set_p95_mm(result.p95_mm);
  wire.set_max_mm(result.max_mm);
  wire.set_mean_mm(result.mean_mm);
  wire.set_rms_mm(result.rms_mm);
  wire.set_tolerance_mm(result.tolerance_mm);
  wire.set_conforming(result.conforming);
  wire.set_not_cut(result.not_cut);
  wire.set_points(result.points);
  wire.set_passed(result.passed);
  if (result.circle.fitted) {
    ToWire(result.circle, *wire.mutable_circle());
  }
}

void ToWire(const Inspection& inspection, const CutPath& path, v1::InspectResponse& wire) {
  ToWire(inspection.all, *wire.mutable_all());
  for (const FeatureResult& feature : inspection.features) {
    ToWire(feature, *wire.add_features());
  }
  wire.mutable_deviations()->Reserve(static_cast<int>(4 * inspection.deviations.size()));
  for (const Deviation& d : inspection.deviations) {
    if (d.cut) {
      wire.add_deviations(d.p_W_mm.x());
      wire.add_deviations(d.p_W_mm.y());
      wire.add_deviations(d.deviation_mm);
      wire.add_deviations(d.feature);
    }
  }
  wire.set_missing(path.missing);
  wire.set_cutting_time_s(path.cutting_time_s);
}

// Every point of every cut, the last one of each with the water off.
std::vector<double> Flatten(const CutPath& path) {
  std::vector<double> values;
  for (const Cut& cut : path.cuts) {
    for (const CutPoint& point : cut) {
      values.insert(values.end(),
                    {point.time_s, point.p_W_mm.x(), point.p_W_mm.y(), &point == &cut.back() ? 0.0 : 1.0});
    }
  }
  return values;
}

}  // namespace

InspectionRpc::~InspectionRpc() = default;

InspectionRpc::InspectionRpc(Recorder& recorder) : recorder_(recorder), pool_(kThreads, kMostWaiting) {}

grpc::ServerUnaryReactor* InspectionRpc::BeginRecording(grpc::CallbackServerContext* context,
                                                        const v1::BeginRecordingRequest* request,
                                                        v1::BeginRecordingResponse*) {
  return Answer(context, [this, request]() -> absl::Status {
    ArgumentChecks checks;
    checks.Require(request->plan_id() != 0, "plan_id", "MUST_BE_POSITIVE", "0 names no plan");
    checks.CountInRange("further_plan_ids", static_cast<std::size_t>(request->further_plan_ids_size()), 0,
                        kMostFurtherPlans);
    if (!checks.ok()) {
      return checks.status();
    }
    const std::vector<std::uint64_t> further(request->further_plan_ids().begin(),
                                             request->further_plan_ids().end());
    recorder_.Begin(request->plan_id(), further);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* InspectionRpc::EndRecording(grpc::CallbackServerContext* context,
                                                      const v1::EndRecordingRequest* request,
                                                      v1::EndRecordingResponse* response) {
  return Answer(context, [this, request, response]() -> absl::Status {
    if (const absl::Status status = CheckPlan(request->plan_id()); !status.ok()) {
      return status;
    }
    const auto size = recorder_.End(request->plan_id());
    if (!size.ok()) {
      return size.status();
    }
    response->set_samples(size->samples);
    response->set_missing(size->missing);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* InspectionRpc::Inspect(grpc::CallbackServerContext* context,
                                                 const v1::InspectRequest* request,
                                                 v1::InspectResponse* response) {
  return AnswerOn(pool_, context, [this, request, response](const Cancelled&) -> absl::Status {
    const absl::StatusOr<Drawing> drawing = ReadDrawing(request->drawing_yaml());
    if (!drawing.ok()) {
      return drawing.status();
    }
    const absl::StatusOr<CutPath> path = JoinRecording(recorder_, request->plan_id());
    if (!path.ok()) {
      return path.status();
    }
    ToWire(CompareWithDrawing(*path, *drawing), *path, *response);
    return absl::OkStatus();
  });
}

grpc::ServerWriteReactor<v1::CutPathBatch>* InspectionRpc::StreamCutPath(
    grpc::CallbackServerContext*, const v1::StreamCutPathRequest* request) {
  const absl::StatusOr<CutPath> path = JoinRecording(recorder_, request->plan_id());
  if (!path.ok()) {
    return RefuseStream<v1::CutPathBatch>(path.status());
  }
  auto values = std::make_shared<const std::vector<double>>(Flatten(*path));
  return NewPullStream<v1::CutPathBatch>(
      [values, at = std::size_t{0}](v1::CutPathBatch& batch) mutable -> absl::StatusOr<bool> {
        const std::size_t end = std::min(values->size(), at + 4 * kPathPointsPerBatch);
        batch.mutable_values()->Add(values->begin() + static_cast<std::ptrdiff_t>(at),
                                    values->begin() + static_cast<std::ptrdiff_t>(end));
        const bool more = end > at;
        at = end;
        return more;
      });
}

}  // namespace lambdajet::inspection
