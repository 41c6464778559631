// Obeys one block in LinuxCNC's order of execution: comment, feed mode, feed, outputs, jet, abrasive, words of the machine,
// dwell, plane, units, kerf, length, work offset, path mode, distance, return mode, reference and offsets, motion, stop.
#include <algorithm>
#include <bit>
#include <cmath>

#include "trajectory/core/part_program/gcode_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kLongestPierce_s = 600.0;
constexpr double kLongestDwell_s = 3600.0;
constexpr double kLargestTolerance_mm = 10.0;
constexpr double kSlowestFeed = 1e-6;  // units a minute, or one over minutes
constexpr double kFastestFeed = 1e9;
constexpr double kMostMarks = 1e6;
constexpr double kMostRepeats = 9999.0;
constexpr double kWhole = 1e-4;

int GroupOfG(int tenfold) {
  switch (tenfold) {
    case 0:
    case 10:
    case 20:
    case 30:
    case 50:
    case 51:
    case 800:
    case 810:
    case 820:
    case 830:
      return kMotion;
    case 40:
    case 100:
    case 280:
    case 281:
    case 300:
    case 301:
    case 520:
    case 530:
    case 920:
    case 921:
    case 922:
    case 923:
      return kOnce;
    case 170:
    case 180:
    case 190:
      return kPlane;
    case 200:
    case 210:
      return kUnits;
    case 400:
    case 410:
    case 411:
    case 420:
    case 421:
      return kKerf;
    case 430:
    case 431:
    case 490:
      return kLength;
    case 540:
    case 550:
    case 560:
    case 570:
    case 580:
    case 590:
    case 591:
    case 592:
    case 593:
      return kOffset;
    default:
      return kNoCode;
  }
}

int ModeGroupOfG(int tenfold) {
  switch (tenfold) {
    case 610:
    case 611:
    case 640:
      return kPathMode;
    case 900:
    case 910:
      return kDistance;
    case 901:
    case 911:
      return kArcDistance;
    case 930:
    case 940:
      return kFeedMode;
    case 980:
    case 990:
      return kReturnMode;
    default:
      return GroupOfG(tenfold);
  }
}

int GroupOfM(int tenfold) {
  switch (tenfold) {
    case 0:
    case 10:
    case 20:
    case 300:
      return kStopping;
    case 60:
    case 610:
      return kTool;
    case 30:
    case 40:
    case 50:
      return kJet;
    case 70:
    case 80:
    case 90:
      return kAbrasive;
    case 620:
    case 630:
    case 640:
    case 650:
    case 660:
    case 670:
    case 680:
      return kOutput;
    case 980:
    case 990:
      return kCallWord;
    case 1000:
    case 1010:
    case 1020:
      return kMachineWord;
    default:
      return kNoCode;
  }
}

// Words a shop may well write that this reader refuses, with what to write instead.
const char* AdviceOnG(int tenfold) {
  switch (tenfold) {
    case 52:
    case 53:
      return "write NURBS as G5, G1, G2 and G3";
    case 950:
      return "feed is in units a minute, G94, or inverse time, G93";
    case 960:
      return "S is in turns a minute, G97";
    case 382:
    case 383:
    case 384:
    case 385:
      return "there is no touch probe; M100 looks at a mark of the sheet";
    case 70:
      return "there is no lathe's diameter mode";
    case 730:
    case 740:
    case 760:
    case 840:
    case 850:
    case 860:
    case 870:
    case 880:
    case 890:
      return "of the drilling cycles G81, G82 and G83 are obeyed";
    default:
      return "not a word of this machine; see the table of supported words";
  }
}

// ---- which words stand in the line ----

// Radius mode, S in turns a minute, overrides on: what this machine is in always.
bool StatesTheOnlyMode(char letter, int tenfold) {
  return letter == 'G' ? tenfold == 80 || tenfold == 970 : tenfold == 480;
}

