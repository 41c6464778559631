#include "trajectory/core/tolerance/judged_contour.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lambdajet::trajectory {
namespace {

using accuracy::ContourModel;
using accuracy::Source;
using Eigen::Vector2d;

constexpr double kPlaceSpacing_mm = 0.25;
constexpr double kFewestPlaces = 600.0;
constexpr double kMostPlaces = 40000.0;
constexpr double kMostMore = 100000.0;  // of those for where the jet creeps
constexpr double kDrawnSpacing_mm = 1.0;
constexpr double kMostDrawnPlaces = 4000.0;
constexpr int kDraws = 300;
constexpr double kLook_mm = 1.0;  // either side of a place, for the nearest programmed contour
constexpr double kQuantile = 0.95;

constexpr std::size_t At(Source s) { return static_cast<std::size_t>(s); }

bool Moving(std::size_t source) {
  return source == At(Source::kElastic) || source == At(Source::kFollowing) || source == At(Source::kJetLag);
}

// Walks the program's path along with the plan's samples: run length, and distance from the programmed contour.
class PathWalk {
 public:
  PathWalk(const ProgramPath& path, const PlannedProgram& planned) : path_(path), planned_(planned) {}

  double RunLength(double s_mm) {
    const std::vector<double>& begin = planned_.element_begin_s_mm;
    while (element_ + 1 < begin.size() && begin[element_ + 1] <= s_mm) {
      ++element_;
      piece_ = 0;
    }
    const PathElement& e = path_.elements[element_];
    offset_mm_ = std::clamp(s_mm - begin[element_], 0.0, e.length_mm());
    return e.run_begin_mm + offset_mm_;
  }

  std::size_t element() const { return element_; }

  // At the place that RunLength was asked for last.
  double Distance(const Vector2d& p_mm) {
    const std::vector<PathPiece>& pieces = path_.elements[element_].pieces;
    if (pieces.empty()) {
      return 0.0;
    }
    while (piece_ + 1 < pieces.size() && pieces[piece_ + 1].begin_mm <= offset_mm_) {
      ++piece_;
    }
    double nearest = DistanceTo(pieces[piece_], p_mm);
    for (std::size_t i = piece_;
         i-- > 0 && offset_mm_ - pieces[i].begin_mm - pieces[i].length_mm < kLook_mm;) {
      nearest = std::min(nearest, DistanceTo(pieces[i], p_mm));
    }
    for (std::size_t i = piece_ + 1; i < pieces.size() && pieces[i].begin_mm - offset_mm_ < kLook_mm; ++i) {
      nearest = std::min(nearest, DistanceTo(pieces[i], p_mm));
    }
    return nearest;
  }

 private:
  const ProgramPath& path_;
  const PlannedProgram& planned_;
  std::size_t element_ = 0;
  std::size_t piece_ = 0;
  double offset_mm_ = 0.0;
};

bool Covers(const ToleranceWish& wish, std::uint32_t contour, std::uint32_t line) {
  const bool any_line = wish.first_line == 0 && wish.last_line == 0;
  return (wish.contour == 0 || wish.contour == contour) &&
         (any_line || (line >= wish.first_line && line <= wish.last_line));
}

// Groups in the order in which the cut meets them.
class Grouping {
 public:
  Grouping(const std::vector<ToleranceWish>& wishes, const Widening& widening,
           std::vector<JudgedGroup>& groups)
      : wishes_(wishes), widening_(widening), groups_(groups) {}

  std::size_t GroupOf(std::uint32_t contour, std::uint32_t line, double length_mm) {
    const double tolerance = ToleranceOf(wishes_, contour, line);
    const auto [there, fresh] = known_.try_emplace({contour, tolerance}, groups_.size());
    if (fresh) {
      JudgedGroup group{contour, line, line, tolerance};
      const auto wider = widening_.find({contour, tolerance});
      group.widening_ratio = wider == widening_.end() ? 1.0 : wider->second;
      groups_.push_back(group);
    }
    JudgedGroup& group = groups_[there->second];
    group.first_line = std::min(group.first_line, line);
    group.last_line = std::max(group.last_line, line);
    group.length_mm += length_mm;
    return there->second;
  }

