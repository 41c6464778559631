// Judges of a plan that share nothing with the planner: limits sampled at 10 kHz on what is played, continuity, gates, and the
// Hausdorff distance of contour and plan both ways by a search of their own.
//
// Units: mm, s. Threads: values. Errors: failures of the test at hand.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "foundation/machine/machine_description.hpp"
#include "kinematics/core/lambda_mechanism.hpp"
#include "tests/support/figure.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/part_program/read_program.hpp"

namespace lambdajet::trajectory {

inline constexpr double kRelative = 1e-6;

// LAMBDAJET_RANDOM_PROGRAMS: how many, or FIRST-LAST.
struct Seeds {
  int first = 1;
  int last = 1;
};

inline Seeds WantedSeeds(Seeds seeds) {
  if (const char* wanted = std::getenv("LAMBDAJET_RANDOM_PROGRAMS"); wanted != nullptr) {
    int first = 0, last = 0;
    const int numbers = std::sscanf(wanted, "%d-%d", &first, &last);
    seeds = numbers == 2 ? Seeds{first, last} : Seeds{1, first};
  }
  return seeds;
}

inline Polynomial Sum(const Polynomial& a, const Polynomial& b) {
  Polynomial sum = a;
  for (std::size_t i = 0; i < sum.c.size(); ++i) {
    sum.c[i] += b.c[i];
  }
  return sum;
}

// What the jet does on the sheet while a segment is played: by forward kinematics from the rigid setpoints, whatever the
// planner believes.
class Jet {
 public:
  explicit Jet(const MachineDescription& m)
      : m_(m), mechanism_(kinematics::LambdaMechanism::FromDescription(m)) {}

  kinematics::Motion At(const Segment& s, double t) const {
    const kinematics::Motion effector =
        kinematics::SolveForwardMotion(mechanism_, {{s.q_mm[0].value(t), s.q_mm[1].value(t)},
                                                    {s.q_mm[0].first(t), s.q_mm[1].first(t)},
                                                    {s.q_mm[0].second(t), s.q_mm[1].second(t)}})
            .motion;
    const Eigen::Matrix2d back = -m_.X_EW().rotation().transpose();
    return {back * (effector.position_mm - m_.X_DJ().translation_mm() + m_.X_EW().translation_mm()),
            back * effector.velocity_mm_per_s, back * effector.acceleration_mm_per_s2};
  }

  Eigen::Vector2d Jerk(const Segment& s, double t) const {
    constexpr double kApart_s = 2e-6;
    const double middle = std::clamp(t, kApart_s, s.duration_s - kApart_s);
    return (At(s, middle + kApart_s).acceleration_mm_per_s2 -
            At(s, middle - kApart_s).acceleration_mm_per_s2) /
           (2 * kApart_s);
  }

 private:
  const MachineDescription& m_;
  kinematics::LambdaMechanism mechanism_;
};

// Shares of the limits reached by what is played, sampled at 10 kHz.
struct LimitShares {
  std::array<double, 2> velocity{}, acceleration{}, jerk{};  // actuators
  double path_velocity = 0.0, path_acceleration = 0.0, path_jerk = 0.0;

  void Take(const MachineDescription& m, const Jet& jet, const Segment& s) {
    for (double t = 0.0; t < s.duration_s; t += 1e-4) {
      TakeAt(m, jet, s, t);
    }
  }

  void TakeAt(const MachineDescription& m, const Jet& jet, const Segment& s, double t) {
    for (std::size_t a = 0; a < 2; ++a) {
      const Polynomial q = Sum(s.q_mm[a], s.lead_mm[a]);
      const ActuatorLimits& limit = m.actuators[a];
      velocity[a] = std::max(velocity[a], std::abs(q.first(t)) / limit.velocity_mm_per_s);
      acceleration[a] = std::max(acceleration[a], std::abs(q.second(t)) / limit.acceleration_mm_per_s2);
      jerk[a] = std::max(jerk[a], std::abs(q.third(t)) / limit.jerk_mm_per_s3);
    }
    const kinematics::Motion motion = jet.At(s, t);
    path_velocity = std::max(path_velocity, motion.velocity_mm_per_s.norm() /
                                                std::max(m.path.rapid_mm_per_s, m.path.feed_mm_per_s));
    path_acceleration =
        std::max(path_acceleration, motion.acceleration_mm_per_s2.norm() / m.path.acceleration_mm_per_s2);
    path_jerk = std::max(path_jerk, jet.Jerk(s, t).norm() / m.path.jerk_mm_per_s3);
  }

