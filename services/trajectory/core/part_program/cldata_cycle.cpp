#include "trajectory/core/part_program/cldata_cycle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace lambdajet::trajectory {
namespace {

constexpr double kSecondsPerMinute = 60.0;
constexpr double kInchMm = 25.4;
constexpr double kLongestDwell_s = 3600.0;
constexpr double kLargest_mm = 1e6;

enum class CycleType : std::uint8_t { kPlain, kDeep, kChipBreak };

struct TypeWord {
  std::string_view word;
  CycleType type;
};

constexpr std::array<TypeWord, 5> kTypes = {{{"DRILL", CycleType::kPlain},
                                             {"FACE", CycleType::kPlain},
                                             {"DEEP", CycleType::kDeep},
                                             {"PECK", CycleType::kDeep},
                                             {"BRKCHP", CycleType::kChipBreak}}};

enum Slot : std::size_t { kDepth, kFeedTo, kClear, kRapidTo, kReturn, kStep, kDwell, kFeed, kSlotCount };

struct SlotWord {
  std::string_view word;
  Slot slot;
};

constexpr std::array<SlotWord, 10> kSlotWords = {{{"DEPTH", kDepth},
                                                  {"FEDTO", kFeedTo},
                                                  {"CLEAR", kClear},
                                                  {"RAPTO", kRapidTo},
                                                  {"RETURN", kReturn},
                                                  {"RTRCTO", kReturn},
                                                  {"STEP", kStep},
                                                  {"INCR", kStep},
                                                  {"PECK", kStep},
                                                  {"DWELL", kDwell}}};

constexpr std::array<std::string_view, 9> kFeedUnits = {"MMPM", "IPM",  "PERMIN", "UPM",   "MMPS",
                                                        "IPS",  "MMPR", "IPR",    "PERREV"};

template <typename Table>
auto Find(const Table& table, std::string_view word) {
  const auto* found =
      std::find_if(table.begin(), table.end(), [&](const auto& entry) { return entry.word == word; });
  return found == table.end() ? nullptr : found;
}

class CycleWords {
 public:
  CycleWords(const CldataStatement& statement, const CldataUnits& units, CldataFault& fault)
      : statement_(statement), units_(units), fault_(fault) {}

  bool Read(CldataCycle& cycle) {
    if (!Type()) {
      return false;
    }
    while (at_ < Size()) {
      if (!(Here().is_number ? Bare() : Word())) {
        return false;
      }
    }
    return Heights(cycle.heights) && Steps(cycle.heights) && Dwell(cycle.dwell_s) &&
           Feed(cycle.feed_mm_per_s);
  }

 private:
  std::size_t Size() const { return statement_.parameters.size(); }
  const CldataParameter& Here() const { return statement_.parameters[at_]; }
  bool NumberFollows() const { return at_ + 1 < Size() && statement_.parameters[at_ + 1].is_number; }

  bool Refuse(const CldataPlace& place, const char* reason, const char* message) {
    fault_ = {reason, place, message};
    return false;
  }

  bool Type() {
    if (Size() == 0) {
      return Refuse(statement_.place, "CYCLE_UNKNOWN", "CYCLE takes a type, as in CYCLE/DRILL, or ON or OFF");
    }
    const TypeWord* word = Find(kTypes, Here().word);
    if (word == nullptr) {
      return Refuse(
          Here().place, "CYCLE_UNKNOWN",
          "DRILL, FACE, DEEP, PECK and BRKCHP are obeyed; have the post write other cycles as motions");
    }
    type_ = word->type;
    ++at_;
    const TypeWord* more = at_ < Size() && !NumberFollows() ? Find(kTypes, Here().word) : nullptr;
    if (word->word == "DRILL" && more != nullptr && more->type != CycleType::kPlain) {
      type_ = more->type;
      ++at_;
    }
    return true;
  }

  // The depth, if nothing stands before it; CLEAR, if the feed does.
  bool Bare() {
    const bool first = !any_;
    const bool behind_feed = values_[kFeed] && !values_[kClear] && !values_[kRapidTo] && !values_[kFeedTo];
    if (!first && !behind_feed) {
      return Refuse(
          Here().place, "CYCLE_NUMBER_WITHOUT_WORD",
          "a word must say what this number means: DEPTH, CLEAR, RAPTO, STEP, DWELL or a feed's unit");
    }
    return Take(first ? kDepth : kClear, Here());
  }

