#include "trajectory/core/spatial_feed/spatial_stretch.hpp"

#include <algorithm>
#include <cmath>

#include "trajectory/core/feed/binding.hpp"
#include "trajectory/core/feed/quintic.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kMostPasses = 80;
constexpr int kChecksPerSegment = 16;
constexpr double kAllowed = 1.0 + 5e-7;  // of a strut's limit, on the final polynomials
constexpr double kPathShare =
    0.997;  // path acceleration and jerk are measured at knots and held between them
constexpr double kStrongestSlowDown = 0.6;  // in one pass
constexpr double kToleranceShare = 0.97;    // measured at knots, held between them
constexpr double kCorner = 0.3;             // changes of direction above this must be come near to
constexpr double kCornerLook_mm = 2.0;
constexpr double kDeviationLook_mm = 1.0;
constexpr double kLeastEase = 0.6;

// Largest magnitudes over a segment: acceleration and jerk exactly; speed at checks, and by jerk * step^2 / 8 more between.
struct Peaks {
  double speed = 0.0;
  double acceleration = 0.0;
  double jerk = 0.0;
};

Peaks PeaksOf(const Polynomial& p, double T) {
  Peaks peaks;
  const auto jerk_at = [&](double t) { peaks.jerk = std::max(peaks.jerk, std::abs(p.third(t))); };
  const auto acceleration_at = [&](double t) {
    if (t >= 0.0 && t <= T) {
      peaks.acceleration = std::max(peaks.acceleration, std::abs(p.second(t)));
    }
  };
  jerk_at(0.0), jerk_at(T), acceleration_at(0.0), acceleration_at(T);
  if (p.c[5] != 0.0) {
    const double extremum = -p.c[4] / (5.0 * p.c[5]);
    if (extremum > 0.0 && extremum < T) {
      jerk_at(extremum);
    }
  }
  // 60 c5 t^2 + 24 c4 t + 6 c3 = 0, the stable way.
  const double d = 144.0 * p.c[4] * p.c[4] - 360.0 * p.c[5] * p.c[3];
  if (d >= 0.0) {
    const double q = -(12.0 * p.c[4] + (p.c[4] < 0.0 ? -1.0 : 1.0) * std::sqrt(d));
    if (p.c[5] != 0.0) {
      acceleration_at(q / (60.0 * p.c[5]));
    }
    if (q != 0.0) {
      acceleration_at(6.0 * p.c[3] / q);
    }
  }
  for (int k = 0; k <= kChecksPerSegment; ++k) {
    peaks.speed = std::max(peaks.speed, std::abs(p.first(T * k / kChecksPerSegment)));
  }
  const double step = T / kChecksPerSegment;
  peaks.speed += 0.125 * step * step * peaks.jerk;
  return peaks;
}

// How far a pose lies from another one that moves along; shares of tolerance.
struct Nearness {
  double tip_mm = 1e9;
  double turn_rad = 1e9;
  double ratio = 1e9;
};

Vector3d TurnFromTo(const Quaterniond& from, const Quaterniond& to) {
  const Quaterniond d = to * from.conjugate();
  return (d.w() < 0.0 ? -2.0 : 2.0) * d.vec();
}

Nearness NearnessOf(const Vector3d& tip, const Vector3d& turn, double tolerance_mm, double tolerance_rad) {
  const double p = tip.norm(), w = turn.norm();
  return {p, w, std::max(p / tolerance_mm, w / tolerance_rad)};
}

class StretchPlanner {
 public:
  StretchPlanner(const SpatialModel& model, const SpatialRun& run, double begin_s)
      : model_(model), run_(run), begin_s_(begin_s), knot_(model.filter.knot_s) {}