  double Worst() const {
    return std::max({velocity[0], velocity[1], acceleration[0], acceleration[1], jerk[0], jerk[1],
                     path_velocity, path_acceleration, path_jerk});
  }
};

// The worst of all programs, for the last line.
struct Worst {
  double limits = 0.0;
  double planned_off_share = 0.0;  // Hausdorff, either way, of the tolerance
  double programmed_off_share = 0.0;
};

inline void ExpectLimits(const MachineDescription& m, const Plan& plan, Worst& worst) {
  const Jet jet(m);
  LimitShares shares;
  for (const Segment& s : plan.segments) {
    shares.Take(m, jet, s);
    for (std::size_t a = 0; a < 2; ++a) {
      for (double t = 0.0; t < s.duration_s; t += 1e-3) {
        ASSERT_GE(Sum(s.q_mm[a], s.lead_mm[a]).value(t), m.actuators[a].position_min_mm);
        ASSERT_LE(Sum(s.q_mm[a], s.lead_mm[a]).value(t), m.actuators[a].position_max_mm);
      }
    }
  }
  EXPECT_LE(shares.Worst(), 1.0 + kRelative)
      << shares.velocity[0] << " " << shares.velocity[1] << " " << shares.acceleration[0] << " "
      << shares.acceleration[1] << " " << shares.jerk[0] << " " << shares.jerk[1] << " path "
      << shares.path_velocity << " " << shares.path_acceleration << " " << shares.path_jerk;
  worst.limits = std::max(worst.limits, shares.Worst());
}

inline void ExpectContinuity(const Plan& plan) {
  for (std::size_t i = 1; i < plan.segments.size(); ++i) {
    const Segment& a = plan.segments[i - 1];
    const Segment& b = plan.segments[i];
    const double T = a.duration_s;
    ASSERT_NEAR(a.start_s + T, b.start_s, 1e-9);
    for (std::size_t j = 0; j < 2; ++j) {
      ASSERT_NEAR(a.q_mm[j].value(T), b.q_mm[j].value(0), 1e-9) << i;
      ASSERT_NEAR(a.q_mm[j].first(T), b.q_mm[j].first(0), 1e-7) << i;
      ASSERT_NEAR(a.q_mm[j].second(T), b.q_mm[j].second(0), 1e-4) << i;
      ASSERT_NEAR(a.lead_mm[j].value(T), b.lead_mm[j].value(0), 1e-6) << i;
      ASSERT_NEAR(a.lead_mm[j].first(T), b.lead_mm[j].first(0), 1e-3) << i;
    }
    ASSERT_NEAR(a.s_mm.value(T), b.s_mm.value(0), 1e-9);
    ASSERT_NEAR(a.s_mm.first(T), b.s_mm.first(0), 1e-7);
  }
}

inline void ExpectMonotone(const Plan& plan) {
  double last = plan.segments.front().s_mm.value(0);
  for (const Segment& s : plan.segments) {
    for (int k = 0; k <= 8; ++k) {
      const double here = s.s_mm.value(s.duration_s * k / 8);
      ASSERT_GE(here, last - 1e-6);  // a nanometre: quintics of a motion of higher order, at its very start
      last = std::max(last, here);
    }
  }
  EXPECT_NEAR(plan.segments.back().s_mm.value(plan.segments.back().duration_s), plan.length_mm, 1e-9);
}

inline void ExpectClosedGates(const Plan& plan) {
  std::uint32_t seen = 0;
  for (const Segment& s : plan.segments) {
    if (s.gate_at_end == 0) {
      continue;
    }
    ASSERT_EQ(s.gate_at_end, ++seen);
    const Gate& gate = plan.gates[seen - 1];
    EXPECT_NEAR(s.s_mm.value(s.duration_s), gate.s_mm, 1e-9);
    EXPECT_NEAR(s.s_mm.first(s.duration_s), 0.0, 1e-8);  // metres of path, rounded, over a knot
    for (std::size_t a = 0; a < 2; ++a) {
      EXPECT_NEAR(s.q_mm[a].first(s.duration_s), 0.0, 1e-8);
      EXPECT_NEAR(s.lead_mm[a].value(s.duration_s), 0.0, 1e-6);
    }
  }
  EXPECT_EQ(seen, plan.gates.size());
  for (std::size_t i = 1; i < plan.events.size(); ++i) {
    EXPECT_GE(plan.events[i].s_mm, plan.events[i - 1].s_mm);
  }
}

// A polyline with its path length and what each of its chords may be left by, and how far the nearest of those of about the
// same path length is from a point, in shares of that: a search of its own.
class Polyline {
 public:
  struct Point {
    Eigen::Vector2d p;
    double s;
    double tolerance_mm;  // of the chord that ends here
  };

