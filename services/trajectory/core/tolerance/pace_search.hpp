// Finds, place by place, the fastest pace at which a program's predicted contour error stays inside its tolerances.
//
// Model: a fixed point. The plan as fast as its limits allow is judged (judged_contour.hpp); each place says by what factor
// the pace could change. The factor goes to the cells of run length that make its error: where following, jet lag or the
// planner's rounding count, the cells around it; where the spring counts, those in whose past accelerations the spring's answer
//     d(t) = -int h(t - t') a(t') dt',  h(t) = exp(-g t) sin(w t)/w/L
// has the deviation's sign and a share that matters. A cell takes the smallest factor asked of it; none asked: it may run
// faster. Then planned and judged again; rises shrink from round to round, cuts do not.
// Contours begin and end at standstill, so each keeps the round that served it best: the quickest that holds, else the one
// nearest to holding. Put together, a contour that does not hold is slowed as a whole by its own factor and at least by a
// given step, so that the search ends; then each is raised as a whole in shrinking steps as long as it holds. At the answer
// the last such step (raised by kLastRise) breaks its tolerance, or does not make it faster.
// Units: mm, s. Threads: pure. Cost: some 20 to 50 plans and their judging.
#pragma once

#include <utility>

#include "trajectory/core/tolerance/judged_contour.hpp"
#include "trajectory/core/tolerance/pass_progress.hpp"

namespace lambdajet::trajectory {

inline constexpr double kLastRise = 1.01;

enum class PaceVerdict { kHolds, kNotReached, kRefused, kCancelled };

struct PacedPlan {
  PaceVerdict verdict = PaceVerdict::kRefused;
  PlannedProgram planned;  // kHolds: the answer; kNotReached: the last one tried; kRefused: faults only
  JudgedContour judged;
  Pace pace;
  int plans = 0;
  double fastest_s = 0.0;  // program time of the first plan, at full pace
};

class PaceSearch {
 public:
  // What is named outlives the search. `options` without resume.
  PaceSearch(const ProgramPath& path, const MachineDescription& machine, const PlanOptions& options,
             PassProgress& progress);

  // Both ways, from the best pace so far. Refuses at once where no feed would do.
  PacedPlan Explore(const Widening& widening);
  // From the best pace so far to one that holds and cannot be raised as a whole.
  PacedPlan Finish(const Widening& widening);

 private:
  // What a contour did in one plan.
  struct Outcome {
    bool holds = true;
    double room_ratio = kMostRoom;  // least of its places
    double time_s = 0.0;
  };
  struct Contour {
    std::size_t first_cell = 0;
    std::size_t end_cell = 0;
    std::size_t first_element = 0;  // whose idle moves lead to it
    std::size_t end_element = 0;
    Outcome best;
    bool known = false;
    bool raising = true;
  };

  // `left`: plans expected from here on, this one among them. False: cancelled or refused.
  bool Try(const Pace& pace, double left);
  void FindContours();
  std::vector<Outcome> OutcomesNow() const;
  void KeepBest();
  bool SlowedIn(const Contour& contour) const;
  bool Settled() const;
  Pace Changed(double most_rise) const;
  void Ask(const JudgedPlace& place, Pace& factor) const;
  void AskAround(const JudgedPlace& place, Pace& factor) const;
  void AskPast(const JudgedPlace& place, Pace& factor) const;
  void AskSample(std::size_t sample, double room_ratio, Pace& factor) const;
  bool Begin(const Widening& widening, double left);
  bool NoFeedWouldDo() const;
  bool BothWays(double rise, int rounds);
  bool SlowPlaces();
  bool SlowWholeContours(double after);  // `after`: plans expected when it is done
  bool RaiseWholeContours();
  bool RaiseOnce(double step, double left);
  void Scale(const Contour& contour, double factor, Pace& pace) const;
  PacedPlan End(PaceVerdict verdict);
  PaceVerdict Broken() const { return cancelled_ ? PaceVerdict::kCancelled : PaceVerdict::kRefused; }

  const ProgramPath& path_;
  const MachineDescription& machine_;
  PlanOptions options_;
  PassProgress& progress_;
  Widening widening_;
  PacedPlan now_;
  Pace best_pace_;  // put together of each contour's best
  std::vector<Contour> contours_;
  double after_ = 0.0;  // passes expected after this search
  int plans_ = 0;
  double fastest_s_ = 0.0;
  bool cancelled_ = false;
};

}  // namespace lambdajet::trajectory