 private:
  const std::vector<ToleranceWish>& wishes_;
  const Widening& widening_;
  std::vector<JudgedGroup>& groups_;
  std::map<std::pair<std::uint32_t, double>, std::size_t> known_;
};

void FillErrors(const std::array<double, accuracy::kSourceCount>& bias,
                const std::array<double, accuracy::kSourceCount>& variance, JudgedPlace& place) {
  double worst = -1.0, worst_still = -1.0;
  for (std::size_t s = 0; s < accuracy::kSourceCount; ++s) {
    const double mean_square = bias[s] * bias[s] + std::max(0.0, variance[s]);
    if (mean_square > worst) {
      worst = mean_square;
      place.worst_source = static_cast<Source>(s);
    }
    place.moving_bias_mm += bias[s];
    if (!Moving(s)) {
      place.still_variance_mm2 += variance[s];
      if (mean_square > worst_still) {
        worst_still = mean_square;
        place.worst_still_source = static_cast<Source>(s);
      }
    }
  }
  place.still_variance_mm2 = std::max(0.0, place.still_variance_mm2);
  place.elastic_bias_mm = bias[At(Source::kElastic)];
  place.elastic_variance_mm2 = std::max(0.0, variance[At(Source::kElastic)]);
  place.rate_variance_mm2 = variance[At(Source::kFollowing)];
  place.surge_variance_mm2 = place.elastic_variance_mm2 + variance[At(Source::kJetLag)];
}

// The pace at which a place's bound meets its tolerance, by bracketing (the bound grows with the pace).
double RoomOf(const JudgedPlace& place, double widening, double tolerance_mm) {
  double high = kMostRoom, above = BoundAt(place, widening, high) - tolerance_mm;
  if (above <= 0.0) {
    return high;
  }
  double low = kLeastRoom, below = BoundAt(place, widening, low) - tolerance_mm;
  if (below >= 0.0) {
    return low;
  }
  for (int i = 0; i < 12 && high - low > 1e-4; ++i) {  // regula falsi with bisection in turn
    const double middle = i % 3 == 2 ? 0.5 * (low + high) : low + (high - low) * below / (below - above);
    const double excess = BoundAt(place, widening, middle) - tolerance_mm;
    (excess > 0.0 ? high : low) = middle;
    (excess > 0.0 ? above : below) = excess;
  }
  return low;
}

void Judge(JudgedContour& judged) {
  judged.holds = true;
  for (std::size_t i = 0; i < judged.places.size(); ++i) {
    JudgedPlace& place = judged.places[i];
    JudgedGroup& group = judged.groups[place.group];
    place.bound_mm = BoundAt(place, group.widening_ratio, 1.0);
    if (place.bound_mm > group.worst_mm) {
      group.worst_mm = place.bound_mm;
      group.worst_place = i;
    }
    if (!std::isfinite(group.tolerance_mm)) {
      continue;
    }
    place.room_ratio = RoomOf(place, group.widening_ratio, group.tolerance_mm);
    if (place.bound_mm > group.tolerance_mm) {
      judged.holds = false;
      place.still_bound_mm = BoundAt(place, group.widening_ratio, 0.0);
    }
  }
}

double WaitAt(const MachineDescription& machine, const Gate& gate) {
  switch (gate.kind) {
    case GateKind::kPierce:
    case GateKind::kDwell:
      return gate.argument;
    case GateKind::kMeasure:
      return machine.process.measuring_settle_time_s;
    default:
      return 0.0;
  }
}

double CutLength(const PlannedProgram& planned) { return std::max(1.0, planned.cutting_length_mm); }

std::vector<std::size_t> GroupOfSample(const JudgedContour& judged, std::size_t samples) {
  std::vector<std::size_t> group(samples, 0);
  std::size_t next = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    while (next + 1 < judged.places.size() && judged.places[next].sample < i) {
      ++next;
    }
    group[i] = judged.places[next].group;
  }
  return group;
}

}  // namespace

