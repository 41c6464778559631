#include "trajectory/core/feed/stretch.hpp"

#include <algorithm>
#include <cmath>

#include "trajectory/core/feed/binding.hpp"
#include "trajectory/core/feed/idle_planner.hpp"
#include "trajectory/core/feed/level_tops.hpp"
#include "trajectory/core/feed/reach.hpp"
#include "trajectory/core/feed/run_profile.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;

constexpr double kPathMargin = 0.995;  // planned against the limit, before smoothing
constexpr double kActuatorMargin = 0.99;
constexpr int kMostPasses = 80;
constexpr std::size_t kAskEvery = 4096;  // segments between questions whether planning is still wanted
constexpr int kChecksPerSegment = 16;
constexpr double kAllowed = 1.0 + 5e-7;       // of a limit, on the final polynomials
constexpr double kStrongestSlowDown = 0.6;    // in one pass
constexpr double kCure = 0.997;               // slower than would just do, so that few passes are needed
constexpr int kContourChecks = 8;             // a segment
constexpr double kToleranceShare = 0.97;      // measured at these, held between them
constexpr double kLeastTold = 0.5;            // of the tolerance, measured exactly from there on
constexpr double kPlayedMargin = 1.0 + 1e-5;  // the actuators' quintics make the jet's, nearly
constexpr double kCornerCosine = 0.995;       // kinks above 0.1 rad are corners
constexpr double kCornerLook_mm = 2.0;
constexpr double kSmallestDamping_s = 2e-5;
constexpr double kLeastEase = 0.6;
constexpr double kSettleTimes = 14.0;  // of the damping time: e^-14 of the lead is left

struct PlannedRun {
  std::vector<ProfileNode> nodes;  // caps as found; x of the last pass
  std::vector<ProfileNode> solved;
  std::vector<double> slow;  // of speed, one a node
  std::vector<double> ease;  // of acceleration
  std::vector<FeedLimit> slow_reason;
  std::vector<double> node_time;
  double end_speed_mm_per_s = 0.0;
};

struct PlannedElement {
  PlannedRun run;
  IdleMove idle;
  double idle_slow = 1.0;
  double begin_time_s = 0.0;
  double end_time_s = 0.0;
  double begin_s_mm = 0.0;
  double length_mm = 0.0;
};

// Value, first and second derivative at both ends of a segment to the one quintic that meets them.
struct End {
  double value = 0.0;
  double first = 0.0;
  double second = 0.0;
};

Polynomial Hermite(const End& a, const End& b, double T) {
  const double h = b.value - a.value - a.first * T - 0.5 * a.second * T * T;
  const double g = (b.first - a.first - a.second * T) * T;
  const double m = (b.second - a.second) * T * T;
  const double T3 = T * T * T;
  return {{a.value, a.first, 0.5 * a.second, (10 * h - 4 * g + 0.5 * m) / T3,
           (-15 * h + 7 * g - m) / (T3 * T), (6 * h - 3 * g + 0.5 * m) / (T3 * T * T)}};
}

// What a segment makes the jet do on the sheet: the quintic that meets the smoothed motion at the segment's ends, as the
// actuators' own do.
struct PlayedPath {
  Polynomial x, y;

  Vector2d value(double t) const { return {x.value(t), y.value(t)}; }
  Vector2d first(double t) const { return {x.first(t), y.first(t)}; }
  Vector2d second(double t) const { return {x.second(t), y.second(t)}; }
  Vector2d third(double t) const { return {x.third(t), y.third(t)}; }
};

double Fourth(const Polynomial& p, double t) { return 120 * p.c[5] * t + 24 * p.c[4]; }

// Bounds of the magnitude of three derivatives on [0, T]: values a step apart, and by how much they can rise between.
struct Largest {
  double first = 0.0;
  double second = 0.0;
  double third = 0.0;

  Largest(const Polynomial& p, double T) {
    const double h = T / kChecksPerSegment;
    for (int k = 0; k <= kChecksPerSegment; ++k) {
      first = std::max(first, std::abs(p.first(h * k)));
      second = std::max(second, std::abs(p.second(h * k)));
    }
    third = std::max(std::abs(p.third(0.0)), std::abs(p.third(T)));
    const double turn = p.c[5] == 0.0 ? -1.0 : -p.c[4] / (5.0 * p.c[5]);
    third = turn > 0.0 && turn < T ? std::max(third, std::abs(p.third(turn))) : third;
    first += h * h / 8 * third;
    second += h * h / 8 * std::max(std::abs(Fourth(p, 0.0)), std::abs(Fourth(p, T)));
  }

  // Of the path: magnitudes of vectors.
  Largest(const PlayedPath& p, double T) {
    const double h = T / kChecksPerSegment;
    for (int k = 0; k <= kChecksPerSegment; ++k) {
      second = std::max(second, p.second(h * k).norm());
      third = std::max(third, p.third(h * k).norm());
    }
    second += h * h / 8 *
              std::max(Vector2d(Fourth(p.x, 0.0), Fourth(p.y, 0.0)).norm(),
                       Vector2d(Fourth(p.x, T), Fourth(p.y, T)).norm());
    third += h * h / 8 * 120 * Vector2d(p.x.c[5], p.y.c[5]).norm();
  }
};

End EndOf(const KnotState& k, int coordinate) {
  return {k.r[coordinate], k.first[coordinate], k.second[coordinate]};
}

// Everything at one knot that segments are made of.
struct KnotActuators {
  std::array<End, 2> q;
  std::array<End, 2> lead;
};

