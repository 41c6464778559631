#include "trajectory/core/feed/stretch_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trajectory/core/feed/binding.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;

constexpr int kMoments = 8;         // a segment
constexpr double kLeastTold = 0.5;  // of the tolerance, measured exactly from there on

void ReportElements(const StretchDraft& draft, StretchPlan& plan) {
  for (std::size_t i = 0; i < draft.elements.size(); ++i) {
    const PlannedElement& e = draft.planned[i];
    plan.places.push_back({e.begin_s_mm, e.end_s_mm()});
    if (!draft.IsRun(i)) {
      plan.idle.push_back({draft.elements[i].line, e.idle.name, e.idle.reason, e.idle.duration_s,
                           e.idle.start_speed_mm_per_s, e.idle.peak_acceleration_mm_per_s2});
    }
  }
}

// Moments a check apart, where the cut is slow.
class Binding {
 public:
  Binding(const PlanningModel& model, const StretchDraft& draft, ContourCheck& contour, StretchPlan& plan)
      : model_(model),
        draft_(draft),
        contour_(contour),
        plan_(plan),
        apart_s_(draft.segment_s() / kMoments),
        report_(static_cast<std::size_t>(model.filter.half_support_s() / apart_s_), plan.slow) {}

  void Report() {
    contour_.Rewind();
    for (std::size_t n = 0; n < plan_.segments.size(); ++n) {
      for (int k = 0; k < kMoments; ++k) {
        Moment(n, apart_s_ * k);
      }
    }
    if (open_) {
      report_.Close(draft_.planned[contour_.run()].end_s_mm());
    }
    SumLengths();
  }

 private:
  void Moment(std::size_t n, double t) {
    const Polynomial& s_mm = plan_.segments[n].s_mm;
    const double s = s_mm.value(t), speed = std::max(0.0, s_mm.first(t));
    const std::size_t run = contour_.run();
    const bool in_run = contour_.MoveTo(s);
    const bool slow = in_run && speed < kFeedHeld * contour_.piece().feed_mm_per_s;
    const bool same_run = in_run && run == contour_.run();
    if (open_ && (!same_run || !slow)) {
      report_.Close(same_run ? s : draft_.planned[run].end_s_mm());
      open_ = false;
    }
    if (slow) {
      report_.Take(MomentAt(n, t, s, speed));
      open_ = true;
    }
  }

  FeedMoment MomentAt(std::size_t n, double t, double s, double speed) {
    FeedMoment m{s, speed, contour_.piece().feed_mm_per_s, contour_.piece().line, FeedLimit::kFeed, 0.0};
    OfferActuators(plan_.segments[n], t, m);
    const PathLimits& path = model_.machine.path;
    const PlanarQuintic& played = draft_.played[n];
    const Vector2d a = played.second(t), v = played.first(t);
    const double along = v.norm() > 0.0 ? a.dot(v) / v.norm() : a.norm();
    m.Offer(2.0 * along * along < a.squaredNorm() ? FeedLimit::kCurvature : FeedLimit::kPathAcceleration,
            a.norm() / path.acceleration_mm_per_s2);
    m.Offer(FeedLimit::kPathJerk, played.third(t).norm() / path.jerk_mm_per_s3);
    double tolerance_mm = 1.0;
    const double deviation_mm = contour_.Deviation(played.value(t), s, kLeastTold, tolerance_mm);
    m.Offer(FeedLimit::kContourTolerance, deviation_mm / tolerance_mm);
    OfferCorners(draft_.SegmentTime_s(n) + t, m);
    OfferPredictedError(s, m);
    return m;
  }

  void OfferActuators(const Segment& segment, double t, FeedMoment& m) const {
    for (std::size_t a = 0; a < 2; ++a) {
      const ActuatorLimits& limit = model_.machine.actuators[a];
      const Polynomial &q = segment.q_mm[a], &lead = segment.lead_mm[a];
      m.Offer(ActuatorVelocityLimit(a), std::abs(q.first(t) + lead.first(t)) / limit.velocity_mm_per_s);
      m.Offer(ActuatorAccelerationLimit(a),
              std::abs(q.second(t) + lead.second(t)) / limit.acceleration_mm_per_s2);
      m.Offer(FeedLimit::kActuatorJerk, std::abs(q.third(t) + lead.third(t)) / limit.jerk_mm_per_s3);
    }
  }

