// Tells what is wrong in a part program as compilers do, FILE:LINE:COLUMN, and ends with the exit code of a refusal.
#pragma once

#include <string>
#include <vector>

#include "clients/cli/output.hpp"
#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::cli {

void TellFaults(const std::string& file, const std::vector<trajectory::ProgramFault>& faults, Output& output);

}  // namespace lambdajet::cli