class StretchPlanner {
 public:
  StretchPlanner(const PlanningModel& model, std::span<const PathElement> elements, const Vector2d& at,
                 double begin_s, const std::function<bool()>& cancelled)
      : model_(model),
        elements_(elements),
        at_(at),
        begin_s_(begin_s),
        cancelled_(cancelled),
        knot_(model.filter.knot_s) {
    plan_.end_s_mm = begin_s;
  }

  StretchPlan Plan() {
    PrepareRuns();
    for (int pass = 0; plan_.faults.empty(); ++pass) {
      widening_ = 1.0 + pass / 6.0;
      SetSpeeds();
      if (!plan_.faults.empty() || Cancelled()) {
        break;
      }
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
  bool Cancelled() {
    if (cancelled_ && cancelled_()) {
      plan_.faults.push_back({0, 0, "CANCELLED", "", "planning was cancelled"});
      return true;
    }
    return false;
  }

  void PrepareRuns() {
    planned_.resize(elements_.size());
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      if (elements_[i].kind == ElementKind::kRun) {
        PlannedRun& run = planned_[i].run;
        run.nodes = MakeRunNodes(model_, elements_[i], plan_.faults);
        run.slow.assign(run.nodes.size(), 1.0);
        run.ease.assign(run.nodes.size(), 1.0);
        run.slow_reason.assign(run.nodes.size(), FeedLimit::kContourTolerance);
        if (model_.options.pace) {
          KeepPace(*model_.options.pace, elements_[i].run_begin_mm, run);
        }
      } else if (model_.options.pace) {
        planned_[i].idle_slow = model_.options.pace->OfIdle(elements_[i].number);
      }
    }
  }

  static void KeepPace(const Pace& pace, double run_begin_mm, PlannedRun& run) {
    for (std::size_t k = 0; k < run.nodes.size(); ++k) {
      run.slow[k] = pace.At(run_begin_mm + run.nodes[k].offset_mm);
      run.ease[k] = run.slow[k] * run.slow[k];
      run.slow_reason[k] = run.slow[k] < 1.0 ? FeedLimit::kPredictedError : FeedLimit::kContourTolerance;
    }
  }

  bool FlowsOn(std::size_t i) const {
    return !elements_[i].flush_after && i + 1 < elements_.size() &&
           elements_[i + 1].kind == ElementKind::kIdle;
  }

  // Speeds of runs and shapes of idle moves, then their places in time.
  void SetSpeeds() {
    double time = 0.0;
    for (std::size_t i = 0; i < elements_.size() && plan_.faults.empty(); ++i) {
      PlannedElement& e = planned_[i];
      if (elements_[i].kind == ElementKind::kRun) {
        SolveRun(i);
      } else if (i == 0 || elements_[i - 1].kind == ElementKind::kIdle || elements_[i - 1].flush_after) {
        SolveIdle(i, Vector2d::Zero());
      }
      e.begin_time_s = time;
      time += elements_[i].kind == ElementKind::kRun ? e.run.node_time.back() : e.idle.duration_s;
      e.end_time_s = time;
      time += PauseAfter(i);
    }
    input_duration_ = time;
  }

  // An exact stop lets the smoothing run out. Between moves that meet at standstill the first average lies between stopping
  // and starting, so that their accelerations do not add up to a jerk of twice the limit.
  double PauseAfter(std::size_t i) const {
    if (elements_[i].flush_after) {
      return (2 * model_.filter.reach() + 2) * knot_;
    }
    const bool run = elements_[i].kind == ElementKind::kRun;
    return i + 1 < elements_.size() && (!run || planned_[i].run.end_speed_mm_per_s == 0.0) ? FirstAverage()
                                                                                           : 0.0;
  }
  double FirstAverage() const { return model_.filter.first_s; }

  void SolveProfile(PlannedRun& run, double end_speed) {
    run.solved = run.nodes;
    for (std::size_t k = 0; k < run.nodes.size(); ++k) {
      const double f = run.slow[k];
      if (f < 1.0) {
        run.solved[k].speed_cap_mm_per_s = f * base_speed_[k];
        run.solved[k].acceleration_mm_per_s2 *= run.ease[k];
        run.solved[k].cap_reason = run.slow_reason[k];
      }
    }
    SolveSpeedProfile(run.solved, model_.bounds, 0.0, end_speed);
    LevelTops(run.solved, FirstAverage(), 1.01 * model_.path_acceleration_mm_per_s2);
    for (std::size_t k = 0; k < run.solved.size(); ++k) {  // eased for another reason than the limit itself
      if (run.solved[k].binding == FeedLimit::kPathAcceleration && run.ease[k] < 1.0) {
        run.solved[k].binding = run.slow_reason[k];
      }
    }
    run.end_speed_mm_per_s = std::sqrt(run.solved.back().x);
  }

  void SolveRun(std::size_t i) {
    PlannedRun& run = planned_[i].run;
    if (run.node_time.empty()) {  // first pass: what slow-down counts from
      RememberSpeeds(run, i);
    }
    base_speed_ = run_speed_[i];
    SolveProfile(run, FlowsOn(i) ? 1e9 : 0.0);
    if (FlowsOn(i)) {
      ChooseEndSpeed(i);
    }
    run.node_time.assign(1, 0.0);
    for (std::size_t k = 0; k + 1 < run.solved.size(); ++k) {
      const double v = std::sqrt(run.solved[k].x) + std::sqrt(run.solved[k + 1].x);
      run.node_time.push_back(run.node_time.back() +
                              2.0 * (run.solved[k + 1].offset_mm - run.solved[k].offset_mm) / v);
    }
  }

  void RememberSpeeds(PlannedRun& run, std::size_t i) {
    run.solved = run.nodes;
    SolveSpeedProfile(run.solved, model_.bounds, 0.0, FlowsOn(i) ? 1e9 : 0.0);
    LevelTops(run.solved, FirstAverage(), 1.01 * model_.path_acceleration_mm_per_s2);
    run_speed_.resize(elements_.size());
    for (const ProfileNode& node : run.solved) {
      run_speed_[i].push_back(std::sqrt(node.x));
    }
    // A node at standstill takes its neighbours' speed, so that slow-down has something to count from.
    std::vector<double>& v = run_speed_[i];
    v.front() = std::max(v.front(), v[1]);
    v.back() = std::max(v.back(), v[v.size() - 2]);
  }

  // The end of a cut is left at the speed that brings the next pierce soonest; once chosen it is kept.
  void ChooseEndSpeed(std::size_t i) {
    const PathElement& run = elements_[i];
    const Vector2d tangent = PointOn(run.pieces.back(), run.pieces.back().length_mm).tangent;
    const double fastest = planned_[i].run.end_speed_mm_per_s;
    const double a = model_.path_acceleration_mm_per_s2;
    double best = 1e300, best_speed = 0.0;
    bool found = false;
    for (const double share : {1.0, 0.6, 0.3, 0.0}) {
      const double v = share * fastest;
      const auto move =
          PlanIdleMove(model_, run.to_mm, v * tangent, elements_[i + 1].to_mm, planned_[i + 1].idle_slow);
      if (!move) {
        continue;
      }
      const double cost = move->duration_s + (v > 0.0 ? 0.0 : FirstAverage()) +
                          (fastest > 0.0 ? (fastest - v) * (fastest - v) / (2.0 * a * fastest) : 0.0);
      if (cost < best) {
        best = cost;
        best_speed = v;
        planned_[i + 1].idle = *move;
        found = true;
      }
    }
    if (!found) {
      IdleOutOfReach(i + 1);
      return;
    }
    if (best_speed < fastest) {
      SolveProfile(planned_[i].run, best_speed);
      SolveIdle(i + 1, planned_[i].run.end_speed_mm_per_s * tangent);
    }
  }

  void SolveIdle(std::size_t i, const Vector2d& velocity) {
    const auto move =
        PlanIdleMove(model_, elements_[i].from_mm, velocity, elements_[i].to_mm, planned_[i].idle_slow);
    if (move) {
      planned_[i].idle = *move;
    } else {
      IdleOutOfReach(i);
    }
  }

  void IdleOutOfReach(std::size_t i) {
    const PathElement& e = elements_[i];
    for (int k = 0; k <= 200; ++k) {
      const Vector2d p = e.from_mm + (e.to_mm - e.from_mm) * (k / 200.0);
      if (model_.sheet.Position(p).reason != kinematics::Reason::kSolved) {
        plan_.faults.push_back(ReachFault(model_.sheet, p, e.line));
        return;
      }
    }
    plan_.faults.push_back(
        {e.line, 0, "IDLE_MOVE_OUT_OF_REACH", "", "no idle move stays within the machine's reach"});
  }

  // ---- sampling ----

  void SampleTime() {
    const int reach = model_.filter.reach();
    pad_ = static_cast<std::size_t>(reach) + 4;
    const auto count = static_cast<std::size_t>(std::ceil(input_duration_ / knot_ - 1e-9)) + 1;
    const int per_segment = model_.options.knots_per_segment;
    const auto settle =
        model_.damping_time_s > 0.0
            ? static_cast<std::size_t>(std::ceil(kSettleTimes * model_.damping_time_s / knot_))
            : 0;
    first_ = pad_ - static_cast<std::size_t>(reach) - 1;
    std::size_t knots = count + 2 * static_cast<std::size_t>(reach) + 2 + settle;
    segment_count_ = elements_.empty() ? 1
                                       : (knots + static_cast<std::size_t>(per_segment) - 1) /
                                             static_cast<std::size_t>(per_segment);
    knots = segment_count_ * static_cast<std::size_t>(per_segment);
    samples_.clear();
    samples_.reserve(first_ + knots + 8);
    const Vector2d start = elements_.empty() ? at_ : elements_.front().from_mm;
    samples_.assign(pad_, PathSample(start.x(), start.y(), begin_s_));
    AppendMotion();
    samples_.resize(first_ + knots + 4, samples_.back());
  }

  void AppendMotion() {
    double s_mm = begin_s_;
    std::size_t k = 0;  // knot in input time
    Vector2d last = samples_.back().head<2>();
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      PlannedElement& e = planned_[i];
      e.begin_s_mm = s_mm;
      const double end = i + 1 < elements_.size() ? planned_[i + 1].begin_time_s : e.end_time_s;
      if (elements_[i].kind == ElementKind::kRun) {
        SampleRun(i, end, k);
        s_mm = e.begin_s_mm + elements_[i].length_mm();
        last = elements_[i].to_mm;
      } else {
        s_mm = SampleIdle(i, end, k, last, s_mm);
        last = elements_[i].to_mm;
      }
      e.length_mm = s_mm - e.begin_s_mm;
    }
    samples_.push_back(PathSample(last.x(), last.y(), s_mm));
    plan_.end_s_mm = elements_.empty() ? begin_s_ : s_mm;
  }

