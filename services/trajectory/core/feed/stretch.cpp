#include "trajectory/core/feed/stretch.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "trajectory/core/feed/contour_check.hpp"
#include "trajectory/core/feed/elastic_lead.hpp"
#include "trajectory/core/feed/moving_time.hpp"
#include "trajectory/core/feed/reach.hpp"
#include "trajectory/core/feed/stretch_draft.hpp"
#include "trajectory/core/feed/stretch_report.hpp"
#include "trajectory/core/feed/stretch_speeds.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;

constexpr int kMostPasses = 80;
constexpr std::size_t kAskEvery = 4096;   // segments between questions whether planning is still wanted
constexpr int kContourChecks = 8;         // a segment
constexpr double kToleranceShare = 0.97;  // measured at these, held between them
// The actuators' quintics make the jet's, nearly: both meet at the ends up to the second derivative, and part like the sixth
// power between, off (4 t (T - t) / T^2)^3. Derivatives of that for off = T = 1, with something for what comes after it.
constexpr double kPartedSecond = 1.3 * 24.0, kPartedThird = 1.3 * 384.0;
constexpr double kSettleTimes = 14.0;  // of the damping time: e^-14 of the lead is left

QuinticEnd EndOf(const KnotState& k, int coordinate) {
  return {k.r[coordinate], k.first[coordinate], k.second[coordinate]};
}

// Everything at one knot that segments are made of.
struct KnotActuators {
  std::array<QuinticEnd, 2> q;
  std::array<QuinticEnd, 2> lead;
};

class StretchPlanner {
 public:
  StretchPlanner(const PlanningModel& model, std::span<const PathElement> elements, const Vector2d& at,
                 double begin_s, const std::function<bool()>& cancelled)
      : model_(model),
        at_(at),
        begin_s_(begin_s),
        cancelled_(cancelled),
        knot_(model.filter.knot_s),
        contour_(draft_) {
    draft_.elements = elements;
    draft_.knot_s = knot_;
    draft_.knots_per_segment = model.options.knots_per_segment;
    plan_.end_s_mm = begin_s;
  }

  StretchPlan Plan() {
    PrepareElements(model_, draft_, plan_.faults);
    for (int pass = 0; plan_.faults.empty(); ++pass) {
      input_duration_s_ = SetSpeeds(model_, draft_, plan_.faults);
      if (!plan_.faults.empty() || Cancelled() || TooLong()) {
        break;
      }
      SampleTime();
      control_ = Smooth(model_.filter, samples_);
      MakeSegments();
      if (!plan_.faults.empty() || !Exceeded()) {
        break;
      }
      SlowDown(1.0 + pass / 6.0);
      if (pass + 1 == kMostPasses) {
        plan_.faults.push_back(
            {draft_.LineAtTime(0.5 * (exceeded_.back().begin_time_s + exceeded_.back().end_time_s)), 0,
             "LIMITS_NOT_HELD", "",
             "no speed was found at which every limit is held here; the contour is too tight"});
      }
    }
    if (plan_.faults.empty()) {
      plan_.contour_deviation_mm = contour_.largest_mm();
      ReportStretch(model_, draft_, contour_, plan_);
    }
    return std::move(plan_);
  }

 private:
  // Slowing may take what the feeds did not.
  bool TooLong() {
    if (input_duration_s_ <= kLongestRun_s) {
      return false;
    }
    plan_.faults.push_back(RunTooLong(draft_.elements.front().line, input_duration_s_));
    return true;
  }
  bool Cancelled() {
    if (cancelled_ && cancelled_()) {
      plan_.faults.push_back({0, 0, "CANCELLED", "", "planning was cancelled"});
      return true;
    }
    return false;
  }

  // ---- sampling ----

  void SampleTime() {
    const int reach = model_.filter.reach();
    const auto per_segment = static_cast<std::size_t>(draft_.knots_per_segment);
    const std::size_t pad = static_cast<std::size_t>(reach) + 4;
    const auto count = static_cast<std::size_t>(std::ceil(input_duration_s_ / knot_ - 1e-9)) + 1;
    const auto settle =
        model_.damping_time_s > 0.0
            ? static_cast<std::size_t>(std::ceil(kSettleTimes * model_.damping_time_s / knot_))
            : 0;
    first_ = pad - static_cast<std::size_t>(reach) - 1;
    draft_.first_knot = static_cast<std::ptrdiff_t>(first_) - static_cast<std::ptrdiff_t>(pad);
    const std::size_t knots = count + 2 * static_cast<std::size_t>(reach) + 2 + settle;
    segment_count_ = draft_.elements.empty() ? 1 : (knots + per_segment - 1) / per_segment;
    const std::size_t end = first_ + segment_count_ * per_segment;
    samples_.clear();
    samples_.reserve(end + 8);
    const Vector2d start = draft_.elements.empty() ? at_ : draft_.elements.front().from_mm;
    samples_.assign(pad, PathSample(start.x(), start.y(), begin_s_));
    AppendMotion();
    samples_.resize(end + 4, samples_.back());
  }

