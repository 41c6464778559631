// Seeded programs for hexapods that are meant to break its planner: at the edge of reach, near singular places, turns in place,
// blocks shorter than a knot, tilts along arcs, many holes, one block only, feeds that alternate.
#pragma once

#include <algorithm>
#include <string>

#include "tests/laws/trajectory_spatial_cases.hpp"

namespace lambdajet::trajectory {

enum class Hostile { kReach, kSingular, kTurns, kShort, kArcs, kHoles, kOneBlock, kFeeds };
inline constexpr std::array<const char*, 8> kHostileNames = {"reach", "singular", "turns",     "short",
                                                             "arcs",  "holes",    "one block", "feeds"};

// Cones and struts that let the platform come to its singular places.
inline HexapodGeometry WideHexapod() {
  HexapodGeometry g = WorkedHexapod();
  g.limits = {400, 2500, 3.15, 3.15, 0.15};
  return g;
}

class HostileSpatialProgram {
 public:
  HostileSpatialProgram(Hostile kind, std::uint64_t seed)
      : kind_(kind),
        random_(seed * 8 + static_cast<std::uint64_t>(kind)),
        machine_(geometry(), WorkedMotion().X_MT_zero) {}

  HexapodGeometry geometry() const { return kind_ == Hostile::kSingular ? WideHexapod() : WorkedHexapod(); }

  std::vector<Operation> Draw(int size) {
    p_ = Place();
    abc_ = kind_ == Hostile::kTurns ? Turn(0.4) : Eigen::Vector3d(Eigen::Vector3d::Zero());
    Add(SpatialMove(OperationKind::kTraverse, p_, abc_, 0.0, ++line_));
    for (int i = 0; i < size; ++i) {
      ++line_;
      MaybeTolerance();
      Block();
    }
    return operations_;
  }

 private:
  double Real(double a, double b) { return std::uniform_real_distribution<>(a, b)(random_); }
  double Log(double a, double b) { return std::exp(Real(std::log(a), std::log(b))); }
  bool Chance(double share) { return Real(0, 1) < share; }
  Eigen::Vector3d Place() { return {Real(-90, 90), Real(-90, 90), Real(0, 60)}; }
  Eigen::Vector3d Turn(double most) { return {Real(-most, most), Real(-most, most), Real(-most, most)}; }

  void Add(const Operation& o) {
    operations_.push_back(o);
    if (o.kind <= OperationKind::kFeedArc) {
      p_ = {o.x_W_mm, o.y_W_mm, o.z_W_mm};
      abc_ = {o.a_rad, o.b_rad, o.c_rad};
    }
  }
  void Line(const Eigen::Vector3d& p, const Eigen::Vector3d& abc, double feed) {
    Add(SpatialMove(OperationKind::kFeedLine, p, abc, feed, line_));
  }

  void MaybeTolerance() {
    if (Chance(0.1)) {
      Operation o;
      o.line = line_;
      o.kind = OperationKind::kPathTolerance;
      o.value = Chance(0.3) ? 0.0 : Log(0.001, 0.5);
      operations_.push_back(o);
    }
  }

  void Block() {
    switch (kind_) {
      case Hostile::kReach:
      case Hostile::kSingular:
        return ToTheEdge();
      case Hostile::kTurns:
        return TurnInPlace();
      case Hostile::kShort:
        return ShortTilts();
      case Hostile::kArcs:
        return TiltAlongArc();
      case Hostile::kHoles:
        return Hole();
      case Hostile::kOneBlock:
        return OneBlock();
      case Hostile::kFeeds:
        return AlternatingFeed();
    }
  }

  bool Reaches(const Eigen::Vector3d& p, const Eigen::Vector3d& abc) const {
    ProgramFault fault;
    return machine_.Reaches(p, Eigen::Quaterniond(RollPitchYaw{abc.x(), abc.y(), abc.z()}.Rotation()), 0,
                            fault);
  }

  // Out from home in a random direction of all six, as far as the machine goes, and a little less; sometimes a little more.
  void ToTheEdge() {
    const Eigen::Vector3d p(Real(-300, 300), Real(-300, 300), Real(-200, 200));
    const Eigen::Vector3d abc =
        kind_ == Hostile::kSingular
            ? Eigen::Vector3d(Real(-0.1, 0.1), Real(-0.1, 0.1), Chance(0.5) ? 1.6 : -1.6)
            : Turn(1.2);
    const Eigen::Vector3d shift = kind_ == Hostile::kSingular ? Eigen::Vector3d(0.2 * p) : p;
    double in = 0.0, out = 1.0;
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (in + out);
      (Reaches(Eigen::Vector3d(0, 0, 20) + middle * shift, middle * abc) ? in : out) = middle;
    }
    const double share = in * (1.0 + (Chance(0.08) ? Log(1e-3, 0.1) : -Log(1e-4, 0.3)));
    const Eigen::Vector3d edge = Eigen::Vector3d(0, 0, 20) + share * shift;
    Line(edge, share * abc, Log(5, 150));
    for (int i = 0; i < 3; ++i) {  // and about it, without leaving it for home
      const double back = share * Real(0.85, 1.0);
      Line(Eigen::Vector3d(0, 0, 20) + back * shift, back * abc, Log(5, 150));
    }
    Line({0, 0, 20}, {0, 0, 0}, 150);
  }

