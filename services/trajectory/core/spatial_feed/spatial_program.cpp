#include "trajectory/core/spatial_feed/spatial_program.hpp"

#include <algorithm>
#include <cstring>
#include <iterator>

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kMostFaults = 100;

// FNV-1a.
std::uint64_t Mixed(std::uint64_t hash, std::string_view bytes) {
  for (const char c : bytes) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  }
  return hash;
}

std::uint64_t Mixed(std::uint64_t hash, double value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  return Mixed(hash, std::string_view(bytes, sizeof bytes));
}

// Whether the machine can hold the tool at the ends of every move; one fault a line.
void CheckPlaces(const SpatialModel& model, const SpatialPath& path, std::vector<ProgramFault>& faults) {
  for (const SpatialRun& run : path.runs) {
    for (const SpatialPiece& piece : run.pieces) {
      for (const double offset_mm : {0.0, piece.length_mm}) {
        const SpatialPoint at = PointOn(piece, offset_mm);
        ProgramFault fault;
        const bool told = !faults.empty() && faults.back().line == piece.line;
        if (faults.size() < kMostFaults && !told && !model.struts.Reaches(at.p_mm, at.q, piece.line, fault)) {
          faults.push_back(std::move(fault));
        }
      }
    }
  }
}

void CheckReach(const SpatialModel& model, const SpatialPath& path, std::vector<ProgramFault>& faults) {
  for (const SpatialRun& run : path.runs) {
    std::vector<ProgramFault> of_run;
    if (!run.pieces.empty() && faults.size() < kMostFaults) {
      MakeSpatialNodes(model, run, of_run);
    }
    std::move(of_run.begin(), of_run.end(), std::back_inserter(faults));
  }
  faults.resize(std::min(faults.size(), kMostFaults));
}

}  // namespace

PartProgram ReadSpatialProgram(std::string_view text, const HexapodMotion& motion, ProgramNotation notation) {
  ReadOptions options;
  options.notation = notation;
  options.gcode.axes = options.cldata.axes = kSixAxes;
  options.gcode.default_tolerance_mm = motion.corner_tolerance_mm;
  options.gcode.kerf_compensation = false;
  options.gcode.abrasive_flow_max_g_per_min = 0.0;  // a hexapod's own players have neither
  options.gcode.process_inputs = false;
  options.cldata.tool_angles = ToolAngles::kRollPitch;
  options.gcode.spindle = options.cldata.spindle = {motion.spindle_least_per_min, motion.spindle_most_per_min};
  PartProgram program = ReadPartProgram(text, options);
  const auto moved = std::find_if(program.operations.begin(), program.operations.end(),
                                  [](const Operation& o) { return o.kerf_offset_mm != 0.0; });
  if (program.faults.empty() && moved != program.operations.end()) {
    program.faults.push_back({moved->line, 0, "COMPENSATION_NOT_SUPPORTED", "TLCOMP",
                              "the tool's radius is not compensated for a hexapod; have the post write the "
                              "tool's own path"});
  }
  return program;
}

SpatialAdmission AdmitSpatialProgram(std::string_view text, const HexapodModel& hexapod,
                                     const SpatialOptions& options) {
  SpatialAdmission admission;
  PartProgram program = ReadSpatialProgram(text, hexapod.motion, options.notation);
  admission.check = AdmissionCheck::kParse;
  admission.faults = std::move(program.faults);
  if (!admission.faults.empty()) {
    return admission;
  }
  const SpatialModel model(hexapod.geometry, hexapod.motion, options);
  const SpatialPath path =
      MakeSpatialPath(program.operations, hexapod.motion, model.turn_radius_mm, options.feed_scale);
  admission.check = AdmissionCheck::kPlace;
  admission.faults = path.faults;
  CheckPlaces(model, path, admission.faults);
  if (!admission.faults.empty()) {
    return admission;
  }
  admission.check = AdmissionCheck::kReach;
  CheckReach(model, path, admission.faults);
  for (const SpatialRun& run : path.runs) {
    for (const SpatialPiece& piece : run.pieces) {
      (piece.cutting ? admission.cutting_length_mm : admission.idle_length_mm) += piece.length_mm;
    }
  }
  return admission;
}

std::uint64_t SpatialPlanIdOf(std::string_view text, const HexapodModel& hexapod,
                              const SpatialOptions& options) {
  std::uint64_t id = Mixed(0xcbf29ce484222325ULL, text);
  id = Mixed(Mixed(id, hexapod.machine_id), hexapod.hash);
  id = Mixed(Mixed(id, options.feed_scale), options.knot_s);
  id = Mixed(id, static_cast<double>(options.knots_per_segment));
  id = Mixed(id, static_cast<double>(options.notation));
  return id == 0 ? 1 : id;
}

PlannedSpatialProgram PlanSpatialText(std::string_view text, const HexapodModel& hexapod,
                                      const SpatialOptions& options, const PlanProgress& progress) {
  PartProgram program = ReadSpatialProgram(text, hexapod.motion, options.notation);
  PlannedSpatialProgram planned;
  planned.faults = std::move(program.faults);
  if (planned.faults.empty()) {
    planned = PlanSpatialProgram(program.operations, hexapod.machine_id, hexapod.geometry, hexapod.motion,
                                 options, progress);
  }
  planned.plan.id = SpatialPlanIdOf(text, hexapod, options);
  return planned;
}

SpatialPlanPoint PointAt(const PlannedSpatialProgram& planned, double tau_s) {
  const std::vector<SpatialPlanSample>& samples = planned.samples;
  const auto after = std::upper_bound(samples.begin(), samples.end(), tau_s,
                                      [](double t, const SpatialPlanSample& s) { return t < s.tau_s; });
  const SpatialPlanSample& a = after == samples.begin() ? *after : *std::prev(after);
  const SpatialPlanSample& b = after == samples.end() ? a : *after;
  const double u = b.tau_s > a.tau_s ? std::clamp((tau_s - a.tau_s) / (b.tau_s - a.tau_s), 0.0, 1.0) : 0.0;
  const auto between = [u](double from, double to) { return from + u * (to - from); };
  SpatialPlanPoint point;
  point.tau_s = tau_s;
  point.s_mm = between(a.s_mm, b.s_mm);
  point.p_W_mm = a.p_W_mm + u * (b.p_W_mm - a.p_W_mm);
  point.turn = RollPitchYaw::Of(a.q_W.slerp(u, b.q_W).toRotationMatrix());
  point.tip_speed_mm_per_s = between(a.tip_speed_mm_per_s, b.tip_speed_mm_per_s);
  point.path_speed_mm_per_s = between(a.path_speed_mm_per_s, b.path_speed_mm_per_s);
  point.struts = StrutsAt(planned.plan, tau_s);
  point.cutting = a.cutting;
  point.line = a.line;
  return point;
}

}  // namespace lambdajet::trajectory