  void AppendMotion() {
    double s_mm = begin_s_;
    std::size_t k = 0;  // knot in input time
    Vector2d last = samples_.back().head<2>();
    for (std::size_t i = 0; i < draft_.elements.size(); ++i) {
      PlannedElement& e = draft_.planned[i];
      e.begin_s_mm = s_mm;
      const double end = i + 1 < draft_.elements.size() ? draft_.planned[i + 1].begin_time_s : e.end_time_s;
      if (draft_.IsRun(i)) {
        SampleRun(i, end, k);
        s_mm = e.begin_s_mm + draft_.elements[i].length_mm();
      } else {
        s_mm = SampleIdle(i, end, k, last, s_mm);
      }
      last = draft_.elements[i].to_mm;
      e.length_mm = s_mm - e.begin_s_mm;
    }
    samples_.push_back(PathSample(last.x(), last.y(), s_mm));
    plan_.end_s_mm = s_mm;
  }

  void SampleRun(std::size_t i, double end, std::size_t& k) {
    const PlannedElement& e = draft_.planned[i];
    const std::vector<PathPiece>& pieces = draft_.elements[i].pieces;
    std::size_t cell = 0, piece = 0;
    const double total = draft_.elements[i].length_mm();
    for (; static_cast<double>(k) * knot_ < end; ++k) {
      const double t = static_cast<double>(k) * knot_ - e.begin_time_s;
      double offset = total;
      if (t < e.run.node_time_s.back()) {
        while (cell + 2 < e.run.node_time_s.size() && e.run.node_time_s[cell + 1] <= t) {
          ++cell;
        }
        offset = std::min(total, OffsetIn(e.run, cell, t));
      }
      while (piece + 1 < pieces.size() && pieces[piece + 1].begin_mm <= offset) {
        ++piece;
      }
      const Vector2d p = PointOn(pieces[piece], offset - pieces[piece].begin_mm).p_mm;
      samples_.push_back(PathSample(p.x(), p.y(), e.begin_s_mm + offset));
    }
  }

  static double OffsetIn(const PlannedRun& run, std::size_t cell, double t) {
    const ProfileNode& a = run.solved[cell];
    const ProfileNode& b = run.solved[cell + 1];
    const double u = 0.5 * (b.x - a.x) / (b.offset_mm - a.offset_mm);
    const double dt = t - run.node_time_s[cell];
    return std::clamp(a.offset_mm + dt * (std::sqrt(a.x) + 0.5 * u * dt), a.offset_mm, b.offset_mm);
  }

  // Path length along an idle move is measured along its chords; the last one is closed by the next element.
  double SampleIdle(std::size_t i, double end, std::size_t& k, Vector2d last, double s_mm) {
    const PathElement& element = draft_.elements[i];
    const PlannedElement& e = draft_.planned[i];
    for (; static_cast<double>(k) * knot_ < end; ++k) {
      const double t = static_cast<double>(k) * knot_ - e.begin_time_s;
      const Vector2d p = IdlePosition(e.idle, element.from_mm, element.to_mm, t);
      s_mm += (p - last).norm();
      last = p;
      samples_.push_back(PathSample(p.x(), p.y(), s_mm));
    }
    return s_mm + (element.to_mm - last).norm();
  }

  // ---- segments ----

  void MakeSegments() {
    plan_.segments.clear();
    plan_.segments.reserve(segment_count_);
    draft_.played.clear();
    draft_.played.reserve(segment_count_);
    const auto per_segment = static_cast<std::size_t>(draft_.knots_per_segment);
    ElasticLead lead(model_.elastic_lag_s2, model_.damping_time_s, knot_);
    KnotState state = EvaluateKnot(control_, first_, knot_);
    KnotActuators from = ActuatorsAt(state, lead.At(state));
    KnotState state_from = state;
    for (std::size_t n = 0; n < segment_count_ && plan_.faults.empty(); ++n) {
      if (n % kAskEvery == kAskEvery - 1 && Cancelled()) {
        return;
      }
      for (std::size_t j = 1; j <= per_segment; ++j) {
        const KnotState next = EvaluateKnot(control_, first_ + n * per_segment + j, knot_);
        lead.Advance(state, next);
        state = next;
      }
      const KnotActuators to = ActuatorsAt(state, lead.At(state));
      AddSegment(n, from, to, state_from, state);
      from = to;
      state_from = state;
    }
    plan_.duration_s = draft_.segment_s() * static_cast<double>(segment_count_);
  }

