// Starts a part program from one of its lines, in the modal state that the lines before leave behind.
//
// Model: the state is replayed from the operation list, so units, offsets, distance modes and expressions of the text are
// already resolved; what remains is where the jet stands, feed, path tolerance, work offset and which valves are open. The
// new list first restores that state (modal changes, a jet-off move to the place, a pierce if the jet is on there), then goes
// on with the operations of the line. Replaying the restored part gives the same state as replaying the lines before.
// Frames: W. Units: mm, mm/s. Threads: pure. Cost: one pass. Errors: LINE_NOT_IN_PROGRAM.
#pragma once

#include <optional>
#include <string_view>

#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

struct ModalState {
  double x_W_mm = 0.0;
  double y_W_mm = 0.0;
  double feed_mm_per_s = 0.0;
  double unit_mm = 1.0;
  double distance_g_value = 90.0;
  double work_offset_g_value = 54.0;
  double work_offset_x_mm = 0.0;
  double work_offset_y_mm = 0.0;
  double path_tolerance_mm = -1.0;        // below 0: the program has not said
  double camera_mark_value = -1.0;        // followed; below 0: none
  double abrasive_flow_g_per_min = -1.0;  // below 0: the program has not said
  double tool_number_value = -1.0;        // mounted; below 0: the program has not said
  bool jet_on = false;
  bool abrasive_on = false;
  bool ended = false;

  bool operator==(const ModalState&) const = default;
};

// Operations of lines below `before_line`.
ModalState ReplayModalState(const std::vector<Operation>& operations, std::uint32_t before_line = UINT32_MAX);

struct LineStart {
  std::string_view reason;  // empty: it can be started there
  ModalState state;
  std::vector<Operation> operations;
  std::size_t restored_count = 0;  // of them, the first ones restore the state
};
// `line`: the first line that is obeyed; lines without operations lead to the next that has some.
LineStart StartFromLine(const std::vector<Operation>& operations, std::uint32_t line);

}  // namespace lambdajet::trajectory
