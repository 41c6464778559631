// Finds the pieces of a cut path near a place without looking at all of them.
//
// Model: square cells over the drawing's box; a piece stands in every cell its own box touches. Where the cut goes at a
// piece is told by places half a millimetre behind and ahead, for single steps of a slow cut are swing and noise.
// Units: mm. Threads: immutable once built. Cost: building linear in pieces; a query looks at nine cells.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "inspection/core/cut_path.hpp"

namespace lambdajet::inspection {

struct CutSegment {
  Eigen::Vector2d a;
  Eigen::Vector2d b;
  Eigen::Vector2d along;  // where the cut goes here; a unit vector
};

class SegmentGrid {
 public:
  // Pieces farther than `reach_mm` from the box cannot matter and are left out.
  SegmentGrid(const CutPath& path, const Eigen::Vector2d& low, const Eigen::Vector2d& high, double reach_mm)
      : low_(low.array() - reach_mm), cell_mm_(std::max({reach_mm, Widest(low, high) / 1000.0, 1.0})) {
    columns_ = 1 + Cell(high.x() + reach_mm - low_.x());
    rows_ = 1 + Cell(high.y() + reach_mm - low_.y());
    Collect(path);
    std::vector<std::size_t> count(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
    ForEachCell([&count](std::size_t cell, std::uint32_t) { ++count[cell + 1]; });
    for (std::size_t i = 1; i < count.size(); ++i) {
      count[i] += count[i - 1];
    }
    begin_ = count;
    index_.resize(count.back());
    ForEachCell([this, &count](std::size_t cell, std::uint32_t segment) { index_[count[cell]++] = segment; });
  }

  // Calls back for each piece in the cells around p; a long piece may come several times.
  template <class Visit>
  void Near(const Eigen::Vector2d& p, Visit visit) const {
    const int x = Cell(p.x() - low_.x());
    const int y = Cell(p.y() - low_.y());
    for (int r = std::max(0, y - 1); r <= std::min(rows_ - 1, y + 1); ++r) {
      for (int c = std::max(0, x - 1); c <= std::min(columns_ - 1, x + 1); ++c) {
        const auto cell = static_cast<std::size_t>(r * columns_ + c);
        for (std::size_t i = begin_[cell]; i < begin_[cell + 1]; ++i) {
          visit(segments_[index_[i]]);
        }
      }
    }
  }

 private:
  static constexpr double kShortestMm = 0.002;  // shorter moves are joined: a pierce stands still for seconds
  static constexpr double kAnchorMm = 0.05;     // between the places that tell directions
  static constexpr double kDirectionMm = 0.5;   // behind and ahead

  static double Widest(const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
    return (high - low).maxCoeff();
  }
  int Cell(double mm) const { return static_cast<int>(std::floor(mm / cell_mm_)); }

  void Collect(const CutPath& path) {
    std::vector<Eigen::Vector2d> anchors;
    std::vector<std::size_t> behind;  // each segment's anchor
    for (const Cut& cut : path.cuts) {
      const std::size_t first = segments_.size();
      anchors.clear();
      behind.clear();
      for (std::size_t i = 0, from = 0; i < cut.size(); ++i) {
        const Eigen::Vector2d& p = cut[i].p_W_mm;
        if (anchors.empty() || (p - anchors.back()).norm() >= kAnchorMm) {
          anchors.push_back(p);
        }
        if ((p - cut[from].p_W_mm).norm() >= kShortestMm) {
          segments_.push_back({cut[from].p_W_mm, p, p - cut[from].p_W_mm});
          behind.push_back(anchors.size() - 1);
          from = i;
        }
      }
      if (!cut.empty()) {
        anchors.push_back(cut.back().p_W_mm);
      }
      for (std::size_t i = first; i < segments_.size(); ++i) {
        SetDirection(anchors, behind[i - first], segments_[i]);
      }
    }
  }

  static void SetDirection(const std::vector<Eigen::Vector2d>& anchors, std::size_t at, CutSegment& segment) {
    const Eigen::Vector2d middle = 0.5 * (segment.a + segment.b);
    const auto near = [&](std::size_t i) { return (anchors[i] - middle).norm() < kDirectionMm; };
    std::size_t from = at;
    while (from > 0 && near(from)) {
      --from;
    }
    std::size_t to = at;
    while (to + 1 < anchors.size() && near(to)) {
      ++to;
    }
    const Eigen::Vector2d chord = anchors[to] - anchors[from];
    segment.along = (chord.norm() >= kAnchorMm ? chord : segment.along).normalized();
  }

  template <class Visit>
  void ForEachCell(Visit visit) const {
    for (std::uint32_t s = 0; s < segments_.size(); ++s) {
      const Eigen::Vector2d from = segments_[s].a.cwiseMin(segments_[s].b) - low_;
      const Eigen::Vector2d to = segments_[s].a.cwiseMax(segments_[s].b) - low_;
      if (!from.allFinite() || !to.allFinite() || to.minCoeff() < 0.0 || from.x() > columns_ * cell_mm_ ||
          from.y() > rows_ * cell_mm_) {
        continue;
      }
      const int right = std::min(columns_ - 1, Cell(std::min(to.x(), columns_ * cell_mm_)));
      const int top = std::min(rows_ - 1, Cell(std::min(to.y(), rows_ * cell_mm_)));
      for (int r = std::max(0, Cell(std::max(from.y(), 0.0))); r <= top; ++r) {
        for (int c = std::max(0, Cell(std::max(from.x(), 0.0))); c <= right; ++c) {
          visit(static_cast<std::size_t>(r * columns_ + c), s);
        }
      }
    }
  }

  Eigen::Vector2d low_;
  double cell_mm_;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<CutSegment> segments_;
  std::vector<std::size_t> begin_;
  std::vector<std::uint32_t> index_;
};

}  // namespace lambdajet::inspection
