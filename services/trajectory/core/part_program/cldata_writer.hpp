// Writes canonical operations as CLDATA, the words that the CLDATA reader reads.
//
// Model: one statement an operation; modes where they change; arcs as CIRCLE with points at most a third of a turn apart.
// Coordinates have as many digits as read back exactly, so reading and writing again changes nothing, neither in motions nor
// in the text. A tool's axis is written as (i, j, k), as the machine means A and B (tool_axis.hpp). Work offsets and distance
// modes are resolved in the operations and leave no word.
// Frames: W. Units: millimetres. Threads: pure. Errors: what CLDATA cannot say is a fault with the operation's line, and
// the text is empty then.
#pragma once

#include <string>
#include <vector>

#include "trajectory/core/part_program/operation.hpp"
#include "trajectory/core/part_program/tool_axis.hpp"

namespace lambdajet::trajectory {

struct CldataText {
  std::string text;
  std::vector<ProgramFault> faults;
};

// `part` names the program (PARTNO); `notes` are lines of text for whoever reads it (PPRINT).
CldataText WriteCldata(const std::vector<Operation>& operations, std::string_view part,
                       const std::vector<std::string>& notes = {},
                       ToolAngles tool_angles = ToolAngles::kRotaryHead);

}  // namespace lambdajet::trajectory