double ToleranceOf(const std::vector<ToleranceWish>& wishes, std::uint32_t contour, std::uint32_t line) {
  double tolerance = std::numeric_limits<double>::infinity();
  for (const ToleranceWish& wish : wishes) {
    tolerance = Covers(wish, contour, line) ? std::min(tolerance, wish.tolerance_mm) : tolerance;
  }
  return tolerance;
}

double BoundAt(const JudgedPlace& place, double widening, double pace) {
  const double square = pace * pace;
  const double variance = place.still_variance_mm2 + square * place.rate_variance_mm2 +
                          square * square * place.surge_variance_mm2;
  return accuracy::FoldedNormalQuantile(square * place.moving_bias_mm,
                                        widening * std::sqrt(std::max(0.0, variance)), kQuantile) +
         pace * place.rounding_mm;
}

std::vector<PlanSample> SamplesWithGates(const MachineDescription& machine, const PlannedProgram& planned) {
  std::vector<PlanSample> samples = planned.samples;
  std::size_t gate = 0, segment = 0;
  double waited_s = 0.0;
  const Plan& plan = planned.plan;
  for (PlanSample& sample : samples) {
    while (segment < plan.segments.size() &&
           plan.segments[segment].start_s + plan.segments[segment].duration_s < sample.tau_s - 1e-9) {
      const std::uint32_t id = plan.segments[segment++].gate_at_end;
      for (; gate < plan.gates.size() && plan.gates[gate].id <= id; ++gate) {
        waited_s += WaitAt(machine, plan.gates[gate]);
      }
    }
    sample.tau_s += waited_s;
  }
  return samples;
}

const JudgedPlace* JudgedContour::Worst() const {
  const JudgedPlace* worst = nullptr;
  double excess = -std::numeric_limits<double>::infinity();
  for (const JudgedGroup& group : groups) {
    if (std::isfinite(group.tolerance_mm) && group.worst_mm - group.tolerance_mm > excess) {
      excess = group.worst_mm - group.tolerance_mm;
      worst = &places[group.worst_place];
    }
  }
  return worst;
}

JudgedContour JudgeContour(const MachineDescription& machine, const ProgramPath& path,
                           const PlannedProgram& planned, const std::vector<ToleranceWish>& wishes,
                           const Widening& widening) {
  JudgedContour judged;
  ContourModel model(machine);
  std::uint32_t blame_line = 0;
  const auto points =
      static_cast<int>(std::clamp(CutLength(planned) / kPlaceSpacing_mm, kFewestPlaces, kMostPlaces));
  const std::vector<PlanSample> samples = SamplesWithGates(machine, planned);
  const double longest_s = std::max(1.99 * kJudgedEvery_s, planned.plan.duration_s / kMostMore);
  judged.reason =
      accuracy::BuildContourModel(samples, planned.plan.compensated, points, model, blame_line, longest_s);
  if (judged.reason != accuracy::PredictionReason::kPredicted) {
    return judged;
  }
  const accuracy::PointErrors errors = accuracy::PropagateLinearly(model);
  Grouping grouping(wishes, widening, judged.groups);
  PathWalk walk(path, planned);
  judged.samples.reserve(samples.size());
  judged.places.reserve(model.points.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const PlanSample& sample = samples[i];
    const double run_mm = walk.RunLength(sample.s_mm);
    judged.samples.push_back({sample.tau_s, walk.element(), run_mm});
    const std::size_t k = judged.places.size();
    if (k == model.points.size() || model.points[k].sample != i) {
      continue;
    }
    const ContourModel::Point& point = model.points[k];
    JudgedPlace& place = judged.places.emplace_back();
    place.time_s = sample.tau_s;
    place.s_mm = sample.s_mm;
    place.run_mm = run_mm;
    place.element = walk.element();
    place.p_W_mm = point.p_W_mm;
    place.n_W = point.n_W;
    place.line = sample.source_line;
    place.sample = i;
    place.group = grouping.GroupOf(point.feature + 1, sample.source_line, point.weight_mm);
    place.rounding_mm = walk.Distance(point.p_W_mm);
    FillErrors(errors.bias_mm[k], errors.variance_mm2[k], place);
  }
  Judge(judged);
  return judged;
}

