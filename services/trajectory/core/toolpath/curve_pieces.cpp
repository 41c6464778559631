// Biarcs with equal tangent lengths: K. M. Bolton, "Biarc curves", Computer-Aided Design 7(2), 1975, eq. for d in the usual
// vector form; B-splines by de Boor's algorithm in homogeneous coordinates, tangents from the hodograph's control points.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include "trajectory/core/toolpath/drawing.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;
constexpr std::size_t kMostPiecesPerCurve = 20'000;
constexpr int kDeepestHalving = 24;
constexpr int kMostSpansPerCurve = 100'000;
constexpr int kSamples = 12;
// Between the samples the deviation may be a little larger than at them.
constexpr double kShareOfTolerance = 0.8;

struct Sample {
  Vector2d p = Vector2d::Zero();
  Vector2d tangent = Vector2d::Zero();  // unit; zero where the curve stands still
};
using Evaluate = std::function<Sample(double)>;

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// The arc that leaves `from` along the tangent and ends in `to`; a line where they agree.
void AppendTangentArc(const Vector2d& from, const Vector2d& tangent, const Vector2d& to, std::uint32_t source,
                      Pieces& pieces) {
  const Vector2d chord = to - from;
  if (chord.norm() < 1e-12) {
    return;
  }
  const double turn = TurnBetween(tangent, chord);  // half the sweep
  if (std::abs(turn) * chord.norm() < 1e-9) {
    pieces.push_back(LinePiece(from, to, source));
    return;
  }
  const double radius = chord.norm() / (2.0 * std::sin(turn));  // left positive
  const Vector2d center = from + radius * Vector2d(-tangent.y(), tangent.x());
  if (std::abs(turn) <= 0.5 * kPi) {
    pieces.push_back({from, to, center, 2.0 * turn, source});
    return;
  }
  const std::size_t first = pieces.size();
  AppendArc(center, std::abs(radius), std::atan2(from.y() - center.y(), from.x() - center.x()), 2.0 * turn,
            source, pieces);
  pieces[first].from_mm = from;
  pieces.back().to_mm = to;
}

Vector2d BiarcJoint(const Sample& a, const Sample& b) {
  const Vector2d v = b.p - a.p;
  const double along = v.dot(a.tangent + b.tangent);
  const double bend = 2.0 * (1.0 - a.tangent.dot(b.tangent));
  double d = 0.0;
  if (bend < 1e-12) {
    const double forward = v.dot(b.tangent);
    d = std::abs(forward) > 1e-12 * v.norm() ? v.squaredNorm() / (4.0 * forward) : 0.0;
  } else {
    d = (-along + std::sqrt(along * along + bend * v.squaredNorm())) / bend;
  }
  return 0.5 * (a.p + b.p + d * (a.tangent - b.tangent));
}

class Biarcs {
 public:
  Biarcs(const Evaluate& evaluate, double tolerance, std::uint32_t source, Pieces& pieces)
      : evaluate_(evaluate), tolerance_(kShareOfTolerance * tolerance), source_(source), pieces_(pieces) {}

  bool Span(double from, double to, int depth = 0) {
    return Span(from, evaluate_(from), to, evaluate_(to), depth);
  }

 private:
  bool Span(double from, const Sample& a, double to, const Sample& b, int depth) {
    if (!a.p.allFinite() || !b.p.allFinite() || pieces_.size() > kMostPiecesPerCurve ||
        ++spans_ > kMostSpansPerCurve) {
      return false;
    }
    Pieces pair;
    if (depth >= 1 && Fits(from, a, to, b, pair)) {
      pieces_.insert(pieces_.end(), pair.begin(), pair.end());
      return true;
    }
    if (depth >= kDeepestHalving) {
      return (b.p - a.p).norm() < tolerance_;  // a cusp: what is left is smaller than the tolerance
    }
    const double middle = 0.5 * (from + to);
    const Sample m = evaluate_(middle);
    return Span(from, a, middle, m, depth + 1) && Span(middle, m, to, b, depth + 1);
  }