  // A corner is passed at the moment that is nearest to it.
  void OfferCorners(double time_s, FeedMoment& m) {
    const std::vector<ContourCorner>& corners = contour_.corners();
    for (; corner_at_ < corners.size() && corners[corner_at_].time_s <= time_s + 1e-9; ++corner_at_) {
      m.Offer(FeedLimit::kCorner, corners[corner_at_].nearest_mm / corners[corner_at_].tolerance_mm);
    }
  }

  // A predicted error binds where its speed is run.
  void OfferPredictedError(double s, FeedMoment& m) {
    if (!model_.options.compensate && !model_.options.pace) {
      return;
    }
    if (node_run_ != contour_.run()) {
      node_run_ = contour_.run();
      node_at_ = 0;
    }
    const PlannedElement& e = draft_.planned[node_run_];
    const std::vector<ProfileNode>& nodes = e.run.solved;
    while (node_at_ + 1 < nodes.size() && nodes[node_at_ + 1].offset_mm <= s - e.begin_s_mm) {
      ++node_at_;
    }
    const ProfileNode& node = nodes[node_at_];
    if (node.binding == FeedLimit::kPredictedError && node.x > 0.0) {
      m.Offer(FeedLimit::kPredictedError, std::min(1.0, m.speed_mm_per_s / std::sqrt(node.x)));
    }
  }

  void SumLengths() {
    std::array<double, kFeedLimitCount> length_mm{};
    double& held_mm = length_mm[static_cast<std::size_t>(FeedLimit::kFeed)];
    for (std::size_t i = 0; i < draft_.elements.size(); ++i) {
      held_mm += draft_.IsRun(i) ? draft_.planned[i].length_mm : 0.0;
    }
    for (const SlowStretch& slow : plan_.slow) {
      length_mm[static_cast<std::size_t>(slow.limit)] += slow.to_s_mm - slow.from_s_mm;
      held_mm -= slow.to_s_mm - slow.from_s_mm;
    }
    for (std::size_t j = 0; j < kFeedLimitCount; ++j) {
      if (length_mm[j] > 1e-9) {
        plan_.binding.push_back({static_cast<FeedLimit>(j), length_mm[j]});
      }
    }
  }

  const PlanningModel& model_;
  const StretchDraft& draft_;
  ContourCheck& contour_;
  StretchPlan& plan_;
  double apart_s_;
  BindingReport report_;
  bool open_ = false;
  std::size_t corner_at_ = 0;
  std::size_t node_run_ = 0;
  std::size_t node_at_ = 0;
};

void ReportSamples(const PlanningModel& model, const StretchDraft& draft, StretchPlan& plan) {
  const auto every =
      static_cast<std::size_t>(std::max(1.0, std::round(model.options.sample_s / draft.knot_s)));
  const auto per_segment = static_cast<std::size_t>(draft.knots_per_segment);
  std::size_t element = 0;
  for (std::size_t n = 0; n <= plan.segments.size() * per_segment; n += every) {
    const std::size_t i = std::min(n / per_segment, plan.segments.size() - 1);
    const double t = static_cast<double>(n - i * per_segment) * draft.knot_s;
    const Vector2d p = draft.played[i].value(t), v = draft.played[i].first(t), a = draft.played[i].second(t);
    PlanSample sample{static_cast<double>(n) * draft.knot_s,
                      plan.segments[i].s_mm.value(t),
                      p.x(),
                      p.y(),
                      v.x(),
                      v.y(),
                      a.x(),
                      a.y(),
                      false,
                      0};
    while (element + 1 < draft.elements.size() && draft.planned[element].end_s_mm() < sample.s_mm) {
      ++element;
    }
    if (!draft.elements.empty()) {
      sample.source_line = draft.IsRun(element)
                               ? draft.LineInRun(element, sample.s_mm - draft.planned[element].begin_s_mm)
                               : draft.elements[element].line;
    }
    plan.samples.push_back(sample);
  }
}

}  // namespace

void ReportStretch(const PlanningModel& model, const StretchDraft& draft, ContourCheck& contour,
                   StretchPlan& plan) {
  ReportElements(draft, plan);
  Binding(model, draft, contour, plan).Report();
  ReportSamples(model, draft, plan);
}

}  // namespace lambdajet::trajectory
