// Splines in the XY plane, as pairs of arcs that meet in one tangent.
//
// A span of the Bezier curve is replaced by a biarc (two arcs from its ends and end tangents, with equal tangent lengths);
// where the curve leaves the biarc by more than a hundredth of the path tolerance the span is halved.
#include <algorithm>
#include <array>
#include <cmath>

#include "trajectory/core/part_program/gcode_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kToleranceShare = 0.01;
constexpr double kFinestTolerance_mm = 1e-5;
constexpr int kDeepestHalving = 18;
constexpr int kProbes = 8;
constexpr double kStraight = 1e-12;

struct Vec {
  double x = 0.0, y = 0.0;
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y}; }
Vec operator*(double s, Vec a) { return {s * a.x, s * a.y}; }
double Dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y; }
double Cross(Vec a, Vec b) { return a.x * b.y - a.y * b.x; }
double Norm(Vec a) { return std::hypot(a.x, a.y); }

using Bezier = std::array<Vec, 4>;

Vec At(const Bezier& b, double t) {
  const double u = 1.0 - t;
  return u * u * u * b[0] + 3.0 * u * u * t * b[1] + 3.0 * u * t * t * b[2] + t * t * t * b[3];
}

Vec Unit(Vec a) {
  const double n = Norm(a);
  return n > 0.0 ? (1.0 / n) * a : Vec{};
}

Vec TangentAtBegin(const Bezier& b) {
  for (int i = 1; i < 4; ++i) {
    const Vec d = b[static_cast<std::size_t>(i)] - b[0];
    if (Norm(d) > 1e-9) {
      return Unit(d);
    }
  }
  return {};
}

Vec TangentAtEnd(const Bezier& b) {
  const Vec back = TangentAtBegin({b[3], b[2], b[1], b[0]});
  return -1.0 * back;
}

// An arc from a point with a tangent to another point; straight where the radius is 0.
struct Arc {
  Vec begin, end, center;
  double sweep = 0.0;
  bool straight = true;

  Arc(Vec begin_in, Vec tangent, Vec end_in) : begin(begin_in), end(end_in) {
    const Vec chord = end - begin;
    const double side = Cross(tangent, chord), along = Dot(tangent, chord);
    const double length2 = Dot(chord, chord);
    if (std::abs(side) <= kStraight * std::max(1.0, length2)) {
      return;
    }
    const double radius = length2 / (2.0 * side);
    center = begin + radius * Vec{-tangent.y, tangent.x};
    sweep = 2.0 * std::atan2(side, along);
    straight = std::abs(radius) > 1e7;
  }

  double Distance(Vec p) const {
    if (straight) {
      const Vec chord = end - begin;
      const double length2 = Dot(chord, chord);
      const double along = length2 > 0.0 ? std::clamp(Dot(p - begin, chord) / length2, 0.0, 1.0) : 0.0;
      return Norm(p - begin - along * chord);
    }
    const Vec from = begin - center, out = p - center;
    double angle = std::atan2(Cross(from, out), Dot(from, out));
    if (sweep > 0.0 && angle < 0.0) {
      angle += 6.283185307179586;
    } else if (sweep < 0.0 && angle > 0.0) {
      angle -= 6.283185307179586;
    }
    return std::abs(angle) <= std::abs(sweep) ? std::abs(Norm(out) - Norm(from))
                                              : std::min(Norm(p - begin), Norm(p - end));
  }
};

class SplineCut {
 public:
  SplineCut(Reading& r, const AxisValues& end)
      : r_(r),
        end_(end),
        tolerance_mm_(
            std::max(kToleranceShare * std::min(r.options.default_tolerance_mm, r.state.path_tolerance_mm),
                     kFinestTolerance_mm)) {}

  void Cut(const Bezier& b) {
    Span(b, 0);
    Straight(b[3]);  // where the last span was too short to count
  }

 private:
  void Span(const Bezier& b, int depth) {
    const Vec t0 = TangentAtBegin(b), t1 = TangentAtEnd(b);
    const double size = std::max({Norm(b[1] - b[0]), Norm(b[2] - b[0]), Norm(b[3] - b[0])});
    if (size <= tolerance_mm_ || depth == kDeepestHalving || r_.ended) {
      Straight(b[3]);
      return;
    }
    // The first halving is always made, so that a loop or an S is not judged by its ends alone.
    if (depth > 0) {
      const Vec middle = Joint(b, t0, t1);
      const Arc first(b[0], t0, middle), second(b[3], -1.0 * t1, middle);
      if (Norm(middle - b[0]) < 2.0 * size && Follows(b, first, second)) {
        if (first.straight && second.straight) {
          Straight(b[3]);
        } else {
          Add(first);
          Add(Reversed(second));
        }
        return;
      }
    }
    const Vec a = 0.5 * (b[0] + b[1]), m = 0.5 * (b[1] + b[2]), z = 0.5 * (b[2] + b[3]);
    const Vec am = 0.5 * (a + m), mz = 0.5 * (m + z), c = 0.5 * (am + mz);
    Span({b[0], a, am, c}, depth + 1);
    Span({c, mz, z, b[3]}, depth + 1);
  }

