#include "kinematics/core/workspace.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

#include "kinematics/core/lambda_differential.hpp"
#include "kinematics/core/largest_rectangle.hpp"

namespace lambdajet::kinematics {
namespace {

using Eigen::Vector2d;
using Margins = std::array<double, kPoseLimits>;

constexpr double kNothing = -std::numeric_limits<double>::max();

// Every limit's margin where the mechanism closes; out of reach the shortfall of the link that is too short.
Margins AllMargins(const LambdaMechanism& m, const Vector2d& p) {
  Margins margins;
  margins.fill(std::numeric_limits<double>::max());
  const auto k =
      lambda::CloseInverse<double>(m.geometry, {p.x(), p.y()}, m.working_mode.s1, m.working_mode.s2);
  const double reach_1 = m.geometry.main_mm - std::abs(k.across_1_mm);
  const double reach_2 = m.geometry.second_mm - std::abs(k.across_2_mm);
  margins[0] = reach_1 - m.singular_margin_mm;
  if (reach_1 < 0.0) {
    return margins;
  }
  margins[1] = reach_2 - m.singular_margin_mm;
  if (reach_2 < 0.0) {
    return margins;
  }
  const auto d = lambda::Differentiate(m.geometry, k, m.working_mode, m.rails_apart);
  const auto q = lambda::ReadingsOf(m.geometry, k);
  margins[1] = d.second_distance_mm - m.singular_margin_mm;
  margins[2] = m.assembly_mode * d.parallel_distance_mm - m.singular_margin_mm;
  margins[3] = q.q1_mm - m.travel[0].min_mm;
  margins[4] = m.travel[0].max_mm - q.q1_mm;
  margins[5] = q.q2_mm - m.travel[1].min_mm;
  margins[6] = m.travel[1].max_mm - q.q2_mm;
  return margins;
}

// Where the smallest margin is zero between two points of which one is usable.
Vector2d Crossing(const LambdaMechanism& m, Vector2d usable, Vector2d refused) {
  for (int i = 0; i < 60 && (usable - refused).squaredNorm() > 1e-18; ++i) {
    const Vector2d middle = 0.5 * (usable + refused);
    (FindUsableMargin(m, middle).margin_mm >= 0.0 ? usable : refused) = middle;
  }
  return usable;
}

struct Grid {
  double x_mm = 0.0, y_mm = 0.0, step_mm = 0.0;
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> usable;  // row by row

