#include "trajectory/core/tolerance/plan_to_tolerance.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "trajectory/core/tolerance/pace_search.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr int kExplorations = 3;
constexpr int kFinishes = 6;
constexpr double kPassesAfterExploring = 14.0;  // mostly, with the drawing
constexpr double kPassesAfterFinishing = 2.0;   // so that there is room for a resume, or for another round
constexpr double kWidenMore = 1.02;
constexpr double kWidest = 3.0;
constexpr double kUnlimited_mm =
    10.0;  // the planner's own limit by predicted error must not stand in the way

const char* AdviceOf(std::string_view remedy) {
  if (remedy == "IDENTIFY") return "identify the machine";
  if (remedy == "COMPENSATE") return "compensate the elastic error";
  if (remedy == "MOVE_PART") return "move the part";
  return "ask for a wider tolerance";
}

void ChooseRemedy(const MachineDescription& machine, const JudgedPlace& place, bool compensated, bool still,
                  ToleranceBlame& blame) {
  const StillBounds bounds = StillBoundsAt(machine, place);
  blame.remedy = "LOOSEN_TOLERANCE";
  blame.with_remedy_mm = 0.0;
  if (!still) {
    if (!compensated && place.worst_source == accuracy::Source::kElastic) {
      blame.remedy = "COMPENSATE";
    }
    return;
  }
  if (bounds.identified_mm <= bounds.elsewhere_mm || bounds.identified_mm < 0.9 * blame.tolerance_mm) {
    blame.remedy = "IDENTIFY";
    blame.with_remedy_mm = bounds.identified_mm;
  } else if (bounds.elsewhere_mm < blame.tolerance_mm) {
    blame.remedy = "MOVE_PART";
    blame.with_remedy_mm = bounds.elsewhere_mm;
  }
  if (blame.with_remedy_mm > blame.tolerance_mm) {
    blame.remedy = "LOOSEN_TOLERANCE";
    blame.with_remedy_mm = 0.0;
  }
}

ProgramFault FaultOf(const ToleranceBlame& blame, bool still) {
  char text[400];
  int used = std::snprintf(text, sizeof text,
                           "at X%.3f Y%.3f the predicted error is %.4f mm %s, %.4f mm over the tolerance of "
                           "%.4f mm; most of it is %.*s",
                           blame.p_W_mm.x(), blame.p_W_mm.y(), blame.predicted_mm,
                           still ? "however slow the feed" : "at the slowest feed tried",
                           blame.predicted_mm - blame.tolerance_mm, blame.tolerance_mm,
                           static_cast<int>(accuracy::SourceName(blame.source).size()),
                           accuracy::SourceName(blame.source).data());
  if (blame.with_remedy_mm > 0.0) {
    std::snprintf(text + used, sizeof text - static_cast<std::size_t>(used), "; %s, %.4f mm then",
                  AdviceOf(blame.remedy), blame.with_remedy_mm);
  } else {
    std::snprintf(text + used, sizeof text - static_cast<std::size_t>(used), "; %s", AdviceOf(blame.remedy));
  }
  return {blame.line, 0, "TOLERANCE_NOT_REACHED", "", text};
}

// The place furthest beyond its tolerance by what the feed cannot change; else furthest by all.
const JudgedPlace& BlamedPlace(const JudgedContour& judged, bool& still) {
  const JudgedPlace* blamed = judged.Worst();
  double excess = 0.0;
  for (const JudgedPlace& place : judged.places) {
    const double over = place.still_bound_mm - judged.groups[place.group].tolerance_mm;
    if (over > excess) {
      excess = over;
      blamed = &place;
      still = true;
    }
  }
  return *blamed;
}

class Tolerances {
 public:
  Tolerances(const ProgramPath& path, const MachineDescription& machine, const PlanOptions& options,
             PassProgress& progress)
      : machine_(machine),
        options_(options),
        progress_(progress),
        inner_(InnerOptions(options)),
        search_(path, machine, inner_, progress_) {
    answer_.report.asked = true;
  }

