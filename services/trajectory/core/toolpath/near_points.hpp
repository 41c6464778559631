// Finds the points of a set that lie nearest to a place; points can be taken out and put back.
//
// Model: k-d tree over a fixed set with a count of present points a node (Bentley, K-d trees for semidynamic point sets,
// 1990). Ties go to the lower index. Frames: any. Units: mm. Threads: a query may stand beside queries.
// Cost: n log n to build, about log n a query or change, however the points are spread.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

namespace lambdajet::trajectory {

class NearPoints {
 public:
  explicit NearPoints(std::vector<Eigen::Vector2d> points_mm);

  void SetPresent(std::size_t point, bool present);
  // At most `count` present points, nearest first.
  std::vector<std::size_t> Nearest(const Eigen::Vector2d& at_mm, std::size_t count) const;

 private:
  using Found = std::vector<std::pair<double, std::size_t>>;
  void Build(std::size_t low, std::size_t high);
  void Visit(std::size_t low, std::size_t high, const Eigen::Vector2d& at, std::size_t count,
             Found& found) const;

  std::vector<Eigen::Vector2d> points_mm_;
  std::vector<std::size_t> order_;    // a node is a range of this; its point stands in the middle
  std::vector<std::size_t> place_;    // of each point in `order_`
  std::vector<int> axis_;             // by middle
  std::vector<std::size_t> present_;  // points in the range, by middle
  std::vector<bool> here_;            // by point
};

}  // namespace lambdajet::trajectory
