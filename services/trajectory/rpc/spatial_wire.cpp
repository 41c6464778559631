#include "trajectory/rpc/spatial_wire.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "platform/rpc/argument_checks.hpp"
#include "trajectory/rpc/answer_limits.hpp"
#include "trajectory/rpc/wire.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kStride = 22;
constexpr const char* kHeader =
    "tau_s,s_mm,x_W_mm,y_W_mm,z_W_mm,a_rad,b_rad,c_rad,tip_mm_per_s,path_mm_per_s,strut_1_mm,strut_2_mm,"
    "strut_3_mm,"
    "strut_4_mm,strut_5_mm,strut_6_mm,strut_1_mm_per_s,strut_2_mm_per_s,strut_3_mm_per_s,strut_4_mm_per_s,"
    "strut_5_mm_per_s,strut_6_mm_per_s,cutting,source_line\n";

std::array<double, kStride> NumbersOf(const SpatialPlanPoint& p) {
  std::array<double, kStride> numbers = {
      p.tau_s,         p.s_mm,           p.p_W_mm.x(),   p.p_W_mm.y(),         p.p_W_mm.z(),
      p.turn.roll_rad, p.turn.pitch_rad, p.turn.yaw_rad, p.tip_speed_mm_per_s, p.path_speed_mm_per_s};
  for (std::size_t j = 0; j < kStrutCount; ++j) {
    numbers[10 + j] = p.struts.q_mm[static_cast<Eigen::Index>(j)];
    numbers[16 + j] = p.struts.first[static_cast<Eigen::Index>(j)];
  }
  return numbers;
}

void AppendLine(const SpatialPlanPoint& point, std::string& csv) {
  char text[32];
  for (const double number : NumbersOf(point)) {
    std::snprintf(text, sizeof text, "%.9g,", number);
    csv += text;
  }
  std::snprintf(text, sizeof text, "%d,%u\n", point.cutting ? 1 : 0, point.line);
  csv += text;
}

}  // namespace

absl::StatusOr<std::shared_ptr<const HexapodModel>> HexapodFor(
    v1::Mechanism mechanism, const std::shared_ptr<const HexapodModel>& own) {
  if (!v1::Mechanism_IsValid(mechanism)) {
    ArgumentChecks checks;
    checks.Require(
        false, "mechanism", "UNKNOWN_MECHANISM",
        "is " + std::to_string(static_cast<int>(mechanism)) +
            ", none of the mechanisms that the request names: 1 is the open-base machine, 2 the hexapod");
    return checks.status();
  }
  if (mechanism != v1::MECHANISM_HEXAPOD) {
    return nullptr;
  }
  if (own == nullptr) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "NO_HEXAPOD",
                   "this service was started without a hexapod; start it with hexapod_file");
  }
  return own;
}

absl::Status DrawingForHexapod() {
  ArgumentChecks checks;
  checks.Require(false, "format", "NOT_FOR_HEXAPOD",
                 "a hexapod takes G-code and CLDATA; a drawing is for the open-base machine");
  return checks.status();
}

absl::StatusOr<SpatialOptions> SpatialFromWire(const v1::PlanOptions& wire, ProgramNotation notation) {
  ArgumentChecks checks;
  const auto refuse = [&checks](bool given, const char* field) {
    checks.Require(!given, field, "NOT_FOR_HEXAPOD",
                   "is an option of the open-base machine; a hexapod's plan takes feed_scale only");
  };
  refuse(wire.compensate(), "options.compensate");
  refuse(wire.has_tolerance_mm(), "options.tolerance_mm");
  refuse(wire.tolerances_size() > 0, "options.tolerances");
  refuse(wire.has_start_from_s_mm(), "options.start_from_s_mm");
  refuse(wire.has_overlap_mm(), "options.overlap_mm");
  refuse(wire.has_machine_version(), "options.machine_version");
  checks.Require(notation != ProgramNotation::kFlatGcode, "format", "NOT_FOR_HEXAPOD",
                 "a hexapod moves Z; flat G-code is for the open-base machine");
  SpatialOptions options;
  options.notation = notation;
  options.feed_scale = wire.has_feed_scale() ? wire.feed_scale() : 1.0;
  checks.InRange("options.feed_scale", options.feed_scale, 0.01, 1.2);
  if (!checks.ok()) {
    return checks.status();
  }
  return options;
}

