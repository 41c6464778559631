#include "trajectory/core/part_program/gcode_reader.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>

#include "trajectory/core/part_program/gcode_words.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kInchMm = 25.4;
constexpr std::size_t kLongestLine = 1000;
constexpr double kSecondsPerMinute = 60.0;
constexpr int kNoCode = -1;

enum Group : int {
  kMotion,
  kOnce,
  kPlane,
  kUnits,
  kCutter,
  kLength,
  kOffset,
  kPathMode,
  kDistance,
  kArcDistance,
  kFeedMode,
  kStopping,
  kJet,
  kAbrasive,
  kOutput,
  kMachineWord,
  kGroupCount
};

int GroupOfG(int tenfold) {
  switch (tenfold) {
    case 0:
    case 10:
    case 20:
    case 30:
    case 800:
      return kMotion;
    case 40:
    case 100:
    case 920:
    case 921:
    case 922:
    case 923:
      return kOnce;
    case 170:
      return kPlane;
    case 200:
    case 210:
      return kUnits;
    case 400:
      return kCutter;
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
    case 940:
      return kFeedMode;
    default:
      return kNoCode;
  }
}

int GroupOfM(int tenfold) {
  switch (tenfold) {
    case 0:
    case 10:
    case 20:
    case 300:
      return kStopping;
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
      return kOutput;
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
    case 410:
    case 420:
    case 411:
    case 421:
      return "kerf compensation is not done here; write the kerf-offset centreline";
    case 180:
    case 190:
      return "the sheet is the XY plane, G17";
    case 930:
    case 950:
      return "feed is in units a minute, G94";
    case 50:
    case 51:
    case 52:
    case 53:
      return "write splines as G1, G2 and G3";
    case 280:
    case 300:
    case 530:
      return "this machine has no fixed machine coordinates; write the move in the work offset";
    default:
      return "not a word of this machine; see the table of supported words";
  }
}

struct Point {
  double x = 0.0;
  double y = 0.0;
};

class Reader {
 public:
  Reader(std::string_view text, const GcodeOptions& options) : text_(text), options_(options) {}

  PartProgram Read() {
    if (RefuseEncoding()) {
      return std::move(program_);
    }
    program_.operations.reserve(text_.size() / 24 + 16);
    while (!ended_ && at_ < text_.size() && program_.faults.size() < options_.fault_limit) {
      NextLine();
      ReadLine();
    }
    program_.line_count = line_number_;
    CloseProgram();
    return std::move(program_);
  }

