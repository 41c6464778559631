// The worked hexapod with the limits of motion of deploy/config/hexapod.yaml, and seeded random programs for it.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "trajectory/core/spatial_feed/drilling_cycle.hpp"
#include "trajectory/core/spatial_feed/plan_spatial_program.hpp"

namespace lambdajet::trajectory {

inline HexapodGeometry WorkedHexapod() {
  constexpr double kDeg = std::numbers::pi / 180.0;
  const double base[6] = {-10, 10, 110, 130, 230, 250}, platform[6] = {-50, 50, 70, 170, 190, 290};
  HexapodGeometry g;
  for (int j = 0; j < kStruts; ++j) {
    g.p_MA_mm.col(j) << 600 * std::cos(base[j] * kDeg), 600 * std::sin(base[j] * kDeg), 0;
    g.p_PB_mm.col(j) << 250 * std::cos(platform[j] * kDeg), 250 * std::sin(platform[j] * kDeg), -25;
  }
  g.X_MP_home.p_mm = {0, 0, 800};
  g.X_PT.p_mm = {0, 0, 150};
  g.limits = {650, 1150, 0.6, 0.7, 0.15};
  LayJointFrames(g);
  return g;
}

inline HexapodMotion WorkedMotion() {
  HexapodMotion m;
  m.strut_velocity_mm_per_s = 500;
  m.strut_acceleration_mm_per_s2 = 5000;
  m.strut_jerk_mm_per_s3 = 150000;
  m.feed_mm_per_s = 150;
  m.rapid_mm_per_s = 400;
  m.path_acceleration_mm_per_s2 = 2500;
  m.path_jerk_mm_per_s3 = 60000;
  m.corner_tolerance_mm = 0.02;
  m.corner_tolerance_rad = 2e-4;
  m.X_MT_zero.p_mm = {0, 0, 980};
  m.spindle_least_per_min = 500;
  m.spindle_most_per_min = 12000;
  m.spindle_run_up_s = 1.5;
  return m;
}

inline Operation SpatialMove(OperationKind kind, const Eigen::Vector3d& p_mm, const Eigen::Vector3d& abc_rad,
                             double feed_mm_per_s, std::uint32_t line) {
  Operation o;
  o.kind = kind;
  o.axes = kSixAxes;
  o.line = line;
  o.x_W_mm = p_mm.x(), o.y_W_mm = p_mm.y(), o.z_W_mm = p_mm.z();
  o.a_rad = abc_rad.x(), o.b_rad = abc_rad.y(), o.c_rad = abc_rad.z();
  o.feed_mm_per_s = feed_mm_per_s;
  return o;
}

// Lines, arcs in all planes, helices, pure turns, short blocks, tilted holes, dwells, exact corners and traverses.
class RandomSpatialProgram {
 public:
  explicit RandomSpatialProgram(std::uint64_t seed, bool translations_only = false)
      : random_(seed), still_(translations_only) {}

  std::vector<Operation> Draw(int blocks) {
    Add(SpatialMove(OperationKind::kTraverse, Place(), Turn(), 0.0, ++line_));
    for (int i = 0; i < blocks; ++i) {
      Block();
    }
    return operations_;
  }

 private:
  double Real(double a, double b) { return std::uniform_real_distribution<>(a, b)(random_); }
  Eigen::Vector3d Place() { return {Real(-90, 90), Real(-90, 90), Real(0, 60)}; }
  Eigen::Vector3d Turn() {
    return still_ ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                  : Eigen::Vector3d(Real(-0.25, 0.25), Real(-0.25, 0.25), Real(-0.3, 0.3));
  }
  double Feed() { return std::exp(Real(std::log(5.0), std::log(150.0))); }

  void Add(const Operation& o) {
    operations_.push_back(o);
    if (o.kind <= OperationKind::kFeedArc) {
      p_ = {o.x_W_mm, o.y_W_mm, o.z_W_mm};
      abc_ = {o.a_rad, o.b_rad, o.c_rad};
    }
  }

