#include "trajectory/core/spatial_feed/spatial_report.hpp"

#include <algorithm>
#include <cmath>

#include "trajectory/core/feed/binding.hpp"

namespace lambdajet::trajectory {
namespace {

class Reporter {
 public:
  Reporter(const SpatialDraft& draft, PoseCheck& check, SpatialStretchPlan& plan)
      : draft_(draft), motion_(draft.model().motion), check_(check), plan_(plan) {}

  void Report() {
    std::vector<SlowStretch> rapid;
    const auto reach = static_cast<std::size_t>(draft_.model().filter.half_support_s() / draft_.knot_s());
    BindingReport cuts(reach, plan_.slow), traverses(reach, rapid);
    BindingReport* open = nullptr;
    check_.Rewind();
    const std::vector<SpatialKnot>& knots = draft_.knots();
    for (std::size_t n = 0; n < knots.size(); ++n) {
      const SpatialPiece& piece = draft_.PieceAt(knots[n].s_mm - draft_.begin_s_mm());
      BindingReport* const mine = piece.cutting ? &cuts : &traverses;
      const bool slow = knots[n].path_speed_mm_per_s < kFeedHeld * piece.programmed_mm_per_s;
      if (open != nullptr && (!slow || open != mine)) {
        open->Close(knots[n].s_mm);
      }
      open = slow ? mine : nullptr;
      if (slow) {
        open->Take(MomentAt(n, piece));
      }
    }
    if (open != nullptr) {
      open->Close(draft_.begin_s_mm() + draft_.run().length_mm());
    }
    SumLengths();
    rapid.insert(rapid.end(), plan_.slow.begin(), plan_.slow.end());
    std::sort(rapid.begin(), rapid.end(),
              [](const SlowStretch& a, const SlowStretch& b) { return a.from_s_mm < b.from_s_mm; });
    ReportSamples(rapid);
  }

 private:
  FeedMoment MomentAt(std::size_t n, const SpatialPiece& piece) {
    const SpatialKnot& k = draft_.knots()[n];
    FeedMoment m{
        k.s_mm, std::max(0.0, k.path_speed_mm_per_s), piece.programmed_mm_per_s, piece.line, FeedLimit::kFeed,
        0.0};
    if (piece.feed_mm_per_s < piece.programmed_mm_per_s) {
      m.Offer(FeedLimit::kFeed, m.speed_mm_per_s / piece.feed_mm_per_s);  // the machine's own
    }
    OfferStruts(n, m);
    const double acceleration = draft_.Size(k.tool.rate.a_mm_per_s2, k.tool.rate.alpha_rad_per_s2);
    const double along = k.path_acceleration_mm_per_s2;
    m.Offer(2.0 * along * along < acceleration * acceleration ? FeedLimit::kCurvature
                                                              : FeedLimit::kPathAcceleration,
            acceleration / motion_.path_acceleration_mm_per_s2);
    m.Offer(FeedLimit::kPathJerk,
            draft_.Size(k.jerk_mm_per_s3, k.turn_jerk_rad_per_s3) / motion_.path_jerk_mm_per_s3);
    m.Offer(FeedLimit::kContourTolerance, check_.Deviation(k).ratio);
    const std::vector<SpatialCorner>& corners = check_.corners();
    for (; corner_at_ < corners.size() && corners[corner_at_].time_s <= draft_.InputTime_s(n); ++corner_at_) {
      m.Offer(FeedLimit::kCorner, corners[corner_at_].nearest.ratio);
    }
    return m;
  }

  void OfferStruts(std::size_t n, FeedMoment& m) const {
    const std::size_t per_segment = draft_.knots_per_segment();
    const std::size_t i = std::min(n / per_segment, plan_.segments.size() - 1);
    const double t = static_cast<double>(n - i * per_segment) * draft_.knot_s();
    for (std::size_t j = 0; j < kStrutCount; ++j) {
      const Polynomial& q = plan_.segments[i].q_mm[j];
      m.Offer(ActuatorVelocityLimit(j), std::abs(q.first(t)) / motion_.strut_velocity_mm_per_s);
      m.Offer(ActuatorAccelerationLimit(j), std::abs(q.second(t)) / motion_.strut_acceleration_mm_per_s2);
      m.Offer(FeedLimit::kActuatorJerk, std::abs(q.third(t)) / motion_.strut_jerk_mm_per_s3);
    }
  }

  void SumLengths() {
    double& held_mm = plan_.binding_mm[static_cast<std::size_t>(FeedLimit::kFeed)];
    for (const SpatialPiece& piece : draft_.run().pieces) {
      held_mm += piece.cutting ? piece.length_mm : 0.0;
    }
    for (const SlowStretch& stretch : plan_.slow) {
      plan_.binding_mm[static_cast<std::size_t>(stretch.limit)] += stretch.to_s_mm - stretch.from_s_mm;
      held_mm -= stretch.to_s_mm - stretch.from_s_mm;
    }
  }

  void ReportSamples(const std::vector<SlowStretch>& slow) {
    std::size_t at = 0;
    const std::vector<SpatialKnot>& knots = draft_.knots();
    for (std::size_t n = 0; n < knots.size(); n += 2) {
      const SpatialKnot& k = knots[n];
      while (at < slow.size() && slow[at].to_s_mm < k.s_mm) {
        ++at;
      }
      const bool bound = at < slow.size() && slow[at].from_s_mm <= k.s_mm;
      const SpatialPiece& piece = draft_.PieceAt(k.s_mm - draft_.begin_s_mm());
      plan_.samples.push_back({static_cast<double>(n) * draft_.knot_s(), k.s_mm, k.tool.p_mm, k.tool.q,
                               k.tool.twist.v_mm_per_s.norm(), k.path_speed_mm_per_s,
                               bound ? slow[at].limit : FeedLimit::kFeed, piece.cutting, piece.line});
    }
  }

  const SpatialDraft& draft_;
  const HexapodMotion& motion_;
  PoseCheck& check_;
  SpatialStretchPlan& plan_;
  std::size_t corner_at_ = 0;
};

}  // namespace

void ReportSpatialStretch(const SpatialDraft& draft, PoseCheck& check, SpatialStretchPlan& plan) {
  Reporter(draft, check, plan).Report();
}

}  // namespace lambdajet::trajectory
