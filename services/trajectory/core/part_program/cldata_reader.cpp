#include "trajectory/core/part_program/cldata_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "trajectory/core/part_program/cldata_cycle.hpp"
#include "trajectory/core/part_program/cldata_words.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFull = 2.0 * kPi;
constexpr double kSecondsPerMinute = 60.0;
constexpr double kInchMm = 25.4;
constexpr double kAxisTolerance = 1e-6;    // of a unit vector's components
constexpr double kVectorTolerance = 1e-3;  // of a tool axis' length
constexpr double kAngleTolerance_rad = 1e-3;
constexpr double kSamePlace_mm = 1e-3;  // posts write three to six decimals
constexpr double kLeastRise =
    0.5;  // cosine between two tools' axes up to which one rises over the other's hole

enum class Major : std::uint8_t {
  kText,  // says nothing about motion
  kUnits,
  kFrom,
  kGoto,
  kGodelta,
  kRapid,
  kFeedrate,
  kCircle,
  kMoveArc,
  kCutter,
  kToolCompensation,
  kMultax,
  kCycle,
  kSpindle,
  kAuxiliary,
  kCoolant,
  kDelay,
  kLoadTool,
  kTolerance,
  kStop,
  kEnd,
  kFinish,
};

struct MajorWord {
  std::string_view word;
  Major major;
};

constexpr std::array<MajorWord, 38> kMajors = {{
    {"PARTNO", Major::kText},
    {"PPRINT", Major::kText},
    {"REMARK", Major::kText},
    {"TPRINT", Major::kText},
    {"OPNAME", Major::kText},
    {"MACHIN", Major::kText},
    {"PAINT", Major::kText},
    {"MODE", Major::kText},
    {"TOOLPATH", Major::kText},
    {"END-OF-PATH", Major::kText},
    {"UNITS", Major::kUnits},
    {"FROM", Major::kFrom},
    {"GOTO", Major::kGoto},
    {"GODLTA", Major::kGodelta},
    {"RAPID", Major::kRapid},
    {"FEDRAT", Major::kFeedrate},
    {"CIRCLE", Major::kCircle},
    {"MOVARC", Major::kMoveArc},
    {"CUTTER", Major::kCutter},
    {"TLDATA", Major::kCutter},
    {"TLCOMP", Major::kToolCompensation},
    {"CUTCOM", Major::kToolCompensation},
    {"MULTAX", Major::kMultax},
    {"CYCLE", Major::kCycle},
    {"SPINDL", Major::kSpindle},
    {"AUXFUN", Major::kAuxiliary},
    {"COOLNT", Major::kCoolant},
    {"DELAY", Major::kDelay},
    {"LOADTL", Major::kLoadTool},
    {"LOAD", Major::kLoadTool},
    {"TURRET", Major::kLoadTool},
    {"TOLER", Major::kTolerance},
    {"STOP", Major::kStop},
    {"OPSTOP", Major::kStop},
    {"END", Major::kEnd},
    {"FINI", Major::kFinish},
    {"CLPRNT", Major::kText},
    {"NOPOST", Major::kText},
}};

const MajorWord* Find(std::string_view word) {
  const auto* found =
      std::find_if(kMajors.begin(), kMajors.end(), [&](const MajorWord& m) { return m.word == word; });
  return found == kMajors.end() ? nullptr : found;
}

// Words a post may well write that this reader refuses, with what to do instead.
std::string AdviceOn(std::string_view word) {
  if (word == "GOHOME" || word == "INSERT" || word == "ORIGIN" || word == "TRACUT" || word == "ROTABL" ||
      word == "ROTHED" || word == "ROTATE" || word == "TRANS" || word == "MSYS" || word == "TLAXIS") {
    return "have the post write the motions themselves, as GOTO in the part's coordinates";
  }
  if (word == "TLON" || word == "INDIRV" || word == "INDIRP" || word == "AUTOPS" || word == "GOFWD") {
    return "have the post write arcs as CIRCLE with points, or as MOVARC";
  }
  return "not a word of this machine; see the table of supported words";
}

using Vector = std::array<double, 3>;

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// The circle that the next points belong to.
struct Circle {
  Vector center{};
  std::size_t normal = 2;  // index of the coordinate along its axis
  double radius_mm = 0.0;
  std::size_t operation = 0;  // of its arc; valid if begun
  bool begun = false;
  Vector start{};
  double swept_rad = 0.0;
  CldataPlace place;
  double said_sweep_rad = 0.0;  // MOVARC; 0: CIRCLE
};

class Reader {
 public:
  Reader(std::string_view text, const CldataOptions& options)
      : text_(text), options_(options), lines_(WithoutMark(text)) {}