  void SampleRun(std::size_t i, double end, std::size_t& k) {
    const PlannedElement& e = planned_[i];
    const std::vector<PathPiece>& pieces = elements_[i].pieces;
    std::size_t cell = 0, piece = 0;
    const double total = elements_[i].length_mm();
    for (; static_cast<double>(k) * knot_ < end; ++k) {
      const double t = static_cast<double>(k) * knot_ - e.begin_time_s;
      double offset = total;
      if (t < e.run.node_time.back()) {
        while (cell + 2 < e.run.node_time.size() && e.run.node_time[cell + 1] <= t) {
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
    const double dt = t - run.node_time[cell];
    return std::clamp(a.offset_mm + dt * (std::sqrt(a.x) + 0.5 * u * dt), a.offset_mm, b.offset_mm);
  }

  // Path length along an idle move is measured along its chords; the last one is closed by the next element.
  double SampleIdle(std::size_t i, double end, std::size_t& k, Vector2d last, double s_mm) {
    const PlannedElement& e = planned_[i];
    for (; static_cast<double>(k) * knot_ < end; ++k) {
      const double t = static_cast<double>(k) * knot_ - e.begin_time_s;
      const Vector2d p = IdlePosition(e.idle, elements_[i].from_mm, elements_[i].to_mm, t);
      s_mm += (p - last).norm();
      last = p;
      samples_.push_back(PathSample(p.x(), p.y(), s_mm));
    }
    return s_mm + (elements_[i].to_mm - last).norm();
  }

  // ---- inverse kinematics ----

  // Effector lead on the sheet's side: T y' + y = (m/k) r''. Between knots r'' is a cubic, so the answer is a cubic plus a
  // decaying exponential.
  class Lead {
   public:
    Lead(double elastic_lag_s2, double damping_time_s, double knot_s)
        : lag_(elastic_lag_s2),
          T_(damping_time_s),
          knot_s_(knot_s),
          decay_(T_ > 0.0 ? std::exp(-knot_s / T_) : 0.0) {}

    void Advance(const KnotState& from, const KnotState& to) {
      const Vector2d fifth = (to.fourth - from.fourth).head<2>() / knot_s_;
      if (T_ > kSmallestDamping_s) {
        y_ = Particular(to, fifth) + decay_ * (y_ - Particular(from, fifth));
      } else {
        y_ = lag_ * to.second.head<2>();
      }
    }

    kinematics::Motion At(const KnotState& k) const {
      if (T_ <= kSmallestDamping_s) {
        return {y_, lag_ * k.third.head<2>(), lag_ * k.fourth.head<2>()};
      }
      const Vector2d first = (lag_ * k.second.head<2>() - y_) / T_;
      return {y_, first, (lag_ * k.third.head<2>() - first) / T_};
    }

   private:
    Vector2d Particular(const KnotState& k, const Vector2d& fifth) const {
      return lag_ * (k.second.head<2>() - T_ * (k.third.head<2>() - T_ * (k.fourth.head<2>() - T_ * fifth)));
    }

    double lag_, T_, knot_s_, decay_;
    Vector2d y_ = Vector2d::Zero();
  };

  void MakeSegments() {
    plan_.segments.clear();
    const auto per_segment = static_cast<std::size_t>(model_.options.knots_per_segment);
    const double duration = knot_ * static_cast<double>(per_segment);
    plan_.segments.reserve(segment_count_);
    played_.clear();
    played_.reserve(segment_count_);
    Lead lead(model_.elastic_lag_s2, model_.damping_time_s, knot_);
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
      Segment segment;
      segment.start_s = duration * static_cast<double>(n);
      segment.duration_s = duration;
      for (std::size_t a = 0; a < 2; ++a) {
        segment.q_mm[a] = Hermite(from.q[a], to.q[a], duration);
        segment.lead_mm[a] = Hermite(from.lead[a], to.lead[a], duration);
      }
      segment.s_mm = Hermite(EndOf(state_from, 2), EndOf(state, 2), duration);
      plan_.segments.push_back(segment);
      played_.push_back({Hermite(EndOf(state_from, 0), EndOf(state, 0), duration),
                         Hermite(EndOf(state_from, 1), EndOf(state, 1), duration)});
      from = to;
      state_from = state;
    }
    plan_.duration_s = duration * static_cast<double>(segment_count_);
  }

  KnotActuators ActuatorsAt(const KnotState& k, const kinematics::Motion& lead) {
    const kinematics::Motion rigid{k.r.head<2>(), k.first.head<2>(), k.second.head<2>()};
    const kinematics::MotionAnswer q = model_.sheet.Actuators(rigid);
    KnotActuators at;
    if (q.reason != kinematics::Reason::kSolved || !q.differentiable) {
      plan_.faults.push_back(ReachFault(model_.sheet, rigid.position_mm, LineAt(k.r.z())));
      return at;
    }
    Fill(q.motion, at.q);
    if (model_.elastic_lag_s2 > 0.0) {
      const kinematics::MotionAnswer bent = model_.sheet.Actuators(
          {rigid.position_mm + lead.position_mm, rigid.velocity_mm_per_s + lead.velocity_mm_per_s,
           rigid.acceleration_mm_per_s2 + lead.acceleration_mm_per_s2});
      if (bent.reason != kinematics::Reason::kSolved || !bent.differentiable) {
        plan_.faults.push_back(
            ReachFault(model_.sheet, rigid.position_mm + lead.position_mm, LineAt(k.r.z())));
        return at;
      }
      Fill({bent.motion.position_mm - q.motion.position_mm,
            bent.motion.velocity_mm_per_s - q.motion.velocity_mm_per_s,
            bent.motion.acceleration_mm_per_s2 - q.motion.acceleration_mm_per_s2},
           at.lead);
    }
    return at;
  }

  static void Fill(const kinematics::Motion& m, std::array<End, 2>& ends) {
    for (int j = 0; j < 2; ++j) {
      ends[static_cast<std::size_t>(j)] = {m.position_mm[j], m.velocity_mm_per_s[j],
                                           m.acceleration_mm_per_s2[j]};
    }
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
  };

  // True if something was exceeded and has been slowed.
  bool SlowWhereExceeded() {
    plan_.contour_deviation_mm = 0.0;
    const auto per_segment = static_cast<std::size_t>(model_.options.knots_per_segment);
    run_at_ = piece_at_ = 0;
    pending_slow_.clear();
    FindCorners();
    const double duration = knot_ * static_cast<double>(per_segment);
    for (std::size_t n = 0; n < segment_count_; ++n) {
      const double begin =
          (static_cast<double>(n * per_segment + first_) - static_cast<double>(pad_)) * knot_;
      Excess excess = SegmentExcess(n);
      for (int k = 0; k < kContourChecks; ++k) {
        const double from = duration * k / kContourChecks, to = duration * (k + 1) / kContourChecks;
        const double s = plan_.segments[n].s_mm.value(from);
        const Vector2d p = played_[n].value(from);
        ContourExcess(p, s, excess);
        NearCorners(s, p, played_[n].value(to), begin + from);
      }
      if (excess.slow < 1.0) {
        pending_slow_.push_back({begin, begin + duration, excess});
      }
    }
    MissedCorners();
    ApplySlow();
    return !pending_slow_.empty();
  }

  // ---- corners that the plan must come near to, also where it turns back on itself ----

  struct Corner {
    Vector2d p_mm;
    double s_mm;
    double last_s_mm;  // where it may still be met: an idle move that happens to come by is no cut
    double tolerance_mm;
    double nearest_mm = 1e9;
    double time_s = 0.0;
  };

  void FindCorners() {
    corners_.clear();
    corner_at_ = 0;
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      const std::vector<PathPiece>& pieces = elements_[i].pieces;
      const double end_s_mm = planned_[i].begin_s_mm + planned_[i].length_mm;
      for (std::size_t k = 1; k < pieces.size(); ++k) {
        const Vector2d u = PointOn(pieces[k - 1], pieces[k - 1].length_mm).tangent;
        const PathPoint here = PointOn(pieces[k], 0.0);
        if (u.dot(here.tangent) < kCornerCosine) {
          const double s_mm = planned_[i].begin_s_mm + pieces[k].begin_mm;
          corners_.push_back(
              {here.p_mm, s_mm, std::min(s_mm + kCornerLook_mm, end_s_mm), pieces[k].tolerance_mm});
        }
      }
      if (!pieces.empty() && FlowsOn(i)) {  // the end of a cut that is left at speed
        corners_.push_back(
            {elements_[i].to_mm, end_s_mm, end_s_mm + kCornerLook_mm, pieces.back().tolerance_mm});
      }
    }
  }

  void NearCorners(double s, const Vector2d& a, const Vector2d& b, double time_s) {
    while (corner_at_ < corners_.size() && corners_[corner_at_].s_mm < s - kCornerLook_mm) {
      ++corner_at_;
    }
    const Vector2d d = b - a;
    for (std::size_t i = corner_at_; i < corners_.size() && corners_[i].s_mm <= s + kCornerLook_mm; ++i) {
      if (s > corners_[i].last_s_mm) {
        continue;
      }
      const Vector2d r = corners_[i].p_mm - a;
      const double share = d.squaredNorm() > 0.0 ? std::clamp(r.dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
      const double distance = (r - share * d).norm();
      if (distance < corners_[i].nearest_mm) {
        corners_[i].nearest_mm = distance;
        corners_[i].time_s = time_s;
      }
    }
  }

  void MissedCorners() {
    for (const Corner& corner : corners_) {
      plan_.contour_deviation_mm = std::max(plan_.contour_deviation_mm, corner.nearest_mm);
      Excess excess;
      Judge(corner.nearest_mm / (kToleranceShare * corner.tolerance_mm), 0.5, FeedLimit::kCorner, excess);
      if (excess.slow < 1.0) {
        pending_slow_.push_back({corner.time_s, corner.time_s, excess});
      }
    }
    std::sort(pending_slow_.begin(), pending_slow_.end(),
              [](const PendingSlow& a, const PendingSlow& b) { return a.begin_time_s < b.begin_time_s; });
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
      const Largest largest(p, segment.duration_s);
      Judge(largest.first / limit.velocity_mm_per_s, 1.0,
            a == 0 ? FeedLimit::kActuator1Velocity : FeedLimit::kActuator2Velocity, excess);
      Judge(largest.second / limit.acceleration_mm_per_s2, 0.5,
            a == 0 ? FeedLimit::kActuator1Acceleration : FeedLimit::kActuator2Acceleration, excess);
      Judge(largest.third / limit.jerk_mm_per_s3, 1.0 / 3.0, FeedLimit::kActuatorJerk, excess);
    }
    const PathLimits& path = model_.machine.path;
    const Largest largest(played_[n], segment.duration_s);
    Judge(kPlayedMargin * largest.second / path.acceleration_mm_per_s2, 0.5, FeedLimit::kPathAcceleration,
          excess);
    Judge(kPlayedMargin * largest.third / path.jerk_mm_per_s3, 1.0 / 3.0, FeedLimit::kPathJerk, excess);
    return excess;
  }

  static void Judge(double ratio, double power, FeedLimit reason, Excess& excess) {
    if (ratio > kAllowed) {
      excess.Take(std::max(kStrongestSlowDown, kCure * std::pow(ratio, -power)), reason);
    }
  }

  void ContourExcess(const Vector2d& p, double s, Excess& excess) {
    double tolerance;
    const double deviation = Deviation(p, s, kToleranceShare, tolerance);
    if (deviation >= 0.0) {
      plan_.contour_deviation_mm = std::max(plan_.contour_deviation_mm, deviation);
      Judge(deviation / (kToleranceShare * tolerance), 0.6, FeedLimit::kContourTolerance, excess);
    }
  }

  // Moves on to the run and piece at s; false outside of runs.
  bool MoveTo(double s) {
    while (run_at_ < elements_.size() && (elements_[run_at_].kind != ElementKind::kRun ||
                                          planned_[run_at_].begin_s_mm + planned_[run_at_].length_mm < s)) {
      ++run_at_;
      piece_at_ = 0;
    }
    if (run_at_ == elements_.size() || planned_[run_at_].begin_s_mm > s) {
      return false;
    }
    const std::vector<PathPiece>& pieces = elements_[run_at_].pieces;
    while (piece_at_ + 1 < pieces.size() &&
           pieces[piece_at_ + 1].begin_mm <= s - planned_[run_at_].begin_s_mm) {
      ++piece_at_;
    }
    return true;
  }

  // Distance of the planned point from the programmed contour; negative outside of runs. It may be taken too large where it
  // is below `exact_from` of the tolerance and of the largest so far.
  double Deviation(const Vector2d& p, double s, double exact_from, double& tolerance) {
    if (!MoveTo(s)) {
      return -1.0;
    }
    const std::vector<PathPiece>& pieces = elements_[run_at_].pieces;
    const double offset = s - planned_[run_at_].begin_s_mm;
    tolerance = pieces[piece_at_].tolerance_mm;
    double distance = DistanceTo(pieces[piece_at_], p);
    // Neighbours only where the answer could matter.
    if (distance > std::min(std::max(plan_.contour_deviation_mm, 0.02 * tolerance), exact_from * tolerance)) {
      constexpr double kLook_mm = 1.0;
      for (std::size_t i = piece_at_;
           i-- > 0 && offset - (pieces[i].begin_mm + pieces[i].length_mm) < kLook_mm;) {
        distance = std::min(distance, DistanceTo(pieces[i], p));
      }
      for (std::size_t i = piece_at_ + 1; i < pieces.size() && pieces[i].begin_mm - offset < kLook_mm; ++i) {
        distance = std::min(distance, DistanceTo(pieces[i], p));
      }
    }
    return distance;
  }

  struct PendingSlow {
    double begin_time_s;
    double end_time_s;
    Excess excess;
  };

  void ApplySlow() {
    // Wider from pass to pass, so that slowing one place does not push the excess to the next for ever.
    const double half = widening_ * model_.filter.half_support_s();
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      PlannedElement& e = planned_[i];
      if (elements_[i].kind == ElementKind::kIdle) {
        SlowIdle(e, half);
      } else {
        SlowRun(e, half);
      }
    }
    for (const PendingSlow& p : pending_slow_) {
      exceeded_line_ = LineAtTime(0.5 * (p.begin_time_s + p.end_time_s));
    }
  }

