#include "trajectory/core/toolpath/near_points.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lambdajet::trajectory {

using Eigen::Vector2d;

NearPoints::NearPoints(std::vector<Vector2d> points_mm)
    : points_mm_(std::move(points_mm)),
      order_(points_mm_.size()),
      place_(points_mm_.size()),
      axis_(points_mm_.size()),
      present_(points_mm_.size()),
      here_(points_mm_.size(), true) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  Build(0, order_.size());
  for (std::size_t k = 0; k < order_.size(); ++k) {
    place_[order_[k]] = k;
  }
}

void NearPoints::Build(std::size_t low, std::size_t high) {
  if (low >= high) {
    return;
  }
  Vector2d least = points_mm_[order_[low]], most = least;
  for (std::size_t k = low; k < high; ++k) {
    least = least.cwiseMin(points_mm_[order_[k]]);
    most = most.cwiseMax(points_mm_[order_[k]]);
  }
  const std::size_t middle = low + (high - low) / 2;
  const int axis = (most - least).x() >= (most - least).y() ? 0 : 1;
  const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
  std::nth_element(at(low), at(middle), at(high), [&](std::size_t a, std::size_t b) {
    return points_mm_[a][axis] != points_mm_[b][axis] ? points_mm_[a][axis] < points_mm_[b][axis] : a < b;
  });
  axis_[middle] = axis;
  present_[middle] = high - low;
  Build(low, middle);
  Build(middle + 1, high);
}

void NearPoints::SetPresent(std::size_t point, bool present) {
  if (here_[point] == present) {
    return;
  }
  here_[point] = present;
  std::size_t low = 0, high = order_.size();
  while (true) {
    const std::size_t middle = low + (high - low) / 2;
    present_[middle] += present ? 1 : static_cast<std::size_t>(-1);
    if (middle == place_[point]) {
      return;
    }
    (place_[point] < middle ? high : low) = place_[point] < middle ? middle : middle + 1;
  }
}

void NearPoints::Visit(std::size_t low, std::size_t high, const Vector2d& at, std::size_t count,
                       Found& found) const {
  const std::size_t middle = low + (high - low) / 2;
  if (low >= high || present_[middle] == 0) {
    return;
  }
  const Vector2d& p = points_mm_[order_[middle]];
  if (here_[order_[middle]]) {
    const std::pair<double, std::size_t> candidate((p - at).squaredNorm(), order_[middle]);
    if (found.size() < count || candidate < found.back()) {
      found.insert(std::upper_bound(found.begin(), found.end(), candidate), candidate);
      found.resize(std::min(found.size(), count));
    }
  }
  const double beyond = at[axis_[middle]] - p[axis_[middle]];
  const bool lower_first = beyond < 0.0;
  for (const bool lower : {lower_first, !lower_first}) {
    if (lower == lower_first || found.size() < count || beyond * beyond <= found.back().first) {
      Visit(lower ? low : middle + 1, lower ? middle : high, at, count, found);
    }
  }
}

std::vector<std::size_t> NearPoints::Nearest(const Vector2d& at_mm, std::size_t count) const {
  Found found;
  found.reserve(count + 1);
  if (count > 0) {
    Visit(0, order_.size(), at_mm, count, found);
  }
  std::vector<std::size_t> points;
  for (const auto& [distance, point] : found) {
    points.push_back(point);
  }
  return points;
}

}  // namespace lambdajet::trajectory
