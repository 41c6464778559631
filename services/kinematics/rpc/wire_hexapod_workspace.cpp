#include "kinematics/rpc/wire_hexapod_workspace.hpp"

#include <cmath>
#include <string>

#include "foundation/contract/trouble.hpp"
#include "kinematics/core/hexapod_workspace.hpp"
#include "kinematics/rpc/mechanism_selection.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr double kLargestMm = 1e5;
constexpr double kMostSamples = 2e6;
constexpr std::size_t kMostSlices = 100;
constexpr std::size_t kMostOrientations = 64;

// The numbers of v1::HexapodBound are those of the core.
v1::HexapodBound ToWire(HexapodBound bound) { return static_cast<v1::HexapodBound>(bound); }
static_assert(static_cast<int>(HexapodBound::kStrutMin) == v1::HEXAPOD_BOUND_STRUT_MIN);
static_assert(static_cast<int>(HexapodBound::kStrutMax) == v1::HEXAPOD_BOUND_STRUT_MAX);
static_assert(static_cast<int>(HexapodBound::kBaseJointCone) == v1::HEXAPOD_BOUND_BASE_JOINT_CONE);
static_assert(static_cast<int>(HexapodBound::kPlatformJointCone) == v1::HEXAPOD_BOUND_PLATFORM_JOINT_CONE);
static_assert(static_cast<int>(HexapodBound::kSingularMargin) == v1::HEXAPOD_BOUND_SINGULAR_MARGIN);

void CornerFromWire(const v1::SpatialVector& wire, const std::string& field, double& x, double& y, double& z,
                    ArgumentChecks& checks) {
  checks.InRange(field + ".x_mm", wire.x_mm(), -kLargestMm, kLargestMm, "mm");
  checks.InRange(field + ".y_mm", wire.y_mm(), -kLargestMm, kLargestMm, "mm");
  checks.InRange(field + ".z_mm", wire.z_mm(), -kLargestMm, kLargestMm, "mm");
  x = wire.x_mm();
  y = wire.y_mm();
  z = wire.z_mm();
}

void OrientationsFromWire(const v1::ComputeHexapodWorkspaceRequest& wire, HexapodWorkspaceRequest& request,
                          ArgumentChecks& checks) {
  checks.CountInRange("orientation", static_cast<std::size_t>(wire.orientation_size()), 0, kMostOrientations);
  if (wire.orientation_size() == 0 || !checks.ok()) {
    return;
  }
  request.R_MT.clear();
  for (const v1::KrylovAngles& angles : wire.orientation()) {
    for (const double angle : {angles.psi_rad(), angles.theta_rad(), angles.gamma_rad()}) {
      checks.InRange("orientation", angle, -1e3, 1e3, "rad");
    }
    request.R_MT.push_back(KrylovAngles{angles.psi_rad(), angles.theta_rad(), angles.gamma_rad()}.Rotation());
  }
}

double SamplesOf(const HexapodWorkspaceRequest& request, bool voxels) {
  const HexapodBox& box = request.box;
  const double flat = std::ceil((box.x_max_mm - box.x_min_mm) / request.step_mm) *
                      std::ceil((box.y_max_mm - box.y_min_mm) / request.step_mm) *
                      static_cast<double>(request.R_MT.size());
  return voxels ? flat * std::max(1.0, std::ceil((box.z_max_mm - box.z_min_mm) / request.step_mm)) : flat;
}