  void SlowIdle(PlannedElement& e, double half) {
    double factor = 1.0;
    for (const PendingSlow& p : pending_slow_) {
      if (p.begin_time_s - half < e.end_time_s && p.end_time_s + half > e.begin_time_s) {
        factor = std::min(factor, p.excess.slow);
      }
    }
    e.idle_slow *= factor;
  }

  // A node is slowed if its time lies within the filter's reach of the excess.
  void SlowRun(PlannedElement& e, double half) {
    std::size_t first = 0;
    for (std::size_t k = 0; k < e.run.slow.size(); ++k) {
      const double t = e.begin_time_s + e.run.node_time[k];
      const double before = k > 0 ? e.begin_time_s + e.run.node_time[k - 1] : t;
      const double after = k + 1 < e.run.slow.size() ? e.begin_time_s + e.run.node_time[k + 1] : t;
      while (first < pending_slow_.size() && pending_slow_[first].end_time_s + half < before) {
        ++first;
      }
      Excess worst;
      for (std::size_t i = first; i < pending_slow_.size() && pending_slow_[i].begin_time_s - half <= after;
           ++i) {
        worst.Take(pending_slow_[i].excess.slow, pending_slow_[i].excess.reason);
      }
      if (worst.slow < 1.0) {
        e.run.slow[k] *= worst.slow;
        // Too much acceleration is cured by less speed at the kink and a little less braking before it.
        const double least =
            worst.reason == FeedLimit::kPathAcceleration ? std::min(kLeastEase, e.run.ease[k]) : 0.0;
        e.run.ease[k] = std::max(least, e.run.ease[k] * worst.slow);
        e.run.slow_reason[k] = worst.reason;
      }
    }
  }

