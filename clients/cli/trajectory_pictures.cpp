#include "clients/cli/trajectory_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "clients/cli/output.hpp"
#include "clients/cli/picture.hpp"
#include "trajectory/core/feed/plan_samples.hpp"

namespace lambdajet::cli {
namespace {

using trajectory::FeedLimit;
using trajectory::PlannedProgram;

constexpr double kWidth_px = 1200.0;
constexpr double kHeight_px = 1500.0;
constexpr std::size_t kMostCurvePoints = 4000;

double SpeedOf(const PlanSample& s) { return std::hypot(s.vx_W_mm_per_s, s.vy_W_mm_per_s); }
double AccelerationOf(const PlanSample& s) { return std::hypot(s.ax_W_mm_per_s2, s.ay_W_mm_per_s2); }

// Blue is slow, red is fast.
Colour Ramp(double share) {
  const double x = std::clamp(share, 0.0, 1.0);
  return {std::clamp(2.0 * x - 0.3, 0.1, 0.9), 0.15 + 0.6 * (1.0 - std::abs(2.0 * x - 1.0)),
          std::clamp(1.1 - 1.6 * x, 0.1, 0.9)};
}

Colour ColourOf(FeedLimit limit) {
  switch (limit) {
    case FeedLimit::kFeed:
      return kGreen;
    case FeedLimit::kCorner:
    case FeedLimit::kContourTolerance:
      return kRed;
    case FeedLimit::kCurvature:
    case FeedLimit::kPredictedError:
      return kOrange;
    case FeedLimit::kPathAcceleration:
    case FeedLimit::kPathJerk:
      return kBlue;
    default:
      return kViolet;
  }
}

// Limit at a path length; where no slow stretch lies the programmed feed is held.
class Limits {
 public:
  explicit Limits(const PlannedProgram& planned) : slow_(planned.slow) {}
  FeedLimit At(double s_mm) {
    while (next_ < slow_.size() && slow_[next_].to_s_mm < s_mm) {
      ++next_;
    }
    return next_ < slow_.size() && slow_[next_].from_s_mm <= s_mm ? slow_[next_].limit : FeedLimit::kFeed;
  }

 private:
  const std::vector<trajectory::SlowStretch>& slow_;
  std::size_t next_ = 0;
};

void DrawPath(PlotFrame& frame, const PlannedProgram& planned, bool by_speed, double fastest) {
  Limits limits(planned);
  const auto& samples = planned.samples;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const Points piece{{samples[i - 1].x_W_mm, samples[i - 1].y_W_mm},
                       {samples[i].x_W_mm, samples[i].y_W_mm}};
    if (!samples[i].cutting) {
      frame.Line(piece, kPale, 1.0);
    } else {
      frame.Line(piece, by_speed ? Ramp(SpeedOf(samples[i]) / fastest) : ColourOf(limits.At(samples[i].s_mm)),
                 2.2);
    }
  }
  for (const Gate& gate : planned.plan.gates) {
    const auto at = std::lower_bound(samples.begin(), samples.end(), gate.s_mm,
                                     [](const PlanSample& s, double mm) { return s.s_mm < mm - 1e-9; });
    if (gate.kind == GateKind::kPierce && at != samples.end()) {
      frame.Dot(at->x_W_mm, at->y_W_mm, 3.0, kInk);
    }
  }
}

template <typename Value>
Points Curve(const PlannedProgram& planned, Value value) {
  Points points;
  const std::size_t step = std::max<std::size_t>(1, planned.samples.size() / kMostCurvePoints);
  for (std::size_t i = 0; i < planned.samples.size(); i += step) {
    points.push_back({planned.samples[i].tau_s, value(planned.samples[i])});
  }
  return points;
}

double Highest(const Points& points) {
  double highest = 1e-9;
  for (const auto& [x, y] : points) {
    highest = std::max(highest, y);
  }
  return highest;
}

void DrawProfile(Picture& picture, double top_px, const std::string& title, const std::string& label,
                 const Points& curve, double limit, double duration_s) {
  PlotFrame frame(picture, {70.0, top_px, kWidth_px - 100.0, 170.0}, {0.0, duration_s, "program time, s"},
                  {0.0, 1.05 * std::max(limit, Highest(curve)), label}, title);
  frame.Line({{0.0, limit}, {duration_s, limit}}, kRed, 1.0, true);
  frame.Line(curve, kBlue, 1.2);
}

void DrawSliders(Picture& picture, double top_px, const PlannedProgram& planned,
                 const MachineDescription& machine) {
  std::array<Points, 2> speed;
  double highest = 0.0;
  const std::size_t step = std::max<std::size_t>(1, planned.samples.size() / kMostCurvePoints);
  for (std::size_t i = 0; i < planned.samples.size(); i += step) {
    const auto s = SampleAt(planned, planned.samples[i].tau_s);
    for (std::size_t a = 0; a < 2; ++a) {
      speed[a].push_back({s.jet.tau_s, s.actuator_mm_per_s[a]});
      highest = std::max(highest, std::abs(s.actuator_mm_per_s[a]));
    }
  }
  PlotFrame frame(picture, {70.0, top_px, kWidth_px - 100.0, 170.0},
                  {0.0, planned.plan.duration_s, "program time, s"},
                  {-1.05 * highest, 1.05 * highest, "mm/s"},
                  "slider speeds (limit " + Fixed(machine.actuators[0].velocity_mm_per_s, 0) + " mm/s)");
  frame.Line(speed[0], kBlue, 1.2);
  frame.Line(speed[1], kOrange, 1.2);
  frame.Legend({{"slider 1", kBlue}, {"slider 2", kOrange}}, true);
}

}  // namespace

absl::Status DrawPlan(const PlannedProgram& planned, const MachineDescription& machine,
                      const std::string& colour, const std::string& path) {
  Picture picture(kWidth_px, kHeight_px);
  const bool by_speed = colour == "speed";
  double fastest = 1e-9;
  for (const PlanSample& s : planned.samples) {
    fastest = std::max(fastest, s.cutting ? SpeedOf(s) : 0.0);
  }
  PlotFrame frame(picture, {70.0, 40.0, kWidth_px - 100.0, 720.0},
                  {0.0, machine.sheet_width_mm, "x in W, mm"}, {0.0, machine.sheet_height_mm, "y in W, mm"},
                  by_speed ? "path by speed" : "path by what limits the feed", true);
  DrawPath(frame, planned, by_speed, fastest);
  if (by_speed) {
    frame.Legend({{"fastest, " + Fixed(fastest, 1) + " mm/s", Ramp(1.0)},
                  {Fixed(0.5 * fastest, 1) + " mm/s", Ramp(0.5)},
                  {"standing", Ramp(0.0)},
                  {"jet off", kPale}});
  } else {
    frame.Legend({{"programmed feed held", kGreen},
                  {"path acceleration or jerk", kBlue},
                  {"curvature, predicted error", kOrange},
                  {"corner, contour tolerance", kRed},
                  {"actuators", kViolet},
                  {"jet off", kPale}});
  }
  const double duration_s = planned.plan.duration_s;
  DrawProfile(picture, 830.0, "path speed (dashed: fastest feed)", "mm/s", Curve(planned, SpeedOf),
              machine.path.feed_mm_per_s, duration_s);
  DrawProfile(picture, 1060.0, "path acceleration (dashed: limit)", "mm/s²", Curve(planned, AccelerationOf),
              machine.path.acceleration_mm_per_s2, duration_s);
  DrawSliders(picture, 1290.0, planned, machine);
  return picture.Write(path);
}

}  // namespace lambdajet::cli