  void AddSegment(std::size_t n, const KnotActuators& from, const KnotActuators& to,
                  const KnotState& state_from, const KnotState& state_to) {
    const double duration = draft_.segment_s();
    Segment segment;
    segment.start_s = duration * static_cast<double>(n);
    segment.duration_s = duration;
    for (std::size_t a = 0; a < 2; ++a) {
      segment.q_mm[a] = QuinticBetween(from.q[a], to.q[a], duration);
      segment.lead_mm[a] = QuinticBetween(from.lead[a], to.lead[a], duration);
    }
    const auto along = [&](int coordinate) {
      return QuinticBetween(EndOf(state_from, coordinate), EndOf(state_to, coordinate), duration);
    };
    segment.s_mm = along(2);
    plan_.segments.push_back(segment);
    draft_.played.push_back({along(0), along(1)});
  }

  KnotActuators ActuatorsAt(const KnotState& k, const kinematics::Motion& lead) {
    const kinematics::Motion rigid{k.r.head<2>(), k.first.head<2>(), k.second.head<2>()};
    KnotActuators at;
    const std::optional<kinematics::Motion> q = Reached(rigid, k);
    if (!q) {
      return at;
    }
    Fill(*q, at.q);
    if (model_.elastic_lag_s2 > 0.0) {
      const std::optional<kinematics::Motion> bent =
          Reached({rigid.position_mm + lead.position_mm, rigid.velocity_mm_per_s + lead.velocity_mm_per_s,
                   rigid.acceleration_mm_per_s2 + lead.acceleration_mm_per_s2},
                  k);
      if (bent) {
        Fill({bent->position_mm - q->position_mm, bent->velocity_mm_per_s - q->velocity_mm_per_s,
              bent->acceleration_mm_per_s2 - q->acceleration_mm_per_s2},
             at.lead);
      }
    }
    return at;
  }

  // The actuators' motion, or a fault.
  std::optional<kinematics::Motion> Reached(const kinematics::Motion& jet, const KnotState& k) {
    const kinematics::MotionAnswer answer = model_.sheet.Actuators(jet);
    if (answer.reason != kinematics::Reason::kSolved || !answer.differentiable) {
      plan_.faults.push_back(ReachFault(model_.sheet, jet.position_mm, draft_.LineAt(k.r.z())));
      return std::nullopt;
    }
    return answer.motion;
  }

  static void Fill(const kinematics::Motion& m, std::array<QuinticEnd, 2>& ends) {
    for (int j = 0; j < 2; ++j) {
      ends[static_cast<std::size_t>(j)] = {m.position_mm[j], m.velocity_mm_per_s[j],
                                           m.acceleration_mm_per_s2[j]};
    }
  }

  // ---- measuring and slowing ----

  // True if a limit or the tolerance is exceeded somewhere; where, stands in `exceeded_`, by time.
  bool Exceeded() {
    exceeded_.clear();
    contour_.Restart();
    const double apart_s = draft_.segment_s() / kContourChecks;
    for (std::size_t n = 0; n < segment_count_; ++n) {
      const double begin_s = draft_.SegmentTime_s(n);
      Excess excess = SegmentExcess(n);
      for (int k = 0; k < kContourChecks; ++k) {
        const double from = apart_s * k, to = apart_s * (k + 1);
        const double s_mm = plan_.segments[n].s_mm.value(from);
        const Vector2d p = draft_.played[n].value(from);
        ContourExcess(p, s_mm, draft_.segment_s() * static_cast<double>(n) + from, excess);
        contour_.NearCorners(s_mm, p, draft_.played[n].value(to), begin_s + from);
      }
      if (excess.any()) {
        exceeded_.push_back({begin_s, begin_s + draft_.segment_s(), excess});
      }
    }
    MissedCorners();
    return !exceeded_.empty();
  }

  void ContourExcess(const Vector2d& p, double s_mm, double time_s, Excess& excess) {
    double tolerance_mm = 0.0;
    const double deviation_mm = contour_.Deviation(p, s_mm, kToleranceShare, tolerance_mm);
    if (deviation_mm < 0.0) {
      return;
    }
    contour_.Keep(deviation_mm);
    excess.Judge(deviation_mm / (kToleranceShare * tolerance_mm), 0.6, FeedLimit::kContourTolerance);
    const double allowed_mm = kToleranceShare * contour_.piece().tolerance_mm;
    excess.Judge(contour_.Missed(p, s_mm, time_s, 2.0 * model_.filter.half_support_s()) / allowed_mm, 0.5,
                 FeedLimit::kContourTolerance);
  }