bool Sort(Reading& r, Code c, int group, char letter) {
  if (StatesTheOnlyMode(letter, c.tenfold)) {
    return true;
  }
  r.columns[0] = c.column;  // for the faults below; the motion word overwrites it
  if (group == kNoCode) {
    r.FaultAt(kMotion, letter == 'G' ? "UNKNOWN_G_CODE" : "UNKNOWN_M_CODE",
              letter == 'G' ? AdviceOnG(c.tenfold)
                            : "not a word of this machine; see the table of supported words");
    return true;  // for the faults of the words behind
  }
  const auto g = static_cast<std::size_t>(group);
  if (group == kMotion && (c.tenfold == 800 || r.codes[g] == 800)) {  // G80 beside a motion word yields to it
    r.codes[g] = r.codes[g] == 800 || r.codes[g] == kNoCode ? c.tenfold : r.codes[g];
    return true;
  }
  if (r.codes[g] != kNoCode) {
    return r.FaultAt(kMotion, "MODAL_GROUP_TWICE",
                     "two words of one modal group contradict each other in this line; write them in two");
  }
  r.codes[g] = c.tenfold;
  r.columns[g] = c.column;
  return true;
}

bool SortCodes(Reading& r) {
  r.codes.fill(kNoCode);
  std::uint32_t motion_column = 0;
  for (int i = 0; i < r.block.g_count; ++i) {
    const Code c = r.block.g[static_cast<std::size_t>(i)];
    const int group = GroupOfCode('G', c.tenfold);
    if (!Sort(r, c, group, 'G')) {
      return false;
    }
    motion_column = group == kMotion && r.code(kMotion) == c.tenfold ? c.column : motion_column;
  }
  for (int i = 0; i < r.block.m_count; ++i) {
    const Code c = r.block.m[static_cast<std::size_t>(i)];
    if (!Sort(r, c, GroupOfCode('M', c.tenfold), 'M')) {
      return false;
    }
  }
  r.columns[kMotion] = motion_column;
  return r.left_in_doubt == 0;
}

bool TakesP(int motion) { return motion == 20 || motion == 30 || motion == 50 || motion == 820; }

bool NotShared(Reading& r, int takers, char letter, std::string_view reason) {
  return takers < 2 || !r.block.has(letter) ||
         r.FaultAt(letter, reason,
                   std::string("two words of this line could take this ") + letter +
                       "; write them in lines of their own");
}

// Which words of this line want a P, a Q or an L; more than one would have to share it.
bool OneTakesEach(Reading& r) {
  const int once = r.code(kOnce), machine = r.code(kMachineWord), output = r.code(kOutput);
  const bool modal = r.code(kMotion) == kNoCode && r.HasAxisWords() && !r.AxesTaken();
  const int motion = modal ? r.state.motion : r.code(kMotion);
  const int path = r.code(kPathMode) == 640, call = r.code(kCallWord) == 980;
  const int p = (once == 40) + (once == 100) +
                (!r.has_spindle() && (r.code(kJet) == 30 || r.code(kJet) == 40)) +
                (output != kNoCode && output < 670) + (machine == 1000 || machine == 1010) + path + call +
                TakesP(motion);
  const int q = (output >= 660) + (r.code(kTool) == 610) + path + (motion == 50 || motion == 830);
  const int l = (output == 660) + (once == 100) + call + (motion >= 810);
  return NotShared(r, p, 'P', "P_AMBIGUOUS") && NotShared(r, q, 'Q', "Q_AMBIGUOUS") &&
         NotShared(r, l, 'L', "L_AMBIGUOUS");
}

// What LinuxCNC refuses while compensation is on; G40 in the same line comes before what follows it in the order above.
bool KerfAllows(Reading& r) {
  if (r.state.kerf_code == 400) {
    return true;
  }
  const auto refuse = [&r](Group group) {
    return r.FaultAt(group, "NOT_WITH_KERF_ON", "G40 must stand before");
  };
  if (r.code(kPlane) != kNoCode && r.code(kPlane) != 170) {
    return refuse(kPlane);
  }
  if (r.code(kUnits) != kNoCode && (r.code(kUnits) == 210) != (r.state.unit_mm == 1.0)) {
    return refuse(kUnits);
  }
  if (r.code(kKerf) == 400) {
    return true;
  }
  if (r.code(kOnce) != kNoCode && r.code(kOnce) != 40) {
    return refuse(kOnce);
  }
  for (const Group group : {kOffset, kPathMode, kLength}) {
    if (r.code(group) != kNoCode) {
      return refuse(group);
    }
  }
  const int motion = r.code(kMotion);
  return (motion != 50 && motion != 51 && motion < 810) || refuse(kMotion);
}

