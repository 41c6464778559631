#include "trajectory/core/part_program/gcode_doubt.hpp"

#include <algorithm>
#include <cmath>

#include "trajectory/core/part_program/gcode_reading.hpp"
#include "trajectory/core/part_program/gcode_scan.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr Doubt kShapeDoubt = kPlaceDoubt | kMotionDoubt | kPlaneDoubt | kUnitsDoubt | kDistanceDoubt;

struct Row {
  std::string_view reason;  // or how it begins
  Doubt rests_on, leaves;
};
// The first row that fits.
constexpr Row kRows[] = {
    {"ARC_CENTER_MISSING", kMotionDoubt | kPlaneDoubt, kMotionDoubt},
    {"ARC_CENTER_AND_RADIUS", kMotionDoubt, 0},
    {"ARC_TURNS", kMotionDoubt, 0},
    {"ARC_WORD_NOT_OF_PLANE", kMotionDoubt | kPlaneDoubt, 0},
    {"ARC_", kShapeDoubt, 0},
    {"COORDINATE_TOO_LARGE", kUnitsDoubt | kDistanceDoubt, 0},
    {"CYCLE_AXIS_NOT_DRIVEN", kMotionDoubt, kMotionDoubt},
    {"CYCLE_PLANE", kMotionDoubt | kPlaneDoubt, kMotionDoubt},
    {"CYCLE_INVERSE_TIME", kMotionDoubt | kFeedDoubt, kMotionDoubt},
    {"CYCLE_WORD_MISSING", kMotionDoubt | kCycleDoubt, kCycleDoubt},
    {"CYCLE_", kShapeDoubt | kCycleDoubt, kCycleDoubt},
    {"FEED_MISSING", kMotionDoubt | kFeedDoubt, kFeedDoubt},
    {"FEED_", 0, kFeedDoubt},
    {"G10_", 0, kPlaceDoubt | kToolDoubt},
    {"G43_", 0, kPlaceDoubt},
    {"G52_", 0, kPlaceDoubt},
    {"G53_INCREMENTAL", kDistanceDoubt, 0},
    {"G53_WITHOUT_LINE", kMotionDoubt, kPlaceDoubt},
    {"G92_", 0, kPlaceDoubt},
    {"JET_ALREADY_ON", kJetDoubt, 0},
    {"KERF_ALREADY_ON", kKerfDoubt, 0},
    {"KERF_EXIT", kKerfDoubt | kMotionDoubt, 0},
    {"KERF_PLANE", kPlaneDoubt, kKerfDoubt},
    {"KERF_WIDTH", kUnitsDoubt | kToolDoubt, kKerfDoubt},
    {"KERF_", 0, kKerfDoubt},
    {"LINE_TOO_LONG", 0, kEveryDoubt | kEndDoubt},
    {"MEASURE_WITH_JET_ON", kJetDoubt, kJetDoubt},
    {"MODAL_GROUP_TWICE", 0, kEveryDoubt},
    {"MOTION_MODE_MISSING", kMotionDoubt, kMotionDoubt},
    {"NOT_WITH_KERF_ON", kKerfDoubt, 0},
    {"OUTPUT_", 0, kJetDoubt},
    {"PLANE_NOT_DRIVEN", 0, kPlaneDoubt},
    {"ROTATION_", 0, kPlaceDoubt},
    {"SPINDLE_SPEED_MISSING", kSpeedDoubt, kSpeedDoubt},
    {"SPINDLE_SPEED", 0, kSpeedDoubt},
    {"SPLINE_CONTROL_MISSING", kMotionDoubt | kSplineDoubt, kSplineDoubt},
    {"SPLINE_", kMotionDoubt | kPlaneDoubt, 0},
    {"TOOL_NOT_SELECTED", kToolDoubt, 0},
    {"TOOL_NUMBER", 0, kToolDoubt},
    {"TOOL_UNKNOWN", kToolDoubt, kKerfDoubt | kPlaceDoubt},
    {"TRAVERSE_WITH_JET_ON", kJetDoubt | kMotionDoubt, kJetDoubt},
    {"UNKNOWN_CODE", 0, kEveryDoubt},
    {"UNKNOWN_G_CODE", 0, kMotionDoubt},
    {"UNKNOWN_M_CODE", 0, kJetDoubt | kSpeedDoubt},
    {"WORD_WITHOUT_USE", kMotionDoubt, 0},
};

const Row* RowOf(std::string_view reason) {
  const auto* row = std::find_if(std::begin(kRows), std::end(kRows),
                                 [reason](const Row& r) { return reason.starts_with(r.reason); });
  return row == std::end(kRows) ? nullptr : row;
}