  void MissedCorners() {
    for (const ContourCorner& corner : contour_.corners()) {
      contour_.Keep(corner.nearest_mm);
      Excess excess;
      excess.Judge(corner.nearest_mm / (kToleranceShare * corner.tolerance_mm), 0.5, FeedLimit::kCorner);
      if (excess.any()) {
        exceeded_.push_back({corner.time_s, corner.time_s, excess});
      }
    }
    std::sort(exceeded_.begin(), exceeded_.end(),
              [](const SlowPlace& a, const SlowPlace& b) { return a.begin_time_s < b.begin_time_s; });
  }

  Excess SegmentExcess(std::size_t n) const {
    Excess excess;
    const Segment& segment = plan_.segments[n];
    for (std::size_t a = 0; a < 2; ++a) {
      const ActuatorLimits& limit = model_.machine.actuators[a];
      Polynomial p = segment.q_mm[a];
      for (std::size_t c = 0; c < p.c.size(); ++c) {
        p.c[c] += segment.lead_mm[a].c[c];
      }
      const DerivativePeaks peaks = PeaksOf(p, segment.duration_s);
      excess.Judge(peaks.first_per_s / limit.velocity_mm_per_s, 1.0, ActuatorVelocityLimit(a));
      excess.Judge(peaks.second_per_s2 / limit.acceleration_mm_per_s2, 0.5, ActuatorAccelerationLimit(a));
      excess.Judge(peaks.third_per_s3 / limit.jerk_mm_per_s3, 1.0 / 3.0, FeedLimit::kActuatorJerk);
    }
    const PathLimits& path = model_.machine.path;
    const double T = segment.duration_s, parted_mm = Parted_mm(segment, draft_.played[n].value(0.5 * T));
    const DerivativePeaks peaks = PeaksOf(draft_.played[n], T);
    excess.Judge((peaks.second_per_s2 + kPartedSecond * parted_mm / (T * T)) / path.acceleration_mm_per_s2,
                 0.5, FeedLimit::kPathAcceleration);
    excess.Judge((peaks.third_per_s3 + kPartedThird * parted_mm / (T * T * T)) / path.jerk_mm_per_s3,
                 1.0 / 3.0, FeedLimit::kPathJerk);
    return excess;
  }

  // How far the jet that the actuators make is from this place, planned for the segment's middle.
  double Parted_mm(const Segment& segment, const Vector2d& jet_mm) const {
    const kinematics::InverseAnswer there = model_.sheet.Position(jet_mm);
    const kinematics::MotionAnswer x = model_.sheet.Actuators({jet_mm, Vector2d::UnitX(), Vector2d::Zero()});
    const kinematics::MotionAnswer y = model_.sheet.Actuators({jet_mm, Vector2d::UnitY(), Vector2d::Zero()});
    if (there.reason != kinematics::Reason::kSolved || !x.differentiable || !y.differentiable) {
      return 0.0;  // only the ends of segments are known to be reached; they are told elsewhere
    }
    Eigen::Matrix2d slopes;
    slopes << x.motion.velocity_mm_per_s, y.motion.velocity_mm_per_s;
    const double middle_s = 0.5 * segment.duration_s;
    const Vector2d played{segment.q_mm[0].value(middle_s), segment.q_mm[1].value(middle_s)};
    return (slopes.inverse() * (played - there.actuator_position_mm)).norm();
  }

  void SlowDown(double widening) {
    const double half_s = widening * model_.filter.half_support_s();
    for (std::size_t i = 0; i < draft_.elements.size(); ++i) {
      PlannedElement& e = draft_.planned[i];
      if (draft_.IsRun(i)) {
        e.run.pace.Slow(exceeded_, half_s, e.begin_time_s, e.run.node_time_s);
      } else {
        SlowIdle(e, half_s);
      }
    }
  }

  void SlowIdle(PlannedElement& e, double half_s) const {
    double factor = 1.0;
    for (const SlowPlace& p : exceeded_) {
      if (p.begin_time_s - half_s < e.end_time_s && p.end_time_s + half_s > e.begin_time_s) {
        factor = std::min(factor, p.excess.factor);
      }
    }
    e.idle_factor *= factor;
  }

  const PlanningModel& model_;
  Vector2d at_;
  double begin_s_;
  const std::function<bool()>& cancelled_;
  double knot_;
  StretchDraft draft_;
  StretchPlan plan_;
  ContourCheck contour_;
  std::vector<PathSample> samples_;
  std::vector<PathSample> control_;
  std::vector<SlowPlace> exceeded_;
  double input_duration_s_ = 0.0;
  std::size_t first_ = 0;  // sample of the stretch's first knot
  std::size_t segment_count_ = 0;
};

}  // namespace

StretchPlan PlanStretch(const PlanningModel& model, std::span<const PathElement> elements,
                        const Vector2d& at_W_mm, double begin_s_mm, const std::function<bool()>& cancelled) {
  return StretchPlanner(model, elements, at_W_mm, begin_s_mm, cancelled).Plan();
}

}  // namespace lambdajet::trajectory