// ---- feed ----

bool TakeFeed(Reading& r) {
  ModalState& s = r.state;
  if (r.code(kFeedMode) != kNoCode) {
    const bool inverse = r.code(kFeedMode) == 930;
    if (s.inverse_time && !inverse) {
      s.feed_mm_per_s = s.feed_deg_per_s = s.feed_per_min = 0.0;  // must be given again
    }
    s.inverse_time = inverse;
  }
  if (!r.block.has('F')) {
    return true;
  }
  const double f = r.block.Take('F');
  if (!(f > 0.0)) {
    return r.FaultAt('F', "FEED_NOT_POSITIVE", "the feed must be above 0");
  }
  if (!(f >= kSlowestFeed && f <= kFastestFeed)) {
    return r.FaultAt('F', "FEED_OUT_OF_RANGE", "F is 1e-6 … 1e9");
  }
  s.feed_per_min = f;
  return true;
}

// In millimetres only now, as F counts in the units of its own line.
void SettleFeed(Reading& r) {
  ModalState& s = r.state;
  if (s.inverse_time || !r.block.has('F')) {
    return;
  }
  s.feed_deg_per_s = s.feed_per_min / kSecondsPerMinute;
  const double feed = s.feed_per_min * s.unit_mm / kSecondsPerMinute;
  FeedFits(r, feed);
  if (feed != s.feed_mm_per_s) {
    s.feed_mm_per_s = feed;
    r.Add(OperationKind::kFeedChange);
  }
}

// ---- jet, abrasive, outputs, words of the machine ----

bool Pierce(Reading& r) {
  if (r.state.jet_on) {
    return r.FaultAt(kJet, "JET_ALREADY_ON", "M5 must stand before the next pierce");
  }
  Operation& o = r.Add(OperationKind::kPierce);
  if (r.block.has('P')) {
    o.value = r.block.Take('P');
    if (!(o.value > 0.0 && o.value <= kLongestPierce_s)) {
      return r.FaultAt('P', "PIERCE_TIME_OUT_OF_RANGE", "a pierce takes more than 0 and at most 600 s");
    }
  }
  r.state.jet_on = r.state.abrasive_on = true;
  return true;
}

bool Jet(Reading& r) {
  if (r.has_spindle()) {
    return ObeySpindle(r);
  }
  if (r.block.has('S') && !(r.block.Take('S') > 0.0 || r.options.leave_out_z)) {
    return r.FaultAt('S', "JET_POWER_NOT_POSITIVE", "a jet is on, at any S above 0, or off, by M5");
  }
  switch (r.code(kJet)) {
    case 30:
    case 40:
      return Pierce(r);
    case 50:
      SwitchJetOff(r);
      return true;
    default:
      return true;
  }
}

void SwitchAbrasive(Reading& r, bool on) {
  const bool coolant = r.has_spindle();
  r.Add(on        ? coolant ? OperationKind::kCoolantOn : OperationKind::kAbrasiveOn
        : coolant ? OperationKind::kCoolantOff
                  : OperationKind::kAbrasiveOff);
  r.state.abrasive_on = on;
}

bool Abrasive(Reading& r) {
  const int m = r.code(kAbrasive);
  if (m != kNoCode && (m != 90) != r.state.abrasive_on) {
    SwitchAbrasive(r, m != 90);
  }
  return true;
}

