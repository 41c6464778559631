// Whether the sheet runs into a body along paths of the tool.
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "kinematics/core/swept_collision.hpp"
#include "kinematics/rpc/kinematics_answers.hpp"
#include "kinematics/rpc/mechanism_selection.hpp"
#include "kinematics/rpc/wire_planar.hpp"
#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr std::size_t kMostBodies = 64;
constexpr std::size_t kMostPaths = 1'024;
constexpr double kLargestSheetMm = 1e6;

using Points = std::vector<Eigen::Vector2d>;

Points PolygonFromWire(const v1::Polygon& wire, const std::string& field, ArgumentChecks& checks) {
  Points corners;
  checks.CountInRange(field + ".vertex_mm", static_cast<std::size_t>(wire.vertex_mm_size()), 6, 128);
  checks.Require(wire.vertex_mm_size() % 2 == 0, field + ".vertex_mm", "BAD_STRIDE",
                 "takes pairs of x and y");
  for (int i = 0; checks.ok() && i < wire.vertex_mm_size(); i += 2) {
    checks.InRange(field + ".vertex_mm", wire.vertex_mm(i), -kLargestSheetMm, kLargestSheetMm, "mm");
    checks.InRange(field + ".vertex_mm", wire.vertex_mm(i + 1), -kLargestSheetMm, kLargestSheetMm, "mm");
    corners.emplace_back(wire.vertex_mm(i), wire.vertex_mm(i + 1));
  }
  checks.Require(!checks.ok() || IsConvex(corners), field, "NOT_CONVEX",
                 "must be convex, counter-clockwise and have an area");
  return corners;
}

// The machine's own sheet in its clamp, unless the request brings one along.
absl::StatusOr<Points> SheetFromWire(const MachineSlot& slot, const v1::SweepSheetRequest& request,
                                     v1::SweepSheetResponse& response) {
  ArgumentChecks checks;
  const auto machine = SelectMachine(slot, request.machine_id());
  if (machine.ok()) {
    ToWire((*machine)->description, *response.mutable_model_version());
  }
  if (request.has_sheet() && (machine.ok() || request.machine_id().empty())) {
    Points sheet = PolygonFromWire(request.sheet(), "sheet", checks);
    return checks.ok() ? absl::StatusOr<Points>(std::move(sheet)) : checks.status();
  }
  if (!machine.ok()) {
    return machine.status();
  }
  const MachineDescription& d = (*machine)->description;
  const auto corners = SheetCorners(d.X_EW(), d.sheet_width_mm, d.sheet_height_mm);
  checks.Require(IsConvex(corners), "sheet", "EMPTY",
                 "the machine has no sheet in its clamp; bring one along");
  return checks.ok() ? absl::StatusOr<Points>(Points(corners.begin(), corners.end())) : checks.status();
}

bool PathFromWire(const v1::ToolPath& wire, Points& path) {
  path.clear();
  for (int i = 0; i + 1 < wire.p_de_mm_size(); i += 2) {
    path.emplace_back(wire.p_de_mm(i), wire.p_de_mm(i + 1));
    if (!(path.back().cwiseAbs().maxCoeff() <= kLargestSheetMm)) {
      return false;
    }
  }
  return true;
}

void SweptToWire(const SweptAnswer& answer, v1::SweptPath& wire) {
  wire.set_reason(v1::REASON_SOLVED);
  wire.set_collides(answer.collides);
  wire.set_stretch(static_cast<std::uint32_t>(answer.stretch));
  wire.set_fraction(answer.fraction);
  wire.set_body(static_cast<std::uint32_t>(answer.body));
  ToWire(answer.p_DE_mm, *wire.mutable_p_de());
  wire.set_clearance_mm(answer.clearance_mm);
}

void CheckPaths(const v1::SweepSheetRequest& request, ArgumentChecks& checks) {
  checks.CountInRange("body", static_cast<std::size_t>(request.body_size()), 1, kMostBodies);
  checks.CountInRange("path", static_cast<std::size_t>(request.path_size()), 1, kMostPaths);
  checks.InRange("margin_mm", request.margin_mm(), 0.0, kLargestSheetMm, "mm");
  std::size_t points = 0;
  for (const v1::ToolPath& path : request.path()) {
    checks.Require(path.p_de_mm_size() % 2 == 0, "path.p_DE_mm", "BAD_STRIDE", "takes pairs of x and y");
    checks.Require(path.p_de_mm_size() > 0, "path.p_DE_mm", "TOO_FEW", "a path has a point at least");
    points += static_cast<std::size_t>(path.p_de_mm_size()) / 2;
  }
  checks.CountInRange("path.p_DE_mm", points, 1, kMostPosesPerMessage);
}

}  // namespace

absl::Status KinematicsAnswers::AnswerBatch(const v1::SweepSheetRequest& request,
                                            v1::SweepSheetResponse& response) const {
  const auto sheet = SheetFromWire(slot_, request, response);
  if (!sheet.ok()) {
    return sheet.status();
  }
  ArgumentChecks checks;
  CheckPaths(request, checks);
  std::vector<Points> bodies;
  for (int i = 0; checks.ok() && i < request.body_size(); ++i) {
    bodies.push_back(PolygonFromWire(request.body(i), "body[" + std::to_string(i) + "]", checks));
  }
  if (!checks.ok()) {
    return checks.status();
  }
  const std::vector<Corners> corners(bodies.begin(), bodies.end());
  Points path;
  for (const v1::ToolPath& wire : request.path()) {
    v1::SweptPath& answer = *response.add_path();
    if (PathFromWire(wire, path)) {
      SweptToWire(kinematics::SweepSheet(*sheet, path, corners, request.margin_mm()), answer);
    } else {
      answer.set_reason(v1::REASON_NOT_FINITE);
    }
  }
  return absl::OkStatus();
}

}  // namespace lambdajet::kinematics