HexapodWorkspaceRequest FromWire(const v1::ComputeHexapodWorkspaceRequest& wire, ArgumentChecks& checks) {
  HexapodWorkspaceRequest request;
  HexapodBox& box = request.box;
  CornerFromWire(wire.box_from(), "box_from", box.x_min_mm, box.y_min_mm, box.z_min_mm, checks);
  CornerFromWire(wire.box_to(), "box_to", box.x_max_mm, box.y_max_mm, box.z_max_mm, checks);
  request.step_mm = wire.step_mm();
  checks.InRange("step_mm", request.step_mm, 1e-3, kLargestMm, "mm");
  request.tolerance_mm = wire.has_tolerance_mm() ? wire.tolerance_mm() : request.tolerance_mm;
  checks.InRange("tolerance_mm", request.tolerance_mm, 1e-3, 100.0, "mm");
  OrientationsFromWire(wire, request, checks);
  checks.CountInRange("slice_z_mm", static_cast<std::size_t>(wire.slice_z_mm_size()), 0, kMostSlices);
  for (const double z : wire.slice_z_mm()) {
    checks.InRange("slice_z_mm", z, -kLargestMm, kLargestMm, "mm");
  }
  if (checks.ok()) {
    // Before the core's own check, since a slice's limit is one for each and not for the whole box.
    const double samples = SamplesOf(request, wire.voxels());
    checks.Require(samples <= kMostSamples, "step_mm", "TOO_FINE",
                   "makes " + std::to_string(samples) + " samples; at most 2000000 are right");
    if (!wire.voxels()) {
      request.box.z_max_mm = request.box.z_min_mm;  // nothing is asked between the slices
    }
    const std::string_view fault = FaultOf(request);
    checks.Require(fault.empty(), "box_to", "BAD_WORKSPACE", std::string(fault));
  }
  return request;
}

void ToWire(const HexapodSlice& slice, v1::HexapodSlice& wire) {
  wire.set_z_mm(slice.z_mm);
  wire.set_area_mm2(slice.area_mm2);
  for (const HexapodSpan& span : slice.spans) {
    wire.add_span(span.y_mm);
    wire.add_span(span.from_x_mm);
    wire.add_span(span.to_x_mm);
    wire.add_bound(ToWire(span.from.bound));
    wire.add_bound(ToWire(span.to.bound));
  }
}

void ToWire(const HexapodRectangle& found, v1::HexapodSlice& wire) {
  const Rectangle& r = found.rectangle;
  if (!(r.area_mm2() > 0.0)) {
    return;
  }
  for (const double number : {r.x_min_mm, r.y_min_mm, r.x_max_mm, r.y_max_mm}) {
    wire.add_rectangle_mm(number);
  }
  for (const HexapodBorder& border : found.binding) {
    wire.add_rectangle_bound(ToWire(border.bound));
  }
}

void ToWire(const HexapodVoxels& voxels, v1::HexapodVoxels& wire) {
  wire.set_count_x(static_cast<std::uint32_t>(voxels.count_x));
  wire.set_count_y(static_cast<std::uint32_t>(voxels.count_y));
  wire.set_count_z(static_cast<std::uint32_t>(voxels.count_z));
  wire.set_reason(std::string(voxels.reason.begin(), voxels.reason.end()));
  wire.set_volume_mm3(voxels.volume_mm3);
}

}  // namespace

absl::Status ComputeHexapodWorkspace(const MachineSlot& slot,
                                     const v1::ComputeHexapodWorkspaceRequest& request,
                                     const std::function<bool()>& cancelled,
                                     v1::ComputeHexapodWorkspaceResponse& response) {
  const auto selected =
      SelectMechanism(slot, request.mechanism(), nullptr, std::nullopt, *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  if (!selected->hexapod) {
    return Trouble(absl::StatusCode::kInvalidArgument, "WRONG_MECHANISM",
                   "this question is about a hexapod; a lambda's region is asked for with ComputeWorkspace");
  }
  ArgumentChecks checks;
  HexapodWorkspaceRequest asked = FromWire(request, checks);
  if (!checks.ok()) {
    return checks.status();
  }
  asked.cancelled = cancelled;
  for (const double z : request.slice_z_mm()) {
    const HexapodSlice slice = CutSlice(*selected->hexapod, asked, z);
    v1::HexapodSlice& wire = *response.add_slice();
    ToWire(slice, wire);
    ToWire(LargestRectangle(*selected->hexapod, asked, slice), wire);
  }
  if (request.voxels()) {
    ToWire(FillVoxels(*selected->hexapod, asked), *response.mutable_voxels());
  }
  return cancelled && cancelled() ? Trouble(absl::StatusCode::kCancelled, "CANCELLED", "the client has gone")
                                  : absl::OkStatus();
}

}  // namespace lambdajet::kinematics