 private:
  bool RefuseEncoding() {
    if (text_.starts_with("\xEF\xBB\xBF")) {
      at_ = 3;
    }
    if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF")) {
      line_number_ = 1;
      Fault(1, 1, "NOT_UTF8", "the file is UTF-16; save it as UTF-8 or ASCII");
      return true;
    }
    return false;
  }

  void NextLine() {
    const char* begin = text_.data() + at_;
    const auto* end = static_cast<const char*>(std::memchr(begin, '\n', text_.size() - at_));
    const std::size_t size = end == nullptr ? text_.size() - at_ : static_cast<std::size_t>(end - begin);
    line_ = {begin, size};
    at_ += size + 1;
    ++line_number_;
  }

  void ReadLine() {
    if (line_.size() > kLongestLine) {
      Fault(static_cast<std::uint32_t>(kLongestLine + 1), 1, "LINE_TOO_LONG",
            "a line has at most 1000 characters");
      return;
    }
    const LineParse parse = ParseLine(line_, block_);
    if (parse.deleted && options_.obey_block_delete) {
      return;
    }
    if (parse.fault.reason != nullptr) {
      Fault(parse.fault.column, parse.fault.length, parse.fault.reason, parse.fault.message);
      return;
    }
    if (parse.percent) {
      Percent();
      return;
    }
    if ((block_.present | static_cast<std::uint32_t>(block_.g_count) |
         static_cast<std::uint32_t>(block_.m_count)) == 0) {
      return;
    }
    anything_ = true;
    Obey();
  }

  void Percent() {
    if (!anything_ && !percent_) {
      percent_ = anything_ = true;
    } else if (percent_) {
      End();
    } else {
      Fault(1, 1, "PERCENT_NOT_FIRST", "a percent sign ends a program only if one began it; end with M2");
    }
  }

  void CloseProgram() {
    if (ended_ || !program_.faults.empty()) {
      return;
    }
    if (!anything_) {
      Fault(0, 0, "PROGRAM_EMPTY", "there is nothing to do; write at least a motion and M2");
    } else {
      Fault(0, 0, "PROGRAM_END_MISSING",
            "the program ends without M2, M30 or a second percent sign; is it complete?");
    }
  }

  // ---- one block ----

  void Obey() {
    if (!SortCodes()) {
      return;
    }
    // LinuxCNC's order of execution.
    const bool good = Feed() && OneTakesP() && Jet() && Abrasive() && Outputs() && MachineWords() &&
                      Dwell() && Modes() && Offsets() && Motion() && Stopping();
    if (good) {
      RefuseUnused();
    }
  }

  bool SortCodes() {
    code_.fill(kNoCode);
    for (int i = 0; i < block_.g_count; ++i) {
      const Code c = block_.g[static_cast<std::size_t>(i)];
      if (!Sort(c, GroupOfG(c.tenfold), 'G')) {
        return false;
      }
    }
    for (int i = 0; i < block_.m_count; ++i) {
      const Code c = block_.m[static_cast<std::size_t>(i)];
      if (!Sort(c, GroupOfM(c.tenfold), 'M')) {
        return false;
      }
    }
    return true;
  }

  bool Sort(Code c, int group, char letter) {
    if (group == kNoCode) {
      return Fault(c.column, WordLength(c.column), letter == 'G' ? "UNKNOWN_G_CODE" : "UNKNOWN_M_CODE",
                   letter == 'G' ? AdviceOnG(c.tenfold)
                                 : "not a word of this machine; see the table of supported words");
    }
    if (code_[static_cast<std::size_t>(group)] != kNoCode) {
      return Fault(c.column, WordLength(c.column), "MODAL_GROUP_TWICE",
                   "two words of one modal group contradict each other in this line");
    }
    code_[static_cast<std::size_t>(group)] = c.tenfold;
    code_column_[static_cast<std::size_t>(group)] = c.column;
    return true;
  }

  int code(Group group) const { return code_[group]; }
  std::uint32_t column(Group group) const { return code_column_[group]; }

  bool Feed() {
    if (!block_.has('F')) {
      return true;
    }
    const double f = block_.Take('F');
    if (!(f > 0.0)) {
      return FaultAt('F', "FEED_NOT_POSITIVE", "the feed must be above 0");
    }
    feed_units_per_min_ = f;
    return true;
  }

  // Which words of this line want a P; more than one would have to share it.
  bool OneTakesP() {
    const int takers = (code(kOnce) == 40) + (code(kOnce) == 100) + (code(kJet) == 30 || code(kJet) == 40) +
                       (code(kOutput) != kNoCode) +
                       (code(kMachineWord) == 1000 || code(kMachineWord) == 1010) + (code(kPathMode) == 640) +
                       (code(kMotion) == 20 || code(kMotion) == 30);
    return takers < 2 || !block_.has('P') ||
           FaultAt('P', "P_AMBIGUOUS",
                   "two words of this line could take this P; write them in lines of their own");
  }

  bool Jet() {
    switch (code(kJet)) {
      case 30:
      case 40:
        return Pierce();
      case 50:
        JetOff();
        return true;
      default:
        return true;
    }
  }

  // Abrasive without water would only fill the tube.
  void JetOff() {
    if (abrasive_on_) {
      Switch(OperationKind::kAbrasiveOff);
    }
    Switch(OperationKind::kJetOff);
    jet_on_ = abrasive_on_ = false;
  }

  bool Pierce() {
    if (jet_on_) {
      return Fault(column(kJet), WordLength(column(kJet)), "JET_ALREADY_ON",
                   "M5 must stand before the next pierce");
    }
    Operation& o = Add(OperationKind::kPierce);
    if (block_.has('P')) {
      o.value = block_.Take('P');
      if (!(o.value > 0.0 && o.value <= 600.0)) {
        return FaultAt('P', "PIERCE_TIME_OUT_OF_RANGE", "a pierce takes more than 0 and at most 600 s");
      }
    }
    jet_on_ = abrasive_on_ = true;
    return true;
  }

  bool Abrasive() {
    const int m = code(kAbrasive);
    if (m != kNoCode) {
      const bool on = m != 90;
      if (on != abrasive_on_) {
        Switch(on ? OperationKind::kAbrasiveOn : OperationKind::kAbrasiveOff);
      }
      abrasive_on_ = on;
    }
    return true;
  }

  bool Outputs() {
    const int m = code(kOutput);
    if (m == kNoCode) {
      return true;
    }
    if (!block_.has('P') || (block_.at('P') != 0.0 && block_.at('P') != 1.0)) {
      return Fault(column(kOutput), WordLength(column(kOutput)), "OUTPUT_UNKNOWN",
                   "P0 is the jet, P1 the abrasive");
    }
    const bool jet = block_.Take('P') == 0.0;
    const bool on = m == 620;
    if (jet && !on) {
      JetOff();
    } else if (jet) {
      Switch(OperationKind::kJetOn);
      jet_on_ = true;
    } else {
      Switch(on ? OperationKind::kAbrasiveOn : OperationKind::kAbrasiveOff);
      abrasive_on_ = on;
    }
    return true;
  }

  bool MachineWords() {
    const int m = code(kMachineWord);
    if (m == kNoCode) {
      return true;
    }
    if (m == 1020) {
      Switch(OperationKind::kCameraTrackOff);
      return true;
    }
    const double mark = block_.has('P') ? block_.Take('P') : -1.0;
    if (!(mark >= 0.0 && mark <= 1e6) || mark != std::floor(mark)) {
      return Fault(column(kMachineWord), WordLength(column(kMachineWord)), "MARK_MISSING",
                   "P must name the mark, a whole number from 0");
    }
    if (m == 1000 && jet_on_) {
      return Fault(column(kMachineWord), WordLength(column(kMachineWord)), "MEASURE_WITH_JET_ON",
                   "M5 must stand before");
    }
    Add(m == 1000 ? OperationKind::kMeasure : OperationKind::kCameraTrackOn).value = mark;
    return true;
  }

  bool Dwell() {
    if (code(kOnce) != 40) {
      return true;
    }
    if (!block_.has('P')) {
      return Fault(column(kOnce), WordLength(column(kOnce)), "DWELL_TIME_MISSING", "G4 needs P in seconds");
    }
    const double seconds = block_.Take('P');
    if (!(seconds >= 0.0 && seconds <= 3600.0)) {
      return FaultAt('P', "DWELL_TIME_OUT_OF_RANGE", "a dwell takes 0 to 3600 s");
    }
    Add(OperationKind::kDwell).value = seconds;
    return true;
  }

  bool Modes() {
    if (code(kUnits) != kNoCode) {
      unit_mm_ = code(kUnits) == 200 ? kInchMm : 1.0;
      Add(OperationKind::kUnitsChange).value = unit_mm_;
    }
    const double feed = feed_units_per_min_ * unit_mm_ / kSecondsPerMinute;
    if (feed != feed_mm_per_s_) {
      feed_mm_per_s_ = feed;
      Add(OperationKind::kFeedChange);
    }
    return PathMode();
  }

  bool PathMode() {
    const int g = code(kPathMode);
    if (g == kNoCode) {
      return true;
    }
    double tolerance_mm = g == 640 ? options_.default_tolerance_mm : 0.0;
    if (g == 640 && block_.has('P')) {
      tolerance_mm = block_.Take('P') * unit_mm_;
      if (!(tolerance_mm > 0.0 && tolerance_mm <= 10.0)) {
        return FaultAt('P', "TOLERANCE_OUT_OF_RANGE", "a path tolerance is above 0 and at most 10 mm");
      }
    }
    Add(OperationKind::kPathTolerance).value = tolerance_mm;
    return true;
  }

  bool Offsets() {
    if (code(kOffset) != kNoCode) {
      const int g = code(kOffset);
      offset_ = static_cast<std::size_t>(g <= 590 ? (g - 540) / 10 : 5 + (g - 590));
      AddOffsetChange();
    }
    if (code(kDistance) != kNoCode) {
      absolute_ = code(kDistance) == 900;
      Add(OperationKind::kDistanceChange).value = absolute_ ? 90.0 : 91.0;
    }
    if (code(kArcDistance) != kNoCode) {
      arc_absolute_ = code(kArcDistance) == 901;
    }
    switch (code(kOnce)) {
      case 100:
        return SetWorkOffset();
      case 920:
        return ShiftOrigin();
      case 921:
        saved_shift_ = shift_ = {};
        return AddOffsetChange();
      case 922:
        saved_shift_ = shift_;
        shift_ = {};
        return AddOffsetChange();
      case 923:
        shift_ = saved_shift_;
        return AddOffsetChange();
      default:
        return true;
    }
  }

  // G10 L2 sets an offset in W, L20 sets it so that the present point reads as written.
  bool SetWorkOffset() {
    const double l = block_.has('L') ? block_.Take('L') : 0.0;
    const double p = block_.has('P') ? block_.Take('P') : -1.0;
    if (l != 2.0 && l != 20.0) {
      return Fault(column(kOnce), WordLength(column(kOnce)), "G10_L_UNKNOWN",
                   "G10 is understood with L2 and L20");
    }
    if (!(p >= 0.0 && p <= 9.0) || p != std::floor(p)) {
      return Fault(column(kOnce), WordLength(column(kOnce)), "G10_P_OUT_OF_RANGE",
                   "P1 … P9 name G54 … G59.3, P0 the active one");
    }
    if (!CoordinatesFinite()) {
      return false;
    }
    Point& offset = offsets_[p == 0.0 ? offset_ : static_cast<std::size_t>(p) - 1];
    for (const char letter : {'X', 'Y'}) {
      if (block_.has(letter)) {
        const double written = block_.Take(letter) * unit_mm_;
        double& o = letter == 'X' ? offset.x : offset.y;
        o = l == 2.0 ? written : (letter == 'X' ? position_.x - shift_.x : position_.y - shift_.y) - written;
      }
    }
    return AddOffsetChange();
  }

  bool ShiftOrigin() {
    if (!block_.has('X') && !block_.has('Y')) {
      return Fault(column(kOnce), WordLength(column(kOnce)), "G92_AXIS_MISSING", "G92 needs X or Y");
    }
    if (!CoordinatesFinite()) {
      return false;
    }
    if (block_.has('X')) {
      shift_.x = position_.x - offsets_[offset_].x - block_.Take('X') * unit_mm_;
    }
    if (block_.has('Y')) {
      shift_.y = position_.y - offsets_[offset_].y - block_.Take('Y') * unit_mm_;
    }
    return AddOffsetChange();
  }

  bool AddOffsetChange() {
    static constexpr std::array<double, 9> kNames = {54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3};
    Operation& o = Add(OperationKind::kWorkOffsetChange);
    o.x_W_mm = offsets_[offset_].x + shift_.x;
    o.y_W_mm = offsets_[offset_].y + shift_.y;
    o.value = kNames[offset_];
    return true;
  }

  // ---- motion ----

  bool Motion() {
    if (code(kMotion) != kNoCode) {
      motion_ = code(kMotion);
    }
    const bool axes_taken = code(kOnce) == 100 || code(kOnce) >= 920;
    if (axes_taken && code(kMotion) != kNoCode && motion_ != 800) {
      return Fault(column(kMotion), WordLength(column(kMotion)), "AXES_TAKEN_TWICE",
                   "G10 and G92 take the axis words of their line; write the motion in the next line");
    }
    const bool axes = !axes_taken && (block_.has('X') || block_.has('Y'));
    if (!axes && (code(kMotion) == kNoCode || motion_ == 800 || motion_ == 0 || motion_ == 10)) {
      return code(kMotion) == kNoCode || motion_ == 800 || code(kOnce) != kNoCode || NoTarget();
    }
    if (!CoordinatesFinite()) {
      return false;
    }
    const Point end = Target();
    switch (motion_) {
      case 0:
        return Traverse(end);
      case 10:
        return FeedLine(end);
      case 20:
        return Arc(end, -1.0);
      case 30:
        return Arc(end, 1.0);
      default:
        return FaultAt(block_.has('X') ? 'X' : 'Y', "MOTION_MODE_MISSING",
                       "G0, G1, G2 or G3 must stand before or in this line");
    }
  }

  // A bare G0 or G1 only sets the mode, as in LinuxCNC.
  bool NoTarget() { return true; }

  bool CoordinatesFinite() {
    for (const char letter : {'X', 'Y', 'I', 'J', 'R'}) {
      if (block_.has(letter) && std::abs(block_.at(letter) * unit_mm_) > options_.largest_coordinate_mm) {
        return FaultAt(letter, "COORDINATE_TOO_LARGE", "a coordinate is at most 1e6 mm");
      }
    }
    return true;
  }

  Point Target() {
    const Point zero =
        absolute_ ? Point{offsets_[offset_].x + shift_.x, offsets_[offset_].y + shift_.y} : position_;
    Point end = position_;
    if (block_.has('X')) {
      end.x = zero.x + block_.Take('X') * unit_mm_;
    }
    if (block_.has('Y')) {
      end.y = zero.y + block_.Take('Y') * unit_mm_;
    }
    return end;
  }

  bool Traverse(Point end) {
    if (jet_on_) {
      return Fault(MotionColumn(), WordLength(MotionColumn()), "TRAVERSE_WITH_JET_ON",
                   "the jet is on; switch it off with M5 or cut with G1");
    }
    Move(OperationKind::kTraverse, end);
    return true;
  }

  bool HasFeed() {
    return feed_mm_per_s_ > 0.0 || Fault(MotionColumn(), WordLength(MotionColumn()), "FEED_MISSING",
                                         "F must stand before or in the first line that cuts");
  }

  bool FeedLine(Point end) {
    if (!HasFeed()) {
      return false;
    }
    Move(OperationKind::kFeedLine, end);
    return true;
  }

  bool Arc(Point end, double turn) {
    if (!HasFeed()) {
      return false;
    }
    if (block_.has('K')) {
      return FaultAt('K', "ARC_WORD_NOT_OF_PLANE", "in G17 the centre is given by I and J");
    }
    const bool by_center = block_.has('I') || block_.has('J');
    if (by_center == block_.has('R')) {
      return Fault(MotionColumn(), WordLength(MotionColumn()),
                   by_center ? "ARC_CENTER_AND_RADIUS" : "ARC_CENTER_MISSING", "an arc needs I and J, or R");
    }
    double turns = 1.0;
    if (block_.has('P')) {
      turns = block_.Take('P');
      if (!(turns >= 1.0 && turns <= 1000.0) || turns != std::floor(turns)) {
        return FaultAt('P', "ARC_TURNS_OUT_OF_RANGE", "P of an arc is a whole number of turns, 1 … 1000");
      }
    }
    return by_center ? ArcByCenter(end, turn, turns) : ArcByRadius(end, turn, turns);
  }

  bool ArcByCenter(Point end, double turn, double turns) {
    Point center =
        arc_absolute_ ? Point{offsets_[offset_].x + shift_.x, offsets_[offset_].y + shift_.y} : position_;
    if (arc_absolute_ && !(block_.has('I') && block_.has('J'))) {
      return Fault(MotionColumn(), WordLength(MotionColumn()), "ARC_CENTER_MISSING",
                   "with G90.1 an arc needs both I and J");
    }
    center.x += block_.has('I') ? block_.Take('I') * unit_mm_ : 0.0;
    center.y += block_.has('J') ? block_.Take('J') * unit_mm_ : 0.0;
    const double radius_begin = std::hypot(position_.x - center.x, position_.y - center.y);
    const double radius_end = std::hypot(end.x - center.x, end.y - center.y);
    if (!(radius_begin > 1e-9) || !(radius_end > 1e-9)) {
      return Fault(MotionColumn(), WordLength(MotionColumn()), "ARC_RADIUS_ZERO",
                   "the centre lies on the path");
    }
    if (std::abs(radius_begin - radius_end) > options_.arc_radius_tolerance_mm) {
      return Fault(MotionColumn(), WordLength(MotionColumn()), "ARC_RADIUS_DIFFERS",
                   "radius at the start " + Number(radius_begin) + " mm, at the end " + Number(radius_end) +
                       " mm; they must agree to " + Number(options_.arc_radius_tolerance_mm) + " mm");
    }
    AddArc(end, CenterBetween(center, end), turn, turns);
    return true;
  }

  // The centre moved onto the bisector of the chord, so that start and end lie on one circle.
  Point CenterBetween(Point center, Point end) const {
    const double dx = end.x - position_.x, dy = end.y - position_.y;
    const double chord2 = dx * dx + dy * dy;
    if (chord2 < 1e-12) {
      return center;
    }
    const double along =
        ((center.x - 0.5 * (position_.x + end.x)) * dx + (center.y - 0.5 * (position_.y + end.y)) * dy) /
        chord2;
    return {center.x - along * dx, center.y - along * dy};
  }

  // R > 0: the shorter of the two arcs, R < 0: the longer.
  bool ArcByRadius(Point end, double turn, double turns) {
    const double radius = block_.Take('R') * unit_mm_;
    const double dx = end.x - position_.x, dy = end.y - position_.y;
    const double half = 0.5 * std::hypot(dx, dy);
    if (half < 1e-9) {
      return FaultAt('R', "ARC_RADIUS_FULL_CIRCLE", "R cannot describe a full circle; use I and J");
    }
    double height2 = radius * radius - half * half;
    if (height2 < 0.0) {
      if (half - std::abs(radius) > options_.arc_radius_tolerance_mm) {
        return FaultAt('R', "ARC_RADIUS_TOO_SMALL",
                       "R is " + Number(std::abs(radius)) + " mm, half the chord " + Number(half) + " mm");
      }
      height2 = 0.0;
    }
    const double side = (radius > 0.0 ? turn : -turn) * std::sqrt(height2) / (2.0 * half);
    AddArc(end, {0.5 * (position_.x + end.x) - side * dy, 0.5 * (position_.y + end.y) + side * dx}, turn,
           turns);
    return true;
  }

  void AddArc(Point end, Point center, double turn, double turns) {
    constexpr double kFull = 2.0 * std::numbers::pi;
    const double from = std::atan2(position_.y - center.y, position_.x - center.x);
    const double to = std::atan2(end.y - center.y, end.x - center.x);
    double sweep = turn * (to - from);
    while (sweep <= 1e-12) {
      sweep += kFull;
    }
    Operation& o = Move(OperationKind::kFeedArc, end);
    o.center_x_W_mm = center.x;
    o.center_y_W_mm = center.y;
    o.sweep_rad = turn * (sweep + kFull * (turns - 1.0));
  }

  bool Stopping() {
    switch (code(kStopping)) {
      case 0:
      case 10:
        Add(OperationKind::kStop);
        break;
      case 20:
      case 300:
        End();
        break;
      default:
        break;
    }
    return true;
  }

  // The jet never stays on after the end, as LinuxCNC's M2 stops the spindle.
  void End() {
    if (jet_on_) {
      JetOff();
    }
    Add(OperationKind::kEnd);
    ended_ = true;
  }

  void RefuseUnused() {
    const std::uint32_t left = block_.present & ~block_.used;
    if (left == 0) {
      return;
    }
    const char letter = static_cast<char>('A' + std::countr_zero(left));
    switch (letter) {
      case 'Z':
      case 'A':
      case 'B':
      case 'C':
      case 'U':
      case 'V':
      case 'W':
        FaultAt(letter, "AXIS_NOT_DRIVEN", "part programs of this machine move X and Y only");
        break;
      case 'S':
      case 'T':
      case 'H':
        FaultAt(letter, "WORD_NOT_SUPPORTED", "a jet has no spindle speed and no tool numbers");
        break;
      default:
        FaultAt(letter, "WORD_WITHOUT_USE", "no word of this line takes this one");
    }
  }

  // ---- leaves ----

  Operation& Add(OperationKind kind) {
    Operation& o = program_.operations.emplace_back();
    o.kind = kind;
    o.line = line_number_;
    o.x_W_mm = position_.x;
    o.y_W_mm = position_.y;
    o.feed_mm_per_s = feed_mm_per_s_;
    if (program_.operations.size() >= options_.operation_limit) {
      Fault(0, 0, "PROGRAM_TOO_LONG", "more operations than the limit; split the program");
      ended_ = true;
    }
    return o;
  }

  void Switch(OperationKind kind) { Add(kind); }

  Operation& Move(OperationKind kind, Point end) {
    position_ = end;
    return Add(kind);
  }

  static std::string Number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
  }

  std::uint32_t MotionColumn() const {
    if (code(kMotion) != kNoCode) {
      return column(kMotion);
    }
    return block_.has('X') ? block_.column_of('X') : block_.column_of('Y');
  }

  // From the letter to the next letter or space.
  std::uint32_t WordLength(std::uint32_t column) const {
    std::size_t end = column;
    while (end < line_.size() && (std::isdigit(static_cast<unsigned char>(line_[end])) || line_[end] == '.' ||
                                  line_[end] == '-' || line_[end] == '+')) {
      ++end;
    }
    return static_cast<std::uint32_t>(end - (column - 1));
  }

  bool FaultAt(char letter, const char* reason, const std::string& message) {
    const std::uint32_t column = block_.column_of(letter);
    return Fault(column, WordLength(column), reason, message);
  }

  bool Fault(std::uint32_t column, std::uint32_t length, const char* reason, std::string message) {
    std::string word;
    if (column > 0 && column <= line_.size()) {
      word = std::string(line_.substr(column - 1, std::min<std::size_t>(length, 60)));
      while (!word.empty() && (word.back() == ' ' || word.back() == '\t' || word.back() == '\r')) {
        word.pop_back();
      }
    }
    program_.faults.push_back({line_number_, column, reason, std::move(word), std::move(message)});
    return false;
  }

  std::string_view text_;
  const GcodeOptions& options_;
  PartProgram program_;
  Block block_;
  std::string_view line_;
  std::size_t at_ = 0;
  std::uint32_t line_number_ = 0;
  bool anything_ = false;
  bool percent_ = false;
  bool ended_ = false;

  std::array<int, kGroupCount> code_{};
  std::array<std::uint32_t, kGroupCount> code_column_{};

  int motion_ = kNoCode;
  Point position_;
  std::array<Point, 9> offsets_{};
  std::size_t offset_ = 0;
  Point shift_;
  Point saved_shift_;
  bool absolute_ = true;
  bool arc_absolute_ = false;
  double unit_mm_ = 1.0;
  double feed_units_per_min_ = 0.0;
  double feed_mm_per_s_ = 0.0;
  bool jet_on_ = false;
  bool abrasive_on_ = false;
};

}  // namespace

PartProgram ReadGcode(std::string_view text, const GcodeOptions& options) {
  return Reader(text, options).Read();
}

}  // namespace lambdajet::trajectory