  bool Fits(double from, const Sample& a, double to, const Sample& b, Pieces& pair) const {
    if (a.tangent.isZero() || b.tangent.isZero()) {
      if ((b.p - a.p).norm() > tolerance_) {
        return false;
      }
      pair.push_back(LinePiece(a.p, b.p, source_));
      return true;
    }
    const Vector2d joint = BiarcJoint(a, b);
    AppendTangentArc(a.p, a.tangent, joint, source_, pair);
    const std::size_t first = pair.size();
    AppendTangentArc(b.p, -b.tangent, joint, source_, pair);
    std::reverse(pair.begin() + static_cast<std::ptrdiff_t>(first), pair.end());
    for (std::size_t i = first; i < pair.size(); ++i) {
      pair[i] = Reversed(pair[i]);
    }
    const double chord = (b.p - a.p).norm(), along = Length(pair);
    if (pair.empty() || along > 2.0 * chord) {
      return chord < tolerance_ && along < 4.0 * tolerance_;
    }
    return WithinTolerance(from, to, pair);
  }

  bool WithinTolerance(double from, double to, const Pieces& pair) const {
    for (int i = 1; i < kSamples; ++i) {
      const Vector2d p = evaluate_(from + (to - from) * i / kSamples).p;
      double nearest = 1e300;
      for (const Piece& piece : pair) {
        nearest = std::min(nearest, Distance(piece, p));
      }
      if (!(nearest <= tolerance_)) {
        return false;
      }
    }
    return true;
  }

  const Evaluate& evaluate_;
  double tolerance_;
  std::uint32_t source_;
  Pieces& pieces_;
  int spans_ = 0;
};

bool AppendConic(const ConicCurve& c, double tolerance, std::uint32_t source, Pieces& pieces) {
  const double radius = c.u.norm();
  const bool round =
      std::abs(radius - c.v.norm()) <= 1e-9 * radius && std::abs(c.u.dot(c.v)) <= 1e-9 * radius * radius;
  const double hand = Cross(c.u, c.v) >= 0.0 ? 1.0 : -1.0;
  if (round) {
    const double start = std::atan2(c.u.y(), c.u.x()) + hand * c.start_rad;
    AppendArc(c.center, radius, start, hand * c.sweep_rad, source, pieces);
    return radius > 0.0;
  }
  if (!(std::abs(Cross(c.u, c.v)) > 1e-12 * c.u.norm() * c.v.norm())) {
    return false;  // flattened to a line that runs forth and back
  }
  const Evaluate evaluate = [&c](double t) {
    const double cos = std::cos(t), sin = std::sin(t);
    return Sample{c.center + cos * c.u + sin * c.v, (cos * c.v - sin * c.u).normalized()};
  };
  Biarcs biarcs(evaluate, tolerance, source, pieces);
  const std::size_t first = pieces.size();
  const int spans = std::max(1, static_cast<int>(std::ceil(std::abs(c.sweep_rad) / (0.5 * kPi) - 1e-9)));
  for (int i = 0; i < spans; ++i) {
    if (!biarcs.Span(c.start_rad + c.sweep_rad * i / spans, c.start_rad + c.sweep_rad * (i + 1) / spans)) {
      return false;
    }
  }
  if (std::abs(std::abs(c.sweep_rad) - 2.0 * kPi) < 1e-12 && pieces.size() > first) {
    pieces.back() = Refit(pieces.back(), pieces.back().from_mm, pieces[first].from_mm);
  }
  return true;
}

