// Reads the values and parameter settings of G-code; the reader's own, not for others.
//
// Model: RS-274/NGC as LinuxCNC documents it. A value is a number, a parameter (#3, ##3, #[…], #<name>), an expression in
// square brackets, or a function of one; a sign may stand before it. Operators bind in this order, left first within one:
// ** | * / MOD | + - | EQ NE GT GE LT LE (equal: within 1e-6) | AND OR XOR. Angles are in degrees; FIX rounds down, FUP up,
// MOD is never negative.
// Errors: a fault in the scan, with its place. Depth of brackets is limited to 64. Threads: pure.
#pragma once

#include <string>

#include "trajectory/core/part_program/gcode_parameters.hpp"
#include "trajectory/core/part_program/gcode_scan.hpp"

namespace lambdajet::trajectory {

// The value that comes next in the line; `word` is where to complain if there is none.
bool ReadValue(LineScan& scan, const Parameters& parameters, std::size_t word, double& value);

// An expression in square brackets that must come next.
bool ReadExpression(LineScan& scan, const Parameters& parameters, double& value);

// "#… = value": the line stands at "#". The setting waits in `parameters` until the line is settled.
bool ReadSetting(LineScan& scan, Parameters& parameters);

// "<name>" in small letters without spaces; the line stands at "<".
bool ReadName(LineScan& scan, std::string& name);

}  // namespace lambdajet::trajectory
