#include "trajectory/core/part_program/read_program.hpp"

#include <utility>

#include "trajectory/core/toolpath/kerf.hpp"

namespace lambdajet::trajectory {
PartProgram ReadPartProgram(std::string_view text, const ReadOptions& options) {
  const bool cldata = options.notation == ProgramNotation::kCldata ||
                      (options.notation == ProgramNotation::kByContent && LooksLikeCldata(text));
  GcodeOptions gcode = options.gcode;
  gcode.leave_out_z = gcode.leave_out_z || options.notation == ProgramNotation::kFlatGcode;
  PartProgram program = cldata ? ReadCldata(text, options.cldata) : ReadGcode(text, gcode);
  return options.compensate_kerf && program.faults.empty() ? CompensateKerf(std::move(program)) : program;
}

}  // namespace lambdajet::trajectory
