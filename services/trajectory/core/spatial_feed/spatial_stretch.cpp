#include "trajectory/core/spatial_feed/spatial_stretch.hpp"

#include <algorithm>
#include <cstdio>

#include "trajectory/core/feed/quintic.hpp"
#include "trajectory/core/spatial_feed/pose_check.hpp"
#include "trajectory/core/spatial_feed/spatial_draft.hpp"
#include "trajectory/core/spatial_feed/spatial_report.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr int kMostPasses = 80;
constexpr double kPathShare =
    0.997;  // path acceleration and jerk are measured at knots and held between them
constexpr double kToleranceShare = 0.97;  // measured at knots, held between them

// Everything at one knot that segments are made of.
struct KnotEnds {
  std::array<QuinticEnd, kStrutCount> q;
  QuinticEnd s;
};

class StretchPlanner {
 public:
  StretchPlanner(const SpatialModel& model, const SpatialRun& run, double begin_s)
      : model_(model), draft_(model, run, begin_s, plan_.faults), check_(draft_) {}

  SpatialStretchPlan Plan() {
    for (int pass = 0; plan_.faults.empty(); ++pass) {
      if (!draft_.Move()) {
        NotHeld(draft_.SlowestOffset_mm());
        break;
      }
      MakeSegments();
      if (!plan_.faults.empty() || !Exceeded()) {
        break;
      }
      const double offset_mm = draft_.Slow(exceeded_, 1.0 + pass / 6.0);
      if (pass + 1 == kMostPasses) {
        NotHeld(offset_mm);
      }
    }
    if (plan_.faults.empty()) {
      plan_.tip_deviation_mm = check_.largest_mm();
      plan_.turn_deviation_rad = check_.largest_rad();
      ReportSpatialStretch(draft_, check_, plan_);
    }
    return std::move(plan_);
  }

 private:
  void NotHeld(double offset_mm) {
    const SpatialPiece& piece = draft_.PieceAt(offset_mm);
    const Eigen::Vector3d p = PointOn(piece, offset_mm - piece.begin_mm).p_mm;
    char text[160];
    std::snprintf(text, sizeof text,
                  "no speed was found at which every limit is held at X%.3f Y%.3f Z%.3f; the contour is too "
                  "tight there",
                  p.x(), p.y(), p.z());
    plan_.faults.push_back({piece.line, 0, "LIMITS_NOT_HELD", "", text});
  }

  // ---- segments ----

  KnotEnds EndsAt(const SpatialKnot& knot) {
    const StrutState state = model_.struts.At(knot.tool);
    KnotEnds ends;
    for (int j = 0; j < kStrutCount; ++j) {
      ends.q[static_cast<std::size_t>(j)] = {state.q_mm[j], state.first[j], state.second[j]};
    }
    ends.s = {knot.s_mm, knot.path_speed_mm_per_s, knot.path_acceleration_mm_per_s2};
    ProgramFault fault;
    const std::uint32_t line = draft_.PieceAt(knot.s_mm - draft_.begin_s_mm()).line;
    if (!model_.struts.Reaches(knot.tool.p_mm, knot.tool.q, line, fault)) {
      plan_.faults.push_back(fault);
    }
    return ends;
  }

  void MakeSegments() {
    const double duration = draft_.segment_s();
    plan_.segments.clear();
    KnotEnds from = EndsAt(draft_.knots().front());
    for (std::size_t n = 0; n < draft_.segment_count() && plan_.faults.empty(); ++n) {
      const KnotEnds to = EndsAt(draft_.knots()[(n + 1) * draft_.knots_per_segment()]);
      SpatialSegment segment;
      segment.start_s = duration * static_cast<double>(n);
      segment.duration_s = duration;
      for (std::size_t j = 0; j < kStrutCount; ++j) {
        segment.q_mm[j] = QuinticBetween(from.q[j], to.q[j], duration);
      }
      segment.s_mm = QuinticBetween(from.s, to.s, duration);
      plan_.segments.push_back(segment);
      from = to;
    }
    plan_.duration_s = duration * static_cast<double>(draft_.segment_count());
  }

  // ---- measuring ----

