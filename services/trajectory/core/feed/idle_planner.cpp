#include "trajectory/core/feed/idle_planner.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;

constexpr int kChecks = 40;
constexpr int kGrowthLimit = 60;
constexpr int kBisections = 10;

kinematics::Motion MotionAt(const IdleMove& move, double t) {
  const IdlePoint x = move.laws[0].At(t), y = move.laws[1].At(t);
  return {{x.z, y.z}, {x.first, y.first}, {x.second, y.second}};
}

enum class Verdict { kGood, kTooFast, kOutOfReach };

// `overshoot` of the smoothing on this motion's acceleration: only where the path bends it is above 1.
Verdict CheckMotion(const PlanningModel& model, const kinematics::Motion& motion, double slow,
                    double overshoot) {
  const auto answer = model.sheet.Actuators(motion);
  if (answer.reason != kinematics::Reason::kSolved || !answer.differentiable) {
    return Verdict::kOutOfReach;
  }
  const PathLimits& path = model.machine.path;
  bool good = motion.velocity_mm_per_s.norm() <= slow * path.rapid_mm_per_s * (1.0 + 1e-9) &&
              motion.acceleration_mm_per_s2.norm() * overshoot <=
                  slow * slow * model.path_acceleration_mm_per_s2 * (1.0 + 1e-9);
  for (int j = 0; j < 2; ++j) {
    good = good &&
           std::abs(answer.motion.velocity_mm_per_s[j]) <=
               slow * model.bounds.velocity_mm_per_s[static_cast<std::size_t>(j)] &&
           std::abs(answer.motion.acceleration_mm_per_s2[j]) <=
               slow * slow * model.bounds.acceleration_mm_per_s2[static_cast<std::size_t>(j)];
  }
  return good ? Verdict::kGood : Verdict::kTooFast;
}

Verdict CheckLaws(const PlanningModel& model, const IdleMove& move, double slow) {
  Verdict worst = Verdict::kGood;
  for (int k = 0; k <= kChecks; ++k) {
    const Verdict verdict =
        CheckMotion(model, MotionAt(move, move.duration_s * k / kChecks), slow, model.overshoot);
    worst = std::max(worst, verdict);
  }
  return worst;
}

IdleMove LawsOf(const Vector2d& from, const Vector2d& velocity, const Vector2d& to, double duration) {
  IdleMove move;
  move.straight = false;
  move.duration_s = duration;
  std::array<IdleChoice, 2> choices;
  for (int j = 0; j < 2; ++j) {
    choices[static_cast<std::size_t>(j)] = ChooseIdleLaw({.z_n = from[j],
                                                          .z_k = to[j],
                                                          .v_n = velocity[j],
                                                          .v_k = 0.0,
                                                          .a_n = 0.0,
                                                          .a_k = 0.0,
                                                          .duration = duration});
    move.laws[static_cast<std::size_t>(j)] = choices[static_cast<std::size_t>(j)].law;
  }
  // Named after the coordinate with the higher peak.
  const IdleChoice& named =
      choices[0].law.peak_acceleration >= choices[1].law.peak_acceleration ? choices[0] : choices[1];
  move.name = IdleKindName(named.law.kind);
  move.reason = named.reason;
  move.peak_acceleration_mm_per_s2 =
      std::hypot(choices[0].law.peak_acceleration, choices[1].law.peak_acceleration);
  return move;
}

// Shortest duration whose law keeps the limits; the limits are met for every longer one until the path leaves the reach.
std::optional<IdleMove> FromSpeed(const PlanningModel& model, const Vector2d& from, const Vector2d& velocity,
                                  const Vector2d& to, double slow) {
  const double a = slow * slow * model.path_acceleration_mm_per_s2;
  double duration =
      std::max({(to - from).norm() / (slow * model.machine.path.rapid_mm_per_s), velocity.norm() / a, 0.02});
  double too_short = 0.0;
  for (int i = 0;; ++i) {
    const Verdict verdict = CheckLaws(model, LawsOf(from, velocity, to, duration), slow);
    if (verdict == Verdict::kGood) {
      break;
    }
    if (i == kGrowthLimit) {
      return std::nullopt;
    }
    too_short = duration;
    duration *= 1.15;
  }
  for (int i = 0; i < kBisections && too_short > 0.0; ++i) {
    const double middle = 0.5 * (too_short + duration);
    (CheckLaws(model, LawsOf(from, velocity, to, middle), slow) == Verdict::kGood ? duration : too_short) =
        middle;
  }
  IdleMove move = LawsOf(from, velocity, to, duration);
  move.start_speed_mm_per_s = velocity.norm();
  return move;
}

