#include "kinematics/rpc/wire_workspace.hpp"

#include <array>
#include <string>

#include "foundation/contract/trouble.hpp"
#include "kinematics/core/workspace.hpp"
#include "kinematics/optimisation/geometry_optimisation.hpp"
#include "kinematics/rpc/mechanism_selection.hpp"
#include "kinematics/rpc/wire_planar.hpp"

namespace lambdajet::kinematics {
namespace {

absl::Status CheckPlanar(const SelectedMechanism& selected) {
  if (!selected.hexapod) {
    return absl::OkStatus();
  }
  return Trouble(absl::StatusCode::kInvalidArgument, "WRONG_MECHANISM",
                 "this question is about a lambda or a biglide; a hexapod's region is asked for with "
                 "ComputeHexapodWorkspace");
}

absl::Status CheckWanted(const std::function<bool()>& cancelled) {
  return cancelled && cancelled() ? Trouble(absl::StatusCode::kCancelled, "CANCELLED", "the client has gone")
                                  : absl::OkStatus();
}

void RefusalToWire(Reason reason, v1::Refusal& wire) {
  wire.set_reason(ToWire(reason));
  wire.set_message(
      reason == Reason::kActuatorLimit
          ? "the sliders have no travel limits, so the region has no end; give both sliders a travel"
          : "no pose is usable: nothing lies within reach, travel and singular margin at once");
}

void SolutionToWire(const Workspace& workspace, v1::WorkspaceSolution& wire) {
  for (const Outline& outline : workspace.outlines) {
    v1::Polygon& polygon = *wire.add_region();
    for (const Eigen::Vector2d& vertex : outline) {
      polygon.add_vertex_mm(vertex.x());
      polygon.add_vertex_mm(vertex.y());
    }
  }
  wire.set_area_mm2(workspace.area_mm2);
  const Rectangle& r = workspace.rectangle;
  for (const double number : {r.x_min_mm, r.y_min_mm, r.x_max_mm, r.y_max_mm}) {
    wire.add_rectangle_mm(number);
  }
  constexpr std::array<const char*, 4> kSides = {"left", "right", "bottom", "top"};
  for (std::size_t i = 0; i < kSides.size(); ++i) {
    v1::RectangleSide& side = *wire.add_binding();
    side.set_side(kSides[i]);
    side.set_reason(ToWire(PoseLimitReason(workspace.binding[i])));
    side.set_message(std::string(PoseLimitSentence(workspace.binding[i])));
  }
}

Rectangle ZoneFromWire(const v1::OptimiseGeometryRequest& request, ArgumentChecks& checks) {
  checks.CountInRange("zone_mm", static_cast<std::size_t>(request.zone_mm_size()), 4, 4);
  for (int i = 0; i < request.zone_mm_size() && i < 4; ++i) {
    checks.InRange("zone_mm[" + std::to_string(i) + "]", request.zone_mm(i), -1e6, 1e6, "mm");
  }
  if (request.zone_mm_size() != 4) {
    return {};
  }
  const Rectangle zone{request.zone_mm(0), request.zone_mm(1), request.zone_mm(2), request.zone_mm(3)};
  checks.Require(zone.x_max_mm > zone.x_min_mm && zone.y_max_mm > zone.y_min_mm, "zone_mm", "EMPTY",
                 "x_max and y_max must be more than x_min and y_min");
  return zone;
}

OptimisationTask TaskFromWire(const v1::OptimiseGeometryRequest& request, const LambdaMechanism& start,
                              ArgumentChecks& checks) {
  OptimisationTask task;
  task.start = start;
  task.zone = ZoneFromWire(request, checks);
  task.objective = request.objective() == v1::OptimiseGeometryRequest::OBJECTIVE_RECTANGLE
                       ? Objective::kRectangle
                       : Objective::kErrorGain;
  task.lowest_ratio = request.has_lowest_ratio() ? request.lowest_ratio() : task.lowest_ratio;
  task.highest_ratio = request.has_highest_ratio() ? request.highest_ratio() : task.highest_ratio;
  task.evaluations = request.has_evaluations() ? static_cast<int>(std::min(request.evaluations(), 1'000'000u))
                                               : task.evaluations;
  checks.Require(request.objective() == v1::OptimiseGeometryRequest::OBJECTIVE_ERROR_GAIN ||
                     request.objective() == v1::OptimiseGeometryRequest::OBJECTIVE_RECTANGLE,
                 "objective", "OUT_OF_RANGE", "must be OBJECTIVE_ERROR_GAIN or OBJECTIVE_RECTANGLE");
  checks.InRange("lowest_ratio", task.lowest_ratio, 0.01, 1.0);
  checks.InRange("highest_ratio", task.highest_ratio, 1.0, 100.0);
  checks.InRange("evaluations", task.evaluations, 10, 20'000);
  return task;
}

}  // namespace

absl::Status ComputeWorkspace(const MachineSlot& slot, const v1::ComputeWorkspaceRequest& request,
                              const std::function<bool()>& cancelled,
                              v1::ComputeWorkspaceResponse& response) {
  const auto selected = SelectMechanism(slot, request.mechanism(),
                                        request.has_working_mode() ? &request.working_mode() : nullptr,
                                        std::nullopt, *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  if (absl::Status status = CheckPlanar(*selected); !status.ok()) {
    return status;
  }
  WorkspaceOptions options;
  options.tolerance_mm = request.has_tolerance_mm() ? request.tolerance_mm() : options.tolerance_mm;
  options.cancelled = cancelled;
  ArgumentChecks checks;
  checks.InRange("tolerance_mm", options.tolerance_mm, 0.001, 100.0, "mm");
  if (!checks.ok()) {
    return checks.status();
  }
  const Workspace workspace = ComputeWorkspace(selected->planar, options);
  if (absl::Status status = CheckWanted(cancelled); !status.ok()) {
    return status;
  }
  if (workspace.reason == Reason::kSolved) {
    SolutionToWire(workspace, *response.mutable_solution());
  } else {
    RefusalToWire(workspace.reason, *response.mutable_refusal());
  }
  return absl::OkStatus();
}

absl::Status OptimiseGeometry(const MachineSlot& slot, const v1::OptimiseGeometryRequest& request,
                              const std::function<bool()>& cancelled,
                              v1::OptimiseGeometryResponse& response) {
  const auto selected =
      SelectMechanism(slot, request.mechanism(), nullptr, std::nullopt, *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  if (absl::Status status = CheckPlanar(*selected); !status.ok()) {
    return status;
  }
  ArgumentChecks checks;
  OptimisationTask task = TaskFromWire(request, selected->planar, checks);
  if (!checks.ok()) {
    return checks.status();
  }
  task.cancelled = cancelled;
  const OptimisationAnswer answer = OptimiseGeometry(task);
  if (absl::Status status = CheckWanted(cancelled); !status.ok()) {
    return status;
  }
  ToWire(answer.found, *response.mutable_geometry());
  response.set_objective_before(answer.before);
  response.set_objective_after(answer.after);
  response.set_evaluations(static_cast<std::uint32_t>(answer.evaluations));
  response.set_reason(answer.reason == Reason::kSolved ? "" : std::string(ReasonName(answer.reason)));
  return absl::OkStatus();
}

}  // namespace lambdajet::kinematics