  SpatialStretchPlan Plan() {
    nodes_ = MakeSpatialNodes(model_, run_, plan_.faults);
    slow_.assign(nodes_.size(), 1.0);
    ease_.assign(nodes_.size(), 1.0);
    slow_reason_.assign(nodes_.size(), FeedLimit::kContourTolerance);
    for (int pass = 0; plan_.faults.empty(); ++pass) {
      widening_ = 1.0 + pass / 6.0;
      SetSpeeds();
      SampleTime();
      control_ = Smooth(model_.filter, samples_);
      MakeSegments();
      if (!plan_.faults.empty() || !SlowWhereExceeded()) {
        break;
      }
      if (pass + 1 == kMostPasses) {
        plan_.faults.push_back(
            {exceeded_line_, 0, "LIMITS_NOT_HELD", "",
             "no speed was found at which every limit is held here; the contour is too tight"});
      }
    }
    if (plan_.faults.empty()) {
      Report();
    }
    return std::move(plan_);
  }

 private:
  // ---- speed along the path ----

  void SetSpeeds() {
    solved_ = nodes_;
    for (std::size_t k = 0; k < nodes_.size() && !base_speed_.empty(); ++k) {
      if (slow_[k] < 1.0) {
        solved_[k].speed_cap_mm_per_s = slow_[k] * base_speed_[k];
        solved_[k].acceleration_mm_per_s2 *= ease_[k];
        solved_[k].cap_reason = slow_reason_[k];
      }
    }
    SolveSpeedProfile(solved_, model_.bounds, 0.0, 0.0);
    if (base_speed_.empty()) {  // what slow-down counts from; standstill takes its neighbour's speed
      for (const SpatialNode& node : solved_) {
        base_speed_.push_back(std::sqrt(node.x));
      }
      base_speed_.front() = base_speed_[1];
      base_speed_.back() = base_speed_[base_speed_.size() - 2];
    }
    node_time_.assign(1, 0.0);
    for (std::size_t k = 0; k + 1 < solved_.size(); ++k) {
      const double v = std::sqrt(solved_[k].x) + std::sqrt(solved_[k + 1].x);
      node_time_.push_back(node_time_.back() + 2.0 * (solved_[k + 1].offset_mm - solved_[k].offset_mm) / v);
    }
  }

  // ---- sampling in time ----

  static SpatialSample SampleOf(const SpatialPoint& point, double s_mm) {
    SpatialSample sample;
    sample << point.p_mm, point.q.w(), point.q.x(), point.q.y(), point.q.z(), s_mm;
    return sample;
  }

