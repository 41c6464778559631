#include "trajectory/core/feed/stretch_speeds.hpp"

#include <algorithm>
#include <cmath>

#include "trajectory/core/feed/level_tops.hpp"
#include "trajectory/core/feed/reach.hpp"
#include "trajectory/core/feed/run_profile.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;

constexpr double kAnySpeed_mm_per_s = 1e9;
constexpr int kReachChecks = 200;

void KeepPace(const Pace& pace, double run_begin_mm, PlannedRun& run) {
  for (std::size_t k = 0; k < run.nodes.size(); ++k) {
    const double slow = pace.At(run_begin_mm + run.nodes[k].offset_mm);
    run.pace.slow[k] = slow;
    run.pace.ease[k] = slow * slow;
    run.pace.reason[k] = slow < 1.0 ? FeedLimit::kPredictedError : FeedLimit::kContourTolerance;
  }
}

class Speeds {
 public:
  Speeds(const PlanningModel& model, StretchDraft& draft, std::vector<ProgramFault>& faults)
      : model_(model), draft_(draft), faults_(faults) {}

  double Set() {
    double time = 0.0;
    for (std::size_t i = 0; i < draft_.elements.size() && faults_.empty(); ++i) {
      PlannedElement& e = draft_.planned[i];
      if (draft_.IsRun(i)) {
        SolveRun(i);
      } else if (i == 0 || !draft_.IsRun(i - 1) || draft_.elements[i - 1].flush_after) {
        SolveIdle(i, Vector2d::Zero());
      }
      e.begin_time_s = time;
      time += draft_.IsRun(i) ? e.run.node_time_s.back() : e.idle.duration_s;
      e.end_time_s = time;
      time += PauseAfter(i);
    }
    return time;
  }

 private:
  double PauseAfter(std::size_t i) const {
    if (draft_.elements[i].flush_after) {
      return (2 * model_.filter.reach() + 2) * model_.filter.knot_s;
    }
    const bool stands = !draft_.IsRun(i) || draft_.planned[i].run.end_speed_mm_per_s == 0.0;
    return i + 1 < draft_.elements.size() && stands ? FirstAverage() : 0.0;
  }
  double FirstAverage() const { return model_.filter.first_s; }

  void Solve(std::vector<ProfileNode>& nodes, double end_speed) const {
    SolveSpeedProfile(nodes, model_.bounds, 0.0, end_speed);
    LevelTops(nodes, FirstAverage(), 1.01 * model_.path_acceleration_mm_per_s2);
  }

  void SolvePaced(PlannedRun& run, double end_speed) const {
    run.solved = run.nodes;
    run.pace.Cap(run.free_mm_per_s, run.solved);
    Solve(run.solved, end_speed);
    for (std::size_t k = 0; k < run.solved.size(); ++k) {  // eased for another reason than the limit itself
      if (run.solved[k].binding == FeedLimit::kPathAcceleration && run.pace.ease[k] < 1.0) {
        run.solved[k].binding = run.pace.reason[k];
      }
    }
    run.end_speed_mm_per_s = std::sqrt(run.solved.back().x);
  }

  void SolveRun(std::size_t i) {
    PlannedRun& run = draft_.planned[i].run;
    const bool flows_on = draft_.FlowsOn(i);
    const double end_speed = flows_on ? kAnySpeed_mm_per_s : 0.0;
    if (run.free_mm_per_s.empty()) {
      RememberSpeeds(run, end_speed);
    }
    SolvePaced(run, end_speed);
    if (flows_on) {
      ChooseEndSpeed(i);
    }
    run.node_time_s.assign(1, 0.0);
    for (std::size_t k = 0; k + 1 < run.solved.size(); ++k) {
      const double v = std::sqrt(run.solved[k].x) + std::sqrt(run.solved[k + 1].x);
      run.node_time_s.push_back(run.node_time_s.back() +
                                2.0 * (run.solved[k + 1].offset_mm - run.solved[k].offset_mm) / v);
    }
  }