  bool Word() {
    const CldataParameter& word = Here();
    if (IsFeedUnit(word.word)) {
      feed_unit_ = &word;
      return TakeNext(kFeed);
    }
    if (const TypeWord* type = Find(kTypes, word.word); type != nullptr && !NumberFollows()) {
      if (type->type == CycleType::kPlain || (type_ != CycleType::kPlain && type->type != type_)) {
        return Refuse(word.place, "CYCLE_WORD_TWICE", "a cycle has one type");
      }
      type_ = type->type;
      ++at_;
      return true;
    }
    const SlotWord* slot = Find(kSlotWords, word.word);
    if (slot == nullptr) {
      return Refuse(
          word.place, "CYCLE_WORD_UNKNOWN",
          "DEPTH, FEDTO, CLEAR, RAPTO, RETURN, RTRCTO, STEP, INCR, DWELL and units of feed are known");
    }
    if (slot->slot == kDwell && at_ + 1 < Size() && statement_.parameters[at_ + 1].word == "REV") {
      dwell_in_turns_ = true;
      ++at_;
    }
    if (word.word == "PECK" && type_ == CycleType::kPlain) {
      type_ = CycleType::kDeep;
    }
    return TakeNext(slot->slot);
  }

  bool TakeNext(Slot slot) {
    if (!NumberFollows()) {
      return Refuse(Here().place, "CYCLE_WORD_MISSING", "a number must follow this word");
    }
    ++at_;
    return Take(slot, Here());
  }

  bool Take(Slot slot, const CldataParameter& number) {
    if (values_[slot]) {
      return Refuse(number.place, "CYCLE_WORD_TWICE", "the cycle has this number already");
    }
    const bool length = slot != kDwell && slot != kFeed;
    const double value = number.value * (length ? units_.unit_mm : 1.0);
    if (length && !(std::abs(value) <= kLargest_mm)) {
      return Refuse(number.place, "COORDINATE_TOO_LARGE", "a height is at most 1e6 mm");
    }
    if ((slot == kDepth || slot == kStep) && !(value > 0.0)) {
      return slot == kDepth
                 ? Refuse(number.place, "CYCLE_DEPTH_NOT_POSITIVE",
                          "a depth counts from the GOTO's point into the part, above 0")
                 : Refuse(number.place, "CYCLE_STEP_NOT_POSITIVE", "the step of a deep hole is above 0");
    }
    values_[slot] = value;
    places_[slot] = number.place;
    any_ = true;
    ++at_;
    return true;
  }

  double Of(Slot slot) const { return values_[slot].value_or(0.0); }

  bool Missing(const char* message) { return Refuse(statement_.place, "CYCLE_WORD_MISSING", message); }

  bool Heights(HoleHeights& h) {
    if (values_[kDepth] && values_[kFeedTo]) {
      return Refuse(places_[kFeedTo], "CYCLE_WORD_TWICE", "DEPTH and FEDTO say the same");
    }
    if (!values_[kDepth] && !values_[kFeedTo]) {
      return Missing("a cycle needs DEPTH, the hole's depth below the GOTO's point");
    }
    if (values_[kFeedTo] && values_[kClear]) {
      return Refuse(places_[kClear], "CYCLE_WORDS_MIXED", "with FEDTO the height to begin at is RAPTO");
    }
    if (!values_[kClear] && !values_[kRapidTo]) {
      return Missing(
          "a cycle needs CLEAR, or RAPTO, the height over the GOTO's point where it begins to feed");
    }
    h.bottom_mm = values_[kDepth] ? -Of(kDepth) : Of(kFeedTo);
    h.retract_mm = values_[kClear] ? Of(kClear) - Of(kRapidTo) : Of(kRapidTo);
    if (h.retract_mm <= h.bottom_mm) {
      return Refuse(places_[values_[kRapidTo] ? kRapidTo : kClear], "CYCLE_R_BELOW_Z",
                    "the height where the cycle begins to feed lies above its bottom");
    }
    const double clear = values_[kClear] ? Of(kClear) : Of(kRapidTo);
    h.clear_mm = values_[kReturn] ? Of(kReturn) : clear;
    return h.clear_mm >= h.retract_mm ||
           Refuse(places_[values_[kReturn] ? kReturn : kRapidTo], "CYCLE_RETURN_BELOW_R",
                  "between holes the tool is not below the height where it begins to feed");
  }

