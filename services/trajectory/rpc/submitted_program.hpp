// Takes programs as they come over the wire, in any of the three formats, and gives the planner what it reads.
//
// Model: G-code and CLDATA are read as they are, in the notation that the request names. A drawing is made a G-code program
// first (toolpath: contours, kerf, leads, order), so that everything behind is the same; what cannot be cut becomes faults
// with the drawing's lines. Same drawing, settings and kerf: same program, so the same plan.
// Units: mm, mm/s, s, rad. Threads: MakeProgram is pure. Cost: of a drawing some milliseconds, on a pool.
// Errors: INVALID_ARGUMENT with the fields that are wrong: EMPTY, NOT_UTF8 (not asked of a drawing), PROGRAM_TOO_LARGE,
// UNKNOWN_FORMAT, TOOLPATH_NOT_WANTED (settings without a drawing), OUT_OF_RANGE, NOT_FINITE.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "foundation/machine/machine_description.hpp"
#include "lambdajet/type/v1/program.pb.h"
#include "trajectory/core/part_program/read_program.hpp"
#include "trajectory/core/toolpath/toolpath.hpp"

namespace lambdajet::trajectory {

inline constexpr std::size_t kMostProgramBytes = 64u << 20;

// How a drawing becomes a program.
struct DrawingSettings {
  ContourOptions contours;
  ToolpathOptions toolpath;
  bool kerf_given = false;  // else the machine's
  std::optional<Eigen::Vector2d> corner_W_mm;
  double turn_rad = 0.0;
};

struct SubmittedProgram {
  std::string text;
  ProgramNotation notation = ProgramNotation::kByContent;
  std::optional<DrawingSettings> drawing;  // the text is one
};

// A program that the readers read, or why there is none.
struct MadeProgram {
  std::string text;  // with faults: the drawing
  ProgramNotation notation = ProgramNotation::kByContent;
  std::vector<ProgramFault> faults;
};

// `toolpath` may be the default instance.
absl::StatusOr<SubmittedProgram> FromWire(const std::string& program, type::v1::ProgramFormat format,
                                          bool has_toolpath, const type::v1::ToolpathSettings& toolpath);

// From any request that carries program, format and toolpath.
template <typename Request>
absl::StatusOr<SubmittedProgram> ProgramOf(const Request& request) {
  return FromWire(request.program(), request.format(), request.has_toolpath(), request.toolpath());
}

// `machine` may be null where no kerf of its own is needed; the default kerf is 0.8 mm then.
MadeProgram MakeProgram(SubmittedProgram submitted, const MachineDescription* machine);

}  // namespace lambdajet::trajectory
