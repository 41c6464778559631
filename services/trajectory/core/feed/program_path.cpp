#include "trajectory/core/feed/program_path.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;

constexpr double kShortestMove_mm = 1e-7;
constexpr double kExactCorner_rad = 5e-3;  // in exact path mode a kink above this is a stop
constexpr double kCrawlTolerance_mm =
    2e-3;  // tighter than this times sin(kink / 2) crossing takes longer than a stop
constexpr double kExactTolerance_mm = 2e-3;  // contour tolerance between the stops of exact path mode

Vector2d Turned(const Vector2d& v) { return {-v.y(), v.x()}; }

class PathBuilder {
 public:
  explicit PathBuilder(const PathDefaults& defaults)
      : defaults_(defaults), tolerance_mm_(defaults.tolerance_mm) {}

  ProgramPath Build(const std::vector<Operation>& operations) {
    for (std::size_t i = 0; i < operations.size(); ++i) {
      const bool had_run = run_;
      Take(operations[i]);
      if (run_ && !had_run) {
        ReserveRun(operations, i);
      }
    }
    CloseRun();
    if (!pending_.empty()) {  // events after the last motion belong to its end
      AttachPendingToEnd();
    }
    return std::move(path_);
  }

 private:
  // A run of a million pieces is not to be held twice while it grows.
  void ReserveRun(const std::vector<Operation>& operations, std::size_t first) {
    std::size_t end = first;
    while (end < operations.size() && (operations[end].kind == OperationKind::kFeedLine ||
                                       operations[end].kind == OperationKind::kFeedArc)) {
      ++end;
    }
    run_element().pieces.reserve(end - first);
  }

  void Take(const Operation& o) {
    switch (o.kind) {
      case OperationKind::kTraverse:
        return Traverse(o);
      case OperationKind::kFeedLine:
        return Line(o);
      case OperationKind::kFeedArc:
        return Arc(o);
      case OperationKind::kDwell:
        return Gate(o, GateKind::kDwell, o.value);
      case OperationKind::kPierce:
        Gate(o, GateKind::kPierce, o.value > 0.0 ? o.value : defaults_.pierce_time_s);
        jet_on_ = true;
        ++path_.pierce_count;
        return;
      case OperationKind::kMeasure:
        return Gate(o, GateKind::kMeasure, o.value);
      case OperationKind::kStop:
      case OperationKind::kToolChange:
        return Gate(o, GateKind::kStop, 0.0);
      case OperationKind::kWaitInput:
        return Gate(o, GateKind::kInput, o.value);
      case OperationKind::kJetOn:
        return Event(o, ProcessAction::kJetOn);
      case OperationKind::kJetOff:
        return Event(o, ProcessAction::kJetOff);
      case OperationKind::kAbrasiveOn:
        return Event(o, ProcessAction::kAbrasiveOn);
      case OperationKind::kAbrasiveOff:
        return Event(o, ProcessAction::kAbrasiveOff);
      case OperationKind::kCameraTrackOn:
        return Event(o, ProcessAction::kCameraTrackOn);
      case OperationKind::kCameraTrackOff:
        return Event(o, ProcessAction::kCameraTrackOff);
      case OperationKind::kAbrasiveFlow:
        return Event(o, ProcessAction::kAbrasiveFlow);
      case OperationKind::kPathTolerance:
        exact_ = o.value == 0.0;
        tolerance_mm_ = exact_ ? std::min(kExactTolerance_mm, defaults_.tolerance_mm) : o.value;
        return;
      default:
        return;
    }
  }

  void Traverse(const Operation& o) {
    const Vector2d to{o.x_W_mm, o.y_W_mm};
    if (!moved_ && path_.elements.empty()) {
      path_.start_mm = position_ = to;
      moved_ = true;
      return;
    }
    if ((to - position_).norm() < kShortestMove_mm) {
      return;
    }
    CloseRun();
    PathElement& idle = Open(ElementKind::kIdle, o.line);
    idle.from_mm = position_;
    idle.to_mm = to;
    position_ = to;
    moved_ = true;
  }

  void Line(const Operation& o) {
    const Vector2d to{o.x_W_mm, o.y_W_mm};
    const double length = (to - position_).norm();
    if (length < kShortestMove_mm) {
      return;
    }
    PathPiece piece;
    piece.length_mm = length;
    piece.origin_mm = position_;
    piece.direction = (to - position_) / length;
    AddPiece(piece, o, to);
  }

  void Arc(const Operation& o) {
    const Vector2d to{o.x_W_mm, o.y_W_mm};
    PathPiece piece;
    piece.origin_mm = {o.center_x_W_mm, o.center_y_W_mm};
    const double radius = (position_ - piece.origin_mm).norm();
    piece.direction = (position_ - piece.origin_mm) / radius;
    piece.radius_mm = o.sweep_rad > 0.0 ? radius : -radius;
    piece.length_mm = radius * std::abs(o.sweep_rad);
    if (piece.length_mm >= kShortestMove_mm) {
      AddPiece(piece, o, to);
    }
  }