  void Add(const Eigen::Vector2d& p, double s, double tolerance_mm) {
    points_.push_back({p, s, tolerance_mm});
  }

  double Share(const Eigen::Vector2d& p, double s) const {
    double nearest = 1e9;
    const auto from = std::partition_point(points_.begin(), points_.end(),
                                           [s](const Point& point) { return point.s < s - kWindow_mm; });
    for (auto a = from == points_.begin() ? from : std::prev(from), b = std::next(a);
         b < points_.end() && a->s <= s + kWindow_mm; a = b++) {
      nearest = std::min(nearest, ToChord(p, a->p, b->p) / b->tolerance_mm);
    }
    return nearest;
  }

  const std::vector<Point>& points() const { return points_; }

 private:
  static constexpr double kWindow_mm = 3.0;

  static double ToChord(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const Eigen::Vector2d d = b - a;
    const double share = d.squaredNorm() > 0.0 ? std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
    return (p - a - share * d).norm();
  }

  std::vector<Point> points_;
};

// Each cut, from its pierce to where its jet goes off, as programmed, kerf and all: chords of arcs within ten nanometres,
// or a thousandth of a tighter tolerance.
class ProgrammedCuts {
 public:
  ProgrammedCuts(const MachineDescription& m, const std::string& text, const Plan& plan)
      : plan_(plan), default_mm_(m.path.corner_tolerance_mm), tolerance_mm_(default_mm_) {
    ReadOptions reading;
    reading.compensate_kerf = true;
    reading.gcode.kerf_width_mm = m.process.kerf_width_mm;
    reading.gcode.default_tolerance_mm = default_mm_;
    for (const Operation& o : ReadPartProgram(text, reading).operations) {
      Take(o);
    }
  }
  const std::vector<Polyline>& cuts() const { return cuts_; }

 private:
  static constexpr double kExact_mm = 0.002;  // G61, and between its stops

  void Take(const Operation& o) {
    const Eigen::Vector2d to{o.x_W_mm, o.y_W_mm};
    switch (o.kind) {
      case OperationKind::kPierce:
        while (plan_.gates[gate_].kind != GateKind::kPierce) {
          ++gate_;
        }
        s_ = plan_.gates[gate_++].s_mm;
        cuts_.emplace_back().Add(at_, s_, tolerance_mm_);
        on_ = true;
        return;
      case OperationKind::kJetOff:
        on_ = false;
        return;
      case OperationKind::kPathTolerance:
        tolerance_mm_ = o.value == 0.0 ? std::min(kExact_mm, default_mm_) : o.value;
        return;
      case OperationKind::kFeedLine:
        Line(to);
        break;
      case OperationKind::kFeedArc:
        Arc(to, {o.center_x_W_mm, o.center_y_W_mm}, o.sweep_rad);
        break;
      case OperationKind::kTraverse:
        break;
      default:
        return;
    }
    at_ = to;
  }

  void Line(const Eigen::Vector2d& to) {
    const double length = (to - at_).norm();
    const int pieces = 1 + static_cast<int>(length / 0.1);
    for (int k = 1; on_ && k <= pieces; ++k) {
      cuts_.back().Add(at_ + (to - at_) * k / pieces, s_ + length * k / pieces, tolerance_mm_);
    }
    s_ += length;
  }

  void Arc(const Eigen::Vector2d& to, const Eigen::Vector2d& centre, double sweep_rad) {
    const Eigen::Vector2d arm = at_ - centre;
    const double length = arm.norm() * std::abs(sweep_rad);
    const double sag = std::min(1e-5, 1e-3 * tolerance_mm_);
    const int pieces = 1 + static_cast<int>(length / std::min(0.1, std::sqrt(8 * sag * arm.norm())));
    for (int k = 1; on_ && k <= pieces; ++k) {
      const Eigen::Vector2d here = centre + Eigen::Rotation2D<double>(sweep_rad * k / pieces) * arm;
      cuts_.back().Add(k == pieces ? to : here, s_ + length * k / pieces, tolerance_mm_);
    }
    s_ += length;
  }