  TolerancePlan Solve() {
    Widening widening;
    PacedPlan found;
    for (int round = 0; round < kExplorations; ++round) {
      found = search_.Explore(widening);
      if (!Drawn(found, kPassesAfterExploring)) {
        return Refused(std::move(found));
      }
      if (!Widen(found.judged, widening)) {
        break;
      }
    }
    for (int round = 0; round < kFinishes; ++round) {
      found = search_.Finish(widening);
      if (!Drawn(found, kPassesAfterFinishing)) {
        return Refused(std::move(found));
      }
      if (!Widen(found.judged, widening)) {
        return Held(std::move(found));
      }
    }
    return Refused(std::move(found));
  }

 private:
  static PlanOptions InnerOptions(PlanOptions options) {
    options.tolerance_mm = kUnlimited_mm;
    options.start_from_s_mm.reset();
    options.sample_s = kJudgedEvery_s;
    return options;
  }

  // True if there is a plan to go on with, its groups' percentiles filled in.
  bool Drawn(PacedPlan& found, double left) {
    answer_.report.plans = found.plans;
    answer_.report.fastest_s = found.fastest_s;
    if (found.verdict != PaceVerdict::kHolds || found.judged.places.empty()) {
      return false;
    }
    if (!progress_.Begin(left) || !PredictGroups(machine_, found.planned, found.judged,
                                                 [this](double share) { return !progress_.Within(share); })) {
      found.verdict = PaceVerdict::kCancelled;
      return false;
    }
    return true;
  }

  // True if some group's percentile is not inside yet.
  static bool Widen(const JudgedContour& judged, Widening& widening) {
    bool wider = false;
    for (const JudgedGroup& group : judged.groups) {
      if (group.predicted_95_mm > group.tolerance_mm) {
        wider = true;
        widening[{group.contour, group.tolerance_mm}] =
            std::min(kWidest, group.widening_ratio * kWidenMore * group.predicted_95_mm / group.tolerance_mm);
      }
    }
    return wider;
  }

  TolerancePlan Held(PacedPlan found) {
    for (const JudgedGroup& group : found.judged.groups) {
      if (!std::isfinite(group.tolerance_mm)) {
        continue;
      }
      const JudgedPlace& worst = found.judged.places[group.worst_place];
      const double worst_mm = BoundAt(worst, 1.0, 1.0);
      answer_.report.held.push_back({group.contour, group.first_line, group.last_line, group.tolerance_mm,
                                     group.predicted_95_mm, worst_mm, worst.line,
                                     group.tolerance_mm - std::max(worst_mm, group.predicted_95_mm),
                                     worst.worst_source});
    }
    answer_.report.pace = std::move(found.pace);
    answer_.planned = std::move(found.planned);
    return std::move(answer_);
  }

  TolerancePlan Refused(PacedPlan found) {
    if (found.verdict == PaceVerdict::kHolds && found.judged.places.empty()) {  // nothing is cut
      answer_.planned = std::move(found.planned);
      return std::move(answer_);
    }
    std::vector<ProgramFault>& faults = answer_.planned.faults;
    if (found.verdict == PaceVerdict::kCancelled) {
      faults.push_back({0, 0, "CANCELLED", "", "planning was cancelled"});
    } else if (found.verdict == PaceVerdict::kRefused && !found.planned.faults.empty()) {
      faults = std::move(found.planned.faults);
    } else if (found.judged.places.empty()) {
      faults.push_back({0, 0, "NOT_PREDICTED", "", std::string(accuracy::Name(found.judged.reason))});
    } else {
      Blame(found);
    }
    return std::move(answer_);
  }