// Cruises for at least `cruise_s`, the smoothing's first average, so that acceleration never turns within it.
IdleMove TrapezoidOf(double length, double speed, double acceleration, double cruise_s) {
  IdleMove move;
  const double rise = acceleration * cruise_s;
  move.speed_mm_per_s = std::min(speed, 0.5 * (std::sqrt(rise * rise + 4.0 * acceleration * length) - rise));
  move.ramp_s = move.speed_mm_per_s / acceleration;
  move.duration_s = move.ramp_s + length / move.speed_mm_per_s;
  move.name = "TRAPEZOID";
  move.reason = "from standstill the straight line with constant acceleration is the quickest";
  move.peak_acceleration_mm_per_s2 = acceleration;
  return move;
}

Verdict CheckStraight(const PlanningModel& model, const Vector2d& from, const Vector2d& to, double speed,
                      double acceleration, double slow) {
  const Vector2d u = (to - from).normalized();
  const double length = (to - from).norm();
  Verdict worst = Verdict::kGood;
  for (int k = 0; k <= kChecks; ++k) {
    const double s = length * k / kChecks;
    const double v = std::min(speed, std::sqrt(2.0 * acceleration * std::min(s, length - s)));
    for (const double sign : {-1.0, 1.0}) {
      worst = std::max(worst, CheckMotion(model, {from + s * u, v * u, sign * acceleration * u}, slow, 1.0));
    }
  }
  return worst;
}

std::optional<IdleMove> FromRest(const PlanningModel& model, const Vector2d& from, const Vector2d& to,
                                 double slow) {
  double speed = slow * model.machine.path.rapid_mm_per_s;
  double acceleration = slow * slow * model.path_acceleration_mm_per_s2;
  for (int i = 0; i < kGrowthLimit; ++i) {
    const Verdict verdict = CheckStraight(model, from, to, speed, acceleration, slow);
    if (verdict == Verdict::kOutOfReach) {
      return std::nullopt;
    }
    if (verdict == Verdict::kGood) {
      return TrapezoidOf((to - from).norm(), speed, acceleration, model.filter.first_s);
    }
    speed *= 0.95;
    acceleration *= 0.95 * 0.95;
  }
  return std::nullopt;
}

}  // namespace

std::optional<IdleMove> PlanIdleMove(const PlanningModel& model, const Vector2d& from_mm,
                                     const Vector2d& velocity_mm_per_s, const Vector2d& to_mm, double slow) {
  return velocity_mm_per_s.norm() > 0.0 ? FromSpeed(model, from_mm, velocity_mm_per_s, to_mm, slow)
                                        : FromRest(model, from_mm, to_mm, slow);
}

Vector2d IdlePosition(const IdleMove& move, const Vector2d& from_mm, const Vector2d& to_mm, double t) {
  if (!move.straight) {
    return MotionAt(move, std::clamp(t, 0.0, move.duration_s)).position_mm;
  }
  const double length = (to_mm - from_mm).norm();
  const double v = move.speed_mm_per_s;
  const double left = std::max(0.0, move.duration_s - t);
  double s;
  if (t <= move.ramp_s) {
    s = 0.5 * v * t * t / move.ramp_s;
  } else if (left <= move.ramp_s) {
    s = length - 0.5 * v * left * left / move.ramp_s;
  } else {
    s = v * (t - 0.5 * move.ramp_s);
  }
  return from_mm + (s / length) * (to_mm - from_mm);
}

}  // namespace lambdajet::trajectory
