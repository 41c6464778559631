// Reads a G-code part program into the canonical operation list, and names every word it cannot obey.
//
// Model: RS-274/NGC as LinuxCNC documents it, with parameters, expressions, subroutines and loops: words may stand in any
// order in a line, spaces within a line do not count, one word of each modal group a line; a block is obeyed in LinuxCNC's
// order. Splines become pairs of arcs within a hundredth of the path tolerance. Words of the jet: services/trajectory/README.md.
// Frames: the program's work coordinates in, W out; W's zero is the machine's. Units: as the program says in, mm, mm/s and rad
// out.
// Errors: nothing is skipped; what is not known or not right becomes a fault with line, column, word, reason and what would
// be right. Reading goes on at the next line, up to the limit of faults, unless what comes depends on parameters or loops.
// Threads: pure. Cost: about 0.2 us a line of plain words; loops and calls are limited in number.
#pragma once

#include <cstddef>
#include <string_view>

#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

struct GcodeOptions {
  std::uint8_t axes = kPlanarAxes;  // of the machine; words of other axes are refused
  bool leave_out_z = false;         // without a Z axis: Z words of flat programs are read over, not refused
  bool obey_block_delete = true;    // a line that starts with "/" is left out
  bool kerf_compensation = true;  // G41 and G42 mark the motions with the kerf offset; else they are refused
  double kerf_width_mm = 0.0;     // of the machine, for G41 and G42 without a tool of the program's own
  double abrasive_flow_max_g_per_min = 1000.0;    // of the machine, for M67 and M68; 0: it has no such output
  bool process_inputs = true;                     // the machine has those that M66 waits for
  SpindleRange spindle = {};                      // of a machine that moves Z
  double default_tolerance_mm = 0.02;             // G64 without P
  double arc_radius_tolerance_mm = 0.005;         // how far start and end of an arc may differ in radius …
  double arc_radius_tolerance_ratio = 1e-3;       // … or by this share of it …
  double arc_radius_largest_difference_mm = 0.5;  // … but never by more
  double largest_coordinate_mm = 1e6;
  std::size_t fault_limit = 100;
  std::size_t operation_limit = 12'000'000;
  std::size_t line_limit = 30'000'000;  // lines obeyed, those of loops as often as they run
  std::size_t jump_limit = 1'000'000;   // turns of loops, and calls
};

PartProgram ReadGcode(std::string_view text, const GcodeOptions& options = {});

}  // namespace lambdajet::trajectory