  void Blame(const PacedPlan& found) {
    bool still = false;
    const JudgedPlace& place = BlamedPlace(found.judged, still);
    const JudgedGroup& group = found.judged.groups[place.group];
    ToleranceBlame blame;
    blame.line = place.line;
    blame.p_W_mm = place.p_W_mm;
    blame.tolerance_mm = group.tolerance_mm;
    blame.predicted_mm = still ? place.still_bound_mm : std::max(place.bound_mm, group.predicted_95_mm);
    blame.source = still ? place.worst_still_source : place.worst_source;
    ChooseRemedy(machine_, place, options_.compensate, still, blame);
    answer_.planned.faults.push_back(FaultOf(blame, still));
    answer_.report.blame.push_back(blame);
  }

  const MachineDescription& machine_;
  const PlanOptions& options_;
  PassProgress& progress_;
  PlanOptions inner_;
  PaceSearch search_;
  TolerancePlan answer_;
};

ProgramFault WishFault(const char* should) { return {0, 0, "OPTION_OUT_OF_RANGE", "hold", should}; }

std::vector<ProgramFault> WishFaults(const std::vector<ToleranceWish>& wishes) {
  std::vector<ProgramFault> faults;
  for (const ToleranceWish& wish : wishes) {
    if (!(wish.tolerance_mm > 0.0 && wish.tolerance_mm <= kUnlimited_mm)) {
      faults.push_back(WishFault("a tolerance above 0 and at most 10 mm"));
    }
    if (wish.first_line > wish.last_line) {
      faults.push_back(WishFault("lines from the lower to the higher"));
    }
  }
  return faults;
}

void End(const PlanProgress& progress, const PlannedProgram& planned) {
  if (progress && planned.faults.empty()) {
    (void)progress(1.0);
  }
}

// The path's own tolerance is what a corner may be missed by, and no bound of a place knows of it: where less is asked of the
// cut, less is left to the path.
void TightenPath(const std::vector<ToleranceWish>& wishes, ProgramPath& path) {
  std::uint32_t contour = 0;
  bool jet_on = false;
  const auto switch_jet = [&](bool on) {
    contour += on && !jet_on ? 1 : 0;
    jet_on = on;
  };
  for (PathElement& element : path.elements) {
    switch_jet(element.jet_on);
    std::size_t next = 0;
    const auto pass_events = [&](double offset_mm) {
      for (; next < element.events.size() && element.events[next].offset_mm <= offset_mm; ++next) {
        const ProcessAction action = element.events[next].action;
        if (action == ProcessAction::kJetOn || action == ProcessAction::kJetOff) {
          switch_jet(action == ProcessAction::kJetOn);
        }
      }
    };
    for (PathPiece& piece : element.pieces) {
      pass_events(piece.begin_mm);
      if (jet_on) {
        piece.tolerance_mm = std::min(piece.tolerance_mm, ToleranceOf(wishes, contour, piece.line));
      }
    }
    pass_events(element.length_mm());
  }
}

}  // namespace

TolerancePlan PlanToTolerance(std::string_view program, const MachineDescription& machine,
                              const PlanOptions& options, const PlanProgress& progress) {
  TolerancePlan answer;
  if (options.hold.empty()) {
    answer.planned = PlanPartProgram(program, machine, options, progress);
    End(progress, answer.planned);
    return answer;
  }
  answer.planned.faults = WishFaults(options.hold);
  if (!answer.planned.faults.empty()) {
    return answer;
  }
  PlanOptions fast = options;
  fast.tolerance_mm = kUnlimited_mm;
  ProgramPath path = LayOutProgram(program, machine, fast, answer.planned.faults);
  if (!answer.planned.faults.empty()) {
    return answer;
  }
  TightenPath(options.hold, path);
  PassProgress passes(progress);
  answer = Tolerances(path, machine, options, passes).Solve();
  if (answer.planned.faults.empty() && (options.start_from_s_mm || options.sample_s != kJudgedEvery_s)) {
    fast.pace = std::make_shared<const Pace>(answer.report.pace);
    passes.Begin(1.0);
    answer.planned =
        PlanLaidOutProgram(path, machine, fast, [&passes](double share) { return passes.Within(share); });
  }
  End(progress, answer.planned);
  answer.planned.plan.id = PlanIdOf(program, options, machine);
  return answer;
}

}  // namespace lambdajet::trajectory
