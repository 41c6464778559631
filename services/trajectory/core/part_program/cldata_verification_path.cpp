#include <algorithm>
#include <array>
#include <cmath>

#include "trajectory/core/part_program/cldata_verification_walks.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kCorner = 1e-6;         // mm/mm
constexpr double kCurvatureStep = 1e-6;  // 1/mm

using Vector = std::array<double, 3>;

struct ExactPoint {
  Vector p, tangent, curvature;
};

struct ExactPiece {
  Vector from{}, to{}, center{};
  double length = 0.0, radius = 0.0, sweep = 0.0, angle = 0.0;
  std::size_t u = 0, v = 1, w = 2;
  std::uint32_t line = 0;

  ExactPoint At(double part) const {
    ExactPoint e{};
    if (sweep == 0.0) {
      for (std::size_t k = 0; k < 3; ++k) {
        e.p[k] = from[k] + part * (to[k] - from[k]);
        e.tangent[k] = (to[k] - from[k]) / length;
      }
      return e;
    }
    const double turn = angle + part * sweep, rate = sweep / length;
    e.p[u] = center[u] + radius * std::cos(turn);
    e.p[v] = center[v] + radius * std::sin(turn);
    e.p[w] = from[w] + part * (to[w] - from[w]);
    e.tangent[u] = -radius * rate * std::sin(turn);
    e.tangent[v] = radius * rate * std::cos(turn);
    e.tangent[w] = (to[w] - from[w]) / length;
    e.curvature[u] = -radius * rate * rate * std::cos(turn);
    e.curvature[v] = -radius * rate * rate * std::sin(turn);
    return e;
  }
};

ExactPiece PieceOf(const Vector& from, const Operation& o) {
  ExactPiece piece;
  piece.from = from;
  piece.to = {o.x_W_mm, o.y_W_mm, o.z_W_mm};
  piece.line = o.line;
  if (o.kind == OperationKind::kFeedArc) {
    piece.w = o.plane == ArcPlane::kXy ? 2 : o.plane == ArcPlane::kZx ? 1 : 0;
    piece.u = (piece.w + 1) % 3;
    piece.v = (piece.w + 2) % 3;
    piece.center = {o.center_x_W_mm, o.center_y_W_mm, o.center_z_W_mm};
    const double du = from[piece.u] - piece.center[piece.u], dv = from[piece.v] - piece.center[piece.v];
    piece.radius = std::hypot(du, dv);
    piece.angle = std::atan2(dv, du);
    piece.sweep = o.sweep_rad;
    piece.length = std::hypot(piece.radius * o.sweep_rad, piece.to[piece.w] - from[piece.w]);
  } else {
    piece.length = std::hypot(piece.to[0] - from[0], piece.to[1] - from[1], piece.to[2] - from[2]);
  }
  return piece;
}

void AddExact(ProgramVerification& result, const ExactPiece& piece, double s) {
  const int steps =
      piece.sweep == 0.0 ? 1 : std::clamp(static_cast<int>(std::abs(piece.sweep) / 0.05), 2, 2000);
  for (int i = 0; i <= steps; ++i) {
    const double part = static_cast<double>(i) / steps;
    const ExactPoint e = piece.At(part);
    result.arguments.push_back(s + part * piece.length);
    result.lines.push_back(piece.line);
    for (std::size_t k = 0; k < result.series.size(); ++k) {
      CoordinateSeries& series = result.series[k];
      series.values.push_back(e.p[k]);
      series.first.push_back(e.tangent[k]);
      series.second.push_back(e.curvature[k]);
      series.peak_first = std::max(series.peak_first, std::abs(e.tangent[k]));
      series.peak_second = std::max(series.peak_second, std::abs(e.curvature[k]));
    }
  }
}

void CompareEnds(ProgramVerification& result, const ExactPiece& before, const ExactPiece& after, double s) {
  const ExactPoint a = before.At(1.0), b = after.At(0.0);
  for (std::size_t k = 0; k < result.series.size(); ++k) {
    const double corner = b.tangent[k] - a.tangent[k], step = b.curvature[k] - a.curvature[k];
    if (std::abs(corner) > kCorner) {
      result.breaks.push_back({after.line, k, 1, s, corner});
    } else if (std::abs(step) > kCurvatureStep) {
      result.breaks.push_back({after.line, k, 2, s, step});
    }
  }
}

}  // namespace

void WalkPath(const std::vector<Operation>& operations, ProgramVerification& result) {
  const bool spatial = std::any_of(operations.begin(), operations.end(),
                                   [](const Operation& o) { return Moves(o) && (o.axes & kAxisZ) != 0; });
  result.series = {{"X, mm", {}, {}, {}}, {"Y, mm", {}, {}, {}}};
  if (spatial) {
    result.series.push_back({"Z, mm", {}, {}, {}});
  }
  Vector at{};
  double s = 0.0;
  ExactPiece before;
  bool joined = false;
  for (const Operation& o : operations) {
    if (Cuts(o)) {
      const ExactPiece piece = PieceOf(at, o);
      if (piece.length > 1e-12) {
        if (joined) {
          CompareEnds(result, before, piece, s);
        } else {
          result.begins.push_back(result.arguments.size());
        }
        AddExact(result, piece, s);
        s += piece.length;
        before = piece;
        joined = true;
      }
    }
    if (Moves(o)) {
      at = {o.x_W_mm, o.y_W_mm, o.z_W_mm};
      joined = joined && Cuts(o);
    }
  }
}

}  // namespace lambdajet::trajectory