// M67 on the fly; M68 at once: where the motion before has ended.
bool AnalogOutput(Reading& r, bool at_once) {
  const double most = r.options.abrasive_flow_max_g_per_min;
  if (!(most > 0.0)) {
    return r.FaultAt(kOutput, "OUTPUT_UNKNOWN", "this machine has no analog outputs");
  }
  if (!r.block.has('E') || r.block.Take('E') != 0.0) {
    return r.FaultAt(kOutput, "OUTPUT_UNKNOWN",
                     "E0 is the flow of abrasive in g/min; there are no other analog outputs");
  }
  if (!r.block.has('Q')) {
    return r.FaultAt(kOutput, "OUTPUT_VALUE_MISSING", "Q must give the flow of abrasive in g/min");
  }
  const double flow_g_per_min = r.block.Take('Q');
  if (!(flow_g_per_min >= 0.0 && flow_g_per_min <= most)) {
    return r.FaultAt('Q', "ABRASIVE_FLOW_OUT_OF_RANGE",
                     "the flow of abrasive is 0 … " + ShortNumber(most) + " g/min on this machine");
  }
  if (at_once) {
    r.Add(OperationKind::kDwell);
  }
  r.Add(OperationKind::kAbrasiveFlow).value = flow_g_per_min;
  return true;
}

// A gate. What the input reads, mode 0, and how the wait ended, #5399, cannot be known: the program is planned whole before
// the machine runs.
bool WaitForInput(Reading& r) {
  const char* inputs =
      "M66 waits for P0, the pump at pressure, or P1, abrasive in the hopper; there are no others";
  if (!r.options.process_inputs) {
    return r.FaultAt(kOutput, "INPUT_UNKNOWN", "this machine has no inputs that a program could wait for");
  }
  if (r.block.has('P') && r.block.has('E')) {
    return r.FaultAt(kOutput, "INPUT_AMBIGUOUS", "P or E names the input, not both");
  }
  const double p = r.block.has('P') ? r.block.Take('P') : -1.0;
  if (p != 0.0 && p != 1.0) {
    return r.FaultAt(kOutput, "INPUT_UNKNOWN", inputs);
  }
  const double l = r.block.has('L') ? r.block.Take('L') : 0.0;
  if (l == 0.0) {
    return r.FaultAt(
        kOutput, "INPUT_READ_UNPLANNED",
        "what an input reads is known when the machine runs, and a program is planned whole before; "
        "wait for it with L1 … L4");
  }
  if (!(l >= 1.0 && l <= 4.0) || l != std::floor(l)) {
    return r.FaultAt('L', "INPUT_EVENT_UNKNOWN",
                     "L1 waits for a rise, L2 for a fall, L3 for high, L4 for low");
  }
  const double seconds = r.block.has('Q') ? r.block.Take('Q') : 0.0;
  if (!(seconds > 0.0 && seconds <= kLongestDwell_s)) {
    return r.FaultAt(r.block.has('Q') ? 'Q' : 'L', "INPUT_TIMEOUT_OUT_OF_RANGE",
                     "Q, the longest wait, is more than 0 and at most 3600 s");
  }
  Operation& o = r.Add(OperationKind::kWaitInput);
  o.value = seconds;
  o.condition = InputCondition::Of(static_cast<ProcessInput>(static_cast<int>(p)),
                                   static_cast<InputEvent>(static_cast<int>(l)));
  r.state.waited_for_input = true;
  return true;
}

bool Outputs(Reading& r) {
  const int m = r.code(kOutput);
  if (m == kNoCode) {
    return true;
  }
  if (r.has_spindle()) {
    return r.FaultAt(kOutput, "OUTPUT_UNKNOWN",
                     "this machine has no jet and no inputs; M3, M5, M8 and M9 switch what it has");
  }
  if (m == 660) {
    return WaitForInput(r);
  }
  if (m >= 670) {
    return AnalogOutput(r, m == 680);
  }
  if (!r.block.has('P') || (r.block.at('P') != 0.0 && r.block.at('P') != 1.0)) {
    return r.FaultAt(kOutput, "OUTPUT_UNKNOWN", "P0 is the jet, P1 the abrasive; there are no others");
  }
  const bool jet = r.block.Take('P') == 0.0;
  const bool on = m == 620 || m == 640;
  if (m == 640 || m == 650) {
    r.Add(OperationKind::kDwell);  // at once: not on the fly, but where the motion before has ended
  }
  if (jet && !on) {
    SwitchJetOff(r);
  } else if (jet) {
    r.Add(OperationKind::kJetOn);
    r.state.jet_on = true;
  } else {
    SwitchAbrasive(r, on);
  }
  return true;
}

