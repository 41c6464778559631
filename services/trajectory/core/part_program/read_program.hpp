// Reads a part program in whatever notation it is written: G-code or CLDATA.
//
// Model: the first statement tells: a word of CLDATA ("PARTNO", "GOTO/…", "$$") or else G-code. Both readers give the same
// canonical operations, so everything behind them is the same.
// Flat G-code is written for machines with a Z axis; its Z words and tool lengths are read over (GcodeOptions::leave_out_z).
// Threads: pure. Errors: the readers' faults, and those of the kerf's compensation.
#pragma once

#include <string_view>

#include "trajectory/core/part_program/cldata_reader.hpp"
#include "trajectory/core/part_program/gcode_reader.hpp"

namespace lambdajet::trajectory {

enum class ProgramNotation : std::uint8_t { kByContent, kGcode, kCldata, kFlatGcode };

struct ReadOptions {
  ProgramNotation notation = ProgramNotation::kByContent;
  GcodeOptions gcode;
  CldataOptions cldata;
  bool compensate_kerf =
      false;  // move the path by the kerf offset that the program asks for (core/toolpath/kerf)
};

// Gives faults of place, found after reading, the columns of their words; of G-code only.
void TellWords(std::string_view text, ProgramNotation notation, std::vector<ProgramFault>& faults);

PartProgram ReadPartProgram(std::string_view text, const ReadOptions& options = {});

}  // namespace lambdajet::trajectory