  void TurnInPlace() {
    Operation turn = SpatialMove(OperationKind::kFeedLine, p_, Chance(0.3) ? -abc_ : Turn(Log(0.001, 0.35)),
                                 Log(2, 150), line_);
    turn.value = Chance(0.5) ? Log(0.005, 3.0) : 0.0;
    Add(turn);
  }

  void ShortTilts() {
    const double step = Log(0.0005, 0.05), tilt = Log(0.001, 0.05), feed = Log(1, 150);
    const Eigen::Vector3d along = Eigen::Vector3d(Real(-1, 1), Real(-1, 1), Real(-1, 1)).normalized();
    const bool zigzag = Chance(0.5);
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector3d turn = Turn(tilt);
      Line(p_ + step * along, (zigzag ? (i % 2 == 0 ? turn : Eigen::Vector3d(-abc_)) : 0.9 * abc_ + turn),
           feed);
    }
  }

  void TiltAlongArc() {
    const auto plane = static_cast<ArcPlane>(std::uniform_int_distribution<>(0, 2)(random_));
    const int n = plane == ArcPlane::kXy ? 2 : plane == ArcPlane::kZx ? 1 : 0;
    const Eigen::Vector3d normal = Eigen::Vector3d::Unit(n), first = Eigen::Vector3d::Unit((n + 1) % 3);
    const double angle = Real(0, 2 * std::numbers::pi), radius = Log(0.05, 40.0);
    const double sweep = (Chance(0.5) ? 1 : -1) * Log(0.01, 4 * std::numbers::pi);
    const Eigen::Vector3d out = std::cos(angle) * first + std::sin(angle) * normal.cross(first);
    const Eigen::Vector3d centre = p_ - radius * out;
    const Eigen::Vector3d to = centre +
                               radius * (std::cos(sweep) * out + std::sin(sweep) * normal.cross(out)) +
                               (Chance(0.5) ? Real(-8, 8) : 0.0) * normal;
    Operation o = SpatialMove(OperationKind::kFeedArc, to, Turn(0.3), Log(1, 150), line_);
    o.plane = plane;
    o.center_x_W_mm = centre.x(), o.center_y_W_mm = centre.y(), o.center_z_W_mm = centre.z();
    o.sweep_rad = sweep;
    if (to.cwiseAbs().maxCoeff() < 100.0 && centre.cwiseAbs().maxCoeff() < 80.0) {
      Add(o);
    } else {
      Line(Place(), Turn(0.2), 150);
    }
  }

  void Hole() {
    DrilledHole hole;
    hole.entry_W_mm = {Real(-80, 80), Real(-80, 80), 0.0};
    const Eigen::Vector3d abc = Turn(0.25);
    hole.a_rad = abc.x(), hole.b_rad = abc.y(), hole.c_rad = abc.z();
    hole.retract_mm = Log(0.1, 3.0), hole.clear_mm = hole.retract_mm + Log(0.1, 20.0);
    hole.bottom_mm = -Log(0.05, 15.0);
    hole.peck_mm = Chance(0.5) ? 0.0 : Log(0.3, 6.0) * std::min(1.0, -hole.bottom_mm);
    hole.chip_break = Chance(0.5);
    hole.dwell_s = Chance(0.5) ? 0.0 : 0.05;
    hole.feed_mm_per_s = Log(2, 50);
    hole.line = line_;
    std::vector<Operation> moves;
    AppendDrilledHole(hole, moves);
    for (const Operation& o : moves) {
      Add(o);
    }
  }

  void OneBlock() {
    const double size = Log(1e-8, 100.0), tilt = Chance(0.4) ? 0.0 : Log(1e-8, 0.3);
    const Eigen::Vector3d along = Eigen::Vector3d(Real(-1, 1), Real(-1, 1), Real(-1, 1)).normalized();
    const bool still = tilt > 0.0 && Chance(0.3);
    Operation o = SpatialMove(Chance(0.2) ? OperationKind::kTraverse : OperationKind::kFeedLine,
                              still ? p_ : Eigen::Vector3d(p_ - size * (p_.dot(along) > 0 ? 1 : -1) * along),
                              abc_ + tilt * Turn(1.0), Log(1.0, 300.0), line_);
    Add(o);
  }

  void AlternatingFeed() {
    const double step = Log(0.02, 5.0);
    const Eigen::Vector3d along =
        (Eigen::Vector3d(Real(-1, 1), Real(-1, 1), Real(-1, 1)) - 0.02 * p_).normalized();
    const Eigen::Vector3d abc = Turn(0.1);
    for (int i = 0; i < 12; ++i) {
      Line(p_ + step * along, Chance(0.5) ? abc_ : Eigen::Vector3d(abc_ + 0.02 * (abc - abc_)),
           i % 2 == 0 ? 150.0 : Log(0.3, 5.0));
    }
  }

  Hostile kind_;
  std::mt19937_64 random_;
  StrutMotion machine_;
  std::uint32_t line_ = 0;
  Eigen::Vector3d p_ = Eigen::Vector3d::Zero(), abc_ = Eigen::Vector3d::Zero();
  std::vector<Operation> operations_;
};

}  // namespace lambdajet::trajectory
