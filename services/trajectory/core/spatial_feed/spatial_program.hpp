// Takes the text of a part program for a hexapod to its answers: canonical list, admission, plan, and the plan's points.
//
// Model: both notations are read for six axes, CLDATA's tool axis as roll and pitch (part_program/tool_axis.hpp); no contour is
// moved. Admission looks at the ends of all moves first (PLACE), then at every millimetre between (REACH): strut lengths, joint
// cones, singular margin. The same text, options and hexapod give the same plan under the same id.
// Frames: W. Units: mm, rad, s. Threads: pure; `progress` is called by the caller's thread. Cost: admission 10 us a millimetre.
// Errors: faults with line and reason. A plan that `progress` stopped has no segments and no faults.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "trajectory/core/part_program/read_program.hpp"
#include "trajectory/core/spatial_feed/plan_spatial_program.hpp"

namespace lambdajet::trajectory {

// One hexapod as it is planned for.
struct HexapodModel {
  std::string machine_id;
  std::string hash;  // 12 hex digits over everything below
  HexapodGeometry geometry;
  HexapodMotion motion;
};

PartProgram ReadSpatialProgram(std::string_view text, const HexapodMotion& motion,
                               ProgramNotation notation = ProgramNotation::kByContent);

enum class AdmissionCheck : std::uint8_t { kParse, kPlace, kReach };

struct SpatialAdmission {
  AdmissionCheck check = AdmissionCheck::kReach;  // the last one made; where there are faults, theirs
  std::vector<ProgramFault> faults;
  double cutting_length_mm = 0.0;  // of feed moves; a turn counts as its shift at the turn radius
  double idle_length_mm = 0.0;     // of traverses
};
SpatialAdmission AdmitSpatialProgram(std::string_view text, const HexapodModel& hexapod,
                                     const SpatialOptions& options);

std::uint64_t SpatialPlanIdOf(std::string_view text, const HexapodModel& hexapod,
                              const SpatialOptions& options);
PlannedSpatialProgram PlanSpatialText(std::string_view text, const HexapodModel& hexapod,
                                      const SpatialOptions& options, const PlanProgress& progress = {});

// A plan at one time: the tool between samples on the chord of 2 ms, the struts exactly.
struct SpatialPlanPoint {
  double tau_s = 0.0;
  double s_mm = 0.0;
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
  RollPitchYaw turn;
  double tip_speed_mm_per_s = 0.0;
  double path_speed_mm_per_s = 0.0;
  StrutState struts;
  bool cutting = false;
  std::uint32_t line = 0;
};
// Beyond the ends the end. The plan has no faults.
SpatialPlanPoint PointAt(const PlannedSpatialProgram& planned, double tau_s);

}  // namespace lambdajet::trajectory