  const Plan& plan_;
  std::vector<Polyline> cuts_;
  double default_mm_;
  double tolerance_mm_;
  std::size_t gate_ = 0;
  Eigen::Vector2d at_ = Eigen::Vector2d::Zero();
  double s_ = 0.0;
  bool on_ = false;
};

// Hausdorff distance of what is played and what is programmed, both ways, cut by cut, in shares of the tolerance there.
inline void ExpectContour(const MachineDescription& m, const std::string& text, const PlannedProgram& planned,
                          Worst& worst) {
  constexpr double kNear =
      1e-3;  // of the tolerance: what is played so near to what was looked at is not looked at
  constexpr double kRuler_mm = 3e-6;  // chords of what is played, between two looks
  const Jet jet(m);
  const ProgrammedCuts programmed(m, text, planned.plan);
  ASSERT_FALSE(programmed.cuts().empty());
  double off = 0.0, missed = 0.0, missed_at_s = 0.0;
  std::size_t segment = 0;
  for (const Polyline& cut : programmed.cuts()) {
    const double begin = cut.points().front().s, end = cut.points().back().s;
    Polyline played;
    double tightest_mm = 1e9;
    for (const Polyline::Point& point : cut.points()) {
      tightest_mm = std::min(tightest_mm, point.tolerance_mm);
    }
    const double ruler = kRuler_mm / tightest_mm;
    const double step_s = tightest_mm < 0.01 ? 2.5e-4 : 5e-4;
    for (; segment < planned.plan.segments.size(); ++segment) {
      const Segment& piece = planned.plan.segments[segment];
      if (piece.s_mm.value(piece.duration_s) < begin) {
        continue;
      }
      for (double t = 0.0; t < piece.duration_s; t += step_s) {
        const double s = piece.s_mm.value(t);
        if (s >= begin && s <= end + 1.0) {
          const Eigen::Vector2d p = jet.At(piece, t).position_mm;
          if (t > 0.0 && !played.points().empty() &&
              (p - played.points().back().p).norm() < kNear * tightest_mm) {
            continue;
          }
          played.Add(p, s, 1.0);
          off = s <= end ? std::max(off, cut.Share(p, s) - ruler) : off;
        }
      }
      if (piece.s_mm.value(0.0) > end + 1.0) {
        break;
      }
    }
    for (const Polyline::Point& point : cut.points()) {
      const double share = played.Share(point.p, point.s) / point.tolerance_mm - ruler;
      missed_at_s = share > missed ? point.s : missed_at_s;
      missed = std::max(missed, share);
    }
    segment = segment > 300 ? segment - 300 : 0;  // the next cut may begin within the millimetre behind
  }
  EXPECT_LE(off, 1.0);
  EXPECT_LE(missed, 1.0) << "at " << missed_at_s << " mm";
  worst.planned_off_share = std::max(worst.planned_off_share, off);
  worst.programmed_off_share = std::max(worst.programmed_off_share, missed);
}

// All of them.
inline void ExpectPlanLaws(const MachineDescription& m, const std::string& text,
                           const PlannedProgram& planned, Worst& worst) {
  ExpectLimits(m, planned.plan, worst);
  ExpectContinuity(planned.plan);
  ExpectMonotone(planned.plan);
  ExpectClosedGates(planned.plan);
  ExpectContour(m, text, planned, worst);
}

inline void Tell(const char* what, std::size_t count, bool compensate, const Worst& worst) {
  std::printf(
      "%zu %s programs%s: limits sampled at 10 kHz reach at most %.9f; contour within %.4f of the tolerance, "
      "and missed by at "
      "most %.4f of it\n",
      count, what, compensate ? ", compensated" : "", worst.limits, worst.planned_off_share,
      worst.programmed_off_share);
  const std::string group = std::string(what) + (compensate ? ".compensated_" : ".");
  tests::PrintFigure((group + "programs").c_str(), static_cast<double>(count));
  tests::PrintFigure((group + "limits_exceeded").c_str(), worst.limits - 1.0);
  tests::PrintFigure((group + "contour_share").c_str(),
                     std::max(worst.planned_off_share, worst.programmed_off_share));
}

}  // namespace lambdajet::trajectory
