// Finds the words of a G-code program that faults of whole lines mean: where a motion leads, found only after reading.
//
// Model: a fault that names an axis in its word stands at that axis's word, another at the first axis word of its line, or
// at the first word where the line writes none. Faults with a column, and those of the whole program (line 0), stay as they
// are. Threads: pure. Cost: one look at the lines up to the last fault.
#pragma once

#include <string_view>
#include <vector>

#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

void PointAtWords(std::string_view program, std::vector<ProgramFault>& faults);

}  // namespace lambdajet::trajectory
