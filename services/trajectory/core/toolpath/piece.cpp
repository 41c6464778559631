#include "trajectory/core/toolpath/piece.hpp"

#include <cmath>
#include <numbers>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;
constexpr double kTiny_mm = 1e-12;

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }
Vector2d Left(const Vector2d& v) { return {-v.y(), v.x()}; }
Vector2d Turned(const Vector2d& v, double rad) {
  const double c = std::cos(rad), s = std::sin(rad);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
}

// Share of an arc's point that lies in a direction from the centre; of the two nearest turns the one nearest the arc.
double ArcShare(const Piece& arc, const Vector2d& direction) {
  const double middle = 0.5 * arc.sweep_rad;
  const double from_middle = TurnBetween(Turned(arc.from_mm - arc.center_mm, middle), direction);
  return 0.5 + from_middle / arc.sweep_rad;
}

// Share of a point that is on the line or circle of the piece.
double ShareOf(const Piece& piece, const Vector2d& p) {
  if (piece.is_arc()) {
    return ArcShare(piece, p - piece.center_mm);
  }
  const Vector2d chord = piece.to_mm - piece.from_mm;
  return (p - piece.from_mm).dot(chord) / chord.squaredNorm();
}

void Keep(const Piece& a, const Piece& b, const Vector2d& p, double tolerance_mm, Meetings& found) {
  const double a_share = ShareOf(a, p), b_share = ShareOf(b, p);
  const double slack_a = tolerance_mm / Length(a), slack_b = tolerance_mm / Length(b);
  if (a_share >= -slack_a && a_share <= 1.0 + slack_a && b_share >= -slack_b && b_share <= 1.0 + slack_b &&
      found.count < 2) {
    found.meeting[found.count++] = {std::clamp(a_share, 0.0, 1.0), std::clamp(b_share, 0.0, 1.0), p};
  }
}

void MeetLines(const Piece& a, const Piece& b, double tolerance_mm, Meetings& found) {
  const Vector2d u = a.to_mm - a.from_mm, v = b.to_mm - b.from_mm;
  const double det = Cross(u, v);
  if (std::abs(det) <= 1e-12 * u.norm() * v.norm()) {
    return;
  }
  const double share = Cross(b.from_mm - a.from_mm, v) / det;
  Keep(a, b, a.from_mm + share * u, tolerance_mm, found);
}

void MeetLineArc(const Piece& line, const Piece& arc, bool line_first, double tolerance_mm, Meetings& found) {
  const Vector2d u = (line.to_mm - line.from_mm).normalized();
  const Vector2d foot = line.from_mm + (arc.center_mm - line.from_mm).dot(u) * u;
  const double r = Radius(arc), h = (foot - arc.center_mm).norm();
  if (h > r + tolerance_mm) {
    return;
  }
  const double half = std::sqrt(std::max(0.0, (r - h) * (r + h)));
  const int places = half > kTiny_mm ? 2 : 1;
  for (int i = 0; i < places; ++i) {
    const Vector2d p = foot + (i == 0 ? -half : half) * u;
    line_first ? Keep(line, arc, p, tolerance_mm, found) : Keep(arc, line, p, tolerance_mm, found);
  }
}

void MeetArcs(const Piece& a, const Piece& b, double tolerance_mm, Meetings& found) {
  const Vector2d between = b.center_mm - a.center_mm;
  const double d = between.norm(), ra = Radius(a), rb = Radius(b);
  if (d <= 1e-9 * (ra + rb) || d > ra + rb + tolerance_mm || d < std::abs(ra - rb) - tolerance_mm) {
    return;
  }
  const double along = 0.5 * (d + (ra - rb) * (ra + rb) / d);
  const double half = std::sqrt(std::max(0.0, (ra - along) * (ra + along)));
  const Vector2d u = between / d;
  const int places = half > kTiny_mm ? 2 : 1;
  for (int i = 0; i < places; ++i) {
    Keep(a, b, a.center_mm + along * u + (i == 0 ? half : -half) * Left(u), tolerance_mm, found);
  }
}

// Lower and upper share of `a` between which `b` lies on it, both on one line or circle.
std::pair<double, double> CoveredShares(const Piece& a, const Piece& b) {
  const double s = ShareOf(a, b.from_mm), t = ShareOf(a, b.to_mm);
  if (!a.is_arc()) {
    return {std::min(s, t), std::max(s, t)};
  }
  // Counted from b's middle, so that an arc of half a turn is not taken for its complement.
  const double middle = ShareOf(a, PointAt(b, 0.5)), half = 0.5 * std::abs(b.sweep_rad / a.sweep_rad);
  return {middle - half, middle + half};
}

}  // namespace

Piece LinePiece(const Vector2d& from_mm, const Vector2d& to_mm, std::uint32_t source) {
  return {from_mm, to_mm, Vector2d::Zero(), 0.0, source};
}

