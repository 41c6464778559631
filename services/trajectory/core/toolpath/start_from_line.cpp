#include "trajectory/core/toolpath/start_from_line.hpp"

#include <algorithm>

namespace lambdajet::trajectory {
namespace {

void Obey(const Operation& o, ModalState& state) {
  switch (o.kind) {
    case OperationKind::kTraverse:
    case OperationKind::kFeedLine:
    case OperationKind::kFeedArc:
      state.x_W_mm = o.x_W_mm;
      state.y_W_mm = o.y_W_mm;
      break;
    case OperationKind::kPierce:
      state.jet_on = state.abrasive_on = true;
      break;
    case OperationKind::kJetOn:
      state.jet_on = true;
      break;
    case OperationKind::kJetOff:
      state.jet_on = false;
      break;
    case OperationKind::kAbrasiveOn:
    case OperationKind::kAbrasiveOff:
      state.abrasive_on = o.kind == OperationKind::kAbrasiveOn;
      break;
    case OperationKind::kAbrasiveFlow:
      state.abrasive_flow_g_per_min = o.value;
      break;
    case OperationKind::kCameraTrackOn:
      state.camera_mark_value = o.value;
      break;
    case OperationKind::kCameraTrackOff:
      state.camera_mark_value = -1.0;
      break;
    case OperationKind::kToolChange:
    case OperationKind::kToolNumber:
      state.tool_number_value = o.value;
      break;
    case OperationKind::kFeedChange:
      state.feed_mm_per_s = o.feed_mm_per_s;
      break;
    case OperationKind::kUnitsChange:
      state.unit_mm = o.value;
      break;
    case OperationKind::kDistanceChange:
      state.distance_g_value = o.value;
      break;
    case OperationKind::kWorkOffsetChange:
      state.work_offset_g_value = o.value;
      state.work_offset_x_mm = o.x_W_mm;
      state.work_offset_y_mm = o.y_W_mm;
      break;
    case OperationKind::kPathTolerance:
      state.path_tolerance_mm = o.value;
      break;
    case OperationKind::kEnd:
      state.ended = true;
      break;
    default:
      break;
  }
}

class StateWriter {
 public:
  StateWriter(const ModalState& state, std::uint32_t line) : state_(state), line_(line) {}

  std::vector<Operation> Write() {
    Add(OperationKind::kUnitsChange).value = state_.unit_mm;
    Add(OperationKind::kDistanceChange).value = state_.distance_g_value;
    Operation& offset = Add(OperationKind::kWorkOffsetChange);
    offset.value = state_.work_offset_g_value;
    offset.x_W_mm = state_.work_offset_x_mm;
    offset.y_W_mm = state_.work_offset_y_mm;
    if (state_.path_tolerance_mm >= 0.0) {
      Add(OperationKind::kPathTolerance).value = state_.path_tolerance_mm;
    }
    if (state_.feed_mm_per_s > 0.0) {
      Add(OperationKind::kFeedChange);
    }
    if (state_.tool_number_value >= 0.0) {
      Add(OperationKind::kToolNumber).value = state_.tool_number_value;
    }
    Add(OperationKind::kTraverse);
    Valves();
    if (state_.camera_mark_value >= 0.0) {
      Add(OperationKind::kCameraTrackOn).value = state_.camera_mark_value;
    }
    return std::move(list_);
  }

 private:
  // The jet has gone: the sheet is pierced again where it stood.
  void Valves() {
    if (state_.abrasive_flow_g_per_min >= 0.0) {
      Add(OperationKind::kAbrasiveFlow).value = state_.abrasive_flow_g_per_min;
    }
    if (state_.jet_on) {
      Add(OperationKind::kPierce);
      if (!state_.abrasive_on) {
        Add(OperationKind::kAbrasiveOff);
      }
    } else if (state_.abrasive_on) {
      Add(OperationKind::kAbrasiveOn);
    }
  }

  Operation& Add(OperationKind kind) {
    Operation& o = list_.emplace_back();
    o.kind = kind;
    o.line = line_;
    o.x_W_mm = state_.x_W_mm;
    o.y_W_mm = state_.y_W_mm;
    o.feed_mm_per_s = state_.feed_mm_per_s;
    return o;
  }

  const ModalState& state_;
  std::uint32_t line_;
  std::vector<Operation> list_;
};

}  // namespace

ModalState ReplayModalState(const std::vector<Operation>& operations, std::uint32_t before_line) {
  ModalState state;
  for (const Operation& o : operations) {
    if (o.line >= before_line) {
      break;
    }
    Obey(o, state);
  }
  return state;
}

LineStart StartFromLine(const std::vector<Operation>& operations, std::uint32_t line) {
  LineStart start;
  // The first operation of the line or after it: called programs make lines run back, so the list is searched in its order.
  const auto at =
      std::find_if(operations.begin(), operations.end(), [&](const Operation& o) { return o.line >= line; });
  if (at == operations.end() || at->kind == OperationKind::kEnd) {
    start.reason = "LINE_NOT_IN_PROGRAM";
    return start;
  }
  for (auto before = operations.begin(); before != at; ++before) {
    Obey(*before, start.state);
  }
  start.operations = StateWriter(start.state, at->line).Write();
  start.restored_count = start.operations.size();
  start.operations.insert(start.operations.end(), at, operations.end());
  return start;
}

}  // namespace lambdajet::trajectory