  // A node at standstill takes its neighbours' speed, so that slow-down has something to count from.
  void RememberSpeeds(PlannedRun& run, double end_speed) const {
    run.solved = run.nodes;
    Solve(run.solved, end_speed);
    std::vector<double>& v = run.free_mm_per_s;
    for (const ProfileNode& node : run.solved) {
      v.push_back(std::sqrt(node.x));
    }
    v.front() = std::max(v.front(), v[1]);
    v.back() = std::max(v.back(), v[v.size() - 2]);
  }

  void ChooseEndSpeed(std::size_t i) {
    const PathElement& run = draft_.elements[i];
    PlannedElement& next = draft_.planned[i + 1];
    const Vector2d tangent = PointOn(run.pieces.back(), run.pieces.back().length_mm).tangent;
    const double fastest = draft_.planned[i].run.end_speed_mm_per_s;
    const double a = model_.path_acceleration_mm_per_s2;
    double best = 1e300, best_speed = 0.0;
    bool found = false;
    for (const double share : {1.0, 0.6, 0.3, 0.0}) {
      const double v = share * fastest;
      const auto move =
          PlanIdleMove(model_, run.to_mm, v * tangent, draft_.elements[i + 1].to_mm, next.idle_factor);
      if (!move) {
        continue;
      }
      const double cost = move->duration_s + (v > 0.0 ? 0.0 : FirstAverage()) +
                          (fastest > 0.0 ? (fastest - v) * (fastest - v) / (2.0 * a * fastest) : 0.0);
      if (cost < best) {
        best = cost;
        best_speed = v;
        next.idle = *move;
        found = true;
      }
    }
    if (!found) {
      IdleOutOfReach(i + 1);
    } else if (best_speed < fastest) {
      SolvePaced(draft_.planned[i].run, best_speed);
      SolveIdle(i + 1, draft_.planned[i].run.end_speed_mm_per_s * tangent);
    }
  }

  void SolveIdle(std::size_t i, const Vector2d& velocity) {
    const PathElement& e = draft_.elements[i];
    const auto move = PlanIdleMove(model_, e.from_mm, velocity, e.to_mm, draft_.planned[i].idle_factor);
    if (move) {
      draft_.planned[i].idle = *move;
    } else {
      IdleOutOfReach(i);
    }
  }

  void IdleOutOfReach(std::size_t i) {
    const PathElement& e = draft_.elements[i];
    for (int k = 0; k <= kReachChecks; ++k) {
      const Vector2d p = e.from_mm + (e.to_mm - e.from_mm) * k / kReachChecks;
      if (model_.sheet.Position(p).reason != kinematics::Reason::kSolved) {
        faults_.push_back(ReachFault(model_.sheet, p, e.line));
        return;
      }
    }
    faults_.push_back(
        {e.line, 0, "IDLE_MOVE_OUT_OF_REACH", "", "no idle move stays within the machine's reach"});
  }

  const PlanningModel& model_;
  StretchDraft& draft_;
  std::vector<ProgramFault>& faults_;
};

}  // namespace

void PrepareElements(const PlanningModel& model, StretchDraft& draft, std::vector<ProgramFault>& faults) {
  const Pace* pace = model.options.pace.get();
  draft.planned.resize(draft.elements.size());
  for (std::size_t i = 0; i < draft.elements.size(); ++i) {
    const PathElement& element = draft.elements[i];
    if (draft.IsRun(i)) {
      PlannedRun& run = draft.planned[i].run;
      run.nodes = MakeRunNodes(model, element, faults);
      run.pace.Reset(run.nodes.size());
      if (pace != nullptr) {
        KeepPace(*pace, element.run_begin_mm, run);
      }
    } else if (pace != nullptr) {
      draft.planned[i].idle_factor = pace->OfIdle(element.number);
    }
  }
}

double SetSpeeds(const PlanningModel& model, StretchDraft& draft, std::vector<ProgramFault>& faults) {
  return Speeds(model, draft, faults).Set();
}

}  // namespace lambdajet::trajectory
