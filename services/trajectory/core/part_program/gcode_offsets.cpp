// Work offsets, shifts, tool offsets and stored positions: what moves the zero of the program, and the moves to them.
#include <array>
#include <cmath>

#include "trajectory/core/part_program/gcode_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::array<double, kWorkOffsets> kOffsetNames = {54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3};
constexpr std::string_view kAxisWords = "XYZABC";
constexpr int kMostTools = 999;
constexpr double kWhole = 1e-4;
constexpr double kReach = 10.0;

// Parameters may set what no word could.
bool WithinReach(Reading& r, const AxisValues& values) {
  for (const double v : values) {
    if (!(std::abs(v) <= kReach * r.options.largest_coordinate_mm)) {
      const Group word = r.code(kOnce) != kNoCode ? kOnce : r.code(kOffset) != kNoCode ? kOffset : kLength;
      return r.FaultAt(word, "COORDINATE_TOO_LARGE", "an offset or stored position is at most 1e7 mm");
    }
  }
  return true;
}

bool AddOffsetChange(Reading& r) {
  ModalState& s = r.state;
  s.UpdateZero();
  if (!WithinReach(r, s.zero)) {
    return false;
  }
  Operation& o = r.Add(OperationKind::kWorkOffsetChange);
  constexpr double kDegree = 0.017453292519943295;
  // Parameters may hold offsets of axes that the machine does not have; they move nothing.
  const auto zero = [&](std::size_t axis) { return r.drives(axis) ? s.zero[axis] : 0.0; };
  o.x_W_mm = zero(0);
  o.y_W_mm = zero(1);
  o.z_W_mm = zero(2);
  o.a_rad = kDegree * zero(3);
  o.b_rad = kDegree * zero(4);
  o.c_rad = kDegree * zero(5);
  o.value = kOffsetNames[s.offset];
  return true;
}

// The written values of the line's axis words, one call an axis that is written.
template <class Work>
void EachAxisWord(Reading& r, Work work) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (r.block.has(kAxisLetters[i])) {
      work(i, r.block.Take(kAxisLetters[i]) * r.unit(i));
    }
  }
}

bool Whole(double value, double low, double high) {
  return value >= low && value <= high && std::abs(value - std::round(value)) <= kWhole;
}

// G10 L1: what a tool of G41 and G43 is like.
bool DescribeTool(Reading& r, double p) {
  if (!Whole(p, 1.0, kMostTools)) {
    return r.FaultAt(kOnce, "G10_P_OUT_OF_RANGE", "P of G10 L1 is a tool, 1 … 999");
  }
  JetTool& tool = r.tools[static_cast<int>(std::round(p))];
  if (r.block.has('R')) {
    tool.radius_mm = r.mm(r.block.Take('R'));
  }
  EachAxisWord(r, [&tool](std::size_t i, double written) { tool.offset[i] = written; });
  return true;
}

// G10 L2 sets an offset in W, L20 sets it so that the present point reads as written.
bool SetWorkOffset(Reading& r) {
  const double l = r.block.has('L') ? r.block.Take('L') : 0.0;
  const double p = r.block.has('P') ? r.block.Take('P') : -1.0;
  if (!CoordinatesFinite(r, "XYZABCR")) {
    return false;
  }
  if (l == 1.0) {
    return DescribeTool(r, p);
  }
  if (l != 2.0 && l != 20.0) {
    return r.FaultAt(kOnce, "G10_L_UNKNOWN", "G10 is understood with L1, L2 and L20");
  }
  if (!Whole(p, 0.0, 9.0)) {
    return r.FaultAt(kOnce, "G10_P_OUT_OF_RANGE", "P1 … P9 name G54 … G59.3, P0 the active one");
  }
  if (r.block.has('R')) {
    return r.FaultAt('R', "ROTATION_NOT_SUPPORTED",
                     "work offsets do not turn; the sheet's own angle is found by its marks");
  }
  ModalState& s = r.state;
  const std::size_t place = p < 0.5 ? s.offset : static_cast<std::size_t>(std::round(p)) - 1;
  EachAxisWord(r, [&](std::size_t i, double written) {
    s.offsets[place][i] = l == 2.0 ? written : s.position[i] - s.shift[i] - s.tool[i] - written;
  });
  if (place == s.offset) {
    s.origin = s.offsets[place];
  }
  return AddOffsetChange(r);
}

bool NeedsAxis(Reading& r, Group group, std::string_view reason, const char* message) {
  return r.HasAxisWords() || r.FaultAt(group, reason, message);
}

