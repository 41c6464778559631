#include "trajectory/core/feed/resume.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

// Whether the jet is on at an offset within an element.
bool JetOnAt(const PathElement& e, double offset_mm) {
  bool on = e.jet_on;
  for (const PathEvent& event : e.events) {
    if (event.offset_mm <= offset_mm &&
        (event.action == ProcessAction::kJetOn || event.action == ProcessAction::kJetOff)) {
      on = event.action == ProcessAction::kJetOn;
    }
  }
  return on;
}

// The part of a piece from an offset on; its begin is set by the caller.
PathPiece Tail(const PathPiece& piece, double offset_mm) {
  PathPiece tail = piece;
  tail.length_mm = piece.length_mm - offset_mm;
  if (piece.radius_mm == 0.0) {
    tail.origin_mm = piece.origin_mm + offset_mm * piece.direction;
  } else {
    tail.direction = (PointOn(piece, offset_mm).p_mm - piece.origin_mm) / std::abs(piece.radius_mm);
  }
  return tail;
}

PathElement RunFrom(const PathElement& run, double offset_mm) {
  PathElement rest = run;
  rest.pieces.clear();
  rest.events.clear();
  rest.run_begin_mm += offset_mm;
  for (const PathPiece& piece : run.pieces) {
    const double end = piece.begin_mm + piece.length_mm;
    if (end <= offset_mm + 1e-9) {
      continue;
    }
    PathPiece part = piece.begin_mm < offset_mm ? Tail(piece, offset_mm - piece.begin_mm) : piece;
    part.begin_mm = std::max(0.0, piece.begin_mm - offset_mm);
    rest.pieces.push_back(part);
  }
  for (PathEvent event : run.events) {
    if (event.offset_mm > offset_mm) {
      event.offset_mm -= offset_mm;
      rest.events.push_back(event);
    }
  }
  if (!rest.pieces.empty()) {
    rest.from_mm = PointOn(rest.pieces.front(), 0.0).p_mm;
  }
  return rest;
}

// What the last setting on the way to an offset within an element asked of the abrasive's feeder, if any did.
std::optional<PathEvent> FlowAt(const std::vector<PathElement>& elements, std::size_t element,
                                double offset_mm) {
  for (std::size_t i = element + 1; i-- > 0;) {
    const std::vector<PathEvent>& events = elements[i].events;
    for (auto event = events.rbegin(); event != events.rend(); ++event) {
      if (event->action == ProcessAction::kAbrasiveFlow && (i < element || event->offset_mm <= offset_mm)) {
        PathEvent flow = *event;
        flow.offset_mm = 0.0;
        return flow;
      }
    }
  }
  return std::nullopt;
}

PathElement PierceAt(const PathElement& run, const MachineDescription& machine) {
  PathElement gate;
  gate.kind = ElementKind::kGate;
  gate.gate = GateKind::kPierce;
  gate.gate_argument = machine.process.pierce_time_s;
  gate.line = run.pieces.empty() ? run.line : run.pieces.front().line;
  gate.from_mm = gate.to_mm = run.from_mm;
  return gate;
}

}  // namespace

std::optional<ProgramPath> PathFrom(const ProgramPath& path, const std::vector<double>& element_begin_s_mm,
                                    double length_mm, const PlanOptions& options,
                                    const MachineDescription& machine) {
  const double wanted = *options.start_from_s_mm;
  std::size_t i = 0;
  while (i < path.elements.size() &&
         (i + 1 < path.elements.size() ? element_begin_s_mm[i + 1] : length_mm) <= wanted) {
    ++i;
  }
  if (i == path.elements.size()) {
    return std::nullopt;
  }
  ProgramPath rest;
  const PathElement& here = path.elements[i];
  const double done = wanted - element_begin_s_mm[i];
  std::optional<PathEvent> flow = FlowAt(path.elements, i, here.length_mm());
  if (here.kind == ElementKind::kRun) {
    const double offset = std::max(0.0, done - options.overlap_mm);
    PathElement run = RunFrom(here, offset);
    flow = FlowAt(path.elements, i, offset);
    if (JetOnAt(here, offset)) {
      rest.elements.push_back(PierceAt(run, machine));
      run.jet_on = true;
    }
    rest.begin_s_mm = element_begin_s_mm[i] + offset;
    rest.start_mm = run.from_mm;
    rest.elements.push_back(std::move(run));
  } else {  // an idle move is not repeated, its end is where the plan begins
    rest.begin_s_mm = i + 1 < path.elements.size() ? element_begin_s_mm[i + 1] : length_mm;
    rest.start_mm = here.to_mm;
  }
  rest.elements.insert(rest.elements.end(), path.elements.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                       path.elements.end());
  if (flow && !rest.elements.empty()) {
    rest.elements.front().events.insert(rest.elements.front().events.begin(), *flow);
  }
  return rest.elements.empty() ? std::nullopt : std::optional<ProgramPath>(std::move(rest));
}

}  // namespace lambdajet::trajectory
