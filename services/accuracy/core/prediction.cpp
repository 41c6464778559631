#include "accuracy/core/prediction.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "accuracy/core/counter_random.hpp"

namespace lambdajet::accuracy {
namespace {

using Deflections = std::vector<Eigen::Vector2d>;

constexpr std::size_t kWorstPlaces = 10;

double Square(double x) { return x * x; }
constexpr Eigen::Index Index(Parameter p) { return static_cast<Eigen::Index>(p); }

Deflections Spring(const ContourModel& model, double elastic_lag_s2, double damping_time_s) {
  Deflections d(model.points.size(), Eigen::Vector2d::Zero());
  PlaySpring(model, elastic_lag_s2, damping_time_s, d);
  return d;
}

// Central difference of the spring's part in one of its two numbers; one-sided where that would become
// negative.
Deflections SpringSlope(const ContourModel& model, double lag_step_s2, double damping_step_s) {
  const double lag = model.chain.elastic_lag_s2;
  const double damping = model.chain.damping_time_s;
  const bool centred = lag >= lag_step_s2 && damping >= damping_step_s;
  const Deflections above = Spring(model, lag + lag_step_s2, damping + damping_step_s);
  const Deflections below =
      centred ? Spring(model, lag - lag_step_s2, damping - damping_step_s) : Spring(model, lag, damping);
  const double width = (centred ? 2.0 : 1.0) * (lag_step_s2 + damping_step_s);
  Deflections slope(above.size());
  for (std::size_t i = 0; i < above.size(); ++i) {
    slope[i] = (above[i] - below[i]) / width;
  }
  return slope;
}

}  // namespace

PointErrors PropagateLinearly(const ContourModel& model) {
  const ErrorChain& chain = model.chain;
  const Deflections elastic = Spring(model, chain.elastic_lag_s2, chain.damping_time_s);
  const Deflections by_lag = SpringSlope(model, std::max(1e-7, 1e-3 * chain.elastic_lag_s2), 0.0);
  const Deflections by_damping = SpringSlope(model, 0.0, std::max(1e-6, 1e-3 * chain.damping_time_s));
  PointErrors errors;
  errors.bias_mm.resize(model.points.size());
  errors.variance_mm2.resize(model.points.size());
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    const ContourModel::Point& point = model.points[i];
    SensitivityRow row = point.n_W.transpose() * point.place.J_p_parameters;
    row[Index(Parameter::kElasticLagS2)] = by_lag[i].dot(point.n_W);
    row[Index(Parameter::kDampingTimeS)] = by_damping[i].dot(point.n_W);
    errors.bias_mm[i].fill(0.0);
    errors.bias_mm[i][static_cast<std::size_t>(Source::kElastic)] = elastic[i].dot(point.n_W);
    errors.bias_mm[i][static_cast<std::size_t>(Source::kFollowing)] =
        ServoBias(chain, point.place, point.n_W, point.a_W_mm_per_s2);
    errors.bias_mm[i][static_cast<std::size_t>(Source::kJetLag)] = point.lag_bias_mm;
    errors.variance_mm2[i] =
        VarianceBySource(chain, point.place, row, point.n_W,
                         {point.p_W_mm, point.v_W_mm_per_s, point.a_W_mm_per_s2}, point.lag_bias_mm);
  }
  return errors;
}

namespace {

double Sum(const std::array<double, kSourceCount>& values) {
  double sum = 0.0;
  for (const double v : values) {
    sum += v;
  }
  return sum;
}

// What a source adds to the mean square at a point; over all sources it sums to bias^2 + variance.
double MeanSquareShare(const PointErrors& errors, std::size_t point, std::size_t source) {
  return errors.bias_mm[point][source] * Sum(errors.bias_mm[point]) + errors.variance_mm2[point][source];
}

Source Dominant(const PointErrors& errors, std::size_t point) {
  std::size_t best = 0;
  for (std::size_t s = 1; s < kSourceCount; ++s) {
    best = MeanSquareShare(errors, point, s) > MeanSquareShare(errors, point, best) ? s : best;
  }
  return static_cast<Source>(best);
}

void FillPointBounds(const ContourModel& model, const PointErrors& errors,
                     std::span<const PlanSample> samples, ContourPrediction& prediction) {
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    const ContourModel::Point& from = model.points[i];
    const PlanSample& sample = samples[from.sample];
    PredictedPoint point;
    point.tau_s = sample.tau_s;
    point.s_mm = sample.s_mm;
    point.p_W_mm = from.p_W_mm;
    point.source_line = sample.source_line;
    point.feature = from.feature;
    point.bias_mm = Sum(errors.bias_mm[i]);
    point.sigma_mm = std::sqrt(std::max(0.0, Sum(errors.variance_mm2[i])));
    point.bound_95_mm = FoldedNormalQuantile(point.bias_mm, point.sigma_mm, 0.95);
    point.dominant = Dominant(errors, i);
    prediction.points.push_back(point);
  }
}

