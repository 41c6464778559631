#include "clients/cli/trajectory_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/status/statusor.h"
#include "accuracy/core/prediction.hpp"
#include "clients/cli/output.hpp"
#include "clients/cli/picture.hpp"
#include "foundation/contract/trouble.hpp"
#include "trajectory/core/feed/plan_samples.hpp"

namespace lambdajet::cli {
namespace {

using trajectory::FeedLimit;
using trajectory::PlannedProgram;

constexpr double kWidth_px = 1300.0;
constexpr double kLeft_px = 84.0;
constexpr double kPathWidth_px = 1010.0;
constexpr double kPathHeight_px = 700.0;
constexpr double kPathTop_px = 48.0;
constexpr double kProfileTop_px = 830.0;
constexpr double kProfileStep_px = 172.0;
constexpr double kProfileHeight_px = 112.0;
constexpr double kHeight_px = kProfileTop_px + 6 * kProfileStep_px;
constexpr std::size_t kMostCurvePoints = 6000;
constexpr int kPredictedPoints = 6000;
constexpr double kPartMargin = 0.04;  // of the part's size, around it
constexpr double kFullPercent = 100.0;
constexpr double kInSight = 0.3;  // of a limit

// Okabe and Ito's palette.
constexpr Colour kSky{0.34, 0.71, 0.91};
constexpr Colour kBluish{0.00, 0.62, 0.45};
constexpr Colour kDeepBlue{0.00, 0.45, 0.70};
constexpr Colour kAmber{0.90, 0.62, 0.00};
constexpr Colour kVermilion{0.84, 0.37, 0.00};
constexpr Colour kPurple{0.80, 0.47, 0.65};

double SpeedOf(const PlanSample& s) { return std::hypot(s.vx_W_mm_per_s, s.vy_W_mm_per_s); }
double AccelerationOf(const PlanSample& s) { return std::hypot(s.ax_W_mm_per_s2, s.ay_W_mm_per_s2); }

// Dark violet over teal to yellow (viridis), brightness growing evenly.
Colour Ramp(double share) {
  constexpr std::array<Colour, 6> kStops = {Colour{0.267, 0.005, 0.329}, {0.255, 0.267, 0.529},
                                            {0.164, 0.471, 0.558},       {0.134, 0.659, 0.518},
                                            {0.478, 0.821, 0.318},       {0.953, 0.886, 0.122}};
  const double at = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double t = at - static_cast<double>(i);
  const auto mix = [t](double a, double b) { return a + t * (b - a); };
  return {mix(kStops[i].red, kStops[i + 1].red), mix(kStops[i].green, kStops[i + 1].green),
          mix(kStops[i].blue, kStops[i + 1].blue)};
}

Colour ColourOf(FeedLimit limit) {
  switch (limit) {
    case FeedLimit::kFeed:
      return kBluish;
    case FeedLimit::kCorner:
    case FeedLimit::kContourTolerance:
      return kVermilion;
    case FeedLimit::kCurvature:
      return kAmber;
    case FeedLimit::kPredictedError:
      return kPurple;
    case FeedLimit::kPathAcceleration:
    case FeedLimit::kPathJerk:
      return kSky;
    case FeedLimit::kSmoothing:
      return kDeepBlue;
    default:
      return kInk;
  }
}

// The slow stretch at a path length; none where the programmed feed is held.
class Slowness {
 public:
  explicit Slowness(const PlannedProgram& planned) : slow_(planned.slow) {}
  const trajectory::SlowStretch* At(double s_mm) {
    while (next_ < slow_.size() && slow_[next_].to_s_mm < s_mm) {
      ++next_;
    }
    return next_ < slow_.size() && slow_[next_].from_s_mm <= s_mm ? &slow_[next_] : nullptr;
  }

