#include "trajectory/core/spatial_feed/spatial_path.hpp"

#include <algorithm>
#include <cmath>

#include "foundation/geometry/pose.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kNoLength_mm = 1e-9;
constexpr double kBackwards = -0.17;         // cosine of 100 degrees
constexpr double kLargestTurn_rad = 2.9671;  // 170 degrees: the short way is clear
constexpr double kSameTangent = 1e-7;

Vector3d NormalOf(ArcPlane plane) {
  return plane == ArcPlane::kXy   ? Vector3d::UnitZ()
         : plane == ArcPlane::kZx ? Vector3d::UnitY()
                                  : Vector3d::UnitX();
}

class PathBuilder {
 public:
  PathBuilder(const HexapodMotion& motion, double turn_radius_mm, double feed_scale)
      : motion_(motion), radius_(turn_radius_mm), feed_scale_(feed_scale) {
    tolerance_mm_ = motion.corner_tolerance_mm;
  }

  SpatialPath Build(const std::vector<Operation>& operations) {
    path_.runs.emplace_back();
    for (const Operation& o : operations) {
      Take(o);
      if (!path_.faults.empty()) {
        break;
      }
    }
    return std::move(path_);
  }

 private:
  void Take(const Operation& o) {
    switch (o.kind) {
      case OperationKind::kTraverse:
        moved_ ? Move(o) : Begin(o);
        return;
      case OperationKind::kFeedLine:
      case OperationKind::kFeedArc:
        Move(o);
        return;
      case OperationKind::kDwell:
        return StandStill(GateKind::kDwell, o);
      case OperationKind::kMeasure:
        return StandStill(GateKind::kMeasure, o);
      case OperationKind::kStop:
      case OperationKind::kToolChange:
        return StandStill(GateKind::kStop, o);
      case OperationKind::kPathTolerance:
        tolerance_mm_ = o.value;
        return;
      case OperationKind::kFeedChange:
      case OperationKind::kUnitsChange:
      case OperationKind::kDistanceChange:
      case OperationKind::kWorkOffsetChange:
      case OperationKind::kToolNumber:
      case OperationKind::kEnd:
        return;
      default:
        Switch(o);
    }
  }

  void Switch(const Operation& o) {
    switch (o.kind) {
      case OperationKind::kSpindleOn:
        return Spindle(o, o.value);
      case OperationKind::kSpindleOff:
        return Spindle(o, 0.0);
      case OperationKind::kCoolantOn:
        return Event(o, SpatialAction::kCoolantOn, 0.0);
      case OperationKind::kCoolantOff:
        return Event(o, SpatialAction::kCoolantOff, 0.0);
      case OperationKind::kCameraTrackOn:
        return Event(o, SpatialAction::kCameraTrackOn, o.value);
      case OperationKind::kCameraTrackOff:
        return Event(o, SpatialAction::kCameraTrackOff, 0.0);
      default:
        Refuse(o);
    }
  }

