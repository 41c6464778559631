// Compensates the kerf that a program asks for with G41 and G42: moves the path sideways as LinuxCNC does, or says why not.
//
// Model: motions that carry kerf_offset_mm are compensated (Operation, left positive). As in LinuxCNC's documentation
// ("Cutter Compensation", entry and exit moves): the first such motion is the entry; a line ends beside its programmed end,
// square to its own direction, and must be longer than the offset; an arc ends tangent to the offset contour. The last
// compensated motion ends beside its end; the next motion (G40) is the exit, a line to its programmed end. In between every
// place of the path is at the offset distance from the contour; outer corners are rolled, inner ones cut off where the parallels
// cross (core/toolpath/offset). Where motions close a contour, that contour is also checked against its whole path.
// Frames: W. Units: mm. Threads: pure. Cost: about 1 us a motion.
// Errors: faults with the line: KERF_GOUGE, RADIUS_BELOW_KERF, KERF_ENTRY_TOO_SHORT, KERF_ENTRY_ARC_UNREACHABLE,
// KERF_EXIT_NOT_STRAIGHT, KERF_CHANGED_ON_CONTOUR, KERF_OUTSIDE_PLANE.
#pragma once

#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

// The same program with compensated coordinates and no offsets left; with faults added where that is not possible.
PartProgram CompensateKerf(PartProgram program);

}  // namespace lambdajet::trajectory