  Vector2d At(int i, int j) const { return {x_mm + step_mm * i, y_mm + step_mm * j}; }
  bool Usable(int i, int j) const { return usable[static_cast<std::size_t>(j) * columns + i] != 0; }
};

// Everywhere the main link can put the tool, and a cell more, so that the border is never usable.
bool Bound(const LambdaMechanism& m, double step_mm, Grid& grid) {
  const lambda::Rail<double>& rail = m.geometry.rail_1;
  const double from = m.travel[0].min_mm + rail.zero_mm;
  const double to = m.travel[0].max_mm + rail.zero_mm;
  if (!(m.travel[0].min_mm > -kUnlimitedMm && m.travel[0].max_mm < kUnlimitedMm)) {
    return false;
  }
  const Vector2d a = lambda::SliderOn(rail, from);
  const Vector2d b = lambda::SliderOn(rail, to);
  const Vector2d low = a.cwiseMin(b).array() - m.geometry.main_mm - 1.7 * step_mm;
  const Vector2d high = a.cwiseMax(b).array() + m.geometry.main_mm + 1.7 * step_mm;
  constexpr double kMostPoints = 4e6;
  const Vector2d size = high - low;
  grid.step_mm = std::max(step_mm, std::sqrt(size.x() * size.y() / kMostPoints));
  grid.x_mm = low.x();
  grid.y_mm = low.y();
  grid.columns = static_cast<int>(size.x() / grid.step_mm) + 2;
  grid.rows = static_cast<int>(size.y() / grid.step_mm) + 2;
  return true;
}

bool Sample(const LambdaMechanism& m, const WorkspaceOptions& options, Grid& grid) {
  grid.usable.assign(static_cast<std::size_t>(grid.columns) * grid.rows, 0);
  for (int j = 1; j + 1 < grid.rows; ++j) {
    if (options.cancelled && options.cancelled()) {
      return false;
    }
    for (int i = 1; i + 1 < grid.columns; ++i) {
      grid.usable[static_cast<std::size_t>(j) * grid.columns + i] =
          FindUsableMargin(m, grid.At(i, j)).margin_mm >= 0.0;
    }
  }
  return true;
}

// An edge of the grid: from (i, j) to the right (0) or up (1).
using GridEdge = std::int64_t;
GridEdge EdgeOf(const Grid& g, int i, int j, int up) {
  return 2 * (static_cast<GridEdge>(j) * g.columns + i) + up;
}

// Marching squares: each cell joins the edges it is crossed on, usable side to the left; a saddle is joined so that the
// usable corners stay apart.
std::map<GridEdge, GridEdge> JoinCells(const Grid& g) {
  std::map<GridEdge, GridEdge> next;
  for (int j = 0; j + 1 < g.rows; ++j) {
    for (int i = 0; i + 1 < g.columns; ++i) {
      const bool corner[4] = {g.Usable(i, j), g.Usable(i + 1, j), g.Usable(i + 1, j + 1), g.Usable(i, j + 1)};
      const GridEdge edge[4] = {EdgeOf(g, i, j, 0), EdgeOf(g, i + 1, j, 1), EdgeOf(g, i, j + 1, 0),
                                EdgeOf(g, i, j, 1)};
      // Edge k lies between corners k and k + 1, corners counted counter-clockwise. With the usable side on the left a line
      // enters the cell on the edge after a run of usable corners and leaves on the edge before it.
      for (int k = 0; k < 4; ++k) {
        if (corner[k] && !corner[(k + 1) % 4]) {
          int first = k;
          for (int n = 0; n < 3 && corner[(first + 3) % 4]; ++n) {
            first = (first + 3) % 4;
          }
          next[edge[k]] = edge[(first + 3) % 4];
        }
      }
    }
  }
  return next;
}

Vector2d CrossingOn(const LambdaMechanism& m, const Grid& g, GridEdge edge) {
  const auto cell = edge / 2;
  const int i = static_cast<int>(cell % g.columns);
  const int j = static_cast<int>(cell / g.columns);
  const int i2 = edge % 2 == 0 ? i + 1 : i;
  const int j2 = edge % 2 == 0 ? j : j + 1;
  return g.Usable(i, j) ? Crossing(m, g.At(i, j), g.At(i2, j2)) : Crossing(m, g.At(i2, j2), g.At(i, j));
}

std::vector<Outline> Trace(const LambdaMechanism& m, const Grid& g) {
  std::map<GridEdge, GridEdge> next = JoinCells(g);
  std::vector<Outline> outlines;
  while (!next.empty()) {
    Outline outline;
    const GridEdge start = next.begin()->first;
    GridEdge at = start;
    do {
      outline.push_back(CrossingOn(m, g, at));
      const auto step = next.find(at);
      if (step == next.end()) {
        break;
      }
      at = step->second;
      next.erase(step);
    } while (at != start);
    if (outline.size() >= 3) {
      outlines.push_back(std::move(outline));
    }
  }
  return outlines;
}

// Where two limits bind at once, near `p`: Newton on their margins with differences for slopes.
bool FindCorner(const LambdaMechanism& m, PoseLimit a, PoseLimit b, double step_mm, Vector2d& p) {
  const auto ia = static_cast<std::size_t>(a);
  const auto ib = static_cast<std::size_t>(b);
  const Vector2d start = p;
  constexpr double h = 1e-4;
  for (int i = 0; i < 20; ++i) {
    const Margins at = AllMargins(m, p);
    const Margins dx = AllMargins(m, p + Vector2d(h, 0.0));
    const Margins dy = AllMargins(m, p + Vector2d(0.0, h));
    const Vector2d f(at[ia], at[ib]);
    const Vector2d ga((dx[ia] - at[ia]) / h, (dy[ia] - at[ia]) / h);
    const Vector2d gb((dx[ib] - at[ib]) / h, (dy[ib] - at[ib]) / h);
    const double det = lambda::Cross(ga, gb);
    if (!(std::abs(det) > 1e-9) || !f.allFinite() || f.cwiseAbs().maxCoeff() > 1e6) {
      return false;
    }
    const Vector2d step((gb.y() * f.x() - ga.y() * f.y()) / det, (ga.x() * f.y() - gb.x() * f.x()) / det);
    p -= step;
    if (!((p - start).norm() < 10.0 * step_mm)) {
      return false;
    }
    if (step.norm() < 1e-7) {
      return FindUsableMargin(m, p).margin_mm > -1e-4;  // both zero, and no third limit nearer
    }
  }
  return false;
}

// Splits an edge until its middle lies on the boundary, to a quarter of the tolerance; at a corner the corner is the split.
void Refine(const LambdaMechanism& m, const Vector2d& a, const Vector2d& b, const WorkspaceOptions& options,
            int depth, Outline& out) {
  const Vector2d edge = b - a;
  const double length = edge.norm();
  if (depth == 0 || length < 0.25 * options.tolerance_mm) {
    return;
  }
  const PoseLimit at_a = FindUsableMargin(m, a).tightest;
  const PoseLimit at_b = FindUsableMargin(m, b).tightest;
  Vector2d middle = 0.5 * (a + b);
  if (at_a != at_b) {
    Vector2d corner = middle;
    if (FindCorner(m, at_a, at_b, options.grid_mm, corner) && (corner - a).norm() > 1e-6 &&
        (corner - b).norm() > 1e-6) {
      Refine(m, a, corner, options, depth - 1, out);
      out.push_back(corner);
      Refine(m, corner, b, options, depth - 1, out);
      return;
    }
  }
  const Vector2d inward = Vector2d(-edge.y(), edge.x()) / length;
  const bool usable = FindUsableMargin(m, middle).margin_mm >= 0.0;
  // Near a sharp corner a long step across would leave the region on its far side.
  Vector2d other = middle;
  bool across = false;
  for (double reach = 0.5 * length; !across && reach > 0.02 * length; reach *= 0.3) {
    other = middle + (usable ? -reach : reach) * inward;
    across = (FindUsableMargin(m, other).margin_mm >= 0.0) != usable;
  }
  if (!across) {
    return;  // no boundary near this edge: the grid's own crossings stand
  }
  const Vector2d on = usable ? Crossing(m, middle, other) : Crossing(m, other, middle);
  if ((on - middle).norm() > 0.25 * options.tolerance_mm || length > 4.0 * options.grid_mm) {
    Refine(m, a, on, options, depth - 1, out);
    out.push_back(on);
    Refine(m, on, b, options, depth - 1, out);
  }
}

Outline RefineOutline(const LambdaMechanism& m, const Outline& rough, const WorkspaceOptions& options) {
  constexpr int kDepth = 12;
  Outline fine;
  for (std::size_t i = 0; i < rough.size(); ++i) {
    fine.push_back(rough[i]);
    Refine(m, rough[i], rough[(i + 1) % rough.size()], options, kDepth, fine);
  }
  return fine;
}

double AreaOf(const Outline& outline) {
  double twice = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    twice += lambda::Cross(outline[i], outline[(i + 1) % outline.size()]);
  }
  return 0.5 * twice;
}

// What stops one side: of the limits that it touches, the one that lies nearest to it over its whole length.
PoseLimit BindingOn(const LambdaMechanism& m, const Vector2d& from, const Vector2d& to) {
  constexpr int kSamples = 200;
  constexpr double kTouchMm = 0.2;
  Margins least, mean;
  least.fill(std::numeric_limits<double>::max());
  mean.fill(0.0);
  for (int i = 0; i <= kSamples; ++i) {
    const Margins here = AllMargins(m, from + (to - from) * (static_cast<double>(i) / kSamples));
    for (std::size_t k = 0; k < kPoseLimits; ++k) {
      least[k] = std::min(least[k], here[k]);
      mean[k] += std::min(here[k], 1e9) / (kSamples + 1);
    }
  }
  const double touch = *std::min_element(least.begin(), least.end()) + kTouchMm;
  std::size_t binding = 0;
  double nearest = std::numeric_limits<double>::max();
  for (std::size_t k = 0; k < kPoseLimits; ++k) {
    if (least[k] <= touch && mean[k] < nearest) {
      nearest = mean[k];
      binding = k;
    }
  }
  return static_cast<PoseLimit>(binding);
}

std::array<PoseLimit, 4> BindingOf(const LambdaMechanism& m, const Rectangle& r) {
  const Vector2d lower_left(r.x_min_mm, r.y_min_mm), lower_right(r.x_max_mm, r.y_min_mm);
  const Vector2d upper_left(r.x_min_mm, r.y_max_mm), upper_right(r.x_max_mm, r.y_max_mm);
  return {BindingOn(m, lower_left, upper_left), BindingOn(m, lower_right, upper_right),
          BindingOn(m, lower_left, lower_right), BindingOn(m, upper_left, upper_right)};
}

}  // namespace

