// T, M6 and M61 of a machine whose tool is changed by hand: T selects, M6 stands still until another tool is mounted.
#include "trajectory/core/part_program/gcode_reading.hpp"

namespace lambdajet::trajectory {
namespace {

bool SelectTool(Reading& r) {
  if (!r.block.has('T')) {
    return true;
  }
  const double number = r.block.Take('T');
  if (!IsTool(number)) {
    return r.FaultAt('T', "TOOL_NUMBER_OUT_OF_RANGE", "T is a whole number, 0 … 99999; T0 is no tool");
  }
  r.state.selected_tool = static_cast<int>(number);
  return true;
}

// As LinuxCNC does: refused while the kerf is compensated, the jet or the spindle off in any case, coolant as it is.
bool ChangeTool(Reading& r) {
  ModalState& s = r.state;
  if (s.selected_tool < 0) {
    return r.FaultAt(kTool, "TOOL_NOT_SELECTED", "T must say which tool, in this line or before");
  }
  if (s.kerf_code != 400) {
    return r.FaultAt(kTool, "NOT_WITH_KERF_ON", "G40 must stand before");
  }
  if (s.jet_on) {
    SwitchJetOff(r);
  }
  StopSpindle(r);
  if (s.selected_tool != s.mounted_tool) {
    s.mounted_tool = s.selected_tool;
    r.Add(OperationKind::kToolChange).value = s.mounted_tool;
  }
  return true;
}

// M61 says what is mounted; nobody has to change it.
bool NameTool(Reading& r) {
  if (!r.block.has('Q') || !IsTool(r.block.at('Q'))) {
    const char* should = "M61 needs Q, the number of the mounted tool, a whole number, 0 … 99999";
    return r.block.has('Q') ? r.FaultAt('Q', "TOOL_NUMBER_OUT_OF_RANGE", should)
                            : r.FaultAt(kTool, "TOOL_NUMBER_MISSING", should);
  }
  r.state.mounted_tool = static_cast<int>(r.block.Take('Q'));
  r.Add(OperationKind::kToolNumber).value = r.state.mounted_tool;
  return true;
}

}  // namespace

bool ObeyTool(Reading& r) {
  if (!SelectTool(r)) {
    return false;
  }
  const int m = r.code(kTool);
  return m == kNoCode || (m == 60 ? ChangeTool(r) : NameTool(r));
}

}  // namespace lambdajet::trajectory