  void AddPiece(PathPiece& piece, const Operation& o, const Vector2d& to) {
    if (run_ && StopsBetween(run_element().pieces.back(), piece)) {
      run_element().flush_after = true;
      CloseRun();
    }
    if (!run_) {
      PathElement& element = Open(ElementKind::kRun, o.line);
      element.from_mm = position_;
      run_ = true;
    }
    PathElement& element = run_element();
    piece.begin_mm = element.length_mm();
    piece.line = o.line;
    piece.tolerance_mm = tolerance_mm_;
    piece.feed_mm_per_s = std::min(o.feed_mm_per_s * defaults_.feed_scale, defaults_.fastest_feed_mm_per_s);
    element.pieces.push_back(piece);
    element.to_mm = position_ = to;
    moved_ = true;
    path_.cut_length_mm += jet_on_ ? piece.length_mm : 0.0;
  }

  bool StopsBetween(const PathPiece& before, const PathPiece& piece) const {
    if (exact_) {
      return Kink(before, piece) > kExactCorner_rad;
    }
    const double tolerance_mm = std::min(before.tolerance_mm, tolerance_mm_);
    return tolerance_mm < kCrawlTolerance_mm &&
           tolerance_mm < kCrawlTolerance_mm * std::sin(0.5 * Kink(before, piece));
  }

  static double Kink(const PathPiece& a, const PathPiece& b) {
    const Vector2d u = PointOn(a, a.length_mm).tangent;
    const Vector2d v = PointOn(b, 0.0).tangent;
    return std::abs(std::atan2(u.x() * v.y() - u.y() * v.x(), u.dot(v)));
  }

  void Gate(const Operation& o, GateKind kind, double argument) {
    CloseRun();
    PathElement& gate = Open(ElementKind::kGate, o.line);
    gate.gate = kind;
    gate.gate_argument = argument;
    gate.gate_condition = o.condition;
    gate.from_mm = gate.to_mm = position_;
    moved_ = true;
  }

  void Event(const Operation& o, ProcessAction action) {
    if (action == ProcessAction::kJetOn || action == ProcessAction::kJetOff) {
      jet_on_ = action == ProcessAction::kJetOn;
    }
    const PathEvent event{action, 0.0, o.value, o.line};
    if (run_) {
      run_element().events.push_back(event);
      run_element().events.back().offset_mm = run_element().length_mm();
    } else {
      pending_.push_back(event);
    }
  }

  // Events that come before an element stand at its beginning.
  PathElement& Open(ElementKind kind, std::uint32_t line) {
    PathElement& element = path_.elements.emplace_back();
    element.kind = kind;
    element.line = line;
    element.jet_on = jet_on_;
    element.events = std::move(pending_);
    pending_.clear();
    return element;
  }

  void CloseRun() { run_ = false; }
  PathElement& run_element() { return path_.elements.back(); }

  void AttachPendingToEnd() {
    PathElement& gate = Open(ElementKind::kGate, 0);  // kNone: a place without a stop of its own
    gate.from_mm = gate.to_mm = position_;
  }

  const PathDefaults& defaults_;
  ProgramPath path_;
  Vector2d position_ = Vector2d::Zero();
  std::vector<PathEvent> pending_;
  double tolerance_mm_;
  bool exact_ = false;
  bool run_ = false;
  bool moved_ = false;
  bool jet_on_ = false;
};

}  // namespace

PathPoint PointOn(const PathPiece& piece, double offset_mm) {
  if (piece.radius_mm == 0.0) {
    return {piece.origin_mm + offset_mm * piece.direction, piece.direction};
  }
  const double angle = offset_mm / piece.radius_mm;
  const double c = std::cos(angle), s = std::sin(angle);
  const Vector2d& d = piece.direction;
  const Vector2d out{c * d.x() - s * d.y(), s * d.x() + c * d.y()};
  return {piece.origin_mm + std::abs(piece.radius_mm) * out,
          piece.radius_mm > 0.0 ? Turned(out) : Vector2d(-Turned(out))};
}

double DistanceTo(const PathPiece& piece, const Vector2d& p_mm) {
  const Vector2d r = p_mm - piece.origin_mm;
  if (piece.radius_mm == 0.0) {
    const double along = std::clamp(r.dot(piece.direction), 0.0, piece.length_mm);
    return (r - along * piece.direction).norm();
  }
  const double turn = piece.radius_mm > 0.0 ? 1.0 : -1.0;
  const Vector2d& d = piece.direction;
  double angle = turn * std::atan2(d.x() * r.y() - d.y() * r.x(), d.dot(r));
  angle = angle < 0.0 ? angle + 2.0 * M_PI : angle;
  if (angle * std::abs(piece.radius_mm) <= piece.length_mm) {
    return std::abs(r.norm() - std::abs(piece.radius_mm));
  }
  return std::min((p_mm - PointOn(piece, 0.0).p_mm).norm(),
                  (p_mm - PointOn(piece, piece.length_mm).p_mm).norm());
}

ProgramPath MakeProgramPath(const std::vector<Operation>& operations, const PathDefaults& defaults) {
  ProgramPath path = PathBuilder(defaults).Build(operations);
  double run_mm = 0.0;
  for (PathElement& element : path.elements) {
    element.number = static_cast<std::size_t>(&element - path.elements.data());
    element.run_begin_mm = run_mm;
    run_mm += element.length_mm();
  }
  return path;
}

}  // namespace lambdajet::trajectory