  void Block() {
    const int kind = std::uniform_int_distribution<>(0, 7)(random_);
    ++line_;
    if (kind == 0) {
      Add(SpatialMove(OperationKind::kTraverse, Place(), Turn(), 0.0, line_));
    } else if (kind == 1 || kind == 2) {
      Add(SpatialMove(OperationKind::kFeedLine, Place(), Turn(), Feed(), line_));
    } else if (kind == 3) {
      Arc();
    } else if (kind == 4) {
      Operation turn = SpatialMove(OperationKind::kFeedLine, p_, Turn(), Feed(), line_);
      turn.value = Real(0.2, 2.0);
      Add(turn);
    } else if (kind == 5) {
      ShortBlocks();
    } else if (kind == 6) {
      Hole();
    } else {
      Operation o;
      o.line = line_;
      o.kind = Real(0, 1) < 0.3 ? OperationKind::kDwell : OperationKind::kPathTolerance;
      o.value = o.kind == OperationKind::kDwell ? 0.2 : Real(0, 1) < 0.3 ? 0.0 : Real(0.005, 0.1);
      Add(o);
    }
  }

  void Arc() {
    const auto plane = static_cast<ArcPlane>(still_ ? 0 : std::uniform_int_distribution<>(0, 2)(random_));
    const int n = plane == ArcPlane::kXy ? 2 : plane == ArcPlane::kZx ? 1 : 0;
    Eigen::Vector3d normal = Eigen::Vector3d::Unit(n), out = Eigen::Vector3d::Unit((n + 1) % 3);
    const double angle = Real(0, 2 * std::numbers::pi), sweep = Real(-5.0, 5.0);
    const double radius = std::exp(Real(std::log(2.0), std::log(25.0)));
    out = std::cos(angle) * out + std::sin(angle) * normal.cross(out);
    const Eigen::Vector3d centre = p_ - radius * out;
    const Eigen::Vector3d to = centre +
                               radius * (std::cos(sweep) * out + std::sin(sweep) * normal.cross(out)) +
                               Real(-8, 8) * normal;
    Operation o = SpatialMove(OperationKind::kFeedArc, to, Turn(), Feed(), line_);
    o.plane = plane;
    o.center_x_W_mm = centre.x(), o.center_y_W_mm = centre.y(), o.center_z_W_mm = centre.z();
    o.sweep_rad = sweep;
    if (to.cwiseAbs().maxCoeff() < 110.0 && centre.cwiseAbs().maxCoeff() < 100.0) {
      Add(o);
    }
  }

  void ShortBlocks() {
    const Eigen::Vector3d from = p_, abc = abc_, turn = Turn() - abc_;
    const double radius = Real(5, 30), step = Real(0.05, 0.5), feed = Feed();
    const double side = from.x() > 0.0 ? -1.0 : 1.0;
    for (int i = 1; i <= 60; ++i) {
      const double a = i * step / radius;
      const Eigen::Vector3d p =
          from + Eigen::Vector3d(side * radius * (1 - std::cos(a)), radius * std::sin(a), 0.0);
      Add(SpatialMove(OperationKind::kFeedLine, p, abc + turn * (i / 60.0), feed, line_));
    }
  }

  void Hole() {
    DrilledHole hole;
    hole.entry_W_mm = {Real(-80, 80), Real(-80, 80), 0.0};
    const Eigen::Vector3d abc = Turn();
    hole.a_rad = abc.x(), hole.b_rad = abc.y(), hole.c_rad = abc.z();
    hole.retract_mm = 2.0, hole.clear_mm = Real(2.0, 20.0), hole.bottom_mm = -Real(3, 15);
    hole.peck_mm = Real(0, 1) < 0.5 ? 0.0 : Real(2, 6);
    hole.chip_break = Real(0, 1) < 0.3;
    hole.dwell_s = Real(0, 1) < 0.5 ? 0.0 : 0.1;
    hole.feed_mm_per_s = Real(5, 30);
    hole.line = line_;
    std::vector<Operation> moves;
    AppendDrilledHole(hole, moves);
    for (const Operation& o : moves) {
      Add(o);
    }
  }

  std::mt19937_64 random_;
  bool still_;
  std::uint32_t line_ = 0;
  Eigen::Vector3d p_ = Eigen::Vector3d::Zero(), abc_ = Eigen::Vector3d::Zero();
  std::vector<Operation> operations_;
};

}  // namespace lambdajet::trajectory
