#include "trajectory/core/part_program/read_program.hpp"

#include <utility>

#include "trajectory/core/part_program/fault_place.hpp"
#include "trajectory/core/toolpath/kerf.hpp"

namespace lambdajet::trajectory {
namespace {

bool IsCldata(std::string_view text, ProgramNotation notation) {
  return notation == ProgramNotation::kCldata ||
         (notation == ProgramNotation::kByContent && LooksLikeCldata(text));
}

}  // namespace

void TellWords(std::string_view text, ProgramNotation notation, std::vector<ProgramFault>& faults) {
  if (!faults.empty() && !IsCldata(text, notation)) {
    PointAtWords(text, faults);
  }
}

PartProgram ReadPartProgram(std::string_view text, const ReadOptions& options) {
  const bool cldata = IsCldata(text, options.notation);
  GcodeOptions gcode = options.gcode;
  gcode.leave_out_z = gcode.leave_out_z || options.notation == ProgramNotation::kFlatGcode;
  PartProgram program = cldata ? ReadCldata(text, options.cldata) : ReadGcode(text, gcode);
  if (options.compensate_kerf && program.faults.empty()) {
    program = CompensateKerf(std::move(program));
    TellWords(text, options.notation, program.faults);
  }
  return program;
}

}  // namespace lambdajet::trajectory