template <class ValueOfPoint>
double ContourPercentile(const ContourModel& model, ValueOfPoint value, double fraction) {
  std::vector<WeightedValue> values;
  values.reserve(model.points.size());
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    values.push_back({value(i), model.points[i].weight_mm});
  }
  return WeightedPercentile(values, fraction);
}

std::vector<SourceShare> RankSources(const ContourModel& model, const PointErrors& errors) {
  std::vector<SourceShare> budget;
  double total = 0.0;
  for (std::size_t s = 0; s < kSourceCount; ++s) {
    SourceShare share;
    share.source = static_cast<Source>(s);
    for (std::size_t i = 0; i < model.points.size(); ++i) {
      share.share += model.points[i].weight_mm * MeanSquareShare(errors, i, s);
    }
    share.share = std::max(0.0, share.share);
    total += share.share;
    share.contribution_95_mm = ContourPercentile(
        model,
        [&errors, s](std::size_t i) {
          return FoldedNormalQuantile(errors.bias_mm[i][s],
                                      std::sqrt(std::max(0.0, errors.variance_mm2[i][s])), 0.95);
        },
        0.95);
    budget.push_back(share);
  }
  for (SourceShare& share : budget) {
    share.share = total > 0.0 ? share.share / total : 0.0;
  }
  std::ranges::stable_sort(budget, std::greater<>{}, &SourceShare::contribution_95_mm);
  return budget;
}

std::vector<PredictedPoint> WorstPlaces(const std::vector<PredictedPoint>& points) {
  std::vector<PredictedPoint> sorted = points;
  std::ranges::stable_sort(sorted, std::greater<>{}, &PredictedPoint::bound_95_mm);
  std::vector<PredictedPoint> worst;
  for (const PredictedPoint& point : sorted) {
    const bool known = std::ranges::any_of(
        worst, [&point](const PredictedPoint& w) { return w.source_line == point.source_line; });
    if (!known && worst.size() < kWorstPlaces) {
      worst.push_back(point);
    }
  }
  return worst;
}

std::vector<FeaturePrediction> ListFeatures(const ContourModel& model,
                                            const std::vector<PredictedPoint>& points) {
  std::vector<FeaturePrediction> features(model.features);
  for (std::size_t i = 0; i < points.size(); ++i) {
    FeaturePrediction& f = features[points[i].feature];
    f.feature = points[i].feature;
    f.first_line = f.length_mm > 0.0 ? std::min(f.first_line, points[i].source_line) : points[i].source_line;
    f.last_line = std::max(f.last_line, points[i].source_line);
    f.length_mm += model.points[i].weight_mm;
  }
  return features;
}

double OrderStatistic(std::vector<double>& values, double rank) {
  const double last = static_cast<double>(values.size()) - 1.0;
  const auto at = static_cast<std::ptrdiff_t>(std::clamp(std::ceil(rank) - 1.0, 0.0, last));
  std::ranges::nth_element(values, values.begin() + at);
  return values[static_cast<std::size_t>(at)];
}

double ShareWithin(const std::vector<double>& values, double tolerance_mm) {
  if (!(tolerance_mm > 0.0) || values.empty()) {
    return 0.0;
  }
  const auto within = std::ranges::count_if(values, [tolerance_mm](double v) { return v <= tolerance_mm; });
  return static_cast<double>(within) / static_cast<double>(values.size());
}

void Sample(const ContourModel& model, const PredictionOptions& options, ContourPrediction& prediction) {
  const auto draws = static_cast<std::size_t>(std::clamp(options.draws, 0, kMostDraws));
  if (draws == 0) {
    return;
  }
  DrawSpace space(model);
  std::vector<double> all;
  std::vector<std::vector<double>> by_feature(model.features);
  for (std::size_t d = 0; d < draws; ++d) {
    if (options.cancelled && options.cancelled()) {
      prediction.reason = PredictionReason::kCancelled;
      return;
    }
    all.push_back(DrawContour(model, options.seed, d, space));
    for (std::size_t f = 0; f < by_feature.size(); ++f) {
      by_feature[f].push_back(space.feature_p95_mm[f]);
    }
  }
  prediction.conformity = ShareWithin(all, options.tolerance_mm);
  prediction.expected_95_mm = OrderStatistic(all, 0.5 * static_cast<double>(all.size()));
  prediction.predicted_95_mm = UpperQuantile(all, 0.95);
  for (std::size_t f = 0; f < by_feature.size(); ++f) {
    prediction.features[f].conformity = ShareWithin(by_feature[f], options.tolerance_mm);
    prediction.features[f].predicted_95_mm = UpperQuantile(by_feature[f], 0.95);
  }
}