  PartProgram Read() {
    if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF")) {
      Fault({1, 1, {}}, "NOT_UTF8", "the file is UTF-16; save it as UTF-8 or ASCII");
      return std::move(program_);
    }
    CldataFault fault;
    while (!stopped_ && program_.faults.size() < options_.fault_limit && lines_.Next(statement_, fault)) {
      if (finished_) {
        Fault(statement_.place, "TEXT_AFTER_FINI", "FINI ends the file");
        break;
      }
      if (fault.reason != nullptr) {
        Fault(fault.place, fault.reason, fault.message);
        continue;
      }
      Obey();
    }
    program_.line_count = lines_.line_count();
    CloseProgram();
    return std::move(program_);
  }

 private:
  static std::string_view WithoutMark(std::string_view text) {
    return text.starts_with("\xEF\xBB\xBF") ? text.substr(3) : text;
  }

  void CloseProgram() {
    if (finished_ || stopped_ || !program_.faults.empty()) {
      return;
    }
    Fault({lines_.line_count(), 0, {}}, anything_ ? "PROGRAM_END_MISSING" : "PROGRAM_EMPTY",
          anything_ ? "the program ends without FINI; is it complete?"
                    : "there is nothing to do; write at least a motion and FINI");
  }

  // ---- one statement ----

  bool Obey() {
    anything_ = true;
    const MajorWord* word = Find(statement_.major);
    if (word == nullptr) {
      return Fault(statement_.place, "UNKNOWN_WORD", AdviceOn(statement_.major));
    }
    if (ended_ && word->major != Major::kFinish && word->major != Major::kText) {
      return Fault(statement_.place, "STATEMENT_AFTER_END", "END ends the program; only FINI may follow");
    }
    if (word->major != Major::kGoto) {
      circle_.reset();
    }
    if (rapid_ && word->major != Major::kGoto && word->major != Major::kGodelta &&
        word->major != Major::kText) {
      return Fault(statement_.place, "RAPID_WITHOUT_MOTION", "RAPID belongs to the GOTO that follows it");
    }
    if (drills_ && MovesWithoutHole(word->major)) {
      return Fault(
          statement_.place, "CYCLE_STILL_ON",
          "CYCLE/OFF must stand before a motion that drills nothing; under a cycle every GOTO is a hole");
    }
    return Obey(word->major);
  }

  static bool MovesWithoutHole(Major major) {
    return major == Major::kRapid || major == Major::kGodelta || major == Major::kFrom ||
           major == Major::kCircle || major == Major::kMoveArc;
  }

  bool Obey(Major major) {
    switch (major) {
      case Major::kText:
        return true;
      case Major::kUnits:
        return Units();
      case Major::kFrom:
        return From();
      case Major::kGoto:
        return Goto();
      case Major::kGodelta:
        return GoDelta();
      case Major::kRapid:
        return Count(0, 0) && (rapid_ = true);
      case Major::kFeedrate:
        return Feedrate();
      case Major::kCircle:
        return ReadCircle();
      case Major::kMoveArc:
        return MoveArc();
      case Major::kCutter:
        return Cutter();
      case Major::kToolCompensation:
        return ToolCompensation();
      case Major::kMultax:
        return Multax();
      default:
        return ObeySwitch(major);
    }
  }

  bool ObeySwitch(Major major) {
    switch (major) {
      case Major::kCycle:
        return Cycle();
      case Major::kSpindle:
        return Spindle();
      case Major::kAuxiliary:
        return Auxiliary();
      case Major::kCoolant:
        return Coolant();
      case Major::kDelay:
        return Delay();
      case Major::kLoadTool:
        return LoadTool();
      case Major::kTolerance:
        return Tolerance();
      case Major::kStop:
        return Count(0, 0) && Add(OperationKind::kStop);
      case Major::kEnd:
        return Count(0, 0) && End();
      default:
        finished_ = true;
        return Count(0, 0) && (ended_ || End());
    }
  }

  // ---- modes ----

  bool Units() {
    if (!Count(1, 1)) {
      return false;
    }
    const std::string& unit = At(0).word;
    if (unit != "MM" && unit != "INCHES" && unit != "INCH" && unit != "CM") {
      return Fault(At(0).place, "UNIT_UNKNOWN", "MM, CM and INCHES are known");
    }
    if (moved_) {
      return Fault(statement_.place, "UNITS_AFTER_MOTION", "UNITS must stand before the first motion");
    }
    unit_mm_ = unit == "MM" ? 1.0 : unit == "CM" ? 10.0 : kInchMm;
    Operation* o = Add(OperationKind::kUnitsChange);
    o->value = unit_mm_;
    return true;
  }

  // A number and a unit in either order; without unit the program's length unit a minute.
  bool Feedrate() {
    if (!Count(1, 2)) {
      return false;
    }
    const std::size_t number = At(0).is_number ? 0 : 1;
    const bool has_unit = Size() == 2;
    if (number >= Size() || !At(number).is_number || (has_unit && At(1 - number).is_number)) {
      return Fault(At(0).place, "FEED_NOT_A_NUMBER", "a feed is a number and a unit, as in FEDRAT/1200,MMPM");
    }
    const double f = At(number).value;
    if (!(f > 0.0 && f < 1e9)) {
      return Fault(At(number).place, "FEED_NOT_POSITIVE", "the feed must be above 0");
    }
    return has_unit ? FeedIn(At(1 - number), f) : SetFeed(f * unit_mm_ / kSecondsPerMinute);
  }

  bool FeedIn(const CldataParameter& unit, double f) {
    if (unit.word == "INVERS") {
      move_s_ = kSecondsPerMinute / f;
      return true;
    }
    if (!IsFeedUnit(unit.word)) {
      return Fault(unit.place, "FEED_UNIT_UNKNOWN",
                   "MMPM, IPM, MMPS, PERMIN, MMPR, IPR, PERREV and INVERS are known");
    }
    CldataFault fault;
    double feed_mm_per_s = 0.0;
    return lambdajet::trajectory::FeedIn(unit, f, {unit_mm_, spindle_per_min_}, feed_mm_per_s, fault)
               ? SetFeed(feed_mm_per_s)
               : Fault(fault.place, fault.reason, fault.message);
  }

  bool SetFeed(double feed_mm_per_s) {
    move_s_ = 0.0;
    if (feed_mm_per_s != feed_mm_per_s_) {
      feed_mm_per_s_ = feed_mm_per_s;
      Add(OperationKind::kFeedChange);
    }
    return true;
  }

  // CUTTER/d,…; TLDATA/MILL,d,…: the diameter of the jet, of which half is the offset that TLCOMP asks for.
  bool Cutter() {
    const std::size_t at = statement_.major == "TLDATA" ? 1 : 0;
    if (!Count(at + 1, kMostParameters)) {
      return false;
    }
    if (!At(at).is_number || !(At(at).value >= 0.0) || At(at).value * unit_mm_ > 1000.0) {
      return Fault(At(at).place, "CUTTER_DIAMETER_OUT_OF_RANGE", "a cutter's diameter is 0 to 1000 mm");
    }
    cutter_mm_ = At(at).value * unit_mm_;
    SetKerf();
    return true;
  }

  bool ToolCompensation() {
    if (!Count(1, 2)) {
      return false;
    }
    const std::string& side = At(0).word;
    if (side == "ON") {
      return true;  // some posts write it before LEFT or RIGHT
    }
    if (side != "LEFT" && side != "RIGHT" && side != "OFF") {
      return Fault(At(0).place, "COMPENSATION_UNKNOWN", "LEFT, RIGHT and OFF are known");
    }
    if (side != "OFF" && !(cutter_mm_ > 0.0)) {
      return Fault(statement_.place, "CUTTER_MISSING", "CUTTER/diameter must stand before, the jet's width");
    }
    side_ = side == "LEFT" ? 1.0 : side == "RIGHT" ? -1.0 : 0.0;
    SetKerf();
    return true;
  }

  void SetKerf() { kerf_offset_mm_ = side_ == 0.0 ? 0.0 : side_ * 0.5 * cutter_mm_; }

  bool Multax() {
    if (!Count(0, 1)) {
      return false;
    }
    if (Size() == 1 && At(0).word != "ON" && At(0).word != "OFF") {
      return Fault(At(0).place, "MULTAX_UNKNOWN", "ON and OFF are known");
    }
    multax_ = Size() == 0 || At(0).word == "ON";
    if (!multax_) {
      axis_ = {0.0, 0.0, 1.0};
    }
    return true;
  }

  bool Tolerance() {
    if (!Count(1, 1)) {
      return false;
    }
    const double mm = At(0).value * unit_mm_;
    if (!At(0).is_number || !(mm >= 0.0 && mm <= 10.0)) {
      return Fault(At(0).place, "TOLERANCE_OUT_OF_RANGE",
                   "a path tolerance is 0 (visit every corner) to 10 mm");
    }
    Add(OperationKind::kPathTolerance)->value = mm;
    return true;
  }

  bool LoadTool() {
    if (!Count(1, kMostParameters)) {
      return false;
    }
    const CldataParameter& tool = At(0).word == "TOOL" && Size() > 1 ? At(1) : At(0);
    if (!tool.is_number) {
      return Fault(tool.place, "TOOL_NUMBER_MISSING", "a tool is named by its number");
    }
    if (tool_ && *tool_ != tool.value) {
      return Fault(tool.place, "TOOL_CHANGE", "this machine has one tool; split the program");
    }
    tool_ = tool.value;
    return true;
  }

  // ---- switches ----

  // A jet has no revolutions, but a wheel's program needs them for feeds a revolution.
  bool Spindle() {
    if (!Count(1, 8)) {
      return false;
    }
    bool off = false;
    double sense = spindle_sense_;
    const CldataParameter* speed = nullptr;
    for (std::size_t i = 0; i < Size(); ++i) {
      const CldataParameter& p = At(i);
      static constexpr std::array<std::string_view, 8> kWords = {"ON",  "OFF", "RPM",  "SFM",
                                                                 "SMM", "CLW", "CCLW", "RANGE"};
      if (!p.is_number && std::find(kWords.begin(), kWords.end(), p.word) == kWords.end()) {
        return Fault(p.place, "SPINDLE_WORD_UNKNOWN", "ON, OFF, RPM, CLW and CCLW are known");
      }
      if (HasSpindle() && (p.word == "SFM" || p.word == "SMM")) {
        return Fault(p.place, "SPINDLE_UNIT_UNKNOWN", "a spindle's speed is in turns a minute, RPM");
      }
      off = off || p.word == "OFF";
      sense = p.word == "CLW" ? 1.0 : p.word == "CCLW" ? -1.0 : sense;
      const bool of_range = i > 0 && At(i - 1).word == "RANGE";
      speed = p.is_number && !of_range ? &p : speed;
    }
    if (speed != nullptr && !SetSpindleSpeed(*speed)) {
      return false;
    }
    return HasSpindle() ? Turn(off, sense) : off ? JetOff() : Pierce(0.0);
  }

  bool SetSpindleSpeed(const CldataParameter& p) {
    if (!(p.value > 0.0)) {
      return Fault(p.place, "SPINDLE_SPEED_NOT_POSITIVE",
                   "a spindle's speed is above 0; SPINDL/OFF stops it");
    }
    const SpindleRange& range = options_.spindle;
    if (HasSpindle() && range.most_per_min > 0.0 &&
        !(p.value >= range.least_per_min && p.value <= range.most_per_min)) {
      return Fault(p.place, "SPINDLE_SPEED_OUT_OF_RANGE",
                   "this spindle turns " + Number(range.least_per_min) + " to " + Number(range.most_per_min) +
                       " times a minute");
    }
    spindle_per_min_ = p.value;
    return true;
  }

  bool HasSpindle() const { return Has(kAxisZ); }

  bool Turn(bool off, double sense) {
    if (off) {
      if (spindle_turns_) {
        Add(OperationKind::kSpindleOff);
      }
      spindle_turns_ = false;
      return true;
    }
    if (!(options_.spindle.most_per_min > 0.0)) {
      return Fault(statement_.place, "SPINDLE_MISSING", "this machine has no spindle");
    }
    if (!(spindle_per_min_ > 0.0)) {
      return Fault(statement_.place, "SPINDLE_SPEED_MISSING",
                   "SPINDL must say the speed first, as in SPINDL/3000,RPM,CLW");
    }
    const double turns = sense * spindle_per_min_;
    if (!spindle_turns_ || turns != turns_per_min_) {
      Add(OperationKind::kSpindleOn)->value = turns;
    }
    spindle_turns_ = true;
    spindle_sense_ = sense;
    turns_per_min_ = turns;
    return true;
  }

  bool Pierce(double time_s) {
    if (jet_on_) {
      return Fault(statement_.place, "JET_ALREADY_ON", "SPINDL/OFF must stand before the next pierce");
    }
    Add(OperationKind::kPierce)->value = time_s;
    jet_on_ = abrasive_on_ = true;
    return true;
  }

  // Abrasive without water would only fill the tube.
  bool JetOff() {
    if (abrasive_on_) {
      Add(OperationKind::kAbrasiveOff);
    }
    Add(OperationKind::kJetOff);
    jet_on_ = abrasive_on_ = false;
    return true;
  }

  // On a machine with a spindle the same words mean its coolant.
  bool Abrasive(bool on) {
    if (on != abrasive_on_) {
      Add(HasSpindle() ? on ? OperationKind::kCoolantOn : OperationKind::kCoolantOff
          : on         ? OperationKind::kAbrasiveOn
                       : OperationKind::kAbrasiveOff);
      abrasive_on_ = on;
    }
    return true;
  }

  bool Coolant() {
    if (!Count(1, 2)) {
      return false;
    }
    static constexpr std::array<std::string_view, 6> kWords = {"ON", "OFF", "FLOOD", "MIST", "THRU", "TAP"};
    if (std::find(kWords.begin(), kWords.end(), At(0).word) == kWords.end()) {
      return Fault(At(0).place, "COOLANT_WORD_UNKNOWN", "ON, OFF, FLOOD, MIST and THRU are known");
    }
    return Abrasive(At(0).word != "OFF");
  }

  bool Delay() {
    if (!Count(1, 1)) {
      return false;
    }
    if (!At(0).is_number || !(At(0).value >= 0.0 && At(0).value <= 3600.0)) {
      return Fault(At(0).place, "DWELL_TIME_OUT_OF_RANGE", "a dwell takes 0 to 3600 s");
    }
    Add(OperationKind::kDwell)->value = At(0).value;
    return true;
  }

  // AUXFUN/n,p is M n P p.
  bool Auxiliary() {
    if (!Count(1, 2)) {
      return false;
    }
    for (std::size_t i = 0; i < Size(); ++i) {
      if (!At(i).is_number) {
        return Fault(At(i).place, "BAD_NUMBER",
                     "AUXFUN takes the number of an M word, and what its P would be");
      }
    }
    const double m = At(0).value;
    const double* p = Size() == 2 ? &At(1).value : nullptr;
    const bool known = m == 0 || m == 1 || m == 2 || m == 3 || m == 4 || m == 5 || m == 7 || m == 8 ||
                       m == 9 || m == 30 || m == 62 || m == 63 || m == 100 || m == 101 || m == 102;
    if (!known) {
      return Fault(At(0).place, "UNKNOWN_M_CODE",
                   "not a word of this machine; see the table of supported words");
    }
    const bool takes = (!HasSpindle() && (m == 3 || m == 4)) || m == 62 || m == 63 || m == 100 || m == 101;
    if (p != nullptr && !takes) {
      return Fault(At(1).place, "WORD_WITHOUT_USE", "this M word takes no number");
    }
    return m == 62 || m == 63 ? Output(m == 62, p) : m >= 100 ? Mark(m, p) : Machine(m, p);
  }

  bool Machine(double m, const double* p) {
    if (HasSpindle() && m >= 3 && m <= 5) {
      return Turn(m == 5, m == 4 ? -1.0 : 1.0);
    }
    if (m == 3 || m == 4) {
      return (p == nullptr || (*p > 0.0 && *p <= 600.0))
                 ? Pierce(p != nullptr ? *p : 0.0)
                 : Fault(At(1).place, "PIERCE_TIME_OUT_OF_RANGE",
                         "a pierce takes more than 0 and at most 600 s");
    }
    if (m == 5) {
      return JetOff();
    }
    if (m >= 7 && m <= 9) {
      return Abrasive(m != 9);
    }
    return m < 2 ? Add(OperationKind::kStop) != nullptr : End();
  }

  bool Output(bool on, const double* p) {
    if (HasSpindle()) {
      return Fault(At(0).place, "OUTPUT_UNKNOWN",
                   "this machine has no jet; SPINDL and COOLNT switch what it has");
    }
    if (p == nullptr || (*p != 0.0 && *p != 1.0)) {
      return Fault(At(0).place, "OUTPUT_UNKNOWN", "AUXFUN/62,0 is the jet, AUXFUN/62,1 the abrasive");
    }
    if (*p == 1.0) {
      Add(on ? OperationKind::kAbrasiveOn : OperationKind::kAbrasiveOff);
      abrasive_on_ = on;
      return true;
    }
    if (!on) {
      return JetOff();
    }
    Add(OperationKind::kJetOn);
    return jet_on_ = true;
  }

  bool Mark(double m, const double* p) {
    if (m == 102) {
      return Add(OperationKind::kCameraTrackOff) != nullptr;
    }
    if (p == nullptr || !(*p >= 0.0 && *p <= 1e6) || *p != std::floor(*p)) {
      return Fault(At(0).place, "MARK_MISSING",
                   "the second number must name the mark, a whole number from 0");
    }
    if (m == 100 && jet_on_) {
      return Fault(statement_.place, "MEASURE_WITH_JET_ON", "SPINDL/OFF must stand before");
    }
    Add(m == 100 ? OperationKind::kMeasure : OperationKind::kCameraTrackOn)->value = *p;
    return true;
  }

  bool End() {
    if (jet_on_) {
      JetOff();
    }
    if (HasSpindle()) {
      Turn(true, 0.0);
      Abrasive(false);
    }
    Add(OperationKind::kEnd);
    ended_ = true;
    return true;
  }

  // ---- motion ----

  bool From() {
    if (moved_) {
      return Fault(statement_.place, "FROM_AFTER_MOTION", "FROM says where the program begins; GOTO moves");
    }
    Vector target;
    if (!Target(target)) {
      return false;
    }
    Move(OperationKind::kTraverse, target);
    return true;
  }

  bool Goto() {
    Vector target;
    if (!Target(target)) {
      return false;
    }
    if (drills_) {
      return Drill(target);
    }
    if (rapid_) {
      return Traverse(target);
    }
    if (circle_) {
      const Verdict verdict = AlongCircle(target);
      if (verdict != Verdict::kNotOnCircle) {
        return verdict == Verdict::kMoved;
      }
      circle_.reset();
    }
    return Line(target);
  }

  // Along the coordinates, or with one number along the tool's axis.
  bool GoDelta() {
    if (!Count(1, 3)) {
      return false;
    }
    if (Size() == 2) {
      return Fault(statement_.place, "PARAMETER_COUNT",
                   "GODLTA takes dx,dy,dz or one distance along the tool's axis");
    }
    Vector target = position_;
    for (std::size_t i = 0; i < 3; ++i) {
      const CldataParameter& p = At(Size() == 1 ? 0 : i);
      if (!Coordinate(p)) {
        return false;
      }
      target[i] += p.value * unit_mm_ * (Size() == 1 ? axis_[i] : 1.0);
    }
    if (!CoordinatesFit(target) || !Driven(target)) {
      return false;
    }
    return rapid_ ? Traverse(target) : Line(target);
  }

  bool Traverse(const Vector& target) {
    rapid_ = false;
    if (jet_on_) {
      return Fault(statement_.place, "TRAVERSE_WITH_JET_ON",
                   "the jet is on; switch it off or cut with a feed");
    }
    Move(OperationKind::kTraverse, target);
    return true;
  }

  bool Line(const Vector& target) {
    if (!HasFeed()) {
      return false;
    }
    const double length =
        std::hypot(target[0] - position_[0], target[1] - position_[1], target[2] - position_[2]);
    Operation& o = Move(OperationKind::kFeedLine, target);
    SetDuration(o, length);
    return true;
  }

  // A time instead of a feed: a feed where there is a way, a duration where there is none.
  void SetDuration(Operation& o, double length_mm) const {
    if (move_s_ > 0.0) {
      o.feed_mm_per_s = length_mm / move_s_;
      o.value = length_mm > 0.0 ? 0.0 : move_s_;
    }
  }

  bool HasFeed() {
    return feed_mm_per_s_ > 0.0 || move_s_ > 0.0 ||
           Fault(statement_.place, "FEED_MISSING", "FEDRAT must stand before the first GOTO that cuts");
  }

  // GOTO/x,y,z or, with MULTAX, GOTO/x,y,z,i,j,k; checks the machine's axes.
  bool Target(Vector& target) {
    if (!Count(2, 6)) {
      return false;
    }
    if (Size() == 4 || Size() == 5) {
      return Fault(statement_.place, "PARAMETER_COUNT", "a point is x,y,z or x,y,z,i,j,k");
    }
    for (std::size_t i = 0; i < Size(); ++i) {
      if (!Coordinate(At(i))) {
        return false;
      }
    }
    target = {At(0).value * unit_mm_, At(1).value * unit_mm_,
              Size() > 2 ? At(2).value * unit_mm_ : position_[2]};
    return (Size() < 6 || ToolAxis()) && Driven(target);
  }

  bool Coordinate(const CldataParameter& p) {
    if (!p.is_number) {
      return Fault(p.place, "BAD_NUMBER", "a coordinate is a number");
    }
    return std::abs(p.value * unit_mm_) <= options_.largest_coordinate_mm ||
           Fault(p.place, "COORDINATE_TOO_LARGE", "a coordinate is at most 1e6 mm");
  }

  bool ToolAxis() {
    const Vector axis = {At(3).value, At(4).value, At(5).value};
    const double length = std::sqrt(Dot(axis, axis));
    if (std::abs(length - 1.0) > kVectorTolerance) {
      return Fault(At(3).place, "TOOL_AXIS_NOT_UNIT", "a tool axis has the length 1, not " + Number(length));
    }
    const bool upright =
        std::abs(axis[0]) < kAxisTolerance && std::abs(axis[1]) < kAxisTolerance && axis[2] > 0.0;
    if (!multax_ && !upright) {
      return Fault(At(3).place, "MULTAX_MISSING", "MULTAX/ON must stand before a tool axis other than 0,0,1");
    }
    if (!upright && !Has(kAxisA) && !Has(kAxisB)) {
      return Fault(At(3).place, "AXIS_NOT_DRIVEN",
                   "this machine's jet does not tilt; the tool axis is 0,0,1");
    }
    axis_ = {axis[0] / length, axis[1] / length, axis[2] / length};
    return true;
  }

  bool Has(AxisBit bit) const { return (options_.axes & bit) != 0; }

  // A machine without Z keeps the height that the program began at.
  bool Driven(const Vector& target) {
    if (!Has(kAxisZ) && moved_ && std::abs(target[2] - position_[2]) > 1e-9) {
      return Fault(
          At(Size() == 1 ? 0 : 2).place, "AXIS_NOT_DRIVEN",
          "part programs of this machine move X and Y only; Z was " + Number(position_[2]) + " mm before");
    }
    return true;
  }

  // ---- holes ----

  bool Cycle() {
    const bool on = Size() == 1 && At(0).word == "ON";
    if (on || (Size() == 1 && At(0).word == "OFF")) {
      drills_ = on;
      return !on || cycle_ ||
             Fault(statement_.place, "CYCLE_UNKNOWN",
                   "CYCLE/ON goes on with a cycle, and none stands before");
    }
    drills_ = false;
    if (!Has(kAxisZ)) {
      return Fault(statement_.place, "CYCLE_AXIS_NOT_DRIVEN", "drilling cycles need a machine that moves Z");
    }
    CldataCycle cycle;
    CldataFault fault;
    if (!ReadCycle(statement_, {unit_mm_, spindle_per_min_}, cycle, fault)) {
      return Fault(fault.place, fault.reason, fault.message);
    }
    cycle_ = cycle;
    return drills_ = true;
  }

  bool Drill(const Vector& entry) {
    if (!cycle_) {
      return false;  // after a CYCLE/ON that was refused
    }
    const double feed_mm_per_s = cycle_->feed_mm_per_s > 0.0 ? cycle_->feed_mm_per_s : feed_mm_per_s_;
    if (!DrillsHere(feed_mm_per_s) || !WithinReach(entry) || !RiseOver(entry)) {
      return false;
    }
    const double height = moved_ ? HeightOver(entry, position_) : 0.0;
    if (height > cycle_->heights.clear_mm + kSamePlace_mm) {
      Move(OperationKind::kTraverse, Over(entry, height));
    }
    const std::vector<HoleStep> steps = StepsOf(cycle_->heights);
    for (std::size_t i = StandsAt(Over(entry, steps.front().height_mm)) ? 1 : 0;
         i < steps.size() && !stopped_; ++i) {
      if (i + 1 == steps.size() && cycle_->dwell_s > 0.0) {
        Add(OperationKind::kDwell)->value = cycle_->dwell_s;
      }
      Operation& o = Move(steps[i].feeds ? OperationKind::kFeedLine : OperationKind::kTraverse,
                          Over(entry, steps[i].height_mm));
      o.feed_mm_per_s = feed_mm_per_s;
    }
    return !stopped_;
  }

  bool StandsAt(const Vector& p) const {
    const double turned = std::hypot(stands_[0] - axis_[0], stands_[1] - axis_[1], stands_[2] - axis_[2]);
    return moved_ && turned < kAxisTolerance &&
           std::hypot(p[0] - position_[0], p[1] - position_[1], p[2] - position_[2]) < kSamePlace_mm;
  }

  bool DrillsHere(double feed_mm_per_s) {
    if (kerf_offset_mm_ != 0.0) {
      return Fault(statement_.place, "CYCLE_WITH_COMPENSATION", "TLCOMP/OFF must stand before a hole");
    }
    if (cycle_->feed_mm_per_s == 0.0 && move_s_ > 0.0) {
      return Fault(statement_.place, "CYCLE_INVERSE_TIME", "a cycle feeds in millimetres or inches a minute");
    }
    if (axis_[2] < kLeastRise) {
      return Leans();
    }
    return feed_mm_per_s > 0.0 ||
           Fault(statement_.place, "FEED_MISSING", "CYCLE or FEDRAT must say the feed before the first hole");
  }

  Vector Over(const Vector& entry, double height_mm) const {
    return {entry[0] + height_mm * axis_[0], entry[1] + height_mm * axis_[1],
            entry[2] + height_mm * axis_[2]};
  }

  // Along the tool's axis over the plane of W in which the hole begins, as G81 counts.
  double HeightOver(const Vector& entry, const Vector& p) const { return (p[2] - entry[2]) / axis_[2]; }

  bool WithinReach(const Vector& entry) {
    const HoleHeights& h = cycle_->heights;
    for (const double height : {h.clear_mm, h.bottom_mm}) {
      if (!CoordinatesFit(Over(entry, height))) {
        return false;
      }
    }
    return true;
  }

  bool CoordinatesFit(const Vector& p) {
    const bool fit = std::all_of(p.begin(), p.end(),
                                 [this](double x) { return std::abs(x) <= options_.largest_coordinate_mm; });
    return fit || Fault(statement_.place, "COORDINATE_TOO_LARGE", "a coordinate is at most 1e6 mm");
  }

  // From below the height at which the next hole is gone to: out along the tool as it stands.
  bool RiseOver(const Vector& entry) {
    const double missing_mm = cycle_->heights.clear_mm - HeightOver(entry, position_);
    if (!moved_ || missing_mm <= kSamePlace_mm) {
      return true;
    }
    if (stands_[2] < kLeastRise) {
      return Leans();
    }
    const Vector axis = axis_;
    axis_ = stands_;
    const Vector risen = Over(position_, missing_mm * axis[2] / stands_[2]);
    const bool fits = CoordinatesFit(risen);
    if (fits) {
      Move(OperationKind::kTraverse, risen);
    }
    axis_ = axis;
    return fits;
  }

  bool Leans() {
    return Fault(statement_.place, "CYCLE_TOOL_LEANS",
                 "in a cycle, and on the way to it, the tool leans by at most 60 degrees from Z");
  }

  // ---- circles ----

  bool CircleFrom(Circle& circle) {
    for (std::size_t i = 0; i < Size() && i < 7; ++i) {
      if (!Coordinate(At(i))) {
        return false;
      }
    }
    const bool short_form = Size() == 4;  // x,y,z,r: about Z
    const Vector axis = short_form ? Vector{0.0, 0.0, 1.0} : Vector{At(3).value, At(4).value, At(5).value};
    const CldataParameter& radius = At(short_form ? 3 : 6);
    const double length = std::sqrt(Dot(axis, axis));
    circle.normal = static_cast<std::size_t>(
        std::max_element(axis.begin(), axis.end(),
                         [](double a, double b) { return std::abs(a) < std::abs(b); }) -
        axis.begin());
    if (std::abs(length - 1.0) > kVectorTolerance ||
        std::abs(axis[circle.normal]) < length * (1.0 - kAxisTolerance)) {
      return Fault(At(3).place, "CIRCLE_AXIS_OBLIQUE", "a circle's axis is along X, Y or Z, of length 1");
    }
    if (circle.normal != 2 && !Has(kAxisZ)) {
      return Fault(At(3).place, "AXIS_NOT_DRIVEN", "the sheet is the XY plane; a circle's axis is 0,0,1");
    }
    if (!(radius.value * unit_mm_ > 1e-9)) {
      return Fault(radius.place, "ARC_RADIUS_ZERO", "a circle has a radius above 0");
    }
    circle.center = {At(0).value * unit_mm_, At(1).value * unit_mm_, At(2).value * unit_mm_};
    circle.radius_mm = radius.value * unit_mm_;
    circle.start = position_;
    circle.place = statement_.place;
    circle.said_sweep_rad = axis[circle.normal] > 0.0 ? 1.0 : -1.0;  // MOVARC: times its angle
    return StartsOn(circle);
  }

  bool StartsOn(const Circle& circle) {
    if (!moved_) {
      return Fault(statement_.place, "CIRCLE_WITHOUT_START", "FROM or GOTO must say where the arc begins");
    }
    const double off = RadiusOf(circle, position_) - circle.radius_mm;
    return std::abs(off) <= options_.arc_radius_tolerance_mm ||
           Fault(statement_.place, "ARC_RADIUS_DIFFERS",
                 "the arc's start lies " + Number(off) + " mm off the circle; at most " +
                     Number(options_.arc_radius_tolerance_mm) + " mm are allowed");
  }

  bool ReadCircle() {
    if (!Count(4, kMostParameters)) {
      return false;
    }
    if (Size() == 5 || Size() == 6) {
      return Fault(statement_.place, "PARAMETER_COUNT", "a circle is x,y,z,i,j,k,r or x,y,z,r");
    }
    Circle circle;
    if (!HasFeed() || !CircleFrom(circle)) {
      return false;
    }
    circle.said_sweep_rad = 0.0;
    circle_ = circle;
    return true;
  }

  bool MoveArc() {
    if (!Count(9, 9)) {
      return false;
    }
    Circle circle;
    if (!HasFeed() || !CircleFrom(circle)) {
      return false;
    }
    const double angle = At(8).value * kPi / 180.0;
    if (At(7).word != "ANGLE" || !At(8).is_number || !(angle > 0.0 && angle <= 1000.0 * kFull)) {
      return Fault(At(7).place, "ARC_ANGLE_MISSING", "MOVARC ends in ANGLE and an angle above 0 degrees");
    }
    circle.said_sweep_rad *= angle;
    circle_ = circle;
    return true;
  }

  // The two coordinates of a circle's plane, in the order that makes it right-handed about its axis.
  static double First(const Circle& c, const Vector& p) {
    return p[(c.normal + 1) % 3] - c.center[(c.normal + 1) % 3];
  }
  static double Second(const Circle& c, const Vector& p) {
    return p[(c.normal + 2) % 3] - c.center[(c.normal + 2) % 3];
  }
  static double RadiusOf(const Circle& c, const Vector& p) { return std::hypot(First(c, p), Second(c, p)); }
  static double AngleOf(const Circle& c, const Vector& p) { return std::atan2(Second(c, p), First(c, p)); }

  enum class Verdict : std::uint8_t { kMoved, kNotOnCircle, kFault };

  Verdict AlongCircle(const Vector& target) {
    Circle& c = *circle_;
    const double off = RadiusOf(c, target) - c.radius_mm;
    if (std::abs(off) > options_.arc_radius_tolerance_mm) {
      if (c.begun) {
        return Verdict::kNotOnCircle;
      }
      Fault(statement_.place, "ARC_RADIUS_DIFFERS",
            "the point lies " + Number(off) + " mm off the circle; at most " +
                Number(options_.arc_radius_tolerance_mm) + " mm are allowed");
      return Verdict::kFault;
    }
    double turn = std::remainder(AngleOf(c, target) - AngleOf(c, position_), kFull);
    if (c.said_sweep_rad != 0.0) {
      turn = c.said_sweep_rad + std::remainder(turn - c.said_sweep_rad, kFull);
    }
    if (!DirectionKnown(c, turn)) {
      return Verdict::kFault;
    }
    if (turn != 0.0) {
      Sweep(c, target, turn);
    }
    if (c.said_sweep_rad != 0.0) {
      circle_.reset();
    }
    return Verdict::kMoved;
  }

  bool DirectionKnown(const Circle& c, double turn) {
    if (c.said_sweep_rad != 0.0) {
      return std::abs(turn - c.said_sweep_rad) <= kAngleTolerance_rad ||
             Fault(statement_.place, "ARC_ANGLE_DIFFERS", "the point is not where the angle of MOVARC leads");
    }
    if (std::abs(turn) > kPi - kAngleTolerance_rad) {
      return Fault(statement_.place, "CIRCLE_DIRECTION_UNKNOWN",
                   "half a turn or more from the point before; write points between, or MOVARC");
    }
    return !c.begun || turn * c.swept_rad >= 0.0 ||
           Fault(statement_.place, "CIRCLE_TURNS_BACK",
                 "the points of a circle turn one way; write CIRCLE again");
  }

  // Begins the arc's operation or goes on with it.
  void Sweep(Circle& c, const Vector& target, double turn) {
    if (!c.begun) {
      c.operation = program_.operations.size();
      c.begun = true;
      Move(OperationKind::kFeedArc, target);
    }
    c.swept_rad += turn;
    Operation& o = program_.operations[c.operation];
    SetPosition(o, target);
    position_ = target;
    // From start, end and centre alone, so that the points between leave no trace in the last digits.
    Circle settled = c;
    settled.center = CenterBetween(c, target);
    const double direct = AngleOf(settled, target) - AngleOf(settled, c.start);
    o.sweep_rad = direct + kFull * std::round((c.swept_rad - direct) / kFull);
    o.plane = c.normal == 2 ? ArcPlane::kXy : c.normal == 1 ? ArcPlane::kZx : ArcPlane::kYz;
    o.center_x_W_mm = settled.center[0];
    o.center_y_W_mm = settled.center[1];
    o.center_z_W_mm = Has(kAxisZ) ? settled.center[2] : 0.0;
    SetDuration(o, std::hypot(c.radius_mm * o.sweep_rad, target[c.normal] - c.start[c.normal]));
  }

  // The centre moved onto the bisector of the chord, so that start and end lie on one circle; left as it is where they do.
  static Vector CenterBetween(const Circle& c, const Vector& end) {
    Vector center = c.center;
    center[c.normal] = end[c.normal];
    const double from = RadiusOf(c, c.start), to = RadiusOf(c, end);
    const double u = First(c, end) - First(c, c.start), v = Second(c, end) - Second(c, c.start);
    const double chord2 = u * u + v * v;
    if (std::abs(from - to) < 1e-9 || chord2 < 1e-12) {
      return center;
    }
    const double along =
        -0.5 * ((First(c, c.start) + First(c, end)) * u + (Second(c, c.start) + Second(c, end)) * v) / chord2;
    center[(c.normal + 1) % 3] -= along * u;
    center[(c.normal + 2) % 3] -= along * v;
    return center;
  }

  // ---- leaves ----

  std::size_t Size() const { return statement_.parameters.size(); }
  const CldataParameter& At(std::size_t i) const { return statement_.parameters[i]; }

  bool Count(std::size_t least, std::size_t most) {
    return (Size() >= least && Size() <= most) ||
           Fault(statement_.place, "PARAMETER_COUNT",
                 statement_.major + " takes " + std::to_string(least) +
                     (most == least ? "" : " to " + std::to_string(most)) + " parameters, not " +
                     std::to_string(Size()));
  }

  Operation* Add(OperationKind kind) {
    Operation& o = program_.operations.emplace_back();
    o.kind = kind;
    o.axes = options_.axes;
    o.line = statement_.place.line;
    o.feed_mm_per_s = feed_mm_per_s_;
    SetPosition(o, position_);
    if (program_.operations.size() >= options_.operation_limit) {
      Fault({0, 0, {}}, "PROGRAM_TOO_LONG", "more operations than the limit; split the program");
      stopped_ = true;
    }
    return &o;
  }

  void SetPosition(Operation& o, const Vector& p) const {
    o.x_W_mm = p[0];
    o.y_W_mm = p[1];
    if (Has(kAxisZ)) {
      o.z_W_mm = p[2];
      const HeadAngles angles = AnglesOf(options_.tool_angles, axis_);
      o.a_rad = angles.a_rad;
      o.b_rad = angles.b_rad;
    }
  }

  Operation& Move(OperationKind kind, const Vector& target) {
    position_ = target;
    stands_ = axis_;
    moved_ = true;
    Operation* o = Add(kind);
    o->kerf_offset_mm = kerf_offset_mm_;
    return *o;
  }

  static std::string Number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
  }

  bool Fault(const CldataPlace& place, const char* reason, std::string message) {
    program_.faults.push_back(
        {place.line, place.column, reason, std::string(place.text), std::move(message)});
    return false;
  }

  std::string_view text_;
  const CldataOptions& options_;
  CldataLines lines_;
  PartProgram program_;
  CldataStatement statement_;
  bool anything_ = false, moved_ = false, ended_ = false, finished_ = false, stopped_ = false;

  Vector position_{};
  Vector axis_{0.0, 0.0, 1.0};
  Vector stands_{0.0, 0.0, 1.0};  // the axis at the last motion's end
  bool multax_ = false;
  std::optional<CldataCycle> cycle_;
  bool drills_ = false;
  bool rapid_ = false;
  std::optional<Circle> circle_;
  double unit_mm_ = 1.0;
  double feed_mm_per_s_ = 0.0;
  double move_s_ = 0.0;  // inverse time feed: how long every move takes
  double spindle_per_min_ = 0.0;
  double spindle_sense_ = 1.0;  // clockwise positive
  double turns_per_min_ = 0.0;
  bool spindle_turns_ = false;
  double cutter_mm_ = 0.0;
  double side_ = 0.0;
  double kerf_offset_mm_ = 0.0;
  std::optional<double> tool_;
  bool jet_on_ = false;
  bool abrasive_on_ = false;
};

}  // namespace

PartProgram ReadCldata(std::string_view text, const CldataOptions& options) {
  return Reader(text, options).Read();
}

bool LooksLikeCldata(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) {
    text.remove_prefix(3);
  }
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) {
    return false;
  }
  text.remove_prefix(first);
  if (text.starts_with("$$")) {
    return true;
  }
  CldataLines lines(text.substr(0, std::min(text.size(), text.find('\n'))));
  CldataStatement statement;
  CldataFault fault;
  return lines.Next(statement, fault) && statement.major.size() > 2 && Find(statement.major) != nullptr;
}

}  // namespace lambdajet::trajectory
