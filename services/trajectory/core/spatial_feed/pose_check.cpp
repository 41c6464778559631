#include "trajectory/core/spatial_feed/pose_check.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kCorner = 0.3;  // changes of direction above this must be come near to
constexpr double kCornerLook_mm = 2.0;
constexpr double kDeviationLook_mm = 1.0;
constexpr double kSurelyOwn = 0.02;  // of tolerance: no other piece is asked

Vector3d TurnFromTo(const Quaterniond& from, const Quaterniond& to) {
  const Quaterniond d = to * from.conjugate();
  return (d.w() < 0.0 ? -2.0 : 2.0) * d.vec();
}

Nearness NearnessOf(const Vector3d& tip, const Vector3d& turn, double tolerance_mm, double tolerance_rad) {
  const double p = tip.norm(), w = turn.norm();
  return {p, w, std::max(p / tolerance_mm, w / tolerance_rad)};
}

}  // namespace

void PoseCheck::Restart() {
  largest_mm_ = largest_rad_ = 0.0;
  corner_at_ = piece_at_ = 0;
  FindCorners();
}

void PoseCheck::Rewind() {
  corner_at_ = piece_at_ = 0;
  std::sort(corners_.begin(), corners_.end(),
            [](const SpatialCorner& a, const SpatialCorner& b) { return a.time_s < b.time_s; });
}

void PoseCheck::Keep(const Nearness& nearness) {
  largest_mm_ = std::max(largest_mm_, nearness.tip_mm);
  largest_rad_ = std::max(largest_rad_, nearness.turn_rad);
}

Nearness PoseCheck::NearnessTo(const SpatialPiece& piece, const SpatialKnot& k) const {
  constexpr int kSteps = 3;
  const double rad = draft_.model().motion.corner_tolerance_rad;
  const double wp = 1.0 / (piece.tolerance_mm * piece.tolerance_mm), ww = 1.0 / (rad * rad);
  double offset = std::clamp(k.s_mm - draft_.begin_s_mm() - piece.begin_mm, 0.0, piece.length_mm);
  Nearness nearest;
  for (int i = 0; i <= kSteps; ++i) {
    const SpatialPoint at = PointOn(piece, offset);
    const Vector3d tip = k.tool.p_mm - at.p_mm, turn = TurnFromTo(at.q, k.tool.q);
    const Nearness now = NearnessOf(tip, turn, piece.tolerance_mm, rad);
    if (now.ratio < nearest.ratio) {
      nearest = now;
    }
    const double slope = wp * at.tangent.dot(tip) + ww * at.turn.dot(turn);
    const double bend = wp * at.tangent.squaredNorm() + ww * at.turn.squaredNorm();
    offset = std::clamp(offset + slope / bend, 0.0, piece.length_mm);
  }
  return nearest;
}

Nearness PoseCheck::Deviation(const SpatialKnot& k) {
  const std::vector<SpatialPiece>& pieces = draft_.run().pieces;
  const double offset = k.s_mm - draft_.begin_s_mm();
  while (piece_at_ + 1 < pieces.size() && pieces[piece_at_ + 1].begin_mm <= offset) {
    ++piece_at_;
  }
  Nearness nearest = NearnessTo(pieces[piece_at_], k);
  const auto take = [&](std::size_t i) {
    const Nearness other = NearnessTo(pieces[i], k);
    nearest = other.ratio < nearest.ratio ? other : nearest;
  };
  if (nearest.ratio > kSurelyOwn) {
    for (std::size_t i = piece_at_;
         i-- > 0 && offset - (pieces[i].begin_mm + pieces[i].length_mm) < kDeviationLook_mm;) {
      take(i);
    }
    for (std::size_t i = piece_at_ + 1; i < pieces.size() && pieces[i].begin_mm - offset < kDeviationLook_mm;
         ++i) {
      take(i);
    }
  }
  return nearest;
}

void PoseCheck::FindCorners() {
  corners_.clear();
  const std::vector<SpatialPiece>& pieces = draft_.run().pieces;
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    const SpatialPoint u = PointOn(pieces[k - 1], pieces[k - 1].length_mm), v = PointOn(pieces[k], 0.0);
    if (draft_.Size(v.tangent - u.tangent, v.turn - u.turn) > kCorner) {
      corners_.push_back({v, pieces[k].begin_mm, pieces[k].tolerance_mm, {}, 0.0});
    }
  }
}

void PoseCheck::NearCorners(std::size_t n) {
  const SpatialKnot& k = draft_.knots()[n];
  const double offset = k.s_mm - draft_.begin_s_mm();
  while (corner_at_ < corners_.size() && corners_[corner_at_].offset_mm < offset - kCornerLook_mm) {
    ++corner_at_;
  }
  for (std::size_t i = corner_at_; i < corners_.size() && corners_[i].offset_mm <= offset + kCornerLook_mm;
       ++i) {
    Meet(k, draft_.InputTime_s(n), corners_[i]);
  }
}

void PoseCheck::Meet(const SpatialKnot& k, double time_s, SpatialCorner& corner) const {
  const double rad = draft_.model().motion.corner_tolerance_rad, half = 0.5 * draft_.knot_s();
  const Vector3d &v = k.tool.twist.v_mm_per_s, &w = k.tool.twist.w_rad_per_s;
  const double wp = 1.0 / (corner.tolerance_mm * corner.tolerance_mm), ww = 1.0 / (rad * rad);
  const Vector3d tip = corner.at.p_mm - k.tool.p_mm, turn = TurnFromTo(k.tool.q, corner.at.q);
  const double pace = wp * v.squaredNorm() + ww * w.squaredNorm();
  const double dt = pace > 0.0 ? std::clamp((wp * tip.dot(v) + ww * turn.dot(w)) / pace, -half, half) : 0.0;
  const Vector3d shift = dt * v + 0.5 * dt * dt * k.tool.rate.a_mm_per_s2;
  const Vector3d turned = dt * w + 0.5 * dt * dt * k.tool.rate.alpha_rad_per_s2;
  const Nearness now = NearnessOf(tip - shift, turn - turned, corner.tolerance_mm, rad);
  if (now.ratio < corner.nearest.ratio) {
    corner.nearest = now;
    corner.time_s = time_s;
  }
}

}  // namespace lambdajet::trajectory
