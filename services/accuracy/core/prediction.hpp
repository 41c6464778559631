// Predicts how far from the drawing a planned cut will be, before it is cut.
//
// Model: the deviation of the cut contour along its normal is a bias and a spread from ten sources (core/error_chain.hpp).
// What is constant for a machine (parameters, slider lags, backlash, rail waves) is drawn once a cut and is fully correlated
// along the contour; jet wander is drawn at each point. The spring is played over the whole plan with
// L d'' + C d' + d = -L a, or, compensated, (L0 - L) a + (C - C0) L0 a' with L0, C0 the believed values; the cut front is
// played behind the jet and its distance to the jet's path taken.
//     linear       per point bias, sigma and 95 % of |N(bias, sigma)|; the contour's 95th percentile of these
//     Monte Carlo  each draw is a whole machine, its mechanism solved exactly; its result is the contour's 95th percentile
// predicted_95_mm of a sample of draws is its upper limit with 95 % confidence (the order statistic n p + 1.645 root(n p (1 - p))),
// so that too few draws make the bound wider, never too small.
// Rail waves are sines of kRailWaveLengthMm with drawn amplitude and phase (a choice; their source gives a sigma only).
// Not in it: the corners that the planner rounds within its tolerance.
// Frames: W. Units: mm, s. Shapes: samples in order of tau; points at equal distances along the cut length, at most
// PredictionOptions::points.
// Threads: pure; draws may be made in any order and split (DrawContour). Cost: 1000 draws of 600 points and 15,000 samples
// about 1 s. Errors: an answer with a Reason of its own.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "accuracy/core/error_chain.hpp"
#include "foundation/motion/plan.hpp"

namespace lambdajet::accuracy {

inline constexpr double kRailWaveLengthMm = 400.0;
inline constexpr int kMostDraws = 100000;

struct PredictionOptions {
  int draws = 1000;  // 0: linear only
  std::uint64_t seed = 1;
  int points = 600;                      // of the contour, at most
  double tolerance_mm = 0.0;             // for the probability of conformity; 0: not asked
  std::function<bool()> cancelled = {};  // asked before each draw
};

enum class PredictionReason : std::uint8_t {
  kPredicted = 1,
  kNoCutting = 2,  // no sample with the jet on moves
  kNotFinite = 3,
  kOutOfOrder = 4,   // tau goes back
  kUnreachable = 5,  // the mechanism cannot stand at `blame_line`
  kCancelled = 6
};
std::string_view Name(PredictionReason reason);

struct PredictedPoint {
  double tau_s = 0.0;
  double s_mm = 0.0;
  Eigen::Vector2d p_W_mm = Eigen::Vector2d::Zero();
  std::uint32_t source_line = 0;
  std::uint32_t feature = 0;  // index of the cut: pierce to jet off
  double bias_mm = 0.0;       // positive to the left of the motion
  double sigma_mm = 0.0;
  double bound_95_mm = 0.0;
  Source dominant = Source::kBase;
};

struct SourceShare {
  Source source = Source::kBase;
  double contribution_95_mm = 0.0;  // the contour's 95th percentile of its own 95 % bounds, alone
  double share = 0.0;               // of the mean square, 0 … 1
};

struct FeaturePrediction {
  std::uint32_t feature = 0;
  std::uint32_t first_line = 0;
  std::uint32_t last_line = 0;
  double length_mm = 0.0;
  double predicted_95_mm = 0.0;
  double conformity = 0.0;  // probability that its 95th percentile is within tolerance_mm; 0 if not asked
};

struct ContourPrediction {
  PredictionReason reason = PredictionReason::kNotFinite;
  std::uint32_t blame_line = 0;
  double predicted_95_mm = 0.0;  // Monte Carlo's, or linear's without draws
  double predicted_95_linear_mm = 0.0;
  double expected_95_mm = 0.0;  // median over the draws; linear: the percentile of |bias| and sigma's median
  double conformity = 0.0;
  std::vector<PredictedPoint> points;
  std::vector<SourceShare> budget;    // ranked, largest first
  std::vector<PredictedPoint> worst;  // at most 10, of different lines
  std::vector<FeaturePrediction> features;
};

// Everything about a plan that does not change from draw to draw.
struct ContourModel {
  struct Point {
    Eigen::Vector2d p_W_mm;
    Eigen::Vector2d n_W;
    Eigen::Vector2d v_W_mm_per_s;
    Eigen::Vector2d a_W_mm_per_s2;
    Eigen::Vector2d actuator_position_mm;
    PlaceSensitivity place;
    double lag_bias_mm = 0.0;
    double weight_mm = 0.0;
    std::size_t sample = 0;
    std::uint32_t feature = 0;
  };
  // One step of the plan for the spring.
  struct Step {
    double duration_s;
    Eigen::Vector2d a_W_mm_per_s2;     // mean over the step
    Eigen::Vector2d jerk_W_mm_per_s3;  // likewise
  };
  ErrorChain chain;
  ParameterCovariance spread;  // square root of the covariance
  bool compensated = false;
  std::vector<Step> steps;  // steps[i] ends at sample i
  std::vector<Point> points;
  std::uint32_t features = 0;

  explicit ContourModel(const MachineDescription& machine) : chain(machine) {}
};

struct WeightedValue {
  double value;
  double weight;
};

// Work space of a draw, made once for many.
struct DrawSpace {
  explicit DrawSpace(const ContourModel& model);
  std::vector<Eigen::Vector2d> spring_W_mm;
  std::vector<WeightedValue> all;
  std::vector<std::vector<WeightedValue>> by_feature;
  std::vector<double> feature_p95_mm;  // of the last draw
};

// One machine drawn, cut, and measured: the 95th percentile of |deviation| over all points; per feature in
// `space`. Cost: no allocation.
double DrawContour(const ContourModel& model, std::uint64_t seed, std::uint64_t draw, DrawSpace& space);

// Walks the plan. Leaves a model fit for DrawContour where the answer is kPredicted. Where the jet creeps, a spring swings through
// its whole deviation on a hundredth of a millimetre: `longest_s` asks for more points, so that none are longer apart than that.
PredictionReason BuildContourModel(std::span<const PlanSample> samples, bool compensated, int points,
                                   ContourModel& model, std::uint32_t& blame_line,
                                   double longest_s = std::numeric_limits<double>::infinity());

// The spring's part of the deviation at each point, for a machine of the given elastic lag and damping time.
void PlaySpring(const ContourModel& model, double elastic_lag_s2, double damping_time_s,
                std::span<Eigen::Vector2d> deviation_W_mm);

ContourPrediction Predict(const MachineDescription& machine, std::span<const PlanSample> samples,
                          bool compensated, const PredictionOptions& options = {});

// Bias and variance of each point by source, first order; elements of a point are ordered as Source.
struct PointErrors {
  std::vector<std::array<double, kSourceCount>> bias_mm;
  std::vector<std::array<double, kSourceCount>> variance_mm2;
};
PointErrors PropagateLinearly(const ContourModel& model);

// The quantile's upper limit with 95 % confidence, free of any distribution. Reorders.
double UpperQuantile(std::vector<double>& values, double fraction);

// The value below which `fraction` of the weight lies; 0 if there is none. Reorders.
double WeightedPercentile(std::vector<WeightedValue>& values, double fraction);

}  // namespace lambdajet::accuracy