bool MachineWords(Reading& r) {
  const int m = r.code(kMachineWord);
  if (m == kNoCode) {
    return true;
  }
  if (m == 1020) {
    r.Add(OperationKind::kCameraTrackOff);
    return true;
  }
  const double mark = r.block.has('P') ? r.block.Take('P') : -1.0;
  if (!(mark >= 0.0 && mark <= kMostMarks) || mark != std::floor(mark)) {
    return r.FaultAt(kMachineWord, "MARK_MISSING", "P must name the mark, a whole number from 0");
  }
  if (m == 1000 && r.state.jet_on) {
    return r.FaultAt(kMachineWord, "MEASURE_WITH_JET_ON", "M5 must stand before");
  }
  r.Add(m == 1000 ? OperationKind::kMeasure : OperationKind::kCameraTrackOn).value = mark;
  return true;
}

bool Dwell(Reading& r) {
  if (r.code(kOnce) != 40) {
    return true;
  }
  if (!r.block.has('P')) {
    return r.FaultAt(kOnce, "DWELL_TIME_MISSING", "G4 needs P in seconds");
  }
  const double seconds = r.block.Take('P');
  if (!(seconds >= 0.0 && seconds <= kLongestDwell_s)) {
    return r.FaultAt('P', "DWELL_TIME_OUT_OF_RANGE", "a dwell takes 0 to 3600 s");
  }
  r.Add(OperationKind::kDwell).value = seconds;
  return true;
}

// ---- modes ----

bool Plane(Reading& r) {
  const int g = r.code(kPlane);
  if (g == kNoCode) {
    return true;
  }
  if (g != 170 && (r.options.axes & (kAxisX | kAxisY | kAxisZ)) != (kAxisX | kAxisY | kAxisZ)) {
    return r.FaultAt(kPlane, "PLANE_NOT_DRIVEN", "this machine drives X and Y; its plane is G17");
  }
  r.state.plane = g == 170 ? ArcPlane::kXy : g == 180 ? ArcPlane::kZx : ArcPlane::kYz;
  return true;
}

bool Units(Reading& r) {
  if (r.code(kUnits) != kNoCode) {
    r.state.unit_mm = r.code(kUnits) == 200 ? kInchMm : 1.0;
    r.Add(OperationKind::kUnitsChange).value = r.state.unit_mm;
  }
  SettleFeed(r);
  return true;
}

// The tool of G41 and G42: the jet itself, or one that G10 L1 has described.
bool KerfRadius(Reading& r, int g, double& radius_mm) {
  const bool dynamic = g == 411 || g == 421;
  if (dynamic && !r.block.has('D')) {
    return r.FaultAt(kKerf, "KERF_DIAMETER_MISSING", "G41.1 and G42.1 need D, the width of the kerf");
  }
  const double d = r.block.has('D') ? r.block.Take('D') : r.state.mounted_tool;
  if (dynamic) {
    radius_mm = 0.5 * r.mm(d);
  } else {
    const auto tool = r.tools.find(
        std::abs(d - std::round(d)) <= kWhole && std::abs(d) < 1e6 ? static_cast<int>(std::round(d)) : -1);
    if (tool == r.tools.end()) {
      const char* should =
          "D, or the mounted tool, needs a width: G10 L1 describes tools other than the jet, 0 and 1";
      return r.block.has('D') ? r.FaultAt('D', "TOOL_UNKNOWN", should)
                              : r.FaultAt(kKerf, "TOOL_UNKNOWN", should);
    }
    radius_mm = tool->second.radius_mm;
  }
  const char* should = "a kerf is more than 0 and at most 20 mm wide; is the machine's kerf width known?";
  return (radius_mm > 0.0 && radius_mm <= 10.0) || r.FaultAt(kKerf, "KERF_WIDTH_OUT_OF_RANGE", should);
}

