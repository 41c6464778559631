#include "trajectory/core/feed/contour_check.hpp"

#include <algorithm>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;

constexpr double kCornerCosine = 0.995;  // kinks above 0.1 rad are corners
constexpr double kCornerLook_mm = 2.0;
constexpr double kPieceLook_mm = 1.0;
constexpr double kMetShare = 0.9;   // of the tolerance: so near, a place is met
constexpr int kChords = 8;          // a segment
constexpr double kNoMatter = 0.02;  // of the tolerance: so near, neighbours are not asked

double ToChord(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d d = b - a, r = p - a;
  const double share = d.squaredNorm() > 0.0 ? std::clamp(r.dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
  return (r - share * d).norm();
}

}  // namespace

void ContourCheck::Restart() {
  largest_mm_ = 0.0;
  Rewind();
  FindCorners();
}

void ContourCheck::FindCorners() {
  corners_.clear();
  corner_at_ = 0;
  for (std::size_t i = 0; i < draft_.elements.size(); ++i) {
    const std::vector<PathPiece>& pieces = draft_.elements[i].pieces;
    const double begin_s_mm = draft_.planned[i].begin_s_mm, end_s_mm = draft_.planned[i].end_s_mm();
    for (std::size_t k = 1; k < pieces.size(); ++k) {
      const Vector2d u = PointOn(pieces[k - 1], pieces[k - 1].length_mm).tangent;
      const PathPoint here = PointOn(pieces[k], 0.0);
      // Also where a tighter tolerance ends: the places looked at on either side do not speak for it.
      if (u.dot(here.tangent) < kCornerCosine || pieces[k - 1].tolerance_mm != pieces[k].tolerance_mm) {
        const double s_mm = begin_s_mm + pieces[k].begin_mm;
        corners_.push_back({here.p_mm, s_mm, std::min(s_mm + kCornerLook_mm, end_s_mm),
                            std::min(pieces[k - 1].tolerance_mm, pieces[k].tolerance_mm)});
      }
    }
    if (!pieces.empty() && draft_.FlowsOn(i)) {  // the end of a cut that is left at speed
      corners_.push_back(
          {draft_.elements[i].to_mm, end_s_mm, end_s_mm + kCornerLook_mm, pieces.back().tolerance_mm});
    }
  }
}

void ContourCheck::NearCorners(double s_mm, const Vector2d& a, const Vector2d& b, double time_s) {
  while (corner_at_ < corners_.size() && corners_[corner_at_].s_mm < s_mm - kCornerLook_mm) {
    ++corner_at_;
  }
  for (std::size_t i = corner_at_; i < corners_.size() && corners_[i].s_mm <= s_mm + kCornerLook_mm; ++i) {
    if (s_mm > corners_[i].last_s_mm) {
      continue;
    }
    const double distance = ToChord(corners_[i].p_mm, a, b);
    if (distance < corners_[i].nearest_mm) {
      corners_[i].nearest_mm = distance;
      corners_[i].time_s = time_s;
    }
  }
}

bool ContourCheck::MoveTo(double s_mm) {
  const auto& elements = draft_.elements;
  const auto& planned = draft_.planned;
  while (run_at_ < elements.size() && (!draft_.IsRun(run_at_) || planned[run_at_].end_s_mm() < s_mm)) {
    ++run_at_;
    piece_at_ = 0;
  }
  if (run_at_ == elements.size() || planned[run_at_].begin_s_mm > s_mm) {
    return false;
  }
  const std::vector<PathPiece>& pieces = elements[run_at_].pieces;
  while (piece_at_ + 1 < pieces.size() &&
         pieces[piece_at_ + 1].begin_mm <= s_mm - planned[run_at_].begin_s_mm) {
    ++piece_at_;
  }
  return true;
}

double ContourCheck::Deviation(const Vector2d& p_mm, double s_mm, double exact_from, double& tolerance_mm) {
  if (!MoveTo(s_mm)) {
    return -1.0;
  }
  const std::vector<PathPiece>& pieces = draft_.elements[run_at_].pieces;
  const double offset = s_mm - draft_.planned[run_at_].begin_s_mm;
  tolerance_mm = pieces[piece_at_].tolerance_mm;
  double distance = DistanceTo(pieces[piece_at_], p_mm);
  if (distance <= std::min(std::max(largest_mm_, kNoMatter * tolerance_mm), exact_from * tolerance_mm)) {
    return distance;
  }
  const auto take =
      [&](const PathPiece& piece) {  // the piece that is left by the least share of its tolerance
        const double other = DistanceTo(piece, p_mm);
        if (other * tolerance_mm < distance * piece.tolerance_mm) {
          distance = other;
          tolerance_mm = piece.tolerance_mm;
        }
      };
  for (std::size_t i = piece_at_;
       i-- > 0 && offset - (pieces[i].begin_mm + pieces[i].length_mm) < kPieceLook_mm;) {
    take(pieces[i]);
  }
  for (std::size_t i = piece_at_ + 1; i < pieces.size() && pieces[i].begin_mm - offset < kPieceLook_mm; ++i) {
    take(pieces[i]);
  }
  return distance;
}

double ContourCheck::Missed(const Vector2d& p_mm, double s_mm, double time_s, double look_s) const {
  const PathPiece& here = piece();
  const double enough = kMetShare * here.tolerance_mm;
  const Vector2d place = PointOn(here, s_mm - draft_.planned[run_at_].begin_s_mm - here.begin_mm).p_mm;
  double nearest = (p_mm - place).norm();
  const double apart_s = draft_.segment_s() / kChords;
  const double end_s = draft_.segment_s() * static_cast<double>(draft_.played.size());
  Vector2d before = p_mm, behind = p_mm;
  for (double away = apart_s; nearest > enough && away <= look_s; away += apart_s) {
    const Vector2d earlier = PlayedAt(std::max(0.0, time_s - away)),
                   later = PlayedAt(std::min(end_s, time_s + away));
    nearest = std::min({nearest, ToChord(place, before, earlier), ToChord(place, behind, later)});
    before = earlier;
    behind = later;
  }
  return nearest;
}

Vector2d ContourCheck::PlayedAt(double time_s) const {
  const auto n = std::min(draft_.played.size() - 1, static_cast<std::size_t>(time_s / draft_.segment_s()));
  return draft_.played[n].value(time_s - static_cast<double>(n) * draft_.segment_s());
}

}  // namespace lambdajet::trajectory