constexpr double kSlowestFeed = 1e-6;
constexpr double kFastestFeed = 1e9;

// What the words of a line that was not obeyed say of the state behind it.
class Meaning {
 public:
  Meaning(Reading& r, bool whole_line_read) : r_(r), s_(r.state) {
    if (!whole_line_read) {
      ReadOn();
    }
  }

  void Take() {
    for (int i = 0; i < r_.block.g_count; ++i) {
      G(r_.block.g[static_cast<std::size_t>(i)].tenfold);
    }
    for (int i = 0; i < r_.block.m_count; ++i) {
      M(r_.block.m[static_cast<std::size_t>(i)].tenfold);
    }
    Feed();
    Place();
    r_.doubt |= Lost('S', kSpeedDoubt) | Lost('T', kToolDoubt);
    if (r_.block.has('T') && IsTool(r_.block.at('T'))) {
      s_.selected_tool = static_cast<int>(r_.block.at('T'));
    }
    r_.doubt |= s_.motion == 50 ? kSplineDoubt : 0u;
    r_.doubt |= s_.motion >= 810 ? kCycleDoubt : 0u;
  }

 private:
  Doubt Lost(char letter, Doubt doubt) const { return (lost_ & LetterBit(letter)) != 0 ? doubt : 0u; }

  // The letters of the whole line; comments are left out.
  void ReadOn() {
    LineScan scan(r_.line);
    while (scan.Next() != ';' && !scan.AtEnd()) {
      const char c = scan.Next();
      const auto column = static_cast<std::uint32_t>(scan.at() + 1);
      scan.Step();
      if (c == '(') {
        scan.GoTo(std::min(scan.line().find(')', scan.at()), scan.line().size()));
      } else if (c == 'G' || c == 'M') {
        ReadCode(scan, c, column);
      } else if (c >= 'A' && c <= 'Z' && !r_.block.has(c)) {
        lost_ |= LetterBit(c);
      }
    }
  }

  void ReadCode(LineScan& scan, char letter, std::uint32_t column) {
    auto& codes = letter == 'G' ? r_.block.g : r_.block.m;
    int& count = letter == 'G' ? r_.block.g_count : r_.block.m_count;
    for (int i = 0; i < count; ++i) {
      if (codes[static_cast<std::size_t>(i)].column == column) {
        return;
      }
    }
    double value = 0.0;
    if (count == kMaxCodesPerLine || !scan.Number(value, scan.at()) || !(value >= 0.0 && value < 1000.0)) {
      r_.doubt |= kEveryDoubt | kEndDoubt;
      return;
    }
    codes[static_cast<std::size_t>(count++)] = {static_cast<int>(std::round(10.0 * value)), column};
  }

  void G(int g) {
    switch (GroupOfCode('G', g)) {
      case kMotion:
        s_.motion = g;
        r_.doubt &= ~kMotionDoubt;
        break;
      case kPlane:
        Plane(g);
        break;
      case kUnits:
        s_.unit_mm = g == 200 ? kInchMm : 1.0;
        r_.doubt &= ~kUnitsDoubt;
        break;
      case kDistance:
        s_.absolute = g == 900;
        r_.doubt &= ~kDistanceDoubt;
        break;
      case kArcDistance:
        s_.arc_absolute = g == 901;
        break;
      case kFeedMode:
        s_.inverse_time = g == 930;
        break;
      case kReturnMode:
        s_.return_to_r = g == 990;
        break;
      case kKerf:
        Kerf(g);
        break;
      case kOffset:
        Offset(g);
        break;
      case kOnce:
        Once(g);
        break;
      case kLength:
        r_.doubt |= kPlaceDoubt;
        break;
      case kNoCode:
        Unknown(g);
        break;
      default:
        break;
    }
  }

  // It may be a motion of its own, a shift of the zero, another meaning of F.
  void Unknown(int g) {
    r_.doubt |= kMotionDoubt | (g >= 950 && g <= 970 ? kFeedDoubt : 0u);
    if (r_.HasAxisWords()) {
      r_.doubt |= kPlaceDoubt;
      taken_ = true;
    }
  }

  // One that the machine does not have is refused where it is obeyed.
  void Plane(int g) {
    const bool driven = g == 170 || r_.drives(2);
    s_.plane = g == 170 || !driven ? ArcPlane::kXy : g == 180 ? ArcPlane::kZx : ArcPlane::kYz;
    r_.doubt = driven ? r_.doubt & ~kPlaneDoubt : r_.doubt | kPlaneDoubt;
  }

  void Kerf(int g) {
    if (g == 400) {
      s_.kerf_code = g;
      s_.kerf_offset_mm = 0.0;
      s_.kerf_ends = false;
      r_.doubt &= ~kKerfDoubt;
    } else if (s_.kerf_code == 400) {
      r_.doubt |= kKerfDoubt;
    }
  }

