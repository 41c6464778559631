// Reads a G-code part program into the canonical operation list, in one pass, and names every word it cannot obey.
//
// Model: RS-274/NGC as LinuxCNC documents it, for the plane of the sheet: words may stand in any order in a line, spaces
// within a line do not count, one word of each modal group a line; a block is obeyed in LinuxCNC's order (feed, jet,
// abrasive, dwell, units, offsets, path mode, distance, motion, stop). Words of the jet: see services/trajectory/README.md.
// Frames: the program's work coordinates in, W out. Units: as the program says in, mm and mm/s out.
// Errors: nothing is skipped; what is not known or not right becomes a fault with line, column, word, reason and what would
// be right, up to the limit, and reading goes on at the next line. Threads: pure. Cost: about 0.2 us a line.
#pragma once

#include <cstddef>
#include <string_view>

#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

struct GcodeOptions {
  bool obey_block_delete = true;            // a line that starts with "/" is left out
  double default_tolerance_mm = 0.02;       // G64 without P
  double arc_radius_tolerance_mm = 0.0127;  // how far start and end of an arc may differ in radius
  double largest_coordinate_mm = 1e6;
  std::size_t fault_limit = 100;
  std::size_t operation_limit = 20'000'000;
};

PartProgram ReadGcode(std::string_view text, const GcodeOptions& options = {});

}  // namespace lambdajet::trajectory
