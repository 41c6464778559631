// Measures lines and arcs, the pieces of every contour and toolpath: places, tangents, distances, intersections, offsets.
//
// Model: a piece is a line (sweep 0) or an arc of at most half a turn; longer arcs are split where they are made, so that a
// chord and a sweep always say which arc is meant. A share counts 0 … 1 along a piece and is proportional to its length.
// Frames: W or the drawing's, the same for all pieces of a call. Units: mm, rad. Threads: values and pure functions.
// Cost: tens of ns each; NearPairs n log n where pieces are short against the drawing.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace lambdajet::trajectory {

struct Piece {
  Eigen::Vector2d from_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d center_mm = Eigen::Vector2d::Zero();  // arc
  double sweep_rad = 0.0;                               // counter-clockwise positive, |sweep| <= pi; 0: line
  std::uint32_t source = 0;                             // what it comes from: an entity, or a piece

  bool is_arc() const { return sweep_rad != 0.0; }
};

using Pieces = std::vector<Piece>;

Piece LinePiece(const Eigen::Vector2d& from_mm, const Eigen::Vector2d& to_mm, std::uint32_t source = 0);
// Any sweep up to full turns; appended in parts of at most half a turn.
void AppendArc(const Eigen::Vector2d& center_mm, double radius_mm, double start_rad, double sweep_rad,
               std::uint32_t source, Pieces& pieces);

double Radius(const Piece& piece);
double Length(const Piece& piece);
double Length(const Pieces& pieces);
Eigen::Vector2d PointAt(const Piece& piece, double share);
Eigen::Vector2d TangentAt(const Piece& piece, double share);  // unit
// From the first share to the second.
Piece Part(const Piece& piece, double from_share, double to_share);
Piece Reversed(const Piece& piece);
Pieces Reversed(const Pieces& pieces);
// The same sweep between other ends: moves, turns and scales the piece.
Piece Refit(const Piece& piece, const Eigen::Vector2d& from_mm, const Eigen::Vector2d& to_mm);

// From tangent u to tangent v, -pi … pi.
double TurnBetween(const Eigen::Vector2d& u, const Eigen::Vector2d& v);

// Of the nearest place on the piece.
double NearestShare(const Piece& piece, const Eigen::Vector2d& p_mm);
double Distance(const Piece& piece, const Eigen::Vector2d& p_mm);
// Least distance between two pieces and where it is, on the first.
struct Closeness {
  double distance_mm = 0.0;
  Eigen::Vector2d at_mm = Eigen::Vector2d::Zero();
};
Closeness Nearest(const Piece& a, const Piece& b);

struct Meeting {
  double a_share = 0.0;
  double b_share = 0.0;
  Eigen::Vector2d at_mm = Eigen::Vector2d::Zero();
};
// Places where two pieces cross or touch, at most two; overlapping pieces (one line, one circle) have none here.
struct Meetings {
  Meeting meeting[2];
  int count = 0;
};
Meetings Intersect(const Piece& a, const Piece& b, double tolerance_mm = 1e-9);
// Length over which two pieces lie on each other, and the middle of that.
struct Overlap {
  double length_mm = 0.0;
  Eigen::Vector2d at_mm = Eigen::Vector2d::Zero();
};
Overlap OverlapOf(const Piece& a, const Piece& b, double tolerance_mm);

// Closed outline, counter-clockwise positive.
double SignedArea_mm2(const Pieces& closed);
// Turns of the closed outline around the point; 0: outside.
int Winding(const Pieces& closed, const Eigen::Vector2d& p_mm);

struct Box {
  Eigen::Vector2d low_mm = Eigen::Vector2d::Constant(1e300);
  Eigen::Vector2d high_mm = Eigen::Vector2d::Constant(-1e300);
  void Add(const Eigen::Vector2d& p_mm) {
    low_mm = low_mm.cwiseMin(p_mm);
    high_mm = high_mm.cwiseMax(p_mm);
  }
  void Add(const Box& other) {
    low_mm = low_mm.cwiseMin(other.low_mm);
    high_mm = high_mm.cwiseMax(other.high_mm);
  }
  bool Near(const Box& other, double margin_mm) const {
    return (low_mm.array() <= other.high_mm.array() + margin_mm).all() &&
           (other.low_mm.array() <= high_mm.array() + margin_mm).all();
  }
};
Box BoxOf(const Piece& piece);
Box BoxOf(const Pieces& pieces);

// Finds the pieces whose boxes come near a piece; made once for many questions.
class PieceIndex {
 public:
  explicit PieceIndex(const Pieces& pieces);

  // Calls found(index) in a fixed order; stops when it returns false.
  template <typename Found>
  void ForNear(const Box& box, double margin_mm, Found found) const {
    const double from = box.low_mm.x() - margin_mm - widest_mm_;
    auto at = std::lower_bound(order_.begin(), order_.end(), from,
                               [this](std::uint32_t i, double x_mm) { return boxes_[i].low_mm.x() < x_mm; });
    for (; at != order_.end() && boxes_[*at].low_mm.x() <= box.high_mm.x() + margin_mm; ++at) {
      if (boxes_[*at].Near(box, margin_mm) && !found(static_cast<std::size_t>(*at))) {
        return;
      }
    }
  }

 private:
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> order_;  // by left edge
  double widest_mm_ = 0.0;
};

}  // namespace lambdajet::trajectory