  void SampleTime() {
    const auto reach = static_cast<std::size_t>(model_.filter.reach());
    const auto per_segment = static_cast<std::size_t>(model_.options.knots_per_segment);
    const auto count = static_cast<std::size_t>(std::ceil(node_time_.back() / knot_ - 1e-9)) + 1;
    segment_count_ = (count + 2 * reach + per_segment) / per_segment;
    first_ = 4;
    lead_ = reach + 1;  // knots of rest before the motion begins
    samples_.clear();
    samples_.assign(first_ + lead_, SampleOf(PointOn(run_.pieces.front(), 0.0), begin_s_));
    std::size_t cell = 0, piece = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const double offset = OffsetAt(static_cast<double>(k) * knot_, cell);
      while (piece + 1 < run_.pieces.size() && run_.pieces[piece + 1].begin_mm <= offset) {
        ++piece;
      }
      samples_.push_back(
          SampleOf(PointOn(run_.pieces[piece], offset - run_.pieces[piece].begin_mm), begin_s_ + offset));
    }
    const SpatialPiece& last = run_.pieces.back();
    const SpatialSample end = SampleOf(PointOn(last, last.length_mm), begin_s_ + run_.length_mm());
    samples_.back() = end;
    samples_.resize(first_ + segment_count_ * per_segment + 5, end);
  }

  double OffsetAt(double t, std::size_t& cell) const {
    if (t >= node_time_.back()) {
      return run_.length_mm();
    }
    while (cell + 2 < node_time_.size() && node_time_[cell + 1] <= t) {
      ++cell;
    }
    const SpatialNode& a = solved_[cell];
    const SpatialNode& b = solved_[cell + 1];
    const double u = 0.5 * (b.x - a.x) / (b.offset_mm - a.offset_mm);
    const double dt = t - node_time_[cell];
    return std::clamp(a.offset_mm + dt * (std::sqrt(a.x) + 0.5 * u * dt), a.offset_mm, b.offset_mm);
  }

  // Input time of knot n of the plan.
  double InputTime(std::size_t n) const {
    return (static_cast<double>(n) - static_cast<double>(lead_)) * knot_;
  }

  // ---- segments ----

  struct KnotEnds {
    std::array<QuinticEnd, kStrutCount> q;
    QuinticEnd s;
  };

  KnotEnds EndsAt(const SpatialKnot& knot) {
    const StrutState state = model_.struts.At(knot.tool);
    KnotEnds ends;
    for (int j = 0; j < kStrutCount; ++j) {
      ends.q[static_cast<std::size_t>(j)] = {state.q_mm[j], state.first[j], state.second[j]};
    }
    ends.s = {knot.s_mm, knot.path_speed_mm_per_s, knot.path_acceleration_mm_per_s2};
    ProgramFault fault;
    if (!model_.struts.Reaches(knot.tool.p_mm, knot.tool.q, PieceAt(knot.s_mm - begin_s_).line, fault)) {
      plan_.faults.push_back(fault);
    }
    return ends;
  }

  void MakeSegments() {
    const auto per_segment = static_cast<std::size_t>(model_.options.knots_per_segment);
    const double duration = knot_ * static_cast<double>(per_segment);
    plan_.segments.clear();
    knots_.assign(1, EvaluateKnot(control_, first_, knot_));
    KnotEnds from = EndsAt(knots_.front());
    for (std::size_t n = 0; n < segment_count_ && plan_.faults.empty(); ++n) {
      for (std::size_t j = 1; j <= per_segment; ++j) {
        knots_.push_back(EvaluateKnot(control_, first_ + n * per_segment + j, knot_));
      }
      const KnotEnds to = EndsAt(knots_.back());
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
    plan_.duration_s = duration * static_cast<double>(segment_count_);
  }

  // ---- measuring and slowing ----

  struct Excess {
    double slow = 1.0;  // factor on speed that would just cure it
    FeedLimit reason = FeedLimit::kFeed;
    void Take(double factor, FeedLimit why) {
      if (factor < slow) {
        slow = factor;
        reason = why;
      }
    }
    void Judge(double ratio, double power, FeedLimit why) {
      if (ratio > kAllowed) {
        Take(std::max(kStrongestSlowDown, 0.97 * std::pow(ratio, -power)), why);
      }
    }
  };
  struct PendingSlow {
    double begin_time_s;
    double end_time_s;
    Excess excess;
  };
  struct Corner {
    SpatialPoint at;
    double offset_mm;
    double tolerance_mm;
    Nearness nearest;
    double time_s;
  };

  // True if something was exceeded and has been slowed.
  bool SlowWhereExceeded() {
    plan_.tip_deviation_mm = plan_.turn_deviation_rad = 0.0;
    const auto per_segment = static_cast<std::size_t>(model_.options.knots_per_segment);
    piece_at_ = 0;
    pending_.clear();
    FindCorners();
    for (std::size_t n = 0; n < segment_count_; ++n) {
      Excess excess = SegmentExcess(plan_.segments[n]);
      for (std::size_t j = 0; j < per_segment; ++j) {
        KnotExcess(knots_[n * per_segment + j], excess);
        NearCorners(n * per_segment + j);
      }
      if (excess.slow < 1.0) {
        const double begin = InputTime(n * per_segment);
        pending_.push_back({begin, begin + knot_ * static_cast<double>(per_segment), excess});
      }
    }
    MissedCorners();
    ApplySlow();
    return !pending_.empty();
  }

  Excess SegmentExcess(const SpatialSegment& segment) const {
    Excess excess;
    for (std::size_t j = 0; j < kStrutCount; ++j) {
      const Peaks peaks = PeaksOf(segment.q_mm[j], segment.duration_s);
      excess.Judge(peaks.speed / model_.motion.strut_velocity_mm_per_s, 1.0, ActuatorVelocityLimit(j));
      excess.Judge(peaks.acceleration / model_.motion.strut_acceleration_mm_per_s2, 0.5,
                   ActuatorAccelerationLimit(j));
      excess.Judge(peaks.jerk / model_.motion.strut_jerk_mm_per_s3, 1.0 / 3.0, FeedLimit::kActuatorJerk);
    }
    return excess;
  }

  double Size(const Vector3d& tip, const Vector3d& turn) const {
    return std::hypot(tip.norm(), model_.turn_radius_mm * turn.norm());
  }

  void KnotExcess(const SpatialKnot& k, Excess& excess) {
    const double acceleration = Size(k.tool.rate.a_mm_per_s2, k.tool.rate.alpha_rad_per_s2);
    const double jerk = Size(k.jerk_mm_per_s3, k.turn_jerk_rad_per_s3);
    excess.Judge(acceleration / (kPathShare * model_.motion.path_acceleration_mm_per_s2), 0.5,
                 FeedLimit::kPathAcceleration);
    excess.Judge(jerk / (kPathShare * model_.motion.path_jerk_mm_per_s3), 1.0 / 3.0, FeedLimit::kPathJerk);
    const Nearness nearest = Deviation(k);
    TakeDeviation(nearest);
    excess.Judge(nearest.ratio / kToleranceShare, 0.6, FeedLimit::kContourTolerance);
  }

  void TakeDeviation(const Nearness& n) {
    plan_.tip_deviation_mm = std::max(plan_.tip_deviation_mm, n.tip_mm);
    plan_.turn_deviation_rad = std::max(plan_.turn_deviation_rad, n.turn_rad);
  }

  // Distance of the planned pose from a piece: Gauss-Newton on the sum of squares of both shares.
  Nearness NearnessTo(const SpatialPiece& piece, const SpatialKnot& k) const {
    constexpr int kSteps = 3;
    const double wp = 1.0 / (piece.tolerance_mm * piece.tolerance_mm);
    const double ww = 1.0 / (model_.motion.corner_tolerance_rad * model_.motion.corner_tolerance_rad);
    double offset = std::clamp(k.s_mm - begin_s_ - piece.begin_mm, 0.0, piece.length_mm);
    Nearness nearest;
    for (int i = 0; i <= kSteps; ++i) {
      const SpatialPoint at = PointOn(piece, offset);
      const Vector3d tip = k.tool.p_mm - at.p_mm, turn = TurnFromTo(at.q, k.tool.q);
      const Nearness now = NearnessOf(tip, turn, piece.tolerance_mm, model_.motion.corner_tolerance_rad);
      if (now.ratio < nearest.ratio) {
        nearest = now;
      }
      const double slope = wp * at.tangent.dot(tip) + ww * at.turn.dot(turn);
      const double bend = wp * at.tangent.squaredNorm() + ww * at.turn.squaredNorm();
      offset = std::clamp(offset + slope / bend, 0.0, piece.length_mm);
    }
    return nearest;
  }

  Nearness Deviation(const SpatialKnot& k) {
    const std::vector<SpatialPiece>& pieces = run_.pieces;
    const double offset = k.s_mm - begin_s_;
    while (piece_at_ + 1 < pieces.size() && pieces[piece_at_ + 1].begin_mm <= offset) {
      ++piece_at_;
    }
    Nearness nearest = NearnessTo(pieces[piece_at_], k);
    const auto take = [&](std::size_t i) {
      const Nearness other = NearnessTo(pieces[i], k);
      nearest = other.ratio < nearest.ratio ? other : nearest;
    };
    if (nearest.ratio > 0.02) {
      for (std::size_t i = piece_at_;
           i-- > 0 && offset - (pieces[i].begin_mm + pieces[i].length_mm) < kDeviationLook_mm;) {
        take(i);
      }
      for (std::size_t i = piece_at_ + 1;
           i < pieces.size() && pieces[i].begin_mm - offset < kDeviationLook_mm; ++i) {
        take(i);
      }
    }
    return nearest;
  }

  // ---- corners that the plan must come near to ----

  void FindCorners() {
    corners_.clear();
    corner_at_ = 0;
    for (std::size_t k = 1; k < run_.pieces.size(); ++k) {
      const SpatialPoint u = PointOn(run_.pieces[k - 1], run_.pieces[k - 1].length_mm);
      const SpatialPoint v = PointOn(run_.pieces[k], 0.0);
      if (Size(v.tangent - u.tangent, v.turn - u.turn) > kCorner) {
        corners_.push_back({v, run_.pieces[k].begin_mm, run_.pieces[k].tolerance_mm, {}, 0.0});
      }
    }
  }

  void NearCorners(std::size_t n) {
    const SpatialKnot& k = knots_[n];
    const double offset = k.s_mm - begin_s_;
    while (corner_at_ < corners_.size() && corners_[corner_at_].offset_mm < offset - kCornerLook_mm) {
      ++corner_at_;
    }
    const double rad = model_.motion.corner_tolerance_rad;
    const Vector3d &v = k.tool.twist.v_mm_per_s, &w = k.tool.twist.w_rad_per_s;
    for (std::size_t i = corner_at_; i < corners_.size() && corners_[i].offset_mm <= offset + kCornerLook_mm;
         ++i) {
      Corner& corner = corners_[i];
      const double wp = 1.0 / (corner.tolerance_mm * corner.tolerance_mm), ww = 1.0 / (rad * rad);
      const Vector3d tip = corner.at.p_mm - k.tool.p_mm, turn = TurnFromTo(k.tool.q, corner.at.q);
      const double pace = wp * v.squaredNorm() + ww * w.squaredNorm();
      const double dt =
          pace > 0.0 ? std::clamp((wp * tip.dot(v) + ww * turn.dot(w)) / pace, -0.5 * knot_, 0.5 * knot_)
                     : 0.0;
      const Vector3d shift = dt * v + 0.5 * dt * dt * k.tool.rate.a_mm_per_s2;
      const Vector3d turned = dt * w + 0.5 * dt * dt * k.tool.rate.alpha_rad_per_s2;
      const Nearness now = NearnessOf(tip - shift, turn - turned, corner.tolerance_mm, rad);
      if (now.ratio < corner.nearest.ratio) {
        corner.nearest = now;
        corner.time_s = InputTime(n);
      }
    }
  }

  void MissedCorners() {
    for (const Corner& corner : corners_) {
      TakeDeviation(corner.nearest);
      Excess excess;
      excess.Judge(corner.nearest.ratio / kToleranceShare, 0.5, FeedLimit::kCorner);
      if (excess.slow < 1.0) {
        pending_.push_back({corner.time_s, corner.time_s, excess});
      }
    }
    std::sort(pending_.begin(), pending_.end(),
              [](const PendingSlow& a, const PendingSlow& b) { return a.begin_time_s < b.begin_time_s; });
  }

  // A node is slowed if its time lies within the filter's reach of an excess; wider from pass to pass, so that slowing one
  // place does not push the excess to the next for ever.
  void ApplySlow() {
    const double half = widening_ * model_.filter.half_support_s();
    std::size_t first = 0;
    for (std::size_t k = 0; k < slow_.size() && !pending_.empty(); ++k) {
      const double before = k > 0 ? node_time_[k - 1] : node_time_[k];
      const double after = k + 1 < slow_.size() ? node_time_[k + 1] : node_time_[k];
      while (first < pending_.size() && pending_[first].end_time_s + half < before) {
        ++first;
      }
      Excess worst;
      for (std::size_t i = first; i < pending_.size() && pending_[i].begin_time_s - half <= after; ++i) {
        worst.Take(pending_[i].excess.slow, pending_[i].excess.reason);
      }
      if (worst.slow < 1.0) {
        slow_[k] *= worst.slow;
        // Too much acceleration is cured by less speed at the corner and a little less braking before it.
        const double least =
            worst.reason == FeedLimit::kPathAcceleration ? std::min(kLeastEase, ease_[k]) : 0.0;
        ease_[k] = std::max(least, ease_[k] * worst.slow * worst.slow);
        slow_reason_[k] = worst.reason;
        exceeded_line_ = PieceAt(nodes_[k].offset_mm).line;
      }
    }
  }

  // ---- reporting ----

  const SpatialPiece& PieceAt(double offset_mm) const {
    const auto after = std::upper_bound(run_.pieces.begin(), run_.pieces.end(), offset_mm,
                                        [](double o, const SpatialPiece& p) { return o < p.begin_mm; });
    return after == run_.pieces.begin() ? run_.pieces.front() : *std::prev(after);
  }

  // What binds, from the final polynomials and knots: of cuts for whoever asks, of traverses for the samples.
  void Report() {
    std::vector<SlowStretch> rapid;
    const auto reach = static_cast<std::size_t>(model_.filter.half_support_s() / knot_);
    BindingReport cuts(reach, plan_.slow), traverses(reach, rapid);
    BindingReport* open = nullptr;
    corner_at_ = piece_at_ = 0;
    std::sort(corners_.begin(), corners_.end(),
              [](const Corner& a, const Corner& b) { return a.time_s < b.time_s; });
    for (std::size_t n = 0; n < knots_.size(); ++n) {
      const SpatialPiece& piece = PieceAt(knots_[n].s_mm - begin_s_);
      BindingReport* const mine = piece.cutting ? &cuts : &traverses;
      const bool slow = knots_[n].path_speed_mm_per_s < kFeedHeld * piece.programmed_mm_per_s;
      if (open != nullptr && (!slow || open != mine)) {
        open->Close(knots_[n].s_mm);
      }
      open = slow ? mine : nullptr;
      if (slow) {
        open->Take(MomentAt(n, piece));
      }
    }
    if (open != nullptr) {
      open->Close(begin_s_ + run_.length_mm());
    }
    SumLengths();
    rapid.insert(rapid.end(), plan_.slow.begin(), plan_.slow.end());
    std::sort(rapid.begin(), rapid.end(),
              [](const SlowStretch& a, const SlowStretch& b) { return a.from_s_mm < b.from_s_mm; });
    ReportSamples(rapid);
  }

  FeedMoment MomentAt(std::size_t n, const SpatialPiece& piece) {
    const SpatialKnot& k = knots_[n];
    FeedMoment m{
        k.s_mm, std::max(0.0, k.path_speed_mm_per_s), piece.programmed_mm_per_s, piece.line, FeedLimit::kFeed,
        0.0};
    if (piece.feed_mm_per_s < piece.programmed_mm_per_s) {
      m.Offer(FeedLimit::kFeed, m.speed_mm_per_s / piece.feed_mm_per_s);  // the machine's own
    }
    OfferStruts(n, m);
    const double acceleration = Size(k.tool.rate.a_mm_per_s2, k.tool.rate.alpha_rad_per_s2);
    const double along = k.path_acceleration_mm_per_s2;
    m.Offer(2.0 * along * along < acceleration * acceleration ? FeedLimit::kCurvature
                                                              : FeedLimit::kPathAcceleration,
            acceleration / model_.motion.path_acceleration_mm_per_s2);
    m.Offer(FeedLimit::kPathJerk,
            Size(k.jerk_mm_per_s3, k.turn_jerk_rad_per_s3) / model_.motion.path_jerk_mm_per_s3);
    m.Offer(FeedLimit::kContourTolerance, Deviation(k).ratio);
    for (; corner_at_ < corners_.size() && corners_[corner_at_].time_s <= InputTime(n); ++corner_at_) {
      m.Offer(FeedLimit::kCorner, corners_[corner_at_].nearest.ratio);
    }
    return m;
  }

  void OfferStruts(std::size_t n, FeedMoment& m) const {
    const auto per_segment = static_cast<std::size_t>(model_.options.knots_per_segment);
    const std::size_t i = std::min(n / per_segment, plan_.segments.size() - 1);
    const double t = static_cast<double>(n - i * per_segment) * knot_;
    for (std::size_t j = 0; j < kStrutCount; ++j) {
      const Polynomial& q = plan_.segments[i].q_mm[j];
      m.Offer(ActuatorVelocityLimit(j), std::abs(q.first(t)) / model_.motion.strut_velocity_mm_per_s);
      m.Offer(ActuatorAccelerationLimit(j),
              std::abs(q.second(t)) / model_.motion.strut_acceleration_mm_per_s2);
      m.Offer(FeedLimit::kActuatorJerk, std::abs(q.third(t)) / model_.motion.strut_jerk_mm_per_s3);
    }
  }

  void SumLengths() {
    double& held_mm = plan_.binding_mm[static_cast<std::size_t>(FeedLimit::kFeed)];
    for (const SpatialPiece& piece : run_.pieces) {
      held_mm += piece.cutting ? piece.length_mm : 0.0;
    }
    for (const SlowStretch& stretch : plan_.slow) {
      plan_.binding_mm[static_cast<std::size_t>(stretch.limit)] += stretch.to_s_mm - stretch.from_s_mm;
      held_mm -= stretch.to_s_mm - stretch.from_s_mm;
    }
  }

  void ReportSamples(const std::vector<SlowStretch>& slow) {
    std::size_t at = 0;
    for (std::size_t n = 0; n < knots_.size(); n += 2) {
      const SpatialKnot& k = knots_[n];
      while (at < slow.size() && slow[at].to_s_mm < k.s_mm) {
        ++at;
      }
      const bool bound = at < slow.size() && slow[at].from_s_mm <= k.s_mm;
      const SpatialPiece& piece = PieceAt(k.s_mm - begin_s_);
      plan_.samples.push_back({static_cast<double>(n) * knot_, k.s_mm, k.tool.p_mm, k.tool.q,
                               k.tool.twist.v_mm_per_s.norm(), k.path_speed_mm_per_s,
                               bound ? slow[at].limit : FeedLimit::kFeed, piece.cutting, piece.line});
    }
  }

  const SpatialModel& model_;
  const SpatialRun& run_;
  double begin_s_;
  double knot_;
  SpatialStretchPlan plan_;
  std::vector<SpatialNode> nodes_;   // caps as found
  std::vector<SpatialNode> solved_;  // of the last pass
  std::vector<double> slow_;         // of speed, one a node
  std::vector<double> ease_;         // of acceleration
  std::vector<FeedLimit> slow_reason_;
  std::vector<double> base_speed_;
  std::vector<double> node_time_;
  std::size_t first_ = 0;  // sample of the plan's first knot
  std::size_t lead_ = 0;
  std::size_t segment_count_ = 0;
  std::vector<SpatialSample> samples_;
  std::vector<SpatialSample> control_;
  std::vector<SpatialKnot> knots_;
  std::vector<PendingSlow> pending_;
  std::vector<Corner> corners_;
  std::size_t corner_at_ = 0;
  std::size_t piece_at_ = 0;
  std::uint32_t exceeded_line_ = 0;
  double widening_ = 1.0;
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
