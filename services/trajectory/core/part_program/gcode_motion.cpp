// Straight motions, and what all motions share: targets, feeds, traverses.
#include <cmath>

#include "trajectory/core/part_program/gcode_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::uint32_t kRotaryWords = LetterBit('A') | LetterBit('B') | LetterBit('C');
constexpr double kShortest_mm = 1e-9;

double Distance(const AxisValues& a, const AxisValues& b, std::size_t from, std::size_t to) {
  double sum = 0.0;
  for (std::size_t i = from; i < to; ++i) {
    sum += (a[i] - b[i]) * (a[i] - b[i]);
  }
  return std::sqrt(sum);
}

bool FeedLine(Reading& r, const AxisValues& end) {
  if (!HasFeed(r)) {
    return false;
  }
  if (!r.state.inverse_time && (r.block.present & kRotaryWords) == 0) {
    r.Move(OperationKind::kFeedLine, end);
    return true;
  }
  const double length_mm = Distance(r.state.position, end, 0, kLinearAxes);
  const double turned_deg = Distance(r.state.position, end, kLinearAxes, kAxisCount);
  SetPace(r, r.Move(OperationKind::kFeedLine, end), length_mm, turned_deg);
  return true;
}

bool InMachineCoordinates(Reading& r) { return r.code(kOnce) == 530; }

// G53 wants G0 or G1 and absolute words.
bool MachineCoordinatesFit(Reading& r) {
  if (r.state.motion != 0 && r.state.motion != 10) {
    return r.FaultAt(kOnce, "G53_WITHOUT_LINE", "G53 stands with G0 or G1");
  }
  return r.state.absolute || r.FaultAt(kOnce, "G53_INCREMENTAL", "G53 needs G90");
}

// Whether a motion word of this kind, with no axis word beside it, moves all the same.
bool MovesWithoutAxes(const Reading& r, int motion) {
  const bool arc = motion == 20 || motion == 30;
  return (arc && (r.code(kMotion) != kNoCode || r.block.has('I') || r.block.has('J') || r.block.has('K'))) ||
         (r.code(kMotion) != kNoCode && motion != 0 && motion != 10 && motion != 800);
}

// After G40 the jet goes back to the contour along a straight line.
bool KerfEnds(Reading& r, int motion) {
  if (!r.state.kerf_ends) {
    return true;
  }
  if (motion != 0 && motion != 10) {
    return r.FaultAtMotion("KERF_EXIT_NOT_LINE", "the first motion after G40 is G0 or G1");
  }
  r.state.kerf_ends = false;
  return true;
}

bool Obey(Reading& r) {
  switch (r.state.motion) {
    case 0:
      return TraverseTo(r, Target(r));
    case 10:
      return FeedLine(r, Target(r));
    case 20:
      return ObeyArc(r, -1.0);
    case 30:
      return ObeyArc(r, 1.0);
    case 50:
      return ObeySpline(r, true);
    case 51:
      return ObeySpline(r, false);
    case 810:
    case 820:
    case 830:
      return ObeyCycle(r);
    default:
      return r.FaultAtMotion("MOTION_MODE_MISSING", "G0, G1, G2 or G3 must stand before or in this line");
  }
}

}  // namespace

bool CoordinatesFinite(Reading& r, std::string_view letters) {
  for (const char letter : letters) {
    if (r.block.has(letter) && !(std::abs(r.mm(r.block.at(letter))) <= r.options.largest_coordinate_mm)) {
      return r.FaultAt(letter, "COORDINATE_TOO_LARGE", "a coordinate is at most 1e6 mm");
    }
  }
  return true;
}

bool HasFeed(Reading& r) {
  if (r.state.inverse_time) {
    return r.block.has('F') ||
           r.FaultAtMotion("FEED_MISSING", "with G93 every line that cuts has its own F, one over minutes");
  }
  return r.state.feed_mm_per_s > 0.0 ||
         r.FaultAtMotion("FEED_MISSING", "F must stand before or in the first line that cuts");
}

AxisValues Target(Reading& r) {
  AxisValues end = r.state.position;
  const bool machine = InMachineCoordinates(r);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!r.block.has(kAxisLetters[i])) {
      continue;
    }
    const double written = r.block.Take(kAxisLetters[i]) * r.unit(i);
    const double zero = machine ? 0.0 : r.state.absolute ? r.state.zero[i] : r.state.position[i];
    end[i] = zero + written;
    r.SettlePlace(i);
  }
  return end;
}

bool TraverseTo(Reading& r, const AxisValues& end) {
  if (r.state.jet_on) {
    return r.code(kOnce) == 280 || r.code(kOnce) == 300
               ? r.FaultAt(kOnce, "TRAVERSE_WITH_JET_ON", "the jet is on; switch it off with M5")
               : r.FaultAtMotion("TRAVERSE_WITH_JET_ON",
                                 "the jet is on; switch it off with M5 or cut with G1");
  }
  r.Move(OperationKind::kTraverse, end);
  return true;
}

void FeedFits(Reading& r, double feed_mm_per_s) {
  if (!(feed_mm_per_s <= kFastestFeed_mm_per_s)) {
    r.FaultAt('F', "FEED_OUT_OF_RANGE", "a feed is at most 1e7 mm/s");
  }
}

void SetPace(Reading& r, Operation& o, double length_mm, double turned_deg) {
  const bool moves = length_mm > kShortest_mm;
  if (r.state.inverse_time) {
    const double duration_s = kSecondsPerMinute / r.state.feed_per_min;
    o.feed_mm_per_s = moves ? length_mm / duration_s : 0.0;
    FeedFits(r, o.feed_mm_per_s);
    o.value = moves ? 0.0 : duration_s;
  } else if (!moves && turned_deg > 0.0) {
    o.feed_mm_per_s = 0.0;
    o.value = turned_deg / r.state.feed_deg_per_s;
  }
}

bool ObeyMotion(Reading& r) {
  ModalState& s = r.state;
  const bool taken = r.AxesTaken();
  const int word = r.code(kMotion);
  if (taken && word != kNoCode && word != 800) {
    return r.FaultAtMotion("AXES_TAKEN_TWICE",
                           "G10, G28, G30, G43.1, G52 and G92 take the axis words of their line; write the "
                           "motion in the next line");
  }
  if (word != kNoCode) {
    s.cycle.active = s.cycle.active && word > 800 && s.motion > 800;
    s.spline_end = word == 50 && s.motion == 50 ? s.spline_end : std::nullopt;
    s.motion = word;
  }
  const bool axes = !taken && r.HasAxisWords();
  if (InMachineCoordinates(r) && !MachineCoordinatesFit(r)) {
    return false;
  }
  if (taken || (!axes && !MovesWithoutAxes(r, s.motion))) {
    return true;
  }
  if (word == kNoCode && (r.doubt & kMotionDoubt) != 0) {
    return false;
  }
  return CoordinatesFinite(r, "XYZABCIJKR") && KerfEnds(r, s.motion) && Obey(r);
}

}  // namespace lambdajet::trajectory