bool Kerf(Reading& r) {
  const int g = r.code(kKerf);
  if (g == kNoCode) {
    return true;
  }
  ModalState& s = r.state;
  if (g == 400) {
    s.kerf_ends = s.kerf_code != 400;
    s.kerf_code = 400;
    s.kerf_offset_mm = 0.0;
    return true;
  }
  if (!r.options.kerf_compensation) {
    return r.FaultAt(kKerf, "KERF_NOT_SUPPORTED", "write the kerf-offset centreline");
  }
  if (s.kerf_code != 400) {
    return r.FaultAt(kKerf, "KERF_ALREADY_ON", "G40 must stand before");
  }
  if (s.plane != ArcPlane::kXy) {
    return r.FaultAt(kKerf, "KERF_PLANE", "the kerf is compensated in the XY plane, G17");
  }
  double radius_mm = 0.0;
  if (!KerfRadius(r, g, radius_mm)) {
    return false;
  }
  s.kerf_code = g;
  s.kerf_offset_mm = g < 420 ? radius_mm : -radius_mm;
  s.kerf_ends = false;
  return true;
}

bool PathMode(Reading& r) {
  const int g = r.code(kPathMode);
  if (g == kNoCode) {
    return true;
  }
  double tolerance_mm = g == 640 ? r.options.default_tolerance_mm : 0.0;
  if (g == 640 && r.block.has('P')) {
    tolerance_mm = r.mm(r.block.Take('P'));
    if (!(tolerance_mm > 0.0 && tolerance_mm <= kLargestTolerance_mm)) {
      return r.FaultAt('P', "TOLERANCE_OUT_OF_RANGE", "a path tolerance is above 0 and at most 10 mm");
    }
  }
  // Q allows short lines to be joined; nobody has to.
  if (g == 640 && r.block.has('Q') && !(r.block.Take('Q') >= 0.0)) {
    return r.FaultAt('Q', "TOLERANCE_OUT_OF_RANGE", "Q of G64 is 0 or more");
  }
  r.state.path_tolerance_mm = tolerance_mm > 0.0 ? tolerance_mm : r.options.default_tolerance_mm;
  r.Add(OperationKind::kPathTolerance).value = tolerance_mm;
  return true;
}

bool DistanceModes(Reading& r) {
  if (r.code(kDistance) != kNoCode) {
    r.state.absolute = r.code(kDistance) == 900;
    r.Add(OperationKind::kDistanceChange).value = r.state.absolute ? 90.0 : 91.0;
  }
  if (r.code(kArcDistance) != kNoCode) {
    r.state.arc_absolute = r.code(kArcDistance) == 901;
  }
  if (r.code(kReturnMode) != kNoCode) {
    r.state.return_to_r = r.code(kReturnMode) == 990;
  }
  return true;
}

// ---- end of the block ----

bool Calls(Reading& r) {
  const int m = r.code(kCallWord);
  if (m == kNoCode) {
    return true;
  }
  if (m == 990) {
    r.flow.leave = true;
    return true;
  }
  const double p = r.block.has('P') ? r.block.Take('P') : -1.0;
  if (!(p >= 0.0 && p < 1e9) || p != std::floor(p)) {
    return r.FaultAt(kCallWord, "SUBPROGRAM_MISSING", "M98 needs P, the number of the subprogram");
  }
  const double l = r.block.has('L') ? r.block.Take('L') : 1.0;
  if (!(l >= 0.0 && l <= kMostRepeats) || l != std::floor(l)) {
    return r.FaultAt('L', "REPEATS_OUT_OF_RANGE", "L is a whole number, 0 … 9999");
  }
  r.flow = {true, false, std::to_string(static_cast<long>(p)), static_cast<int>(l)};
  return true;
}

bool Stopping(Reading& r) {
  switch (r.code(kStopping)) {
    case 0:
    case 10:
      r.Add(OperationKind::kStop);
      break;
    case 20:
    case 300:
      EndProgram(r);
      break;
    default:
      break;
  }
  return true;
}

void RefuseUnused(Reading& r, char letter) {
  switch (letter) {
    case 'U':
    case 'V':
    case 'W':
      r.FaultAt(letter, "AXIS_NOT_DRIVEN", "this machine has no axes U, V and W");
      break;
    case 'H':
      r.FaultAt(letter, "WORD_NOT_SUPPORTED", "H, the row of a tool length, stands with G43");
      break;
    default:
      r.FaultAt(letter, "WORD_WITHOUT_USE", "no word of this line takes this one");
  }
}