void AppendArc(const Vector2d& center_mm, double radius_mm, double start_rad, double sweep_rad,
               std::uint32_t source, Pieces& pieces) {
  const int parts = std::max(1, static_cast<int>(std::ceil(std::abs(sweep_rad) / kPi - 1e-9)));
  const bool whole = std::abs(std::abs(sweep_rad) - 2.0 * kPi) < 1e-12;
  const auto at = [&](double rad) -> Vector2d {
    return center_mm + radius_mm * Vector2d(std::cos(rad), std::sin(rad));
  };
  const Vector2d first = at(start_rad);
  Vector2d from = first;
  for (int i = 1; i <= parts; ++i) {
    const Vector2d to = i == parts && whole ? first : at(start_rad + sweep_rad * i / parts);
    pieces.push_back({from, to, center_mm, sweep_rad / parts, source});
    from = to;
  }
}

double Radius(const Piece& piece) { return (piece.from_mm - piece.center_mm).norm(); }

double Length(const Piece& piece) {
  return piece.is_arc() ? std::abs(piece.sweep_rad) * Radius(piece) : (piece.to_mm - piece.from_mm).norm();
}

double Length(const Pieces& pieces) {
  double length = 0.0;
  for (const Piece& piece : pieces) {
    length += Length(piece);
  }
  return length;
}

Vector2d PointAt(const Piece& piece, double share) {
  if (share <= 0.0 || share >= 1.0) {
    return share <= 0.0 ? piece.from_mm : piece.to_mm;
  }
  if (!piece.is_arc()) {
    return piece.from_mm + share * (piece.to_mm - piece.from_mm);
  }
  return piece.center_mm + Turned(piece.from_mm - piece.center_mm, share * piece.sweep_rad);
}

Vector2d TangentAt(const Piece& piece, double share) {
  if (!piece.is_arc()) {
    return (piece.to_mm - piece.from_mm).normalized();
  }
  const Vector2d out = Turned(piece.from_mm - piece.center_mm, share * piece.sweep_rad).normalized();
  return piece.sweep_rad > 0.0 ? Left(out) : Vector2d(-Left(out));
}

Piece Part(const Piece& piece, double from_share, double to_share) {
  Piece part = piece;
  part.from_mm = PointAt(piece, from_share);
  part.to_mm = PointAt(piece, to_share);
  part.sweep_rad = piece.sweep_rad * (to_share - from_share);
  return part;
}

Piece Reversed(const Piece& piece) {
  return {piece.to_mm, piece.from_mm, piece.center_mm, -piece.sweep_rad, piece.source};
}

Pieces Reversed(const Pieces& pieces) {
  Pieces back;
  back.reserve(pieces.size());
  for (auto at = pieces.rbegin(); at != pieces.rend(); ++at) {
    back.push_back(Reversed(*at));
  }
  return back;
}

Piece Refit(const Piece& piece, const Vector2d& from_mm, const Vector2d& to_mm) {
  Piece fitted = piece;
  fitted.from_mm = from_mm;
  fitted.to_mm = to_mm;
  if (piece.is_arc()) {
    const Vector2d half = 0.5 * (to_mm - from_mm);
    fitted.center_mm = from_mm + half + Left(half) / std::tan(0.5 * piece.sweep_rad);
  }
  return fitted;
}

double TurnBetween(const Vector2d& u, const Vector2d& v) { return std::atan2(Cross(u, v), u.dot(v)); }

double NearestShare(const Piece& piece, const Vector2d& p_mm) {
  const bool pole = piece.is_arc() && (p_mm - piece.center_mm).squaredNorm() < 1e-24;
  const double share = pole ? 0.0 : ShareOf(piece, p_mm);
  if (share >= 0.0 && share <= 1.0) {
    return share;
  }
  return (p_mm - piece.from_mm).squaredNorm() <= (p_mm - piece.to_mm).squaredNorm() ? 0.0 : 1.0;
}

double Distance(const Piece& piece, const Vector2d& p_mm) {
  const double share = NearestShare(piece, p_mm);
  if (share <= 0.0 || share >= 1.0) {
    return (p_mm - PointAt(piece, share)).norm();
  }
  return piece.is_arc() ? std::abs((p_mm - piece.center_mm).norm() - Radius(piece))
                        : std::abs(Cross(TangentAt(piece, 0.0), p_mm - piece.from_mm));
}