  // ---- reporting ----

  std::uint32_t LineAtTime(double time_s) const {
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      if (time_s < planned_[i].end_time_s || i + 1 == elements_.size()) {
        if (elements_[i].kind != ElementKind::kRun) {
          return elements_[i].line;
        }
        const PlannedRun& run = planned_[i].run;
        std::size_t k = 0;
        while (k + 1 < run.node_time.size() && run.node_time[k + 1] + planned_[i].begin_time_s < time_s) {
          ++k;
        }
        return PieceLine(i, run.nodes[k].offset_mm);
      }
    }
    return 0;
  }

  std::uint32_t LineAt(double s_mm) const {
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      if (s_mm <= planned_[i].begin_s_mm + planned_[i].length_mm || i + 1 == elements_.size()) {
        return elements_[i].kind == ElementKind::kRun ? PieceLine(i, s_mm - planned_[i].begin_s_mm)
                                                      : elements_[i].line;
      }
    }
    return 0;
  }

  std::uint32_t PieceLine(std::size_t i, double offset) const {
    const std::vector<PathPiece>& pieces = elements_[i].pieces;
    const auto after = std::upper_bound(pieces.begin(), pieces.end(), offset,
                                        [](double o, const PathPiece& p) { return o < p.begin_mm; });
    return after == pieces.begin() ? pieces.front().line : std::prev(after)->line;
  }

  void Report() {
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      plan_.places.push_back({planned_[i].begin_s_mm, planned_[i].begin_s_mm + planned_[i].length_mm});
      if (elements_[i].kind == ElementKind::kIdle) {
        const IdleMove& m = planned_[i].idle;
        plan_.idle.push_back({elements_[i].line, m.name, m.reason, m.duration_s, m.start_speed_mm_per_s,
                              m.peak_acceleration_mm_per_s2});
      }
    }
    ReportBinding();
    ReportSamples();
  }

  // Moments a check apart: what slows the cut where it is slow, on the final polynomials.
  void ReportBinding() {
    const double apart_s = knot_ * model_.options.knots_per_segment / kContourChecks;
    BindingReport report(static_cast<std::size_t>(model_.filter.half_support_s() / apart_s), plan_.slow);
    run_at_ = piece_at_ = node_at_ = corner_at_ = 0;
    bool open = false;
    for (std::size_t n = 0; n < segment_count_; ++n) {
      for (int k = 0; k < kContourChecks; ++k) {
        const double t = apart_s * k;
        const Polynomial& s_mm = plan_.segments[n].s_mm;
        const double s = s_mm.value(t), speed = std::max(0.0, s_mm.first(t));
        const std::size_t run = run_at_;
        const bool in_run = MoveTo(s);
        if (open && (!in_run || run != run_at_ || speed >= kFeedHeld * Piece().feed_mm_per_s)) {
          report.Close(in_run && run == run_at_ ? s : planned_[run].begin_s_mm + planned_[run].length_mm);
          open = false;
        }
        if (in_run && speed < kFeedHeld * Piece().feed_mm_per_s) {
          report.Take(MomentAt(n, t, s, speed));
          open = true;
        }
      }
    }
    if (open) {
      report.Close(planned_[run_at_].begin_s_mm + planned_[run_at_].length_mm);
    }
    SumBinding();
  }

  const PathPiece& Piece() const { return elements_[run_at_].pieces[piece_at_]; }

  FeedMoment MomentAt(std::size_t n, double t, double s, double speed) {
    const Segment& segment = plan_.segments[n];
    FeedMoment m{s, speed, Piece().feed_mm_per_s, Piece().line, FeedLimit::kFeed, 0.0};
    for (std::size_t a = 0; a < 2; ++a) {
      const ActuatorLimits& limit = model_.machine.actuators[a];
      const Polynomial &q = segment.q_mm[a], &lead = segment.lead_mm[a];
      m.Offer(ActuatorVelocityLimit(a), std::abs(q.first(t) + lead.first(t)) / limit.velocity_mm_per_s);
      m.Offer(ActuatorAccelerationLimit(a),
              std::abs(q.second(t) + lead.second(t)) / limit.acceleration_mm_per_s2);
      m.Offer(FeedLimit::kActuatorJerk, std::abs(q.third(t) + lead.third(t)) / limit.jerk_mm_per_s3);
    }
    const PathLimits& path = model_.machine.path;
    const Vector2d a = played_[n].second(t), v = played_[n].first(t);
    const double along = v.norm() > 0.0 ? a.dot(v) / v.norm() : a.norm();
    m.Offer(2.0 * along * along < a.squaredNorm() ? FeedLimit::kCurvature : FeedLimit::kPathAcceleration,
            a.norm() / path.acceleration_mm_per_s2);
    m.Offer(FeedLimit::kPathJerk, played_[n].third(t).norm() / path.jerk_mm_per_s3);
    double tolerance_mm = 1.0;
    const double deviation_mm = Deviation(played_[n].value(t), s, kLeastTold, tolerance_mm);
    m.Offer(FeedLimit::kContourTolerance, deviation_mm / tolerance_mm);
    OfferPlaces(n, t, s, m);
    return m;
  }

  // A corner is passed at the moment that is nearest to it; a predicted error binds where its speed is run.
  void OfferPlaces(std::size_t n, double t, double s, FeedMoment& m) {
    const double time_s =
        knot_ *
            (static_cast<double>(n * static_cast<std::size_t>(model_.options.knots_per_segment) + first_) -
             static_cast<double>(pad_)) +
        t;
    for (; corner_at_ < corners_.size() && corners_[corner_at_].time_s <= time_s + 1e-9; ++corner_at_) {
      const Corner& corner = corners_[corner_at_];
      m.Offer(FeedLimit::kCorner, corner.nearest_mm / corner.tolerance_mm);
    }
    if (!model_.options.compensate && !model_.options.pace) {
      return;
    }
    if (node_run_ != run_at_) {
      node_run_ = run_at_;
      node_at_ = 0;
    }
    const std::vector<ProfileNode>& nodes = planned_[run_at_].run.solved;
    const double offset = s - planned_[run_at_].begin_s_mm;
    while (node_at_ + 1 < nodes.size() && nodes[node_at_ + 1].offset_mm <= offset) {
      ++node_at_;
    }
    if (nodes[node_at_].binding == FeedLimit::kPredictedError && nodes[node_at_].x > 0.0) {
      m.Offer(FeedLimit::kPredictedError, std::min(1.0, m.speed_mm_per_s / std::sqrt(nodes[node_at_].x)));
    }
  }

  void SumBinding() {
    std::array<double, kFeedLimitCount> length{};
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      length[0] += elements_[i].kind == ElementKind::kRun ? planned_[i].length_mm : 0.0;
    }
    for (const SlowStretch& slow : plan_.slow) {
      length[static_cast<std::size_t>(slow.limit)] += slow.to_s_mm - slow.from_s_mm;
      length[0] -= slow.to_s_mm - slow.from_s_mm;
    }
    for (std::size_t j = 0; j < kFeedLimitCount; ++j) {
      if (length[j] > 1e-9) {
        plan_.binding.push_back({static_cast<FeedLimit>(j), length[j]});
      }
    }
  }

  void ReportSamples() {
    const auto every = static_cast<std::size_t>(std::max(1.0, std::round(model_.options.sample_s / knot_)));
    std::size_t element = 0;
    const auto per_segment = static_cast<std::size_t>(model_.options.knots_per_segment);
    for (std::size_t n = 0; n <= segment_count_ * per_segment; n += every) {
      const std::size_t i = std::min(n / per_segment, segment_count_ - 1);
      const double t = static_cast<double>(n - i * per_segment) * knot_;
      const Vector2d p = played_[i].value(t), v = played_[i].first(t), a = played_[i].second(t);
      PlanSample sample{static_cast<double>(n) * knot_,
                        plan_.segments[i].s_mm.value(t),
                        p.x(),
                        p.y(),
                        v.x(),
                        v.y(),
                        a.x(),
                        a.y(),
                        false,
                        0};
      while (element + 1 < elements_.size() &&
             planned_[element].begin_s_mm + planned_[element].length_mm < sample.s_mm) {
        ++element;
      }
      if (!elements_.empty()) {
        sample.source_line = elements_[element].kind == ElementKind::kRun
                                 ? PieceLine(element, sample.s_mm - planned_[element].begin_s_mm)
                                 : elements_[element].line;
      }
      plan_.samples.push_back(sample);
    }
  }

  const PlanningModel& model_;
  std::span<const PathElement> elements_;
  Vector2d at_;
  double begin_s_;
  const std::function<bool()>& cancelled_;
  double knot_;
  StretchPlan plan_;
  std::vector<PlannedElement> planned_;
  std::vector<std::vector<double>> run_speed_;
  std::vector<double> base_speed_;
  double input_duration_ = 0.0;
  std::size_t pad_ = 0;
  std::size_t first_ = 0;  // sample of the stretch's first knot
  std::size_t segment_count_ = 0;
  std::vector<PathSample> samples_;
  std::vector<PathSample> control_;
  std::vector<PlayedPath> played_;
  std::vector<PendingSlow> pending_slow_;
  std::vector<Corner> corners_;
  std::size_t corner_at_ = 0;
  std::size_t run_at_ = 0;
  std::size_t piece_at_ = 0;
  std::size_t node_run_ = 0;
  std::size_t node_at_ = 0;
  std::uint32_t exceeded_line_ = 0;
  double widening_ = 1.0;
};

}  // namespace

