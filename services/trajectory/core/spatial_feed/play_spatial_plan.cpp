#include "trajectory/core/spatial_feed/play_spatial_plan.hpp"

#include <algorithm>
#include <cmath>

#include "trajectory/core/spatial_feed/programmed_blocks.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kWindow_mm = 2.0;
constexpr double kLongestSettling_s = 5.0;

void Keep(WorstPlace& worst, double value, double tau_s, std::uint32_t line) {
  if (value > worst.value) {
    worst = {value, tau_s, line};
  }
}

// Six drives that follow readings: v' = (v_set - v) / lag, v_set = dq/dt + gain (q - x).
class Drives {
 public:
  Drives(const SpatialPlayOptions& options, const StrutVector& at) : options_(options), x_(at) {}

  void Step(const StrutState& wanted) {
    const StrutVector set = wanted.first + options_.drive_gain_per_s * (wanted.q_mm - x_);
    const double share = -std::expm1(-options_.cycle_s / options_.drive_lag_s);
    const StrutVector before = v_;
    v_ += share * (set - v_);
    x_ += 0.5 * options_.cycle_s * (before + v_);
  }
  const StrutVector& x() const { return x_; }

 private:
  const SpatialPlayOptions& options_;
  StrutVector x_;
  StrutVector v_ = StrutVector::Zero();
};

class Player {
 public:
  Player(const PlannedSpatialProgram& planned, const std::vector<Operation>& programmed,
         const HexapodModel& hexapod, const SpatialPlayOptions& options)
      : plan_(planned.plan),
        motion_(hexapod.motion),
        options_(options),
        machine_(hexapod.geometry, hexapod.motion.X_MT_zero),
        blocks_(programmed, hexapod.motion, planned.plan.turn_radius_mm),
        nearest_mm_(blocks_.blocks().size(), 1e9),
        drives_(options, StrutsAt(planned.plan, 0.0).q_mm) {
    const SpatialPlanSample& start = planned.samples.front();
    X_MP_ = X_MP_drives_ = machine_.PlatformAt(start.p_W_mm, start.q_W);
    report_.predicted_s = planned.plan.duration_s + planned.gate_time_s;
  }

  SpatialPlayReport Play() {
    double begin_s = 0.0;  // of the first cycle within the segment, in its own time
    for (const SpatialSegment& segment : plan_.segments) {
      double t = begin_s;
      for (; t < segment.duration_s; t += options_.cycle_s) {
        Cycle(segment, t);
      }
      begin_s = t - segment.duration_s;
      if (segment.gate_at_end != 0) {
        StandAt(segment);
        begin_s = 0.0;
      }
    }
    Settle(plan_.segments.back());
    for (std::size_t i = 0; i < nearest_mm_.size(); ++i) {
      Keep(report_.missed_end_mm, nearest_mm_[i], 0.0, blocks_.blocks()[i].line);
    }
    report_.played_s = static_cast<double>(cycles_in_all_) * options_.cycle_s;
    return std::move(report_);
  }

 private:
  void Cycle(const SpatialSegment& segment, double t) {
    StrutState struts;
    StrutVector third;
    for (int j = 0; j < kStrutCount; ++j) {
      const Polynomial& q = segment.q_mm[static_cast<std::size_t>(j)];
      struts.q_mm[j] = q.value(t), struts.first[j] = q.first(t), struts.second[j] = q.second(t);
      third[j] = q.third(t);
    }
    const double tau_s = segment.start_s + t, s_mm = segment.s_mm.value(t);
    ++report_.cycles;
    ++cycles_in_all_;
    drives_.Step(struts);
    const BlockDistance d = ToolError(struts, s_mm, tau_s);
    Limits(struts, third, tau_s, d.line);
    const double drives_error_mm = DrivesError(s_mm, tau_s);
    Keep(report_.following_mm, (drives_.x() - struts.q_mm).cwiseAbs().maxCoeff(), tau_s, d.line);
    since_.tip_error_mm = std::max(since_.tip_error_mm, d.tip_mm);
    since_.turn_error_rad = std::max(since_.turn_error_rad, d.turn_rad);
    since_.drives_tip_error_mm = std::max(since_.drives_tip_error_mm, drives_error_mm);
    if (tau_s >= since_.tau_s + options_.trace_s) {
      since_.tau_s = tau_s;
      report_.trace.push_back(since_);
      since_ = {tau_s};
      if (options_.watch) {
        options_.watch(tau_s / plan_.duration_s);
      }
    }
  }

