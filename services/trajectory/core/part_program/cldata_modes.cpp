#include <array>
#include <cmath>

#include "trajectory/core/part_program/cldata_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kSecondsPerMinute = 60.0;
constexpr double kInchMm = 25.4;

}  // namespace

bool CldataReading::Units() {
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
bool CldataReading::Feedrate() {
  if (!Count(1, 2)) {
    return false;
  }
  const std::size_t number = At(0).is_number ? 0 : 1;
  const bool has_unit = Size() == 2;
  if (number >= Size() || !At(number).is_number || (has_unit && At(1 - number).is_number)) {
    return Fault(At(0).place, "FEED_NOT_A_NUMBER", "a feed is a number and a unit, as in FEDRAT/1200,MMPM");
  }
  const double f = At(number).value;
  if (!(f > 0.0)) {
    return Fault(At(number).place, "FEED_NOT_POSITIVE", "the feed must be above 0");
  }
  return has_unit ? FeedIn(At(1 - number), At(number))
                  : SetFeed(At(number), f * unit_mm_ / kSecondsPerMinute);
}

bool CldataReading::FeedIn(const CldataParameter& unit, const CldataParameter& number) {
  if (unit.word == "INVERS") {
    move_s_ = kSecondsPerMinute / number.value;
    return true;
  }
  if (!IsFeedUnit(unit.word)) {
    return Fault(unit.place, "FEED_UNIT_UNKNOWN",
                 "MMPM, IPM, MMPS, PERMIN, MMPR, IPR, PERREV and INVERS are known");
  }
  CldataFault fault;
  double feed_mm_per_s = 0.0;
  return trajectory::FeedIn(unit, number.value, {unit_mm_, spindle_per_min_}, feed_mm_per_s, fault)
             ? SetFeed(number, feed_mm_per_s)
             : Fault(fault.place, fault.reason, fault.message);
}

bool CldataReading::SetFeed(const CldataParameter& number, double feed_mm_per_s) {
  if (!(feed_mm_per_s <= kFastestFeed_mm_per_s)) {
    return Fault(number.place, "FEED_OUT_OF_RANGE", "a feed is at most 1e7 mm/s");
  }
  move_s_ = 0.0;
  if (feed_mm_per_s != feed_mm_per_s_) {
    feed_mm_per_s_ = feed_mm_per_s;
    Add(OperationKind::kFeedChange);
  }
  return true;
}

// CUTTER/d,…; TLDATA/MILL,d,…: the diameter of the jet, of which half is the offset that TLCOMP asks for.
bool CldataReading::Cutter() {
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

bool CldataReading::ToolCompensation() {
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

void CldataReading::SetKerf() { kerf_offset_mm_ = side_ == 0.0 ? 0.0 : side_ * 0.5 * cutter_mm_; }

bool CldataReading::Multax() {
  if (!Count(0, 1)) {
    return false;
  }
  if (Size() == 1 && At(0).word != "ON" && At(0).word != "OFF") {
    return Fault(At(0).place, "MULTAX_UNKNOWN", "ON and OFF are known");
  }
  const bool on = Size() == 0 || At(0).word == "ON";
  if (!on && !Upright(axis_)) {
    return Fault(statement_.place, "MULTAX_OFF_TILTED",
                 "posts differ in where the tool stands then; write a GOTO with the axis 0,0,1 before");
  }
  multax_ = on;
  return true;
}

// MSYS of NX: where the frame that its points are in stands in the part's, and the directions of its X and Y.
bool CldataReading::Frame() {
  if (!Count(9, 9)) {
    return false;
  }
  constexpr std::array<double, 9> kSame = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  for (std::size_t i = 0; i < kSame.size(); ++i) {
    if (!At(i).is_number || std::abs(At(i).value - kSame[i]) > kCldataAxisTolerance) {
      return Fault(At(i).place, "FRAME_MOVED",
                   "MSYS must be the part's own frame, 0,0,0,1,0,0,0,1,0; have the post write points in it");
    }
  }
  return true;
}

bool CldataReading::Tolerance() {
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

// The first one, before anything is cut, names the tool that the job begins with; another is mounted by hand, as with M6.
bool CldataReading::LoadTool() {
  if (!Count(1, kMostParameters)) {
    return false;
  }
  const CldataParameter& tool = At(0).word == "TOOL" && Size() > 1 ? At(1) : At(0);
  if (!tool.is_number) {
    return Fault(tool.place, "TOOL_NUMBER_MISSING", "a tool is named by its number");
  }
  if (!IsTool(tool.value)) {
    return Fault(tool.place, "TOOL_NUMBER_OUT_OF_RANGE", "a tool's number is whole, 0 to 99999");
  }
  if (tool_ == tool.value) {
    return true;
  }
  return !tool_ && !cut_ ? NameTool(tool.value) : ChangeTool(tool.value);
}

bool CldataReading::NameTool(double number) {
  tool_ = number;
  Add(OperationKind::kToolNumber)->value = number;
  return true;
}

bool CldataReading::ChangeTool(double number) {
  if (kerf_offset_mm_ != 0.0) {
    return Fault(statement_.place, "NOT_WITH_KERF_ON", "TLCOMP/OFF must stand before");
  }
  if (jet_on_) {
    JetOff();
  }
  Turn(true, 0.0);
  tool_ = number;
  Add(OperationKind::kToolChange)->value = number;
  return true;
}

}  // namespace lambdajet::trajectory
