#include "kinematics/optimisation/geometry_optimisation.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <nlopt.hpp>
#include <vector>

namespace lambdajet::kinematics {
namespace {

constexpr int kRaster = 17;
// More than any gain or negative rectangle of a zone that is served, so that serving the zone always comes first.
constexpr double kUnserved = 1e9;

class Search {
 public:
  explicit Search(const OptimisationTask& task)
      : task_(task), biglide_(task.start.parameters[0] == task.start.parameters[1]) {}

  std::vector<double> Unknowns(const LambdaMechanism& m) const {
    const MechanismParameters& p = m.parameters;
    return biglide_ ? std::vector<double>{p[0], p[2], p[4]} : std::vector<double>{p[0], p[2], p[4], p[1]};
  }

  LambdaMechanism Mechanism(const std::vector<double>& unknowns) const {
    MechanismParameters p = task_.start.parameters;
    const double shift = unknowns[2] - p[4];
    p[0] = unknowns[0];
    p[2] = unknowns[1];
    p[4] += shift;
    p[6] += shift;
    p[1] = biglide_ ? unknowns[0] : unknowns[3];
    return task_.start.WithParameters(p);
  }

  // Smaller is better.
  double Cost(const std::vector<double>& unknowns) {
    ++evaluations_;
    if (task_.cancelled && task_.cancelled()) {
      throw nlopt::forced_stop();
    }
    const LambdaMechanism m = Mechanism(unknowns);
    const ZoneGain zone = WorstErrorGain(m, task_.zone);
    double cost = zone.shortfall_mm > 0.0 ? kUnserved + zone.shortfall_mm : zone.gain;
    if (task_.objective == Objective::kRectangle && zone.shortfall_mm <= 0.0) {
      WorkspaceOptions coarse;
      coarse.grid_mm = 30.0;
      coarse.tolerance_mm = 2.0;
      cost = -ComputeWorkspace(m, coarse).rectangle.area_mm2();
    }
    if (cost < best_cost_) {
      best_cost_ = cost;
      best_ = unknowns;
    }
    return cost;
  }

  static double Ask(const std::vector<double>& unknowns, std::vector<double>&, void* search) {
    return static_cast<Search*>(search)->Cost(unknowns);
  }

  void Minimise(nlopt::algorithm algorithm, int evaluations, std::vector<double> from) {
    const std::vector<double> start = Unknowns(task_.start);
    nlopt::opt opt(algorithm, static_cast<unsigned>(start.size()));
    std::vector<double> low, high;
    for (std::size_t i = 0; i < start.size(); ++i) {
      const bool offset = i == 2;
      low.push_back(offset ? start[i] - task_.start.parameters[0] : task_.lowest_ratio * start[i]);
      high.push_back(offset ? start[i] + task_.start.parameters[0] : task_.highest_ratio * start[i]);
      from[i] = std::clamp(from[i], low[i], high[i]);
    }
    opt.set_lower_bounds(low);
    opt.set_upper_bounds(high);
    opt.set_min_objective(&Search::Ask, this);
    opt.set_maxeval(evaluations);
    opt.set_xtol_rel(1e-7);
    double cost = 0.0;
    opt.optimize(from, cost);
  }

  bool Run() {
    try {
      Cost(Unknowns(task_.start));
      before_ = best_cost_;
      Minimise(nlopt::GN_DIRECT_L, task_.evaluations / 2, best_);
      Minimise(nlopt::LN_SBPLX, std::max(1, task_.evaluations - evaluations_), best_);
      return true;
    } catch (const nlopt::roundoff_limited&) {
      return true;  // as good as doubles let it become
    } catch (const std::exception&) {
      return false;  // cancelled, or NLopt gave up
    }
  }

  double before() const { return before_; }
  double best_cost() const { return best_cost_; }
  const std::vector<double>& best() const { return best_; }
  int evaluations() const { return evaluations_; }

 private:
  const OptimisationTask& task_;
  const bool biglide_;
  int evaluations_ = 0;
  double before_ = 0.0;
  double best_cost_ = 1e300;
  std::vector<double> best_;
};

double Told(double cost) { return cost >= kUnserved ? 0.0 : std::abs(cost); }

}  // namespace

ZoneGain WorstErrorGain(const LambdaMechanism& m, const Rectangle& zone) {
  ZoneGain worst;
  for (int j = 0; j < kRaster; ++j) {
    for (int i = 0; i < kRaster; ++i) {
      const Eigen::Vector2d p(zone.x_min_mm + (zone.x_max_mm - zone.x_min_mm) * i / (kRaster - 1),
                              zone.y_min_mm + (zone.y_max_mm - zone.y_min_mm) * j / (kRaster - 1));
      const double margin = FindUsableMargin(m, p).margin_mm;
      worst.shortfall_mm = std::max(worst.shortfall_mm, std::min(-margin, 1e8));
      if (margin >= 0.0 && worst.shortfall_mm <= 0.0) {
        const LambdaJacobians jacobians = ComputeJacobians(m, p);
        worst.gain =
            std::max(worst.gain, jacobians.invertible ? 1.0 / jacobians.smallest_singular_value : 1e8);
      }
    }
  }
  return worst.shortfall_mm > 0.0 ? ZoneGain{0.0, worst.shortfall_mm} : worst;
}

OptimisationAnswer OptimiseGeometry(const OptimisationTask& task) {
  OptimisationAnswer answer;
  answer.found = task.start;
  if (!task.start.valid) {
    return answer;
  }
  const bool limited = std::all_of(
      task.start.travel.begin(), task.start.travel.end(),
      [](const ActuatorTravel& t) { return t.min_mm > -kUnlimitedMm && t.max_mm < kUnlimitedMm; });
  if (!limited) {
    answer.reason = Reason::kActuatorLimit;
    return answer;
  }
  Search search(task);
  const bool finished = search.Run();
  answer.evaluations = search.evaluations();
  answer.before = Told(search.before());
  if (!finished) {
    answer.reason = Reason::kNotConverged;
    return answer;
  }
  answer.after = Told(search.best_cost());
  answer.reason = search.best_cost() >= kUnserved ? Reason::kOutOfReach : Reason::kSolved;
  answer.found = search.Mechanism(search.best());
  return answer;
}

}  // namespace lambdajet::kinematics
