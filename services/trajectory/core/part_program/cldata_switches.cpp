#include <algorithm>
#include <cmath>

#include "trajectory/core/part_program/cldata_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kSecondsPerMinute = 60.0;

}  // namespace

// A jet has no revolutions, but a wheel's program needs them for feeds a revolution.
bool CldataReading::Spindle() {
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

bool CldataReading::SetSpindleSpeed(const CldataParameter& p) {
  if (!(p.value > 0.0)) {
    return Fault(p.place, "SPINDLE_SPEED_NOT_POSITIVE", "a spindle's speed is above 0; SPINDL/OFF stops it");
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

bool CldataReading::Turn(bool off, double sense) {
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

bool CldataReading::Pierce(double time_s) {
  if (jet_on_) {
    return Fault(statement_.place, "JET_ALREADY_ON", "SPINDL/OFF must stand before the next pierce");
  }
  Add(OperationKind::kPierce)->value = time_s;
  jet_on_ = abrasive_on_ = true;
  return true;
}

// Abrasive without water would only fill the tube.
bool CldataReading::JetOff() {
  if (abrasive_on_) {
    Add(OperationKind::kAbrasiveOff);
  }
  Add(OperationKind::kJetOff);
  jet_on_ = abrasive_on_ = false;
  return true;
}

// On a machine with a spindle the same words mean its coolant.
bool CldataReading::Abrasive(bool on) {
  if (on != abrasive_on_) {
    Add(HasSpindle() ? on ? OperationKind::kCoolantOn : OperationKind::kCoolantOff
        : on         ? OperationKind::kAbrasiveOn
                     : OperationKind::kAbrasiveOff);
    abrasive_on_ = on;
  }
  return true;
}

bool CldataReading::Coolant() {
  if (!Count(1, 2)) {
    return false;
  }
  static constexpr std::array<std::string_view, 6> kWords = {"ON", "OFF", "FLOOD", "MIST", "THRU", "TAP"};
  if (std::find(kWords.begin(), kWords.end(), At(0).word) == kWords.end()) {
    return Fault(At(0).place, "COOLANT_WORD_UNKNOWN", "ON, OFF, FLOOD, MIST and THRU are known");
  }
  return Abrasive(At(0).word != "OFF");
}

// DELAY/2, DELAY/2,SEC and, in turns of the spindle, DELAY/3,REV.
bool CldataReading::Delay() {
  if (!Count(1, 2)) {
    return false;
  }
  const bool turns = Size() == 2 && At(1).word == "REV";
  if (Size() == 2 && !turns && At(1).word != "SEC") {
    return Fault(At(1).place, "DWELL_UNIT_UNKNOWN", "SEC and REV are known");
  }
  if (turns && !(spindle_per_min_ > 0.0)) {
    return Fault(At(1).place, "DWELL_NEEDS_SPINDLE_SPEED", "SPINDL must say turns a minute before");
  }
  const double s = At(0).value * (turns ? kSecondsPerMinute / spindle_per_min_ : 1.0);
  if (!At(0).is_number || !(s >= 0.0 && s <= 3600.0)) {
    return Fault(At(0).place, "DWELL_TIME_OUT_OF_RANGE", "a dwell takes 0 to 3600 s");
  }
  Add(OperationKind::kDwell)->value = s;
  return true;
}

// AUXFUN/n,p is M n P p.
bool CldataReading::Auxiliary() {
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
  const bool known = m == 0 || m == 1 || m == 2 || m == 3 || m == 4 || m == 5 || m == 7 || m == 8 || m == 9 ||
                     m == 30 || m == 62 || m == 63 || m == 100 || m == 101 || m == 102;
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

bool CldataReading::Machine(double m, const double* p) {
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

bool CldataReading::Output(bool on, const double* p) {
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

bool CldataReading::Mark(double m, const double* p) {
  if (m == 102) {
    return Add(OperationKind::kCameraTrackOff) != nullptr;
  }
  if (p == nullptr || !(*p >= 0.0 && *p <= 1e6) || *p != std::floor(*p)) {
    return Fault(At(0).place, "MARK_MISSING", "the second number must name the mark, a whole number from 0");
  }
  if (m == 100 && jet_on_) {
    return Fault(statement_.place, "MEASURE_WITH_JET_ON", "SPINDL/OFF must stand before");
  }
  Add(m == 100 ? OperationKind::kMeasure : OperationKind::kCameraTrackOn)->value = *p;
  return true;
}

bool CldataReading::End() {
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

}  // namespace lambdajet::trajectory
