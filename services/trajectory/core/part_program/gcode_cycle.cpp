// Drilling cycles G81, G82 and G83 along the tool, upright or tilted, with the repeats and return levels of LinuxCNC.
#include <algorithm>
#include <cmath>
#include <span>

#include "trajectory/core/part_program/gcode_reading.hpp"
#include "trajectory/core/spatial_feed/drilling_cycle.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kPeckClearance_mm = 0.254;
constexpr double kMostRepeats = 9999.0;
constexpr double kLongestDwell_s = 3600.0;
constexpr std::size_t kZ = 2;

class Drilling {
 public:
  explicit Drilling(Reading& r) : r_(r), memory_(r.state.cycle) {}

  bool Obey() {
    if (!Fits() || !HasFeed(r_) || !TakeWords()) {
      return false;
    }
    const bool absolute = r_.state.absolute;
    const AxisValues before = r_.state.position;
    if (!memory_.active) {
      memory_.initial_mm = before[kZ];
      memory_.active = true;
    }
    double level = memory_.initial_mm;
    retract_ = absolute ? r_.state.zero[kZ] + memory_.r_mm : level + memory_.r_mm;
    bottom_ = absolute ? r_.state.zero[kZ] + memory_.z_mm : retract_ + memory_.z_mm;
    if (retract_ < bottom_) {
      return r_.FaultAtMotion("CYCLE_R_BELOW_Z", "R, where the cycle begins to feed, lies above Z");
    }
    if (r_.code(kMotion) == 830 || r_.state.motion == 830) {
      if ((retract_ - bottom_) / memory_.q_mm > kMostPecks) {
        return r_.FaultAtMotion("CYCLE_TOO_MANY_PECKS", "at most 10000 steps of Q lie between R and Z");
      }
    }
    if (level < retract_) {
      if (!GoTo(retract_)) {
        return false;
      }
      level = retract_;
    }
    clear_ = r_.state.return_to_r ? retract_ : level;
    return Holes();
  }

 private:
  bool Fits() {
    if (!r_.drives(kZ)) {
      return r_.FaultAtMotion("CYCLE_AXIS_NOT_DRIVEN", "drilling cycles need a machine that moves Z");
    }
    if (r_.state.plane != ArcPlane::kXy) {
      return r_.FaultAtMotion("CYCLE_PLANE", "drilling cycles are obeyed in the XY plane, G17");
    }
    if (r_.state.inverse_time) {
      return r_.FaultAtMotion("CYCLE_INVERSE_TIME", "drilling cycles feed in units a minute, G94");
    }
    for (const char letter : {'A', 'B', 'C'}) {
      if (r_.block.has(letter)) {
        return r_.FaultAt(letter, "CYCLE_ROTARY_WORD", "rotary axes stand still in a drilling cycle");
      }
    }
    return r_.HasAxisWords() || r_.FaultAtMotion("CYCLE_AXES_MISSING", "a drilling cycle needs X, Y or Z");
  }

  bool TakeWords() {
    const bool first = !memory_.active || (r_.code(kMotion) != kNoCode && r_.code(kMotion) != last_);
    if (!Sticky('Z', first, memory_.z_mm) || !Sticky('R', !memory_.active, memory_.r_mm)) {
      return false;
    }
    if (r_.state.motion == 830 && (!Sticky('Q', first, memory_.q_mm) || !Positive('Q', memory_.q_mm))) {
      return false;
    }
    if (r_.state.motion == 820 && !TakeDwell(first)) {
      return false;
    }
    repeats_ = r_.block.has('L') ? r_.block.Take('L') : 1.0;
    return (repeats_ >= 1.0 && repeats_ <= kMostRepeats && repeats_ == std::floor(repeats_)) ||
           r_.FaultAt('L', "REPEATS_OUT_OF_RANGE", "L is a whole number, 1 … 9999");
  }

  bool TakeDwell(bool first) {
    if (r_.block.has('P')) {
      memory_.dwell_s = r_.block.Take('P');
    } else if (first) {
      return r_.FaultAtMotion("CYCLE_WORD_MISSING", "G82 needs P, the dwell in seconds");
    }
    return (memory_.dwell_s >= 0.0 && memory_.dwell_s <= kLongestDwell_s) ||
           r_.FaultAtMotion("DWELL_TIME_OUT_OF_RANGE", "a dwell takes 0 to 3600 s");
  }

  bool Sticky(char letter, bool needed, double& value_mm) {
    if (r_.block.has(letter)) {
      value_mm = r_.mm(r_.block.Take(letter));
      return true;
    }
    return !needed || r_.FaultAtMotion("CYCLE_WORD_MISSING",
                                       std::string("the first line of this cycle needs ") + letter);
  }

  bool Positive(char letter, double value_mm) {
    return value_mm > 0.0 || r_.FaultAtMotion("CYCLE_STEP_NOT_POSITIVE",
                                              std::string(1, letter) + ", the step of G83, is above 0");
  }

  bool Holes() {
    const bool absolute = r_.state.absolute;
    const double x = r_.block.has('X') ? r_.mm(r_.block.Take('X')) : 0.0;
    const double y = r_.block.has('Y') ? r_.mm(r_.block.Take('Y')) : 0.0;
    for (double n = 0.0; n < repeats_ && !r_.ended; n += 1.0) {
      AxisValues at = r_.state.position;
      const auto place = [&](char letter, std::size_t i, double written) {
        if (r_.block.has(letter)) {
          at[i] = (absolute ? r_.state.zero[i] : at[i]) + written;
        }
      };
      place('X', 0, x);
      place('Y', 1, y);
      if (!TraverseTo(r_, at) || (at[kZ] != retract_ && !GoTo(retract_)) || !Drill()) {
        return false;
      }
    }
    return true;
  }

  bool GoTo(double z) {
    AxisValues end = r_.state.position;
    end[kZ] = z;
    return TraverseTo(r_, end);
  }

  void FeedTo(double z) {
    AxisValues end = r_.state.position;
    end[kZ] = z;
    r_.Move(OperationKind::kFeedLine, end);
  }

  bool Drill() {
    if (r_.state.motion == 830) {
      for (double depth = retract_ - memory_.q_mm; depth > bottom_ && !r_.ended; depth -= memory_.q_mm) {
        FeedTo(depth);
        if (!GoTo(retract_) || !GoTo(std::min(depth + kPeckClearance_mm, retract_))) {
          return false;
        }
      }
    }
    FeedTo(bottom_);
    if (r_.state.motion == 820) {
      r_.Add(OperationKind::kDwell).value = memory_.dwell_s;
    }
    return GoTo(clear_);
  }

  Reading& r_;
  CycleMemory& memory_;
  int last_ = memory_.motion;
  double repeats_ = 1.0;
  double retract_ = 0.0, bottom_ = 0.0, clear_ = 0.0;  // Z in W
};

}  // namespace

bool ObeyCycle(Reading& r) {
  const std::size_t first = r.program.operations.size();
  const bool good = Drilling(r).Obey();
  AlignWithTool(std::span(r.program.operations).subspan(first), r.state.zero[kZ]);
  r.state.cycle.motion = r.state.motion;
  return good;
}

}  // namespace lambdajet::trajectory