 private:
  const std::vector<trajectory::SlowStretch>& slow_;
  std::size_t next_ = 0;
};

// What colours the path: a value for each sample, or what limits it there.
struct PathColours {
  std::vector<Colour> of;  // one a sample
  std::string title;
  std::string unit;
  double from = 0.0, to = 0.0;  // of the ramp; equal: no ramp
  std::vector<std::pair<std::string, Colour>> legend;
};

PathColours BySpeed(const PlannedProgram& planned) {
  PathColours colours;
  for (const PlanSample& s : planned.samples) {
    colours.to = std::max(colours.to, s.cutting ? SpeedOf(s) : 0.0);
  }
  colours.to = std::max(1.0, std::ceil(colours.to));
  for (const PlanSample& s : planned.samples) {
    colours.of.push_back(Ramp(SpeedOf(s) / colours.to));
  }
  colours.title = "toolpath by speed";
  colours.unit = "mm/s";
  return colours;
}

PathColours ByLimit(const PlannedProgram& planned) {
  PathColours colours;
  Slowness slowness(planned);
  for (const PlanSample& s : planned.samples) {
    const auto* slow = slowness.At(s.s_mm);
    colours.of.push_back(ColourOf(slow == nullptr ? FeedLimit::kFeed : slow->limit));
  }
  colours.title = "toolpath by the limit that binds";
  colours.legend = {{"programmed feed held", kBluish},
                    {"path acceleration or jerk", kSky},
                    {"curvature", kAmber},
                    {"corner, contour tolerance", kVermilion},
                    {"predicted error", kPurple},
                    {"an actuator", kInk},
                    {"none reached: smoothing in time", kDeepBlue}};
  return colours;
}

absl::StatusOr<PathColours> ByError(const PlannedProgram& planned, const MachineDescription& machine) {
  accuracy::PredictionOptions options;
  options.draws = 0;
  options.points = kPredictedPoints;
  const auto prediction = accuracy::Predict(machine, planned.samples, planned.plan.compensated, options);
  if (prediction.reason != accuracy::PredictionReason::kPredicted) {
    return Trouble(absl::StatusCode::kFailedPrecondition, std::string(accuracy::Name(prediction.reason)),
                   "the plan's error could not be predicted");
  }
  PathColours colours;
  for (const auto& point : prediction.points) {
    colours.to = std::max(colours.to, point.bound_95_mm);
  }
  colours.to = std::max(0.01, std::ceil(colours.to * kFullPercent) / kFullPercent);
  std::size_t next = 0;
  for (const PlanSample& s : planned.samples) {
    while (next + 1 < prediction.points.size() && prediction.points[next].tau_s < s.tau_s) {
      ++next;
    }
    colours.of.push_back(Ramp(prediction.points[next].bound_95_mm / colours.to));
  }
  colours.title = "toolpath by predicted contour error (95 % of machines stay below, place by place)";
  colours.unit = "mm";
  return colours;
}

struct Bounds {
  double left = 1e9, right = -1e9, bottom = 1e9, top = -1e9;
};

Bounds BoundsOf(const PlannedProgram& planned) {
  Bounds b;
  for (const PlanSample& s : planned.samples) {
    b.left = std::min(b.left, s.x_W_mm);
    b.right = std::max(b.right, s.x_W_mm);
    b.bottom = std::min(b.bottom, s.y_W_mm);
    b.top = std::max(b.top, s.y_W_mm);
  }
  const double margin = 1.0 + kPartMargin * std::max(b.right - b.left, b.top - b.bottom);
  return {b.left - margin, b.right + margin, b.bottom - margin, b.top + margin};
}

void DrawColourBar(Picture& picture, const PathColours& colours) {
  constexpr double kBarLeft_px = kLeft_px + kPathWidth_px + 26.0, kBarWidth_px = 20.0, kBarHeight_px = 420.0;
  constexpr int kSteps = 84, kTicks = 6;
  const double top = kPathTop_px + 60.0;
  for (int i = 0; i < kSteps; ++i) {
    const double y = top + kBarHeight_px * (1.0 - static_cast<double>(i + 1) / kSteps);
    const double height = kBarHeight_px / kSteps + 0.5;
    picture.Area({{kBarLeft_px, y},
                  {kBarLeft_px + kBarWidth_px, y},
                  {kBarLeft_px + kBarWidth_px, y + height},
                  {kBarLeft_px, y + height}},
                 Ramp((i + 0.5) / kSteps));
  }
  for (int i = 0; i <= kTicks; ++i) {
    const double share = static_cast<double>(i) / kTicks;
    const double y = top + kBarHeight_px * (1.0 - share);
    picture.Line({{kBarLeft_px + kBarWidth_px, y}, {kBarLeft_px + kBarWidth_px + 5.0, y}}, kInk, 1.0);
    picture.Text(kBarLeft_px + kBarWidth_px + 9.0, y + 4.0,
                 Fixed(share * colours.to, colours.to < 0.2    ? 3
                                           : colours.to < 10.0 ? 2
                                                               : 0));
  }
  picture.Text(kBarLeft_px, top - 14.0, colours.unit, 13.0);
}

void DrawPath(Picture& picture, const PlannedProgram& planned, const MachineDescription& machine,
              const PathColours& colours) {
  const Bounds b = BoundsOf(planned);
  PlotFrame frame(picture, {kLeft_px, kPathTop_px, kPathWidth_px, kPathHeight_px},
                  {b.left, b.right, "x in W, mm"}, {b.bottom, b.top, "y in W, mm"}, colours.title, true);
  const double w = machine.sheet_width_mm, h = machine.sheet_height_mm;
  frame.Line({{0, 0}, {w, 0}, {w, h}, {0, h}, {0, 0}}, kGrey, 1.0);
  const auto& samples = planned.samples;
  for (const bool cutting : {false, true}) {  // cuts lie over idle moves
    for (std::size_t i = 1; i < samples.size(); ++i) {
      const Points piece{{samples[i - 1].x_W_mm, samples[i - 1].y_W_mm},
                         {samples[i].x_W_mm, samples[i].y_W_mm}};
      if (samples[i].cutting == cutting && piece[0] != piece[1]) {
        frame.Line(piece, cutting ? colours.of[i] : kPale, cutting ? 3.2 : 1.0);
      }
    }
  }
  int contour = 0;
  for (const Gate& gate : planned.plan.gates) {
    const auto at = std::lower_bound(samples.begin(), samples.end(), gate.s_mm,
                                     [](const PlanSample& s, double mm) { return s.s_mm < mm - 1e-9; });
    if (gate.kind == GateKind::kPierce && at != samples.end()) {
      frame.Dot(at->x_W_mm, at->y_W_mm, 4.0, kInk);
      frame.Text(at->x_W_mm, at->y_W_mm, std::to_string(++contour), kInk, 7.0, -7.0, 13.0);
    }
  }
  if (colours.to > colours.from) {
    DrawColourBar(picture, colours);
  }
  auto legend = colours.legend;
  legend.push_back({"jet off", kPale});
  double y = kPathTop_px + (colours.legend.empty() ? kPathHeight_px - 60.0 : 20.0);
  for (const auto& [name, colour] : legend) {
    constexpr double kKey_px = kLeft_px + kPathWidth_px + 14.0;
    picture.Line({{kKey_px, y}, {kKey_px + 20.0, y}}, colour, 4.0);
    picture.Text(kKey_px, y + 16.0, name, 11.0);
    y += 36.0;
  }
  picture.Dot(kLeft_px + kPathWidth_px + 24.0, kPathTop_px + kPathHeight_px - 16.0, 4.0, kInk);
  picture.Text(kLeft_px + kPathWidth_px + 34.0, kPathTop_px + kPathHeight_px - 12.0, "pierce, n-th cut",
               11.0);
}

// Curves over program time, in per cent of their limits or in their own unit.
struct Profile {
  std::string title;
  std::string label;
  std::vector<std::pair<std::string, Colour>> names;
  std::vector<Points> curves;
  double limit = 0.0;
  bool both_signs = false;
  std::string limit_name = "limit";
};

double Highest(const Profile& profile) {
  double highest = 1e-9;
  for (const Points& curve : profile.curves) {
    for (const auto& [x, y] : curve) {
      highest = std::max(highest, std::abs(y));
    }
  }
  return highest;
}

void ShadeSlow(PlotFrame& frame, const PlannedProgram& planned, double from, double to) {
  Slowness slowness(planned);
  const auto& samples = planned.samples;
  double begin_s = -1.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const bool slow = samples[i].cutting && slowness.At(samples[i].s_mm) != nullptr;
    if (slow && begin_s < 0.0) {
      begin_s = samples[i].tau_s;
    } else if (!slow && begin_s >= 0.0) {
      frame.Area({{begin_s, from}, {samples[i].tau_s, from}, {samples[i].tau_s, to}, {begin_s, to}},
                 kAmber.Faded(0.22));
      begin_s = -1.0;
    }
  }
}

void DrawProfile(Picture& picture, int number, const PlannedProgram& planned, const Profile& profile) {
  // A limit that is far away is told in the title instead, so that the curve is seen.
  const double highest = Highest(profile);
  const bool in_sight = highest > kInSight * profile.limit;
  const double top = 1.08 * (in_sight ? std::max(profile.limit, highest) : highest);
  const std::string title =
      profile.title + ": largest " + Fixed(kFullPercent * highest / profile.limit, 1) + " % of the limit";
  const double bottom = profile.both_signs ? -top : 0.0;
  const double duration_s = planned.plan.duration_s;
  PlotFrame frame(
      picture, {kLeft_px, kProfileTop_px + number * kProfileStep_px, kPathWidth_px, kProfileHeight_px},
      {0.0, duration_s, "program time, s"}, {bottom, top, profile.label}, in_sight ? profile.title : title);
  ShadeSlow(frame, planned, bottom, top);
  if (in_sight) {
    frame.Line({{0.0, profile.limit}, {duration_s, profile.limit}}, kVermilion, 1.2, true);
  }
  if (in_sight && profile.both_signs) {
    frame.Line({{0.0, -profile.limit}, {duration_s, -profile.limit}}, kVermilion, 1.2, true);
  }
  double y = kProfileTop_px + number * kProfileStep_px + 12.0;
  const auto key = [&picture, &y](const std::string& name, Colour colour) {
    constexpr double kKey_px = kLeft_px + kPathWidth_px + 14.0;
    picture.Line({{kKey_px, y}, {kKey_px + 20.0, y}}, colour, 3.0);
    picture.Text(kKey_px + 26.0, y + 4.0, name, 11.0);
    y += 17.0;
  };
  for (std::size_t c = 0; c < profile.curves.size(); ++c) {
    frame.Line(profile.curves[c], profile.names[c].second, 1.2);
    key(profile.names[c].first, profile.names[c].second);
  }
  if (in_sight) {
    key(profile.limit_name, kVermilion);
  }
  key("feed not held", kAmber.Faded(0.5));
}

template <typename Value>
Points Curve(const PlannedProgram& planned, Value value) {
  Points points;
  const std::size_t step = std::max<std::size_t>(1, planned.samples.size() / kMostCurvePoints);
  for (std::size_t i = 0; i < planned.samples.size(); i += step) {
    points.push_back({planned.samples[i].tau_s, value(i)});
  }
  return points;
}

Profile SpeedProfile(const PlannedProgram& planned, const MachineDescription& machine) {
  return {"path speed",
          "mm/s",
          {{"speed", kDeepBlue}},
          {Curve(planned, [&planned](std::size_t i) { return SpeedOf(planned.samples[i]); })},
          machine.path.feed_mm_per_s,
          false,
          "fastest feed, jet on"};
}

Profile AccelerationProfile(const PlannedProgram& planned, const MachineDescription& machine) {
  return {"path acceleration",
          "mm/s²",
          {{"acceleration", kDeepBlue}},
          {Curve(planned, [&planned](std::size_t i) { return AccelerationOf(planned.samples[i]); })},
          machine.path.acceleration_mm_per_s2};
}

// From the change of acceleration between samples; a jump across a gate is none.
Profile JerkProfile(const PlannedProgram& planned, const MachineDescription& machine) {
  const auto& samples = planned.samples;
  const auto jerk = [&samples](std::size_t i) {
    const PlanSample& a = samples[i > 0 ? i - 1 : 0];
    const PlanSample& b = samples[i > 0 ? i : std::min<std::size_t>(1, samples.size() - 1)];
    const double h = b.tau_s - a.tau_s;
    return h > 0.0 ? std::hypot(b.ax_W_mm_per_s2 - a.ax_W_mm_per_s2, b.ay_W_mm_per_s2 - a.ay_W_mm_per_s2) / h
                   : 0.0;
  };
  return {"path jerk", "mm/s³", {{"jerk", kDeepBlue}}, {Curve(planned, jerk)}, machine.path.jerk_mm_per_s3};
}

// Both sliders in per cent of their own limits, from the segments that the drive plays, elastic lead included.
template <typename Derivative>
Profile SliderProfile(const PlannedProgram& planned, const std::string& title,
                      const std::array<double, 2>& limits, Derivative derivative) {
  Profile profile{title, "% of limit", {{"slider 1", kDeepBlue}, {"slider 2", kVermilion}},
                  {},    kFullPercent, true};
  profile.names[1].second = kBluish;
  const auto& segments = planned.plan.segments;
  const std::size_t step = std::max<std::size_t>(1, segments.size() / kMostCurvePoints);
  for (std::size_t a = 0; a < 2; ++a) {
    Points& curve = profile.curves.emplace_back();
    for (std::size_t i = 0; i < segments.size(); i += step) {
      const Segment& segment = segments[i];
      const double t = 0.5 * segment.duration_s;
      curve.push_back(
          {segment.start_s + t,
           kFullPercent / limits[a] * (derivative(segment.q_mm[a], t) + derivative(segment.lead_mm[a], t))});
    }
  }
  return profile;
}

}  // namespace

