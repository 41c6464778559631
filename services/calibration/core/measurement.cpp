#include "calibration/core/measurement.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

#include "calibration/core/look_model.hpp"

namespace lambdajet::calibration {
namespace {

bool Finite(const Measurement& m) {
  return m.p_C_mm.allFinite() && m.actuator_position_mm.allFinite() &&
         m.actuator_velocity_mm_per_s.allFinite() && m.actuator_acceleration_mm_per_s2.allFinite() &&
         m.pierce_actuator_position_mm.allFinite();
}

bool Known(const MachineDescription& machine, const Measurement& m) {
  if (IsHole(m)) {
    return true;
  }
  return std::any_of(machine.marks.begin(), machine.marks.end(),
                     [&](const SheetMark& s) { return s.id == m.mark; });
}

bool Reached(const MachineDescription& machine, const Measurement& m) {
  return PlaceEffector(machine, machine.parameters, m.actuator_position_mm).closed &&
         (!IsHole(m) || PlaceEffector(machine, machine.parameters, m.pierce_actuator_position_mm).closed);
}

// Everything that can differ, so that the order of arrival never matters.
auto Key(const Measurement& m) {
  return std::make_tuple(m.exposure_ns, m.mark, static_cast<int>(m.kind), m.p_C_mm.x(), m.p_C_mm.y(),
                         m.actuator_position_mm.x(), m.actuator_position_mm.y());
}

// Tracking runs too short to swing leave the order.
void DropShortRuns(const std::vector<Measurement>& run, UsableRun& usable) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < usable.order.size();) {
    std::size_t end = i + 1;
    const bool tracking = run[usable.order[i]].kind == LookKind::kTracking;
    while (tracking && end < usable.order.size() &&
           SameRun(run[usable.order[end - 1]], run[usable.order[end]])) {
      ++end;
    }
    const bool too_short = tracking && end - i < kShortestRun;
    for (; i < end; ++i) {
      if (too_short) {
        usable.refused.push_back({usable.order[i], LookRefusal::kSparseTracking});
      } else {
        kept.push_back(usable.order[i]);
      }
    }
  }
  usable.order = std::move(kept);
}

}  // namespace

bool SameRun(const Measurement& earlier, const Measurement& later) {
  const double gap_s = static_cast<double>(later.exposure_ns - earlier.exposure_ns) * 1e-9;
  return earlier.kind == LookKind::kTracking && later.kind == LookKind::kTracking &&
         earlier.mark == later.mark && gap_s > 0.0 && gap_s <= kLongestGapS;
}

LookKind KindOf(std::uint32_t gate, int mark) {
  if (gate == 0) {
    return LookKind::kTracking;
  }
  return mark > kFirstHole ? LookKind::kHole : LookKind::kStill;
}

std::string_view KindName(LookKind kind) {
  constexpr std::array<std::string_view, 3> kNames = {"still", "tracking", "hole"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string_view LookRefusalName(LookRefusal refusal) {
  constexpr std::array<std::string_view, 6> kNames = {"NOT_SEEN",     "NOT_FINITE", "UNKNOWN_MARK",
                                                      "OUT_OF_REACH", "DUPLICATE",  "SPARSE_TRACKING"};
  return kNames[static_cast<std::size_t>(refusal)];
}

UsableRun SelectUsable(const MachineDescription& machine, const std::vector<Measurement>& run) {
  UsableRun usable;
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; i < run.size(); ++i) {
    const Measurement& m = run[i];
    if (!m.seen) {
      usable.refused.push_back({i, LookRefusal::kNotSeen});
    } else if (!Finite(m)) {
      usable.refused.push_back({i, LookRefusal::kNotFinite});
    } else if (!Known(machine, m)) {
      usable.refused.push_back({i, LookRefusal::kUnknownMark});
    } else if (!Reached(machine, m)) {
      usable.refused.push_back({i, LookRefusal::kOutOfReach});
    } else {
      candidates.push_back(i);
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](std::size_t a, std::size_t b) { return Key(run[a]) < Key(run[b]); });
  for (const std::size_t i : candidates) {
    if (!usable.order.empty() && Key(run[usable.order.back()]) == Key(run[i])) {
      usable.refused.push_back({i, LookRefusal::kDuplicate});
    } else {
      usable.order.push_back(i);
    }
  }
  DropShortRuns(run, usable);
  return usable;
}

}  // namespace lambdajet::calibration