void RefuseUnused(Reading& r) {
  for (std::uint32_t left = r.block.present & ~r.block.used; left != 0; left &= left - 1) {
    RefuseUnused(r, static_cast<char>('A' + std::countr_zero(left)));
  }
}

// An axis that the machine does not have.
bool AxesDriven(Reading& r) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const char letter = kAxisLetters[i];
    if (!r.block.has(letter) || r.drives(i)) {
      continue;
    }
    if (letter == 'Z' && r.options.leave_out_z) {
      r.block.present &= ~LetterBit('Z');
      continue;
    }
    return r.FaultAt(letter, "AXIS_NOT_DRIVEN",
                     letter == 'Z'
                         ? "this machine does not move Z; where Z only lifts a tool, ask for flat G-code "
                           "(--format flat-gcode, --leave-out-z): its Z words are read over"
                         : "this machine does not move this axis");
  }
  return true;
}

// A line of nothing but axis words and a feed, in a straight motion that is on.
bool Straight(const Reading& r) {
  constexpr std::uint32_t kWords = LetterBit('X') | LetterBit('Y') | LetterBit('Z') | LetterBit('A') |
                                   LetterBit('B') | LetterBit('C') | LetterBit('F');
  return r.block.m_count == 0 && (r.block.present & ~kWords) == 0 &&
         (r.block.g_count == 0
              ? r.state.motion == 0 || r.state.motion == 10
              : r.block.g_count == 1 && (r.block.g[0].tenfold == 0 || r.block.g[0].tenfold == 10));
}

bool ObeyStraight(Reading& r) {
  r.codes[kMotion] = kNoCode;
  r.codes[kOnce] = kNoCode;
  r.codes[kFeedMode] = kNoCode;
  r.codes[kLength] = kNoCode;
  if (r.block.g_count == 1) {
    r.codes[kMotion] = r.block.g[0].tenfold;
    r.columns[kMotion] = r.block.g[0].column;
  }
  if (!TakeFeed(r)) {
    return false;
  }
  SettleFeed(r);
  return ObeyMotion(r);
}

bool SettledModes(Reading& r) {
  if (r.doubt != 0) {
    SettleModes(r);
  }
  return true;
}

}  // namespace

// Abrasive without water would only fill the tube.
void SwitchJetOff(Reading& r) {
  if (r.state.abrasive_on) {
    r.Add(OperationKind::kAbrasiveOff);
  }
  r.Add(OperationKind::kJetOff);
  r.state.jet_on = r.state.abrasive_on = false;
}

// The jet never stays on after the end, as LinuxCNC's M2 stops the spindle.
void EndProgram(Reading& r) {
  if (r.state.jet_on) {
    SwitchJetOff(r);
  }
  if (r.has_spindle()) {
    StopSpindle(r);
    if (r.state.abrasive_on) {
      SwitchAbrasive(r, false);
    }
  }
  r.Add(OperationKind::kEnd);
  r.ended = true;
}

int GroupOfCode(char letter, int tenfold) {
  return letter == 'G' ? ModeGroupOfG(tenfold) : GroupOfM(tenfold);
}

bool ObeyBlock(Reading& r) {
  if ((r.block.present & ~(LetterBit('X') | LetterBit('Y') | LetterBit('F'))) != 0 && !AxesDriven(r)) {
    return false;
  }
  if (r.doubt == 0 && Straight(r)) {
    return ObeyStraight(r);
  }
  const bool good = SortCodes(r) && SettledModes(r) && OneTakesEach(r) && KerfAllows(r) && TakeFeed(r) &&
                    Outputs(r) && ObeyTool(r) && Jet(r) && Abrasive(r) && MachineWords(r) && Dwell(r) &&
                    Plane(r) && Units(r) && Kerf(r) && PathMode(r) && DistanceModes(r) && ChangeOffsets(r) &&
                    GoToReference(r) && ObeyMotion(r) && Calls(r) && Stopping(r);
  if (good) {
    SettleSwitches(r);
    RefuseUnused(r);
  }
  return good;
}

}  // namespace lambdajet::trajectory