void ToWire(const HexapodModel& hexapod, machine::v1::ModelVersion& wire) {
  wire.set_machine_id(hexapod.machine_id);
  wire.set_hash(hexapod.hash);
}

void ToWire(const SpatialAdmission& admission, const HexapodModel& hexapod, v1::AdmitProgramResponse& wire) {
  wire.set_admitted(admission.faults.empty());
  for (const ProgramFault& fault : admission.faults) {
    ToWire(fault, *wire.add_faults());
  }
  ToWire(hexapod, *wire.mutable_model_version());
  wire.set_cutting_length_mm(admission.cutting_length_mm);
  wire.set_idle_length_mm(admission.idle_length_mm);
}

void ToWire(const PlannedSpatialProgram& p, const HexapodModel& hexapod, v1::PlanSummary& wire) {
  ToWire(hexapod, *wire.mutable_model_version());
  wire.set_duration_s(p.plan.duration_s);
  wire.set_gate_time_s(p.gate_time_s);
  wire.set_cutting_time_s(p.cutting_time_s);
  wire.set_length_mm(p.plan.length_mm);
  wire.set_cutting_length_mm(p.cutting_length_mm);
  wire.set_segment_count(static_cast<std::uint32_t>(p.plan.segments.size()));
  wire.set_gate_count(static_cast<std::uint32_t>(p.plan.gates.size()));
  wire.set_event_count(static_cast<std::uint32_t>(p.plan.events.size()));
  wire.set_contour_tolerance_used_mm(p.tip_deviation_mm);
  for (const BindingLength& binding : p.binding) {
    v1::BindingLimit& to = *wire.add_binding_limits();
    to.set_limit(std::string(FeedLimitName(binding.limit)));
    to.set_length_mm(binding.length_mm);
    to.set_share(p.plan.length_mm > 0.0 ? binding.length_mm / p.plan.length_mm : 0.0);
  }
  ToWire(p.slow, wire);
  v1::SpatialSummary& spatial = *wire.mutable_spatial();
  spatial.set_turn_radius_mm(p.plan.turn_radius_mm);
  spatial.set_turn_deviation_rad(p.turn_deviation_rad);
  spatial.set_shortest_strut_mm(p.shortest_mm.minCoeff());
  spatial.set_longest_strut_mm(p.longest_mm.maxCoeff());
  spatial.set_singular_margin_ratio(p.singular_margin_ratio);
}

void AddSpatialPoint(const PlannedSpatialProgram& planned, double tau_s, v1::SampleBatch& wire) {
  const SpatialPlanPoint point = PointAt(planned, tau_s);
  for (const double number : NumbersOf(point)) {
    wire.add_spatial_values(number);
  }
  wire.add_cutting(point.cutting ? 1 : 0);
  wire.add_source_line(point.line);
}

std::function<absl::StatusOr<bool>(v1::ExportPiece&)> SpatialSamplePieces(
    std::shared_ptr<const PlannedSpatialProgram> planned, double step_s) {
  const auto count = static_cast<std::int64_t>(std::floor(planned->plan.duration_s / step_s + 1e-9)) + 1;
  return [planned = std::move(planned), step_s, count,
          next = std::int64_t{0}](v1::ExportPiece& piece) mutable -> absl::StatusOr<bool> {
    std::string& text = *piece.mutable_content();
    if (next == 0) {
      text = kHeader;
    }
    while (text.size() < kBytesPerPiece && next < count) {
      AppendLine(PointAt(*planned, static_cast<double>(next++) * step_s), text);
    }
    return !text.empty();
  };
}

}  // namespace lambdajet::trajectory
