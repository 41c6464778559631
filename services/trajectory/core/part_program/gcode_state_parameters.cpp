#include <algorithm>
#include <array>
#include <cmath>

#include "trajectory/core/part_program/gcode_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kNearNumber = 1e-9;

struct Fixed {
  std::string_view name;
  double value;
};
// What LinuxCNC programs may ask for and this machine has in one way only.
constexpr std::array<Fixed, 22> kFixed = {{{"_vmajor", 2.9},
                                           {"_vminor", 0.0},
                                           {"_units_per_rev", 0.0},
                                           {"_spindle_rpm_mode", 1.0},
                                           {"_spindle_css_mode", 0.0},
                                           {"_lathe_diameter_mode", 0.0},
                                           {"_lathe_radius_mode", 0.0},
                                           {"_speed_override", 1.0},
                                           {"_feed_override", 1.0},
                                           {"_adaptive_feed", 0.0},
                                           {"_feed_hold", 1.0},
                                           {"_u", 0.0},
                                           {"_v", 0.0},
                                           {"_w", 0.0},
                                           {"_abs_u", 0.0},
                                           {"_abs_v", 0.0},
                                           {"_abs_w", 0.0},
                                           {"_current_pocket", 0.0},
                                           {"_selected_pocket", -1.0},
                                           {"_value", 0.0},
                                           {"_value_returned", 0.0},
                                           {"_remap_level", 0.0}}};

int PlaneCode(ArcPlane plane) { return plane == ArcPlane::kXy ? 170 : plane == ArcPlane::kZx ? 180 : 190; }

double OffsetCode(std::size_t offset) {
  const auto number = static_cast<double>(offset);
  return offset < 6 ? 540.0 + 10.0 * number : 585.0 + number;
}

std::optional<std::size_t> AxisOf(char small_letter) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (kAxisLetters[i] == Upper(small_letter)) {
      return i;
    }
  }
  return std::nullopt;
}

std::optional<double> ModeNamed(const ModalState& state, std::string_view name) {
  const bool metric = state.unit_mm == 1.0;
  const Fixed modes[] = {{"_motion_mode", state.motion == kNoCode ? 800.0 : state.motion},
                         {"_plane", PlaneCode(state.plane) * 1.0},
                         {"_ccomp", state.kerf_code * 1.0},
                         {"_metric", metric ? 1.0 : 0.0},
                         {"_imperial", metric ? 0.0 : 1.0},
                         {"_absolute", state.absolute ? 1.0 : 0.0},
                         {"_incremental", state.absolute ? 0.0 : 1.0},
                         {"_inverse_time", state.inverse_time ? 1.0 : 0.0},
                         {"_units_per_minute", state.inverse_time ? 0.0 : 1.0},
                         {"_coord_system", OffsetCode(state.offset)},
                         {"_tool_offset", state.length_on ? 1.0 : 0.0},
                         {"_retract_r_plane", state.return_to_r ? 1.0 : 0.0},
                         {"_retract_old_z", state.return_to_r ? 0.0 : 1.0},
                         {"_ijk_absolute_mode", state.arc_absolute ? 1.0 : 0.0},
                         {"_spindle_on", state.jet_on || state.turns_per_min != 0.0 ? 1.0 : 0.0},
                         {"_spindle_cw", state.jet_on || state.turns_per_min > 0.0 ? 1.0 : 0.0},
                         {"_current_tool", state.mounted_tool * 1.0},
                         {"_selected_tool", state.selected_tool * 1.0},
                         {"_rpm", state.spindle_per_min},
                         {"_mist", state.abrasive_on ? 1.0 : 0.0},
                         {"_flood", state.abrasive_on ? 1.0 : 0.0},
                         {"_feed", state.feed_per_min}};
  for (const Fixed& mode : modes) {
    if (mode.name == name) {
      return mode.value;
    }
  }
  return std::nullopt;
}

}  // namespace

// By LinuxCNC's numbers.
std::optional<double> Reading::Numbered(int index) const {
  const auto axis = [&](const AxisValues& values, int first, bool written) -> std::optional<double> {
    const auto i = static_cast<std::size_t>(index - first);
    return i >= kAxisCount ? 0.0 : values[i] / (written ? unit(i) : 1.0);
  };
  const auto within = [index](int first, int last) { return index >= first && index <= last; };
  if (!within(5021, 5428)) {
    return std::nullopt;
  }
  if (within(5021, 5029)) {
    return axis(state.position, 5021, true);
  }
  if (within(5081, 5089)) {
    return axis(state.tool, 5081, true);
  }
  if (within(5161, 5169) || within(5181, 5189)) {
    return within(5161, 5169) ? axis(state.home_28, 5161, false) : axis(state.home_30, 5181, false);
  }
  if (index == 5210) {
    return state.shifted ? 1.0 : 0.0;
  }
  if (within(5211, 5219)) {
    return axis(state.saved_shift, 5211, false);
  }
  if (index == 5220) {
    return static_cast<double>(state.offset + 1);
  }
  if (within(5221, 5390)) {
    const int place = (index - 5221) % 20;
    return place >= 9
               ? 0.0
               : axis(state.offsets[static_cast<std::size_t>((index - 5221) / 20)], index - place, false);
  }
  if (within(5420, 5428)) {
    AxisValues relative{};
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      relative[i] = state.position[i] - state.zero[i];
      relative[i] = std::abs(relative[i]) < kNearNumber ? 0.0 : relative[i];
    }
    return axis(relative, 5420, true);
  }
  if (index == 5400) {
    return state.mounted_tool;
  }
  if (index == 5410) {
    const auto tool = tools.find(state.mounted_tool);
    return tool == tools.end() ? 0.0 : 2.0 * tool->second.radius_mm / state.unit_mm;
  }
  return within(5400, 5413) ? std::optional(0.0) : std::nullopt;
}

bool Reading::SetNumbered(int index, double value) {
  const auto within = [index](int first, int last) { return index >= first && index <= last; };
  const auto set = [&](AxisValues& values, int first) {
    if (static_cast<std::size_t>(index - first) < kAxisCount) {
      values[static_cast<std::size_t>(index - first)] = value;
    }
    return true;
  };
  state.waited_for_input = state.waited_for_input && index != kInputResult;
  if (within(5161, 5169)) {
    return set(state.home_28, 5161);
  }
  if (within(5181, 5189)) {
    return set(state.home_30, 5181);
  }
  if (within(5211, 5219)) {
    return set(state.saved_shift, 5211);
  }
  if (within(5221, 5390)) {
    const int place = (index - 5221) % 20;
    return place >= 9 || set(state.offsets[static_cast<std::size_t>((index - 5221) / 20)], index - place);
  }
  return false;
}

std::optional<double> Reading::Named(std::string_view name) const {
  if (name.size() == 2) {
    if (const auto axis = AxisOf(name[1])) {
      return Numbered(5420 + static_cast<int>(*axis));
    }
  }
  if (name.size() == 6 && name.starts_with("_abs_")) {
    if (const auto axis = AxisOf(name[5])) {
      return Numbered(5021 + static_cast<int>(*axis));
    }
  }
  if (name == "_call_level") {
    return static_cast<double>(parameters.depth());
  }
  if (name == "_line") {
    return static_cast<double>(line_number);
  }
  if (const auto mode = ModeNamed(state, name)) {
    return mode;
  }
  const auto* fixed =
      std::find_if(kFixed.begin(), kFixed.end(), [name](const Fixed& f) { return f.name == name; });
  return fixed == kFixed.end() ? std::nullopt : std::optional(fixed->value);
}

}  // namespace lambdajet::trajectory