// Numbers of a draw's stream that belong to one cut; the points' own follow.
enum Drawn : std::uint64_t {
  kFollowing1 = kParameterCount,
  kFollowing2,
  kBacklash1,
  kBacklash2,
  kRail1Sine,
  kRail1Cosine,
  kRail2Sine,
  kRail2Cosine,
  kLag,
  kServo1,
  kServo2,
  kAzimuth1,
  kAzimuth2,
  kAzimuth3,
  kFirstPoint = 40
};

// One machine out of the many that the description allows.
struct DrawnMachine {
  ParameterVector parameters;
  kinematics::LambdaMechanism mechanism;
  PlanarPose X_DJ;
  Eigen::Vector2d p_EW_mm;
  Eigen::Matrix2d R_WE;
  Eigen::Array2d following;    // slider error by slider rate, s
  Eigen::Array2d servo_s2;     // and by its acceleration
  Eigen::Array2d backlash_mm;  // half width
  Eigen::Array2d sine_mm;
  Eigen::Array2d cosine_mm;
  Eigen::Vector2d jet_offset_mm;  // on the sheet
  double lag_factor;              // on the lag's inset, which goes with the square of its time
};

DrawnMachine DrawMachine(const ContourModel& model, const CounterStream& random) {
  const ErrorChain& chain = model.chain;
  const Uncertainties& u = chain.uncertainties;
  ParameterVector z;
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    z[i] = random.Normal(static_cast<std::uint64_t>(i));
  }
  DrawnMachine m;
  m.parameters = chain.parameters + model.spread * z;
  m.mechanism = chain.mechanism.WithParameters(m.parameters.head<kinematics::kMechanismParameterCount>());
  m.X_DJ = {m.parameters[Index(Parameter::kBaseXMm)], m.parameters[Index(Parameter::kBaseYMm)], 0.0};
  m.p_EW_mm = m.parameters.segment<2>(Index(Parameter::kSheetXMm));
  m.R_WE = PlanarPose{0.0, 0.0, m.parameters[Index(Parameter::kSheetThetaRad)]}.rotation().transpose();
  m.following = u.following_mm / chain.reference_feed_mm_per_s *
                Eigen::Array2d(random.Normal(kFollowing1), random.Normal(kFollowing2));
  m.servo_s2 = u.following_mm / chain.reference_acceleration_mm_per_s2 *
               Eigen::Array2d(random.Normal(kServo1), random.Normal(kServo2)).abs();
  m.backlash_mm = 0.5 * u.backlash_mm * Eigen::Array2d(random.Normal(kBacklash1), random.Normal(kBacklash2));
  m.sine_mm = u.straightness_mm * Eigen::Array2d(random.Normal(kRail1Sine), random.Normal(kRail2Sine));
  m.cosine_mm = u.straightness_mm * Eigen::Array2d(random.Normal(kRail1Cosine), random.Normal(kRail2Cosine));
  m.lag_factor = Square(std::max(0.0, 1.0 + u.jet_lag_relative * random.Normal(kLag)));
  m.jet_offset_mm.setZero();
  for (std::size_t i = 0; i < chain.jet_offset_mm.size(); ++i) {
    const double azimuth_rad = 2.0 * std::numbers::pi * random.Uniform(2 * (kAzimuth1 + i));
    m.jet_offset_mm += chain.jet_offset_mm[i] * Eigen::Vector2d(std::cos(azimuth_rad), std::sin(azimuth_rad));
  }
  return m;
}

// Deviation from the parameters, the mechanism solved exactly; by first order where the drawn machine cannot
// stand there.
double ParameterDeviation(const ErrorChain& chain, const DrawnMachine& m, const ContourModel::Point& point) {
  const auto forward = kinematics::SolveForward(m.mechanism, point.actuator_position_mm);
  if (!forward.positioned) {
    return point.n_W.dot(point.place.J_p_parameters * (m.parameters - chain.parameters) + m.jet_offset_mm);
  }
  const Eigen::Vector2d p_W = m.R_WE * (m.X_DJ.translation_mm() - forward.p_DE_mm - m.p_EW_mm);
  return point.n_W.dot(p_W - point.p_W_mm + m.jet_offset_mm);
}

double SliderDeviation(const DrawnMachine& m, const ContourModel::Point& point) {
  const Eigen::Array2d rate = (point.place.J_q_p * point.v_W_mm_per_s).array();
  const Eigen::Array2d turn = 2.0 * std::numbers::pi / kRailWaveLengthMm * point.actuator_position_mm.array();
  const Eigen::Array2d surge = (point.place.J_q_p * point.a_W_mm_per_s2).array();
  const Eigen::Array2d slider_mm = m.following * rate - m.servo_s2 * surge + m.backlash_mm * rate.sign();
  const Eigen::Array2d rail_mm = m.sine_mm * turn.sin() + m.cosine_mm * turn.cos();
  return point.n_W.dot(point.place.J_p_q * slider_mm.matrix() + point.place.J_p_rail * rail_mm.matrix());
}

}  // namespace