  // Where the two arcs meet, for equal lengths d of the tangents up to their corners:
  // 2 d^2 (1 - t0 t1) + 2 d v (t0 + t1) - v v = 0, v from begin to end.
  static Vec Joint(const Bezier& b, Vec t0, Vec t1) {
    const Vec v = b[3] - b[0], t = t0 + t1;
    const double vv = Dot(v, v), vt = Dot(v, t), k = 2.0 * (1.0 - Dot(t0, t1));
    const double root = std::sqrt(vt * vt + k * vv);
    const double d = vv / std::max(vt + root, 1e-300);
    return 0.5 * (b[0] + b[3] + d * (t0 - t1));
  }

  static Arc Reversed(const Arc& a) {
    Arc back = a;
    std::swap(back.begin, back.end);
    back.sweep = -a.sweep;
    return back;
  }

  bool Follows(const Bezier& b, const Arc& first, const Arc& second) const {
    for (int i = 1; i < kProbes; ++i) {
      const Vec p = At(b, static_cast<double>(i) / kProbes);
      if (!(std::min(first.Distance(p), second.Distance(p)) <= tolerance_mm_)) {
        return false;
      }
    }
    return true;
  }

  void Straight(Vec to) {
    const AxisValues& p = r_.state.position;
    if (p[0] == to.x && p[1] == to.y) {
      return;
    }
    r_.Move(OperationKind::kFeedLine, EndAt(to));
  }

  void Add(const Arc& arc) {
    if (arc.straight) {
      Straight(arc.end);
      return;
    }
    if (Norm(arc.end - arc.begin) == 0.0) {
      return;
    }
    Operation& o = r_.Move(OperationKind::kFeedArc, EndAt(arc.end));
    o.center_x_W_mm = arc.center.x;
    o.center_y_W_mm = arc.center.y;
    o.center_z_W_mm = r_.state.position[2];
    o.sweep_rad = arc.sweep;
  }

  AxisValues EndAt(Vec to) const {
    AxisValues p = end_;
    p[0] = to.x;
    p[1] = to.y;
    return p;
  }

  Reading& r_;
  AxisValues end_;
  double tolerance_mm_;
};

double LengthOf(const Operation& o, Vec from) {
  const Vec to{o.x_W_mm, o.y_W_mm};
  return o.kind == OperationKind::kFeedArc
             ? std::abs(o.sweep_rad) * Norm(to - Vec{o.center_x_W_mm, o.center_y_W_mm})
             : Norm(to - from);
}

// With G93 the whole spline has one duration.
void SharePace(Reading& r, std::size_t first, Vec begin) {
  if (!r.state.inverse_time) {
    return;
  }
  double length_mm = 0.0;
  Vec at = begin;
  for (std::size_t i = first; i < r.program.operations.size(); ++i) {
    const Operation& o = r.program.operations[i];
    length_mm += LengthOf(o, at);
    at = {o.x_W_mm, o.y_W_mm};
  }
  for (std::size_t i = first; i < r.program.operations.size(); ++i) {
    SetPace(r, r.program.operations[i], length_mm, 0.0);
  }
}

bool Fits(Reading& r) {
  if (r.state.plane != ArcPlane::kXy) {
    return r.FaultAtMotion("SPLINE_PLANE", "splines lie in the XY plane, G17");
  }
  for (const char letter : {'Z', 'A', 'B', 'C'}) {
    if (r.block.has(letter)) {
      return r.FaultAt(letter, "SPLINE_AXIS", "a spline moves X and Y only");
    }
  }
  return HasFeed(r);
}

// The first control point, from the start; taken over from the spline before where neither I nor J is written.
bool FirstControl(Reading& r, bool cubic, Vec& control) {
  const bool i = r.block.has('I'), j = r.block.has('J');
  if (cubic && i != j) {
    return r.FaultAtMotion("SPLINE_CONTROL_MISSING", "G5 has both I and J, or neither");
  }
  if (!i && !j) {
    if (!cubic || !r.state.spline_end) {
      return r.FaultAtMotion("SPLINE_CONTROL_MISSING",
                             cubic ? "the first G5 of a series needs I and J" : "G5.1 needs I or J");
    }
    control = {-(*r.state.spline_end)[0], -(*r.state.spline_end)[1]};
    return true;
  }
  control = {i ? r.mm(r.block.Take('I')) : 0.0, j ? r.mm(r.block.Take('J')) : 0.0};
  return cubic || control.x != 0.0 || control.y != 0.0 ||
         r.FaultAtMotion("SPLINE_CONTROL_MISSING", "I and J of G5.1 are not both 0");
}

}  // namespace

bool ObeySpline(Reading& r, bool cubic) {
  Vec control, last;
  if (!Fits(r) || !FirstControl(r, cubic, control)) {
    return false;
  }
  if (cubic) {
    if (!r.block.has('P') || !r.block.has('Q')) {
      return r.FaultAtMotion("SPLINE_CONTROL_MISSING", "G5 needs P and Q");
    }
    if (!CoordinatesFinite(r, "PQ")) {
      return false;
    }
    last = {r.mm(r.block.Take('P')), r.mm(r.block.Take('Q'))};
    r.state.spline_end = {last.x, last.y};
  }
  const Vec begin{r.state.position[0], r.state.position[1]};
  const AxisValues target = Target(r);
  const Vec end{target[0], target[1]};
  const Vec c0 = begin + control;
  const std::size_t first = r.program.operations.size();
  const Bezier curve =
      cubic ? Bezier{begin, c0, end + last, end}
            : Bezier{begin, begin + (2.0 / 3.0) * control, end + (2.0 / 3.0) * (c0 - end), end};
  SplineCut(r, target).Cut(curve);
  SharePace(r, first, begin);
  return true;
}

}  // namespace lambdajet::trajectory