  // The first traverse says where the program begins; the drive goes there before it starts.
  void Begin(const Operation& o) {
    moved_ = true;
    here_ = {o.x_W_mm, o.y_W_mm, o.z_W_mm};
    q_here_ = Quaterniond(RollPitchYaw{o.a_rad, o.b_rad, o.c_rad}.Rotation());
    path_.start = {here_, q_here_, Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
  }

  void Move(const Operation& o) {
    moved_ = true;
    SpatialPiece piece;
    piece.line = o.line;
    piece.cutting = o.kind != OperationKind::kTraverse;
    const Vector3d to(o.x_W_mm, o.y_W_mm, o.z_W_mm);
    o.kind == OperationKind::kFeedArc ? Arc(o, to, piece) : Line(to, piece);
    Turn(o, piece);
    piece.length_mm = std::hypot(piece.tip_length_mm, radius_ * piece.turn_rad);
    here_ = to;
    if (piece.length_mm < kNoLength_mm || !path_.faults.empty()) {
      return;
    }
    SetFeed(o, piece);
    piece.tolerance_mm = tolerance_mm_ > 0.0 ? tolerance_mm_ : motion_.corner_tolerance_mm;
    BreakBefore(piece);
    piece.begin_mm = path_.runs.back().length_mm();
    path_.runs.back().pieces.push_back(piece);
    exact_ = tolerance_mm_ <= 0.0;
  }

  void Line(const Vector3d& to, SpatialPiece& piece) const {
    piece.origin_mm = here_;
    piece.along = to - here_;
    piece.tip_length_mm = piece.along.norm();
  }

  void Arc(const Operation& o, const Vector3d& to, SpatialPiece& piece) const {
    const Vector3d plane_normal = NormalOf(o.plane);
    Vector3d centre(o.center_x_W_mm, o.center_y_W_mm, o.center_z_W_mm);
    centre += plane_normal * plane_normal.dot(here_ - centre);
    piece.rise_mm = plane_normal.dot(to - here_);
    piece.normal = o.sweep_rad < 0.0 ? Vector3d(-plane_normal) : plane_normal;
    piece.rise_mm = o.sweep_rad < 0.0 ? -piece.rise_mm : piece.rise_mm;
    piece.sweep_rad = std::abs(o.sweep_rad);
    piece.origin_mm = centre;
    piece.radius_mm = (here_ - centre).norm();
    piece.along = (here_ - centre) / piece.radius_mm;
    piece.growth_mm = (to - piece.normal * piece.rise_mm - centre).norm() - piece.radius_mm;
    piece.tip_length_mm =
        std::hypot((piece.radius_mm + 0.5 * piece.growth_mm) * piece.sweep_rad, piece.rise_mm);
  }

  void Turn(const Operation& o, SpatialPiece& piece) {
    Quaterniond q_to(RollPitchYaw{o.a_rad, o.b_rad, o.c_rad}.Rotation());
    if (q_to.dot(q_here_) < 0.0) {
      q_to.coeffs() = -q_to.coeffs();
    }
    const Quaterniond d = q_to * q_here_.conjugate();
    const double sine = d.vec().norm();
    piece.q_start = q_here_;
    piece.turn_rad = 2.0 * std::atan2(sine, d.w());
    if (piece.turn_rad < 1e-9) {
      piece.turn_rad = 0.0;
    } else {
      piece.axis = d.vec() / sine;
    }
    if (piece.turn_rad > kLargestTurn_rad) {
      path_.faults.push_back(
          {o.line, 0, "TURN_TOO_LARGE", "",
           "the tool turns by more than 170 degrees in one block; give a block in between that says "
           "which way round"});
    }
    q_here_ = q_to;
  }

  void SetFeed(const Operation& o, SpatialPiece& piece) const {
    if (!piece.cutting) {
      piece.programmed_mm_per_s = piece.feed_mm_per_s = motion_.rapid_mm_per_s;
      return;
    }
    double speed = o.feed_mm_per_s;
    if (piece.tip_length_mm > kNoLength_mm) {
      speed *= piece.length_mm / piece.tip_length_mm;
    } else if (o.value > 0.0) {
      speed = piece.length_mm / o.value;
    }
    piece.programmed_mm_per_s = feed_scale_ * speed;
    piece.feed_mm_per_s = std::min(piece.programmed_mm_per_s, motion_.feed_mm_per_s);
  }

  // Exact corners, and places where the path turns back, are met at standstill.
  void BreakBefore(const SpatialPiece& piece) {
    const SpatialRun& run = path_.runs.back();
    if (run.pieces.empty()) {
      return;
    }
    const SpatialPoint u = PointOn(run.pieces.back(), run.pieces.back().length_mm), v = PointOn(piece, 0.0);
    const double cosine = u.tangent.dot(v.tangent) + radius_ * radius_ * u.turn.dot(v.turn);
    const double change = std::hypot((u.tangent - v.tangent).norm(), radius_ * (u.turn - v.turn).norm());
    if (cosine < kBackwards || (exact_ && change > kSameTangent)) {
      path_.runs.emplace_back();
    }
  }

  void StandStill(GateKind kind, const Operation& o) {
    SpatialRun& run = path_.runs.back();
    run.gate = kind;
    run.gate_argument = o.value;
    run.gate_line = o.line;
    path_.runs.emplace_back();
  }

  void Event(const Operation& o, SpatialAction action, double argument) {
    path_.runs.back().events.push_back({action, path_.runs.back().length_mm(), argument, o.line});
  }

  // Nobody waits for it to stop.
  void Spindle(const Operation& o, double turns_per_min) {
    Event(o, SpatialAction::kSpindle, turns_per_min);
    Operation wait = o;
    wait.value = turns_per_min != 0.0 && motion_.spindle_most_per_min > 0.0
                     ? motion_.spindle_run_up_s * std::abs(turns_per_min - spindle_per_min_) /
                           motion_.spindle_most_per_min
                     : 0.0;
    spindle_per_min_ = turns_per_min;
    StandStill(GateKind::kDwell, wait);
  }

  void Refuse(const Operation& o) {
    path_.faults.push_back({o.line, 0, "OPERATION_NOT_DRIVEN", std::string(OperationName(o.kind)),
                            "a hexapod has a spindle and its coolant, no jet"});
  }

  const HexapodMotion& motion_;
  double radius_;
  double feed_scale_;
  double tolerance_mm_;
  bool exact_ = false;
  bool moved_ = false;
  Vector3d here_ = Vector3d::Zero();
  Quaterniond q_here_ = Quaterniond::Identity();
  double spindle_per_min_ = 0.0;
  SpatialPath path_;
};

}  // namespace

SpatialPoint PointOn(const SpatialPiece& piece, double offset_mm) {
  const double u = offset_mm / piece.length_mm;
  SpatialPoint point;
  if (piece.radius_mm == 0.0) {
    point.p_mm = piece.origin_mm + u * piece.along;
    point.tangent = piece.along / piece.length_mm;
  } else {
    const double angle = u * piece.sweep_rad, rate = piece.sweep_rad / piece.length_mm;
    const Vector3d out = std::cos(angle) * piece.along + std::sin(angle) * piece.normal.cross(piece.along);
    const double r = piece.radius_mm + u * piece.growth_mm;
    point.p_mm = piece.origin_mm + r * out + u * piece.rise_mm * piece.normal;
    point.tangent = r * rate * piece.normal.cross(out) +
                    (piece.growth_mm * out + piece.rise_mm * piece.normal) / piece.length_mm;
    point.bend = -r * rate * rate * out;
  }
  if (piece.turn_rad == 0.0) {
    point.q = piece.q_start;
  } else {
    point.q = Quaterniond(Eigen::AngleAxisd(u * piece.turn_rad, piece.axis)) * piece.q_start;
    point.turn = piece.axis * (piece.turn_rad / piece.length_mm);
  }
  return point;
}

SpatialPath MakeSpatialPath(const std::vector<Operation>& operations, const HexapodMotion& motion,
                            double turn_radius_mm, double feed_scale) {
  return PathBuilder(motion, turn_radius_mm, feed_scale).Build(operations);
}

}  // namespace lambdajet::trajectory
