#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "accuracy/core/elastic.hpp"
#include "accuracy/core/jet_lag.hpp"
#include "accuracy/core/prediction.hpp"

namespace lambdajet::accuracy {
namespace {

constexpr double kShortestStepMm = 1e-9;

Eigen::Vector2d Place(const PlanSample& s) { return {s.x_W_mm, s.y_W_mm}; }
Eigen::Vector2d Velocity(const PlanSample& s) { return {s.vx_W_mm_per_s, s.vy_W_mm_per_s}; }
Eigen::Vector2d Acceleration(const PlanSample& s) { return {s.ax_W_mm_per_s2, s.ay_W_mm_per_s2}; }

bool Finite(const PlanSample& s) {
  return std::isfinite(s.tau_s) && std::isfinite(s.s_mm) && Place(s).allFinite() && Velocity(s).allFinite() &&
         Acceleration(s).allFinite();
}

PredictionReason Judge(std::span<const PlanSample> samples, std::uint32_t& blame_line) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    blame_line = samples[i].source_line;
    if (!Finite(samples[i])) {
      return PredictionReason::kNotFinite;
    }
    if (i > 0 && samples[i].tau_s < samples[i - 1].tau_s) {
      return PredictionReason::kOutOfOrder;
    }
  }
  blame_line = 0;
  return PredictionReason::kPredicted;
}

bool Cuts(std::span<const PlanSample> samples, std::size_t i) {  // the step that ends at i
  return samples[i].cutting && samples[i - 1].cutting;
}

double StepLength(std::span<const PlanSample> samples, std::size_t i) {
  return (Place(samples[i]) - Place(samples[i - 1])).norm();
}

double CutLength(std::span<const PlanSample> samples) {
  double length = 0.0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    length += Cuts(samples, i) ? StepLength(samples, i) : 0.0;
  }
  return length;
}

void FillSteps(std::span<const PlanSample> samples, ContourModel& model) {
  model.steps.assign(samples.size(), {0.0, Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const Eigen::Vector2d from = Acceleration(samples[i - 1]);
    const Eigen::Vector2d to = Acceleration(samples[i]);
    const double h = samples[i].tau_s - samples[i - 1].tau_s;
    model.steps[i] = {h, 0.5 * (from + to),
                      h > 0.0 ? Eigen::Vector2d((to - from) / h) : Eigen::Vector2d::Zero()};
  }
}

// The chord over the last step that moved gives the direction where the velocity is too small to.
Eigen::Vector2d NormalAt(std::span<const PlanSample> samples, std::size_t i) {
  Eigen::Vector2d t = Velocity(samples[i]);
  if (t.norm() < 1e-6) {
    t = Place(samples[i]) - Place(samples[i - 1]);
  }
  return Eigen::Vector2d(-t.y(), t.x()).normalized();
}

std::size_t EndOfCut(std::span<const PlanSample> samples, std::size_t begin) {
  std::size_t end = begin;
  while (end < samples.size() && samples[end].cutting) {
    ++end;
  }
  return end;
}

std::vector<Eigen::Vector2d> PlayFront(std::span<const PlanSample> samples, double lag_time_s) {
  std::vector<Eigen::Vector2d> front(samples.size(), Eigen::Vector2d::Zero());
  CutFront cut(lag_time_s);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i == 0 || !Cuts(samples, i)) {
      cut.Start(Place(samples[i]));
    } else {
      cut.Advance(samples[i].tau_s - samples[i - 1].tau_s, Place(samples[i]));
    }
    front[i] = cut.place();
  }
  return front;
}

