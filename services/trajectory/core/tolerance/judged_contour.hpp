// Judges every place of a planned cut against its tolerance, and says how much faster or slower it could be run there.
//
// Model: the prediction's linear form (accuracy/core/prediction.hpp) gives bias and variance of the deviation at a place by
// source. What the feed does not change (base, sheet, mechanism, jet offset, straightness, backlash, wander) is s0^2; a pace m
// times the present one changes the rest as time stretching does: elastic and jet-lag bias and deviation by m^2, following by
// m. The planner's own rounding r, which the prediction leaves out, is added. The place holds while
//     F(m^2 |b|, k sqrt(s0^2 + m^2 s_f^2 + m^4 s_a^2)) + m r <= tolerance,   F the 95 % quantile of |N|
// whose left side grows with m, so that the largest m (`room_ratio`) is found by bracketing. k >= 1 is a widening by which a group's
// places together hold their 95th percentile in 95 of 100 machines.
// Places stand at equal distances along the cut and, where the jet creeps, at every other sample: there the spring swings through
// its whole deviation within a hundredth of a millimetre.
// A group is what of one contour has one tolerance.
// Frames: W. Units: mm, s. Threads: pure. Cost: about 3 us a place.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "accuracy/core/prediction.hpp"
#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::trajectory {

inline constexpr double kJudgedEvery_s = 0.002;  // between the samples of a plan that is judged
inline constexpr double kMostRoom = 1.3;
inline constexpr double kLeastRoom = 0.5;

struct JudgedPlace {
  double time_s = 0.0;  // with the gates' before it
  double s_mm = 0.0;
  double run_mm = 0.0;
  std::size_t element = 0;  // of the path
  Eigen::Vector2d p_W_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d n_W = Eigen::Vector2d::UnitX();
  std::uint32_t line = 0;
  std::size_t group = 0;
  std::size_t sample = 0;
  double elastic_bias_mm = 0.0;
  double moving_bias_mm = 0.0;  // with elastic
  double still_variance_mm2 = 0.0;
  double rate_variance_mm2 = 0.0;
  double surge_variance_mm2 = 0.0;
  double elastic_variance_mm2 = 0.0;  // part of surge
  double rounding_mm = 0.0;
  double bound_mm = 0.0;  // 95 %, at this pace
  double still_bound_mm =
      0.0;  // what would be left at creeping speed; set where it matters (bound above the tolerance)
  double room_ratio = kMostRoom;  // largest factor on the pace, kLeastRoom … kMostRoom
  accuracy::Source worst_source = accuracy::Source::kBase;        // of everything
  accuracy::Source worst_still_source = accuracy::Source::kBase;  // of what the feed does not change
};

// The tightest that is asked of a line in the n-th cut, 1 the first; infinite where none is.
double ToleranceOf(const std::vector<ToleranceWish>& wishes, std::uint32_t contour, std::uint32_t line);

struct JudgedGroup {
  std::uint32_t contour = 0;  // 1 is the first
  std::uint32_t first_line = 0;
  std::uint32_t last_line = 0;
  double tolerance_mm = 0.0;  // infinite where none was asked
  double length_mm = 0.0;
  double widening_ratio = 1.0;   // k
  double predicted_95_mm = 0.0;  // of its 95th percentile; set by PredictGroups
  double worst_mm = 0.0;         // largest bound of a place
  std::size_t worst_place = 0;
};

struct JudgedContour {
  accuracy::PredictionReason reason = accuracy::PredictionReason::kNotFinite;
  std::vector<JudgedPlace> places;
  std::vector<JudgedGroup> groups;
  // Of each plan sample: its time with the gates', its element of the path, and its run length.
  struct SamplePlace {
    double time_s = 0.0;
    std::size_t element = 0;
    double run_mm = 0.0;
  };
  std::vector<SamplePlace> samples;
  bool holds = false;  // every place within its tolerance

  const JudgedPlace* Worst()
      const;  // the one furthest beyond its tolerance, or nearest to it; null without places
};

// k by contour and tolerance; 1 for those not named.
using Widening = std::map<std::pair<std::uint32_t, double>, double>;

// The plan's samples in the time that the machine takes: at gates it stands for theirs, and the spring comes to rest.
std::vector<PlanSample> SamplesWithGates(const MachineDescription& machine, const PlannedProgram& planned);

JudgedContour JudgeContour(const MachineDescription& machine, const ProgramPath& path,
                           const PlannedProgram& planned, const std::vector<ToleranceWish>& wishes,
                           const Widening& widening);

// Sets every group's predicted 95th percentile by seeded draws. `cancelled` is asked before each, with the share that is drawn;
// false if it said so.
bool PredictGroups(const MachineDescription& machine, const PlannedProgram& planned, JudgedContour& judged,
                   const std::function<bool(double)>& cancelled);

// The 95 % bound of a place at `pace` times the present one, with its group's widening.
double BoundAt(const JudgedPlace& place, double widening, double pace);

// What would be left at creeping speed and standing elsewhere on the sheet, or with an identified machine.
struct StillBounds {
  double here_mm = 0.0;
  double identified_mm = 0.0;  // without base, sheet, mechanism and jet offset
  double elsewhere_mm = 0.0;   // least over the sheet
  Eigen::Vector2d best_W_mm = Eigen::Vector2d::Zero();
};
StillBounds StillBoundsAt(const MachineDescription& machine, const JudgedPlace& place);

}  // namespace lambdajet::trajectory