  void Offset(int g) {
    s_.offset = static_cast<std::size_t>(g <= 590 ? (g - 540) / 10 : 5 + (g - 590));
    s_.origin = s_.offsets[s_.offset];
    s_.UpdateZero();
  }

  void Once(int g) {
    if (g == 530) {
      machine_ = true;
    } else if (g != 40) {
      taken_ = true;
      r_.doubt |= kPlaceDoubt | (g == 100 ? kToolDoubt : 0u);
    }
  }

  void M(int m) {
    switch (GroupOfCode('M', m)) {
      case kJet:
        s_.jet_on = s_.abrasive_on = m != 50 && !r_.has_spindle();
        r_.doubt &= ~kJetDoubt;
        break;
      case kTool:
        s_.jet_on = s_.abrasive_on = false;
        r_.doubt &= ~kJetDoubt;
        break;
      case kOutput:
        r_.doubt |= m <= 650 ? kJetDoubt : 0u;
        break;
      case kStopping:
        r_.ended = r_.ended || m >= 20;
        break;
      case kCallWord:
        r_.ended = r_.ended || m == 990;
        r_.doubt |= kEveryDoubt;
        break;
      case kNoCode:
        r_.doubt |= LeavesInDoubt("UNKNOWN_M_CODE");
        break;
      default:
        break;
    }
  }

  void Feed() {
    r_.doubt |= Lost('F', kFeedDoubt);
    if (r_.block.has('F') && r_.block.at('F') >= kSlowestFeed && r_.block.at('F') <= kFastestFeed) {
      s_.feed_per_min = r_.block.at('F');
      s_.feed_mm_per_s = s_.feed_per_min * s_.unit_mm / kSecondsPerMinute;
      s_.feed_deg_per_s = s_.feed_per_min / kSecondsPerMinute;
      r_.doubt &= ~kFeedDoubt;
    }
  }

  // A drilling cycle ends at the height it began from.
  void Place() {
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const char letter = kAxisLetters[i];
      r_.doubt |= Lost(letter, 1u << i);
      if (r_.moved || taken_ || !r_.block.has(letter) || !r_.drives(i) || (i == 2 && s_.motion >= 810)) {
        continue;
      }
      s_.kerf_ends = false;
      const double zero = machine_ ? 0.0 : s_.absolute ? s_.zero[i] : s_.position[i];
      const double written = r_.block.at(letter) * r_.unit(i);
      if (!(std::abs(written) <= r_.options.largest_coordinate_mm)) {
        r_.doubt |= 1u << i;
        continue;
      }
      s_.position[i] = zero + written;
      r_.SettlePlace(i);
    }
  }

  Reading& r_;
  ModalState& s_;
  std::uint32_t lost_ = 0;  // letters whose values are not known
  bool taken_ = false;      // the axis words, by a word that is no motion
  bool machine_ = false;    // G53
};

}  // namespace

Doubt RestsOn(std::string_view reason) {
  const Row* row = RowOf(reason);
  return row == nullptr ? 0 : row->rests_on;
}

Doubt LeavesInDoubt(std::string_view reason) {
  const Row* row = RowOf(reason);
  return row == nullptr ? 0 : row->leaves;
}

void SettleModes(Reading& r) {
  const int motion = r.code(kMotion);
  const auto settle = [&r](bool settled, Doubt doubt) { r.doubt &= settled ? ~doubt : ~0u; };
  settle(motion != kNoCode, kMotionDoubt);
  settle(motion != kNoCode && motion < 810, kCycleDoubt);
  settle(r.block.has('Z') && r.block.has('R'), kCycleDoubt);
  settle(r.block.has('I') && r.block.has('J'), kSplineDoubt);
  settle(r.code(kPlane) != kNoCode, kPlaneDoubt);
  settle(r.code(kUnits) != kNoCode, kUnitsDoubt);
  settle(r.code(kDistance) != kNoCode, kDistanceDoubt);
  settle(r.block.has('F'), kFeedDoubt);
}

void SettleSwitches(Reading& r) {
  const auto settle = [&r](bool settled, Doubt doubt) { r.doubt &= settled ? ~doubt : ~0u; };
  settle(r.code(kJet) != kNoCode, kJetDoubt);
  settle(r.code(kKerf) == 400, kKerfDoubt);
  settle(r.block.has('S'), kSpeedDoubt);
}

void TakeAtItsWords(Reading& r, bool whole_line_read) {
  Meaning(r, whole_line_read).Take();
  r.doubt |= r.left_in_doubt;
}

}  // namespace lambdajet::trajectory