std::string_view Name(PredictionReason reason) {
  constexpr std::array<std::string_view, 7> kNames = {
      "UNKNOWN", "PREDICTED", "NO_CUTTING", "NOT_FINITE", "OUT_OF_ORDER", "UNREACHABLE", "CANCELLED"};
  const auto i = static_cast<std::size_t>(reason);
  return i < kNames.size() ? kNames[i] : kNames[0];
}

double UpperQuantile(std::vector<double>& values, double fraction) {
  const double n = static_cast<double>(values.size());
  return OrderStatistic(values, n * fraction + 1.6448536 * std::sqrt(n * fraction * (1.0 - fraction)));
}

double WeightedPercentile(std::vector<WeightedValue>& values, double fraction) {
  if (values.empty()) {
    return 0.0;
  }
  std::ranges::sort(values, {}, &WeightedValue::value);
  double total = 0.0;
  for (const WeightedValue& v : values) {
    total += v.weight;
  }
  double below = 0.0;
  for (const WeightedValue& v : values) {
    below += v.weight;
    if (below >= fraction * total) {
      return v.value;
    }
  }
  return values.back().value;
}

DrawSpace::DrawSpace(const ContourModel& model)
    : spring_W_mm(model.points.size(), Eigen::Vector2d::Zero()),
      by_feature(model.features),
      feature_p95_mm(model.features) {
  all.reserve(model.points.size());
  std::vector<std::size_t> count(model.features);
  for (const ContourModel::Point& point : model.points) {
    ++count[point.feature];
  }
  for (std::size_t f = 0; f < count.size(); ++f) {
    by_feature[f].reserve(count[f]);
  }
}

double DrawContour(const ContourModel& model, std::uint64_t seed, std::uint64_t draw, DrawSpace& space) {
  const CounterStream random(seed, draw);
  const DrawnMachine machine = DrawMachine(model, random);
  PlaySpring(model, machine.parameters[Index(Parameter::kElasticLagS2)],
             machine.parameters[Index(Parameter::kDampingTimeS)], space.spring_W_mm);
  space.all.clear();
  for (auto& values : space.by_feature) {
    values.clear();
  }
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    const ContourModel::Point& point = model.points[i];
    const double deviation = ParameterDeviation(model.chain, machine, point) +
                             SliderDeviation(machine, point) + point.n_W.dot(space.spring_W_mm[i]) +
                             machine.lag_factor * point.lag_bias_mm +
                             model.chain.uncertainties.jet_wander_mm * random.Normal(kFirstPoint + i);
    space.all.push_back({std::abs(deviation), point.weight_mm});
    space.by_feature[point.feature].push_back(space.all.back());
  }
  for (std::size_t f = 0; f < space.by_feature.size(); ++f) {
    space.feature_p95_mm[f] = WeightedPercentile(space.by_feature[f], 0.95);
  }
  return WeightedPercentile(space.all, 0.95);
}

ContourPrediction Predict(const MachineDescription& machine, std::span<const PlanSample> samples,
                          bool compensated, const PredictionOptions& options) {
  ContourPrediction prediction;
  ContourModel model(machine);
  prediction.reason = BuildContourModel(samples, compensated, options.points, model, prediction.blame_line);
  if (prediction.reason != PredictionReason::kPredicted) {
    return prediction;
  }
  const PointErrors errors = PropagateLinearly(model);
  FillPointBounds(model, errors, samples, prediction);
  const std::vector<PredictedPoint>& points = prediction.points;
  prediction.predicted_95_linear_mm = ContourPercentile(
      model, [&points](std::size_t i) { return points[i].bound_95_mm; }, 0.95);
  prediction.predicted_95_mm = prediction.predicted_95_linear_mm;
  prediction.expected_95_mm = ContourPercentile(
      model,
      [&points](std::size_t i) { return FoldedNormalQuantile(points[i].bias_mm, points[i].sigma_mm, 0.5); },
      0.95);
  prediction.budget = RankSources(model, errors);
  prediction.worst = WorstPlaces(points);
  prediction.features = ListFeatures(model, points);
  for (FeaturePrediction& f : prediction.features) {
    for (const PredictedPoint& point : points) {
      f.predicted_95_mm =
          point.feature == f.feature ? std::max(f.predicted_95_mm, point.bound_95_mm) : f.predicted_95_mm;
    }
  }
  Sample(model, options, prediction);
  return prediction;
}

}  // namespace lambdajet::accuracy
