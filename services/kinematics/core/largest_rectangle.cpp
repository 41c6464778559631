#include "kinematics/core/largest_rectangle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace lambdajet::kinematics {
namespace {

using Eigen::Vector2d;

constexpr int kRaster = 240;  // cells along the longer side

struct Box {
  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::max());
  Vector2d high = Vector2d::Constant(-std::numeric_limits<double>::max());
};

Box BoxOf(std::span<const Outline> outlines) {
  Box box;
  for (const Outline& outline : outlines) {
    for (const Vector2d& p : outline) {
      box.low = box.low.cwiseMin(p);
      box.high = box.high.cwiseMax(p);
    }
  }
  return box;
}

// Where the horizontal line at y crosses the outlines, from left to right: inside between the 1st and 2nd, 3rd and 4th, …
std::vector<double> CrossingsAt(std::span<const Outline> outlines, double y) {
  std::vector<double> crossings;
  for (const Outline& outline : outlines) {
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Vector2d& a = outline[i];
      const Vector2d& b = outline[(i + 1) % outline.size()];
      if ((a.y() <= y) != (b.y() <= y)) {
        crossings.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
      }
    }
  }
  std::sort(crossings.begin(), crossings.end());
  return crossings;
}

struct Raster {
  Vector2d low;
  double cell_mm;
  int columns, rows;
};

// How many rows below and with this one every column is inside, its whole cell counted by both its edges.
void Grow(std::span<const Outline> outlines, const Raster& raster, int row, std::vector<int>& heights) {
  std::vector<char> inside(static_cast<std::size_t>(raster.columns), 0);
  const std::vector<double> crossings = CrossingsAt(outlines, raster.low.y() + (row + 0.5) * raster.cell_mm);
  for (std::size_t k = 0; k + 1 < crossings.size(); k += 2) {
    const int first = static_cast<int>(std::ceil((crossings[k] - raster.low.x()) / raster.cell_mm));
    const int last = static_cast<int>(std::floor((crossings[k + 1] - raster.low.x()) / raster.cell_mm)) - 1;
    for (int i = std::max(0, first); i <= std::min(last, raster.columns - 1); ++i) {
      inside[static_cast<std::size_t>(i)] = 1;
    }
  }
  for (std::size_t i = 0; i < heights.size(); ++i) {
    heights[i] = inside[i] != 0 ? heights[i] + 1 : 0;
  }
}

// The largest rectangle under the histogram that stands on this row.
void BestUnder(const std::vector<int>& heights, const Raster& raster, int row, Rectangle& best) {
  std::vector<int> rising;  // columns of increasing height
  const int columns = static_cast<int>(heights.size());
  for (int i = 0; i <= columns; ++i) {
    const int height = i < columns ? heights[static_cast<std::size_t>(i)] : 0;
    while (!rising.empty() && heights[static_cast<std::size_t>(rising.back())] >= height) {
      const int top = heights[static_cast<std::size_t>(rising.back())];
      rising.pop_back();
      const int left = rising.empty() ? 0 : rising.back() + 1;
      const Rectangle r{raster.low.x() + left * raster.cell_mm,
                        raster.low.y() + (row + 1 - top) * raster.cell_mm,
                        raster.low.x() + i * raster.cell_mm, raster.low.y() + (row + 1) * raster.cell_mm};
      if (r.area_mm2() > best.area_mm2()) {
        best = r;
      }
    }
    rising.push_back(i);
  }
}

Rectangle BestOfRaster(std::span<const Outline> outlines) {
  const Box box = BoxOf(outlines);
  const Vector2d size = box.high - box.low;
  const double cell = size.maxCoeff() / kRaster;
  const Raster raster{box.low, cell, static_cast<int>(size.x() / cell) + 1,
                      static_cast<int>(size.y() / cell) + 1};
  std::vector<int> heights(static_cast<std::size_t>(raster.columns), 0);
  Rectangle best;
  for (int row = 0; row < raster.rows; ++row) {
    Grow(outlines, raster, row, heights);
    BestUnder(heights, raster, row, best);
  }
  return best;
}

// Left and right of the widest rectangle between two heights around x_mid: no outline may enter it. Empty if one does.
Rectangle Widest(std::span<const Outline> outlines, double y_min, double y_max, double x_mid) {
  double left = -std::numeric_limits<double>::max();
  double right = std::numeric_limits<double>::max();
  for (const Outline& outline : outlines) {
    for (std::size_t i = 0; i < outline.size(); ++i) {
      Vector2d a = outline[i];
      Vector2d b = outline[(i + 1) % outline.size()];
      if (a.y() > b.y()) {
        std::swap(a, b);
      }
      if (b.y() <= y_min || a.y() >= y_max) {
        continue;
      }
      // The part of the edge inside the band.
      const double rise = b.y() - a.y();
      const double low = rise > 0.0 ? std::max(0.0, (y_min - a.y()) / rise) : 0.0;
      const double high = rise > 0.0 ? std::min(1.0, (y_max - a.y()) / rise) : 1.0;
      const double x_low = a.x() + low * (b.x() - a.x());
      const double x_high = a.x() + high * (b.x() - a.x());
      if (std::max(x_low, x_high) <= x_mid) {
        left = std::max({left, x_low, x_high});
      } else if (std::min(x_low, x_high) >= x_mid) {
        right = std::min({right, x_low, x_high});
      } else {
        return {};
      }
    }
  }
  const bool bounded =
      left > -std::numeric_limits<double>::max() && right < std::numeric_limits<double>::max();
  return bounded ? Rectangle{left, y_min, right, y_max} : Rectangle{};
}

}  // namespace

Rectangle LargestRectangle(std::span<const Outline> outlines) {
  Rectangle best = BestOfRaster(outlines);
  if (!(best.area_mm2() > 0.0)) {
    return {};
  }
  // The raster looks at the middle of rows; shrink until the polygons agree, then grow.
  double inset = 0.0;
  const double middle = 0.5 * (best.x_min_mm + best.x_max_mm);
  Rectangle exact;
  const double cell = (best.y_max_mm - best.y_min_mm) / 16.0;
  for (int i = 0; i < 8 && !(exact.area_mm2() > 0.0); ++i, inset += 0.5 * cell) {
    exact = Widest(outlines, best.y_min_mm + inset, best.y_max_mm - inset, middle);
  }
  for (double step = 4.0 * cell; step > 1e-4; step *= 0.5) {
    for (bool improved = true; improved;) {
      improved = false;
      const double x_mid = 0.5 * (exact.x_min_mm + exact.x_max_mm);
      const double moves[8][2] = {{-step, 0},    {step, 0},     {0, -step},   {0, step},
                                  {-step, step}, {step, -step}, {step, step}, {-step, -step}};
      for (const auto& move : moves) {
        const double y_min = exact.y_min_mm + move[0];
        const double y_max = exact.y_max_mm + move[1];
        const Rectangle tried = y_max > y_min ? Widest(outlines, y_min, y_max, x_mid) : Rectangle{};
        if (tried.area_mm2() > exact.area_mm2() * (1.0 + 1e-12)) {
          exact = tried;
          improved = true;
        }
      }
    }
  }
  return exact;
}

}  // namespace lambdajet::kinematics