// How far to the left of the jet's path at sample i the front passes later; its tail at the end of a cut is
// judged across.
double LagBias(std::span<const PlanSample> samples, const std::vector<Eigen::Vector2d>& front, std::size_t i,
               std::size_t end, const Eigen::Vector2d& n_W, double lag_time_s) {
  constexpr double kLagsUntilPassed = 8.0;
  const Eigen::Vector2d p = Place(samples[i]);
  double best = INFINITY;
  Eigen::Vector2d nearest = front[i] - p;
  bool passed = false;
  for (std::size_t k = i + 1;
       k < end && samples[k].tau_s - samples[i].tau_s <= kLagsUntilPassed * lag_time_s + 0.01; ++k) {
    const Eigen::Vector2d a = front[k - 1] - p;
    const Eigen::Vector2d d = front[k] - front[k - 1];
    const double along = d.squaredNorm() > 0.0 ? std::clamp(-a.dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
    const Eigen::Vector2d gap = a + along * d;
    if (gap.norm() < best) {
      best = gap.norm();
      nearest = gap;
      passed = along < 1.0;
    }
  }
  const double across = nearest.dot(n_W);
  return passed ? std::copysign(best, across) : across;
}

struct Walk {
  double spacing_mm;
  double longest_s;
  double kept_s = 0.0;
  double walked_mm = 0.0;
  double kept_mm = 0.0;
  std::size_t end_of_cut = 0;
};

bool AddPoint(std::span<const PlanSample> samples, const std::vector<Eigen::Vector2d>& front, std::size_t i,
              Walk& walk, ContourModel& model) {
  ContourModel::Point point;
  point.p_W_mm = Place(samples[i]);
  point.n_W = NormalAt(samples, i);
  point.v_W_mm_per_s = Velocity(samples[i]);
  point.a_W_mm_per_s2 = Acceleration(samples[i]);
  const auto inverse = kinematics::SolveInverse(model.chain.mechanism, model.chain.EffectorAt(point.p_W_mm));
  point.place = SensitivityAt(model.chain, point.p_W_mm);
  if (!inverse.positioned || !point.place.valid) {
    return false;
  }
  point.actuator_position_mm = inverse.actuator_position_mm;
  point.lag_bias_mm = LagBias(samples, front, i, walk.end_of_cut, point.n_W, model.chain.jet_lag_time_s);
  point.weight_mm = walk.walked_mm - walk.kept_mm;
  point.sample = i;
  point.feature = model.features - 1;
  walk.kept_mm = walk.walked_mm;
  walk.kept_s = samples[i].tau_s;
  model.points.push_back(point);
  return true;
}

// Points at equal distances of cut length, and not longer apart than asked. False with the line where the mechanism cannot
// stand.
bool FillPoints(std::span<const PlanSample> samples, double spacing_mm, double longest_s, ContourModel& model,
                std::uint32_t& blame_line) {
  const auto front = PlayFront(samples, model.chain.jet_lag_time_s);
  Walk walk{spacing_mm, longest_s};
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (!Cuts(samples, i)) {
      continue;
    }
    if (i >= walk.end_of_cut) {
      walk.end_of_cut = EndOfCut(samples, i);
      ++model.features;
    }
    const double step = StepLength(samples, i);
    walk.walked_mm += step;
    const bool due =
        walk.walked_mm - walk.kept_mm >= walk.spacing_mm || samples[i].tau_s - walk.kept_s >= walk.longest_s;
    if (step > kShortestStepMm && due && !AddPoint(samples, front, i, walk, model)) {
      blame_line = samples[i].source_line;
      return false;
    }
  }
  return true;
}

// Of a covariance scaled to unit diagonal, so that mm^2 and s^4 are factored alike; null directions stay
// null.
ParameterCovariance SquareRoot(const ParameterCovariance& covariance) {
  const ParameterVector sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const ParameterVector scale = (sigma.array() > 0.0).select(sigma.cwiseInverse(), 0.0);
  const Eigen::SelfAdjointEigenSolver<ParameterCovariance> solver(scale.asDiagonal() * covariance *
                                                                  scale.asDiagonal());
  return sigma.asDiagonal() * solver.eigenvectors() *
         solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

}  // namespace

PredictionReason BuildContourModel(std::span<const PlanSample> samples, bool compensated, int points,
                                   ContourModel& model, std::uint32_t& blame_line, double longest_s) {
  const PredictionReason reason = Judge(samples, blame_line);
  if (reason != PredictionReason::kPredicted) {
    return reason;
  }
  const double length = CutLength(samples);
  if (!(length > kShortestStepMm)) {
    return PredictionReason::kNoCutting;
  }
  model.compensated = compensated;
  model.spread = SquareRoot(model.chain.covariance);
  FillSteps(samples, model);
  const double spacing = 0.999999 * length / std::max(1, points);
  return FillPoints(samples, spacing, longest_s, model, blame_line) ? PredictionReason::kPredicted
                                                                    : PredictionReason::kUnreachable;
}

void PlaySpring(const ContourModel& model, double elastic_lag_s2, double damping_time_s,
                std::span<Eigen::Vector2d> deviation_W_mm) {
  const double lag = std::max(0.0, elastic_lag_s2);
  const double damping = std::max(0.0, damping_time_s);
  const double by_acceleration = (model.compensated ? model.chain.elastic_lag_s2 : 0.0) - lag;
  const double by_jerk =
      model.compensated ? (damping - model.chain.damping_time_s) * model.chain.elastic_lag_s2 : 0.0;
  SpringResponse spring(lag, damping);
  std::size_t next = 0;
  for (std::size_t i = 0; i < model.steps.size() && next < model.points.size(); ++i) {
    const ContourModel::Step& step = model.steps[i];
    spring.Advance(step.duration_s, by_acceleration * step.a_W_mm_per_s2 + by_jerk * step.jerk_W_mm_per_s3);
    if (model.points[next].sample == i) {
      deviation_W_mm[next++] = spring.deflection();
    }
  }
}

}  // namespace lambdajet::accuracy