absl::Status DrawPlan(const PlannedProgram& planned, const MachineDescription& machine,
                      const std::string& colour, const std::string& path) {
  const absl::StatusOr<PathColours> colours = colour == "speed"   ? BySpeed(planned)
                                              : colour == "limit" ? ByLimit(planned)
                                                                  : ByError(planned, machine);
  if (!colours.ok()) {
    return colours.status();
  }
  Picture picture(kWidth_px, kHeight_px);
  DrawPath(picture, planned, machine, *colours);
  DrawProfile(picture, 0, planned, SpeedProfile(planned, machine));
  DrawProfile(picture, 1, planned, AccelerationProfile(planned, machine));
  DrawProfile(picture, 2, planned, JerkProfile(planned, machine));
  const auto& m = machine.actuators;
  DrawProfile(picture, 3, planned,
              SliderProfile(planned, "slider speeds", {m[0].velocity_mm_per_s, m[1].velocity_mm_per_s},
                            [](const Polynomial& p, double t) { return p.first(t); }));
  DrawProfile(picture, 4, planned,
              SliderProfile(planned, "slider accelerations",
                            {m[0].acceleration_mm_per_s2, m[1].acceleration_mm_per_s2},
                            [](const Polynomial& p, double t) { return p.second(t); }));
  DrawProfile(picture, 5, planned,
              SliderProfile(planned, "slider jerks", {m[0].jerk_mm_per_s3, m[1].jerk_mm_per_s3},
                            [](const Polynomial& p, double t) { return p.third(t); }));
  return picture.Write(path);
}

}  // namespace lambdajet::cli