  // True if a limit or a tolerance is exceeded somewhere; where, stands in `exceeded_`, by time.
  bool Exceeded() {
    exceeded_.clear();
    check_.Restart();
    const std::size_t per_segment = draft_.knots_per_segment();
    for (std::size_t n = 0; n < draft_.segment_count(); ++n) {
      Excess excess = SegmentExcess(plan_.segments[n]);
      for (std::size_t j = 0; j < per_segment; ++j) {
        KnotExcess(draft_.knots()[n * per_segment + j], excess);
        check_.NearCorners(n * per_segment + j);
      }
      if (excess.any()) {
        const double begin_s = draft_.InputTime_s(n * per_segment);
        exceeded_.push_back({begin_s, begin_s + draft_.segment_s(), excess});
      }
    }
    MissedCorners();
    return !exceeded_.empty();
  }

  Excess SegmentExcess(const SpatialSegment& segment) const {
    Excess excess;
    const HexapodMotion& limits = model_.motion;
    for (std::size_t j = 0; j < kStrutCount; ++j) {
      const DerivativePeaks peaks = PeaksOf(segment.q_mm[j], segment.duration_s);
      excess.Judge(peaks.first_per_s / limits.strut_velocity_mm_per_s, 1.0, ActuatorVelocityLimit(j));
      excess.Judge(peaks.second_per_s2 / limits.strut_acceleration_mm_per_s2, 0.5,
                   ActuatorAccelerationLimit(j));
      excess.Judge(peaks.third_per_s3 / limits.strut_jerk_mm_per_s3, 1.0 / 3.0, FeedLimit::kActuatorJerk);
    }
    return excess;
  }

  void KnotExcess(const SpatialKnot& k, Excess& excess) {
    const double acceleration = draft_.Size(k.tool.rate.a_mm_per_s2, k.tool.rate.alpha_rad_per_s2);
    const double jerk = draft_.Size(k.jerk_mm_per_s3, k.turn_jerk_rad_per_s3);
    excess.Judge(acceleration / (kPathShare * model_.motion.path_acceleration_mm_per_s2), 0.5,
                 FeedLimit::kPathAcceleration);
    excess.Judge(jerk / (kPathShare * model_.motion.path_jerk_mm_per_s3), 1.0 / 3.0, FeedLimit::kPathJerk);
    const Nearness nearest = check_.Deviation(k);
    check_.Keep(nearest);
    excess.Judge(nearest.ratio / kToleranceShare, 0.6, FeedLimit::kContourTolerance);
  }

  void MissedCorners() {
    for (const SpatialCorner& corner : check_.corners()) {
      check_.Keep(corner.nearest);
      Excess excess;
      excess.Judge(corner.nearest.ratio / kToleranceShare, 0.5, FeedLimit::kCorner);
      if (excess.any()) {
        exceeded_.push_back({corner.time_s, corner.time_s, excess});
      }
    }
    std::sort(exceeded_.begin(), exceeded_.end(),
              [](const SlowPlace& a, const SlowPlace& b) { return a.begin_time_s < b.begin_time_s; });
  }

  const SpatialModel& model_;
  SpatialStretchPlan plan_;
  SpatialDraft draft_;
  PoseCheck check_;
  std::vector<SlowPlace> exceeded_;
};

}  // namespace

SpatialStretchPlan PlanSpatialStretch(const SpatialModel& model, const SpatialRun& run, double begin_s_mm) {
  return StretchPlanner(model, run, begin_s_mm).Plan();
}

SpatialStretchPlan RestAt(const SpatialModel& model, const SpatialPoint& at, double begin_s_mm) {
  SpatialStretchPlan plan;
  ProgramFault fault;
  if (!model.struts.Reaches(at.p_mm, at.q, 0, fault)) {
    plan.faults.push_back(fault);
    return plan;
  }
  SpatialSegment segment;
  segment.duration_s = plan.duration_s = model.filter.knot_s * model.options.knots_per_segment;
  const StrutState state = model.struts.At({at.p_mm, at.q, {}, {}});
  for (int j = 0; j < kStrutCount; ++j) {
    segment.q_mm[static_cast<std::size_t>(j)].c[0] = state.q_mm[j];
  }
  segment.s_mm.c[0] = begin_s_mm;
  plan.segments.push_back(segment);
  plan.samples.push_back({0.0, begin_s_mm, at.p_mm, at.q, 0.0, 0.0, FeedLimit::kFeed, false, 0});
  return plan;
}

}  // namespace lambdajet::trajectory