bool PredictGroups(const MachineDescription& machine, const PlannedProgram& planned, JudgedContour& judged,
                   const std::function<bool(double)>& cancelled) {
  ContourModel model(machine);
  std::uint32_t blame_line = 0;
  const auto points =
      static_cast<int>(std::clamp(CutLength(planned) / kDrawnSpacing_mm, kFewestPlaces, kMostDrawnPlaces));
  accuracy::BuildContourModel(SamplesWithGates(machine, planned), planned.plan.compensated, points, model,
                              blame_line);
  const std::vector<std::size_t> group = GroupOfSample(judged, planned.samples.size());
  for (ContourModel::Point& point : model.points) {
    point.feature = static_cast<std::uint32_t>(group[point.sample]);
  }
  model.features = static_cast<std::uint32_t>(judged.groups.size());
  accuracy::DrawSpace space(model);
  std::vector<std::vector<double>> drawn(judged.groups.size());
  for (int d = 0; d < kDraws; ++d) {
    if (cancelled && cancelled(static_cast<double>(d) / kDraws)) {
      return false;
    }
    accuracy::DrawContour(model, 1, static_cast<std::uint64_t>(d), space);
    for (std::size_t g = 0; g < drawn.size(); ++g) {
      drawn[g].push_back(space.feature_p95_mm[g]);
    }
  }
  for (std::size_t g = 0; g < drawn.size(); ++g) {
    judged.groups[g].predicted_95_mm = accuracy::UpperQuantile(drawn[g], kQuantile);
  }
  return true;
}

StillBounds StillBoundsAt(const MachineDescription& machine, const JudgedPlace& place) {
  constexpr int kColumns = 17, kRows = 13;
  const accuracy::ErrorChain chain(machine);
  const auto bound = [&chain, &place](const Vector2d& p_W, bool identified) {
    const auto sensitivity = accuracy::SensitivityAt(chain, p_W);
    if (!sensitivity.valid) {
      return std::numeric_limits<double>::infinity();
    }
    const accuracy::SensitivityRow row = place.n_W.transpose() * sensitivity.J_p_parameters;
    const auto variance = accuracy::VarianceBySource(chain, sensitivity, row, place.n_W, {p_W}, 0.0);
    double sum = 0.0;
    for (std::size_t s = 0; s < variance.size(); ++s) {
      sum += identified && s <= At(Source::kJetOffset) ? 0.0 : variance[s];
    }
    return accuracy::FoldedNormalQuantile(0.0, std::sqrt(std::max(0.0, sum)), kQuantile);
  };
  StillBounds bounds{bound(place.p_W_mm, false), bound(place.p_W_mm, true),
                     std::numeric_limits<double>::infinity()};
  for (int i = 0; i < kColumns * kRows; ++i) {
    const Vector2d p_W(machine.sheet_width_mm * (i % kColumns) / (kColumns - 1),
                       machine.sheet_height_mm * (i / kColumns) / (kRows - 1));
    if (const double there = bound(p_W, false); there < bounds.elsewhere_mm) {
      bounds.elsewhere_mm = there;
      bounds.best_W_mm = p_W;
    }
  }
  return bounds;
}

}  // namespace lambdajet::trajectory