namespace {

// The lead's third derivative is m/k times the path's fifth: this much of T2 T3 keeps it to a share of the actuators' jerk.
double LeadRamp(const MachineDescription& m) {
  constexpr double kShareOfJerk = 0.5;
  constexpr double kJumpAndLever = 3.0;  // jerk turning from one sign to the other, and the mechanism's lever
  const double jerk = std::min(m.actuators[0].jerk_mm_per_s3, m.actuators[1].jerk_mm_per_s3);
  return kJumpAndLever * m.value(Parameter::kElasticLagS2) * m.path.jerk_mm_per_s3 / (kShareOfJerk * jerk);
}

}  // namespace

PlanningModel::PlanningModel(const MachineDescription& m, const PlanOptions& o)
    : machine(m),
      options(o),
      sheet(m),
      filter(SmoothingFilter::ForLimits(o.knot_s, m.path.acceleration_mm_per_s2, m.path.jerk_mm_per_s3,
                                        o.compensate ? LeadRamp(m) : 0.0)),
      overshoot(filter.overshoot()),
      kink_deviation_s(filter.kink_deviation_s()),
      path_acceleration_mm_per_s2(kPathMargin * m.path.acceleration_mm_per_s2),
      corner(filter, kink_deviation_s, path_acceleration_mm_per_s2, m.path.jerk_mm_per_s3) {
  for (std::size_t j = 0; j < 2; ++j) {
    bounds.velocity_mm_per_s[j] = kActuatorMargin * m.actuators[j].velocity_mm_per_s;
    bounds.acceleration_mm_per_s2[j] = kActuatorMargin * m.actuators[j].acceleration_mm_per_s2;
  }
  if (o.compensate) {
    elastic_lag_s2 = m.value(Parameter::kElasticLagS2);
    damping_time_s = m.value(Parameter::kDampingTimeS);
  }
}

StretchPlan PlanStretch(const PlanningModel& model, std::span<const PathElement> elements,
                        const Vector2d& at_W_mm, double begin_s_mm, const std::function<bool()>& cancelled) {
  return StretchPlanner(model, elements, at_W_mm, begin_s_mm, cancelled).Plan();
}

}  // namespace lambdajet::trajectory
