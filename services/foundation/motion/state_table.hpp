// Is what the state machines of both modules have in common: rows (mode, event) -> (mode, action), and how one is found.
//
// Model: guards are decided before an event is named, so that a table has no conditions. A pair that is not in the table is
// refused and changes nothing. Threads: pure. Cost: a search over some tens of rows.
#pragma once

#include <optional>
#include <span>

#include "foundation/motion/module_words.hpp"

namespace lambdajet {

template <typename Action>
struct ModeTransition {
  ModuleMode mode;
  Action action;
  friend bool operator==(const ModeTransition&, const ModeTransition&) = default;
};

template <typename Event, typename Action>
struct ModeRow {
  ModuleMode mode;
  Event event;
  ModeTransition<Action> transition;
};

template <typename Event, typename Action>
std::optional<ModeTransition<Action>> FindTransition(std::span<const ModeRow<Event, Action>> table,
                                                     ModuleMode mode, Event event) {
  for (const ModeRow<Event, Action>& row : table) {
    if (row.mode == mode && row.event == event) {
      return row.transition;
    }
  }
  return std::nullopt;
}

}  // namespace lambdajet