  bool Steps(HoleHeights& h) {
    if (type_ == CycleType::kPlain) {
      return !values_[kStep] || Refuse(places_[kStep], "WORD_WITHOUT_USE",
                                       "steps belong to DEEP, PECK or BRKCHP; this cycle drills in one go");
    }
    if (!values_[kStep]) {
      return Missing("a deep hole needs STEP, how far it is drilled at once");
    }
    h.peck_mm = Of(kStep);
    h.chip_break = type_ == CycleType::kChipBreak;
    return (h.retract_mm - h.bottom_mm) / h.peck_mm <= kMostPecks ||
           Refuse(places_[kStep], "CYCLE_TOO_MANY_PECKS", "at most 10000 steps lie in a hole");
  }

  bool Dwell(double& seconds) {
    if (dwell_in_turns_ && !(units_.spindle_per_min > 0.0)) {
      return Refuse(places_[kDwell], "FEED_NEEDS_SPINDLE_SPEED",
                    "a dwell in turns needs SPINDL with revolutions a minute before it");
    }
    seconds = dwell_in_turns_ ? Of(kDwell) * kSecondsPerMinute / units_.spindle_per_min : Of(kDwell);
    return (seconds >= 0.0 && seconds <= kLongestDwell_s) ||
           Refuse(places_[kDwell], "DWELL_TIME_OUT_OF_RANGE", "a dwell takes 0 to 3600 s");
  }

  bool Feed(double& feed_mm_per_s) {
    if (!values_[kFeed]) {
      return true;
    }
    if (!FeedIn(*feed_unit_, Of(kFeed), units_, feed_mm_per_s, fault_)) {
      return false;
    }
    if (!(feed_mm_per_s > 0.0)) {
      return Refuse(places_[kFeed], "FEED_NOT_POSITIVE", "the feed must be above 0");
    }
    return feed_mm_per_s <= kFastestFeed_mm_per_s ||
           Refuse(places_[kFeed], "FEED_OUT_OF_RANGE", "a feed is at most 1e7 mm/s");
  }

  const CldataStatement& statement_;
  const CldataUnits& units_;
  CldataFault& fault_;
  std::size_t at_ = 0;
  CycleType type_ = CycleType::kPlain;
  bool any_ = false;
  bool dwell_in_turns_ = false;
  const CldataParameter* feed_unit_ = nullptr;
  std::array<std::optional<double>, kSlotCount> values_{};
  std::array<CldataPlace, kSlotCount> places_{};
};

}  // namespace

bool IsFeedUnit(std::string_view word) {
  return std::find(kFeedUnits.begin(), kFeedUnits.end(), word) != kFeedUnits.end();
}

bool FeedIn(const CldataParameter& unit, double value, const CldataUnits& units, double& feed_mm_per_s,
            CldataFault& fault) {
  const std::string& u = unit.word;
  const bool inches = u.starts_with('I'), millimetres = u.starts_with("MM");
  const double length_mm = value * (millimetres ? 1.0 : inches ? kInchMm : units.unit_mm);
  if (u == "MMPS" || u == "IPS") {
    feed_mm_per_s = length_mm;
    return true;
  }
  const bool a_turn = u == "MMPR" || u == "IPR" || u == "PERREV";
  if (a_turn && !(units.spindle_per_min > 0.0)) {
    fault = {"FEED_NEEDS_SPINDLE_SPEED", unit.place,
             "feed a revolution needs SPINDL with revolutions a minute before it; a jet has none: use MMPM"};
    return false;
  }
  feed_mm_per_s = length_mm * (a_turn ? units.spindle_per_min : 1.0) / kSecondsPerMinute;
  return true;
}

bool ReadCycle(const CldataStatement& statement, const CldataUnits& units, CldataCycle& cycle,
               CldataFault& fault) {
  return CycleWords(statement, units, fault).Read(cycle);
}

}  // namespace lambdajet::trajectory