// G92: the present point reads as written; G52: the shift itself is written.
bool ShiftOrigin(Reading& r, bool local) {
  if (!NeedsAxis(r, kOnce, local ? "G52_AXIS_MISSING" : "G92_AXIS_MISSING", "an axis word is missing") ||
      !CoordinatesFinite(r, kAxisWords)) {
    return false;
  }
  ModalState& s = r.state;
  EachAxisWord(r, [&s, local](std::size_t i, double written) {
    s.shift[i] = local ? written : s.position[i] - s.origin[i] - s.tool[i] - written;
  });
  s.saved_shift = s.shift;
  s.shifted = true;
  return AddOffsetChange(r);
}

bool Once(Reading& r) {
  ModalState& s = r.state;
  switch (r.code(kOnce)) {
    case 100:
      return SetWorkOffset(r);
    case 520:
      return ShiftOrigin(r, true);
    case 920:
      return ShiftOrigin(r, false);
    case 921:
      s.saved_shift = {};
      [[fallthrough]];
    case 922:
      s.shift = {};
      s.shifted = false;
      return AddOffsetChange(r);
    case 923:
      s.shift = s.saved_shift;
      s.shifted = true;
      return AddOffsetChange(r);
    default:
      return true;
  }
}

bool ToolLength(Reading& r) {
  const int g = r.code(kLength);
  ModalState& s = r.state;
  if (g == 490) {
    const bool change = s.tool != AxisValues{};
    s.tool = {};
    s.length_on = false;
    return !change || AddOffsetChange(r);
  }
  if (!r.drives(2)) {
    r.block.used |= r.options.leave_out_z ? LetterBit('H') : 0u;
    return r.options.leave_out_z ||
           r.FaultAt(kLength, "AXIS_NOT_DRIVEN", "this machine does not move Z; there is no tool length");
  }
  if (g == 431) {
    if (!NeedsAxis(r, kLength, "G43_AXIS_MISSING", "G43.1 needs an axis word")) {
      return false;
    }
    EachAxisWord(r, [&s](std::size_t i, double written) { s.tool[i] = written; });
  } else {
    const double h = r.block.has('H') ? r.block.Take('H') : s.mounted_tool;
    const auto tool =
        Whole(h, 0.0, kMostTools) ? r.tools.find(static_cast<int>(std::round(h))) : r.tools.end();
    if (tool == r.tools.end()) {
      const char* should =
          "H, or the mounted tool, needs a length: G10 L1 describes tools other than 0 and 1";
      return r.block.has('H') ? r.FaultAt('H', "TOOL_UNKNOWN", should)
                              : r.FaultAt(kLength, "TOOL_UNKNOWN", should);
    }
    s.tool = tool->second.offset;
  }
  s.length_on = true;
  return AddOffsetChange(r);
}

// By way of the written point to the stored one; without axis words all axes go there.
bool ReturnTo(Reading& r, const AxisValues& home) {
  if (!CoordinatesFinite(r, kAxisWords) || !WithinReach(r, home)) {
    return false;
  }
  AxisValues end = r.state.position;
  const bool some = r.HasAxisWords();
  const std::uint32_t written = r.block.present;
  if (some && !TraverseTo(r, Target(r))) {
    return false;
  }
  end = r.state.position;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (r.drives(i) && (!some || (written & LetterBit(kAxisLetters[i])) != 0)) {
      end[i] = home[i];
    }
  }
  return TraverseTo(r, end);
}

}  // namespace

bool ChangeOffsets(Reading& r) {
  if (r.code(kLength) != kNoCode && !ToolLength(r)) {
    return false;
  }
  if (r.code(kOffset) != kNoCode) {
    const int g = r.code(kOffset);
    const auto offset = static_cast<std::size_t>(g <= 590 ? (g - 540) / 10 : 5 + (g - 590));
    // Parameters that were set since it was selected count from when it is selected out of another.
    if (offset != r.state.offset) {
      r.state.origin = r.state.offsets[offset];
    }
    r.state.offset = offset;
    if (!AddOffsetChange(r)) {
      return false;
    }
  }
  return Once(r);
}

bool GoToReference(Reading& r) {
  switch (r.code(kOnce)) {
    case 280:
      return ReturnTo(r, r.state.home_28);
    case 281:
      r.state.home_28 = r.state.position;
      return true;
    case 300:
      return ReturnTo(r, r.state.home_30);
    case 301:
      r.state.home_30 = r.state.position;
      return true;
    default:
      return true;
  }
}

}  // namespace lambdajet::trajectory