Sample EvaluateSpline(const SplineCurve& s, std::size_t span, double t) {
  const auto p = static_cast<std::size_t>(s.degree);
  std::vector<Vector3d> d(p + 1);
  for (std::size_t j = 0; j <= p; ++j) {
    const std::size_t i = span - p + j;
    const double w = s.weights.empty() ? 1.0 : s.weights[i];
    d[j] = {w * s.points[i].x(), w * s.points[i].y(), w};
  }
  Vector3d slope = Vector3d::Zero();
  for (std::size_t r = 1; r <= p; ++r) {
    if (r == p && p >= 1) {  // the two points of the last step give the derivative
      const double width = s.knots[span + 1] - s.knots[span];
      slope = width > 0.0 ? Vector3d((d[p] - d[p - 1]) * (static_cast<double>(p) / width)) : Vector3d::Zero();
    }
    for (std::size_t j = p; j >= r; --j) {
      const std::size_t i = span - p + j;
      const double width = s.knots[i + p - r + 1] - s.knots[i];
      const double a = width > 0.0 ? (t - s.knots[i]) / width : 0.0;
      d[j] = (1.0 - a) * d[j - 1] + a * d[j];
    }
  }
  const Vector3d& before = d[p];
  const Vector2d point = before.head<2>() / before.z();
  const Vector2d velocity = (slope.head<2>() - slope.z() * point) / before.z();
  const double speed = velocity.norm();
  return {point, speed > 1e-12 ? Vector2d(velocity / speed) : Vector2d::Zero()};
}

bool AppendSpline(const SplineCurve& s, double tolerance, std::uint32_t source, Pieces& pieces) {
  const auto p = static_cast<std::size_t>(s.degree);
  if (s.degree < 1 || s.points.size() <= p || s.knots.size() != s.points.size() + p + 1) {
    return false;
  }
  for (std::size_t span = p; span < s.points.size(); ++span) {
    const double from = s.knots[span], to = s.knots[span + 1];
    if (!(to > from)) {
      continue;
    }
    const Evaluate evaluate = [&s, span](double t) { return EvaluateSpline(s, span, t); };
    if (s.degree == 1) {
      pieces.push_back(LinePiece(evaluate(from).p, evaluate(to).p, source));
    } else if (!Biarcs(evaluate, tolerance, source, pieces).Span(from, to)) {
      return false;
    }
  }
  return true;
}

}  // namespace

AffineMap operator*(const AffineMap& outer, const AffineMap& inner) {
  return {outer.linear * inner.linear, outer.linear * inner.offset + outer.offset};
}

Curve Mapped(const AffineMap& map, const Curve& curve) {
  const auto point = [&](const Vector2d& p) -> Vector2d { return map.linear * p + map.offset; };
  if (const auto* line = std::get_if<LineCurve>(&curve)) {
    return LineCurve{point(line->from), point(line->to)};
  }
  if (const auto* conic = std::get_if<ConicCurve>(&curve)) {
    ConicCurve mapped = *conic;
    mapped.center = point(conic->center);
    mapped.u = map.linear * conic->u;
    mapped.v = map.linear * conic->v;
    return mapped;
  }
  SplineCurve mapped = std::get<SplineCurve>(curve);
  for (Vector2d& p : mapped.points) {
    p = point(p);
  }
  return mapped;
}

bool AppendPieces(const Curve& curve, double tolerance_mm, std::uint32_t source, Pieces& pieces) {
  const std::size_t first = pieces.size();
  bool followed = true;
  if (const auto* line = std::get_if<LineCurve>(&curve)) {
    pieces.push_back(LinePiece(line->from, line->to, source));
  } else if (const auto* conic = std::get_if<ConicCurve>(&curve)) {
    followed = AppendConic(*conic, tolerance_mm, source, pieces);
  } else {
    followed = AppendSpline(std::get<SplineCurve>(curve), tolerance_mm, source, pieces);
  }
  for (std::size_t i = first; i < pieces.size(); ++i) {
    followed &=
        pieces[i].from_mm.allFinite() && pieces[i].to_mm.allFinite() && pieces[i].center_mm.allFinite();
  }
  const auto gone = std::remove_if(pieces.begin() + static_cast<std::ptrdiff_t>(first), pieces.end(),
                                   [](const Piece& piece) { return !(Length(piece) > 1e-9); });
  pieces.erase(gone, pieces.end());
  return followed;
}

std::string EntityText(const Finding& finding) {
  if (finding.entity.empty()) {
    return {};
  }
  char digits[24] = "";
  if (finding.dxf_handle != 0) {
    std::snprintf(digits, sizeof digits, " %llX", static_cast<unsigned long long>(finding.dxf_handle));
  }
  return finding.entity + digits + " on layer " + finding.layer;
}

}  // namespace lambdajet::trajectory