  BlockDistance ToolError(const StrutState& struts, double s_mm, double tau_s) {
    const kinematics::HexapodForward forward =
        kinematics::SolveForward(machine_.hexapod(), struts.q_mm, X_MP_);
    if (forward.reason != kinematics::Reason::kSolved) {
      ++report_.unsolved;
      return {};
    }
    X_MP_ = forward.X_MP;
    const Pose tool = machine_.ToolAt(X_MP_);
    const BlockDistance d = blocks_.From(tool.p_mm, Quaterniond(tool.R), s_mm, kWindow_mm);
    Keep(report_.tip_error_mm, d.tip_mm, tau_s, d.line);
    Keep(report_.turn_error_rad, d.turn_rad, tau_s, d.line);
    Keep(report_.tolerance_share, d.share, tau_s, d.line);
    PassEnds(tool.p_mm, s_mm);
    const kinematics::ToolMotion motion =
        kinematics::ToolMotionOf(machine_.hexapod(), X_MP_, {struts.first, struts.second});
    Keep(report_.path_acceleration_share,
         std::hypot(motion.rate.a_mm_per_s2.norm(),
                    plan_.turn_radius_mm * motion.rate.alpha_rad_per_s2.norm()) /
             motion_.path_acceleration_mm_per_s2,
         tau_s, d.line);
    return d;
  }

  // How near the tool has come to the ends of the blocks around.
  void PassEnds(const Vector3d& p_mm, double s_mm) {
    const auto& all = blocks_.blocks();
    while (first_end_ < all.size() &&
           all[first_end_].begin_s_mm + all[first_end_].length_mm < s_mm - kWindow_mm) {
      ++first_end_;
    }
    for (std::size_t i = first_end_;
         i < all.size() && all[i].begin_s_mm + all[i].length_mm <= s_mm + kWindow_mm; ++i) {
      nearest_mm_[i] = std::min(nearest_mm_[i], (p_mm - all[i].to_mm).norm());
    }
  }

  void Limits(const StrutState& struts, const StrutVector& third, double tau_s, std::uint32_t line) {
    const auto share = [](const StrutVector& v, double limit) { return v.cwiseAbs().maxCoeff() / limit; };
    Keep(report_.strut_speed_share, share(struts.first, motion_.strut_velocity_mm_per_s), tau_s, line);
    Keep(report_.strut_acceleration_share, share(struts.second, motion_.strut_acceleration_mm_per_s2), tau_s,
         line);
    Keep(report_.strut_jerk_share, share(third, motion_.strut_jerk_mm_per_s3), tau_s, line);
  }

  double DrivesError(double s_mm, double tau_s) {
    const kinematics::HexapodForward forward =
        kinematics::SolveForward(machine_.hexapod(), drives_.x(), X_MP_drives_);
    if (forward.reason != kinematics::Reason::kSolved) {
      ++report_.unsolved;
      return 0.0;
    }
    X_MP_drives_ = forward.X_MP;
    const Pose tool = machine_.ToolAt(X_MP_drives_);
    const BlockDistance d = blocks_.From(tool.p_mm, Quaterniond(tool.R), s_mm, kWindow_mm);
    Keep(report_.drives_tip_error_mm, d.tip_mm, tau_s, d.line);
    return d.tip_mm;
  }

  void StandAt(const SpatialSegment& segment) {
    Settle(segment);
    const Gate& gate = plan_.gates[segment.gate_at_end - 1];
    if (gate.kind == GateKind::kDwell) {
      cycles_in_all_ += static_cast<std::uint64_t>(std::llround(gate.argument / options_.cycle_s));
    }
  }

  void Settle(const SpatialSegment& segment) {
    StrutState rest;
    for (int j = 0; j < kStrutCount; ++j) {
      rest.q_mm[j] = segment.q_mm[static_cast<std::size_t>(j)].value(segment.duration_s);
    }
    const auto most = static_cast<std::uint64_t>(kLongestSettling_s / options_.cycle_s);
    for (std::uint64_t i = 0;
         i < most && (drives_.x() - rest.q_mm).cwiseAbs().maxCoeff() > options_.settled_mm; ++i) {
      drives_.Step(rest);
      ++cycles_in_all_;
    }
  }

  const SpatialPlan& plan_;
  const HexapodMotion& motion_;
  const SpatialPlayOptions& options_;
  StrutMotion machine_;
  ProgrammedBlocks blocks_;
  std::vector<double> nearest_mm_;  // of the tool, to each block's end
  std::size_t first_end_ = 0;
  Drives drives_;
  Pose X_MP_, X_MP_drives_;
  std::uint64_t cycles_in_all_ = 0;
  PlayedPoint since_;  // for the trace
  SpatialPlayReport report_;
};

}  // namespace

SpatialPlayReport PlaySpatialPlan(const PlannedSpatialProgram& planned,
                                  const std::vector<Operation>& programmed, const HexapodModel& hexapod,
                                  const SpatialPlayOptions& options) {
  return Player(planned, programmed, hexapod, options).Play();
}

}  // namespace lambdajet::trajectory