std::string_view PoseLimitSentence(PoseLimit limit) {
  switch (limit) {
    case PoseLimit::kMainLink:
      return "the main link stands square to its rail (type 1 singularity)";
    case PoseLimit::kSecondLink:
      return "the second link stands square to its rail (type 1 singularity)";
    case PoseLimit::kParallel:
      return "the tool comes to the line of the sliders (type 2 singularity)";
    case PoseLimit::kSlider1Lower:
      return "slider 1 is at the lower end of its travel";
    case PoseLimit::kSlider1Upper:
      return "slider 1 is at the upper end of its travel";
    case PoseLimit::kSlider2Lower:
      return "slider 2 is at the lower end of its travel";
    case PoseLimit::kSlider2Upper:
      return "slider 2 is at the upper end of its travel";
  }
  return "";
}

Reason PoseLimitReason(PoseLimit limit) {
  return limit <= PoseLimit::kParallel ? Reason::kSingular : Reason::kActuatorLimit;
}

UsableMargin FindUsableMargin(const LambdaMechanism& m, const Vector2d& p_DE_mm) {
  if (!m.valid || !p_DE_mm.allFinite()) {
    return {kNothing, PoseLimit::kMainLink};
  }
  const Margins margins = AllMargins(m, p_DE_mm);
  const auto least = std::min_element(margins.begin(), margins.end());
  return {*least, static_cast<PoseLimit>(least - margins.begin())};
}

Workspace ComputeWorkspace(const LambdaMechanism& m, const WorkspaceOptions& options) {
  Workspace workspace;
  Grid grid;
  if (!m.valid) {
    return workspace;
  }
  if (!Bound(m, options.grid_mm, grid)) {
    workspace.reason = Reason::kActuatorLimit;
    return workspace;
  }
  workspace.reason = Reason::kOutOfReach;
  if (!Sample(m, options, grid)) {
    return workspace;
  }
  WorkspaceOptions on_grid = options;
  on_grid.grid_mm = grid.step_mm;
  for (const Outline& rough : Trace(m, grid)) {
    workspace.outlines.push_back(RefineOutline(m, rough, on_grid));
    workspace.area_mm2 += AreaOf(workspace.outlines.back());
  }
  if (workspace.outlines.empty()) {
    return workspace;
  }
  workspace.reason = Reason::kSolved;
  workspace.rectangle = LargestRectangle(workspace.outlines);
  workspace.binding = BindingOf(m, workspace.rectangle);
  return workspace;
}

}  // namespace lambdajet::kinematics