Closeness Nearest(const Piece& a, const Piece& b) {
  const Meetings meetings = Intersect(a, b);
  if (meetings.count > 0) {
    return {0.0, meetings.meeting[0].at_mm};
  }
  Closeness best{1e300, a.from_mm};
  const auto consider = [&](const Vector2d& on_a) {
    const double d = Distance(b, on_a);
    if (d < best.distance_mm) {
      best = {d, on_a};
    }
  };
  consider(a.from_mm);
  consider(a.to_mm);
  for (const Vector2d& end : {b.from_mm, b.to_mm}) {
    consider(PointAt(a, NearestShare(a, end)));
  }
  // The common normal passes through the centres.
  if (a.is_arc()) {
    const Vector2d far = b.is_arc() ? b.center_mm : PointAt(b, NearestShare(b, a.center_mm));
    consider(PointAt(a, NearestShare(a, far)));
    consider(PointAt(a, NearestShare(a, 2.0 * a.center_mm - far)));
  } else if (b.is_arc()) {
    consider(PointAt(a, NearestShare(a, b.center_mm)));
  }
  return best;
}

Meetings Intersect(const Piece& a, const Piece& b, double tolerance_mm) {
  Meetings found;
  if (Length(a) <= kTiny_mm || Length(b) <= kTiny_mm) {
    return found;
  }
  if (!a.is_arc() && !b.is_arc()) {
    MeetLines(a, b, tolerance_mm, found);
  } else if (a.is_arc() && b.is_arc()) {
    MeetArcs(a, b, tolerance_mm, found);
  } else {
    MeetLineArc(a.is_arc() ? b : a, a.is_arc() ? a : b, !a.is_arc(), tolerance_mm, found);
  }
  return found;
}

Overlap OverlapOf(const Piece& a, const Piece& b, double tolerance_mm) {
  if (a.is_arc() != b.is_arc() || Length(a) <= kTiny_mm || Length(b) <= kTiny_mm) {
    return {};
  }
  const auto on = [&](double share) {
    const Vector2d p = PointAt(b, share);
    return a.is_arc() ? std::abs((p - a.center_mm).norm() - Radius(a)) <= tolerance_mm
                      : std::abs(Cross(TangentAt(a, 0.0), p - a.from_mm)) <= tolerance_mm;
  };
  if (!on(0.0) || !on(0.5) || !on(1.0)) {
    return {};
  }
  const auto [low, high] = CoveredShares(a, b);
  const double from = std::max(0.0, low), to = std::min(1.0, high);
  if (to <= from) {
    return {};
  }
  return {(to - from) * Length(a), PointAt(a, 0.5 * (from + to))};
}

double SignedArea_mm2(const Pieces& closed) {
  double twice = 0.0;
  const Vector2d origin = closed.empty() ? Vector2d(0.0, 0.0) : closed.front().from_mm;
  for (const Piece& p : closed) {
    twice += Cross(p.from_mm - origin, p.to_mm - origin);
    if (p.is_arc()) {
      const double r = Radius(p);
      twice += r * r * (p.sweep_rad - std::sin(p.sweep_rad));
    }
  }
  return 0.5 * twice;
}

int Winding(const Pieces& closed, const Vector2d& p_mm) {
  double turned = 0.0;
  for (const Piece& piece : closed) {
    turned += TurnBetween(piece.from_mm - p_mm, piece.to_mm - p_mm);
    if (!piece.is_arc()) {
      continue;
    }
    // Between chord and arc the arc goes round the other way than its chord.
    const double side = Cross(piece.to_mm - piece.from_mm, p_mm - piece.from_mm);
    if ((p_mm - piece.center_mm).norm() < Radius(piece) && side * piece.sweep_rad < 0.0) {
      turned += std::copysign(2.0 * kPi, piece.sweep_rad);
    }
  }
  return static_cast<int>(std::lround(turned / (2.0 * kPi)));
}

Box BoxOf(const Piece& piece) {
  Box box;
  box.Add(piece.from_mm);
  box.Add(piece.to_mm);
  if (piece.is_arc()) {
    const double r = Radius(piece);
    for (const Vector2d& way : {Vector2d(1, 0), Vector2d(0, 1), Vector2d(-1, 0), Vector2d(0, -1)}) {
      const double share = ArcShare(piece, way);
      if (share > 0.0 && share < 1.0) {
        box.Add(piece.center_mm + r * way);
      }
    }
  }
  return box;
}

Box BoxOf(const Pieces& pieces) {
  Box box;
  for (const Piece& piece : pieces) {
    box.Add(BoxOf(piece));
  }
  return box;
}

PieceIndex::PieceIndex(const Pieces& pieces) {
  boxes_.reserve(pieces.size());
  for (const Piece& piece : pieces) {
    boxes_.push_back(BoxOf(piece));
    widest_mm_ = std::max(widest_mm_, boxes_.back().high_mm.x() - boxes_.back().low_mm.x());
  }
  order_.resize(pieces.size());
  std::iota(order_.begin(), order_.end(), 0u);
  std::stable_sort(order_.begin(), order_.end(), [this](std::uint32_t i, std::uint32_t j) {
    return boxes_[i].low_mm.x() < boxes_[j].low_mm.x();
  });
}

}  // namespace lambdajet::trajectory
