#include "inspection/core/comparison.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "inspection/core/segment_grid.hpp"

namespace lambdajet::inspection {
namespace {

constexpr double kSharpRad = 15.0 * std::numbers::pi / 180.0;
constexpr double kAligned = 0.7;   // cosine of the largest angle between cut and outline
constexpr double kSwinging = 0.5;  // of a cut that swings, where none is aligned

struct OutlinePoint {
  Eigen::Vector2d p;
  Eigen::Vector2d n;
  Eigen::Vector2d n_beyond;  // across the nearest sharp corner; n itself where none is near
  double to_corner_mm = INFINITY;
  double weight_mm = 0.0;
};

Eigen::Vector2d LeftOf(const Eigen::Vector2d& t) { return {-t.y(), t.x()}; }

double Turn(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  return std::abs(std::atan2(from.x() * to.y() - from.y() * to.x(), from.dot(to)));
}

// +1 where the jet runs to the left of the outline's sense.
double JetSide(const Feature& feature) {
  const bool left_is_inside = SignedAreaMm2(feature.outline) > 0.0;
  return left_is_inside == (feature.side == Side::kInside) ? 1.0 : -1.0;
}

struct Corners {
  bool at_start = false;
  bool at_end = false;
  Eigen::Vector2d n_before;  // of the neighbour across the start, and across the end
  Eigen::Vector2d n_after;
};

Corners CornersOf(const Feature& feature, std::size_t i, double side) {
  const std::size_t count = feature.outline.size();
  const OutlineElement& element = feature.outline[i];
  const OutlineElement& before = feature.outline[(i + count - 1) % count];
  const OutlineElement& after = feature.outline[(i + 1) % count];
  const Eigen::Vector2d t_before = TangentAt(before, LengthMm(before));
  const Eigen::Vector2d t_after = TangentAt(after, 0.0);
  return {Turn(t_before, TangentAt(element, 0.0)) > kSharpRad,
          Turn(TangentAt(element, LengthMm(element)), t_after) > kSharpRad, side * LeftOf(t_before),
          side * LeftOf(t_after)};
}

void AddElement(const Feature& feature, std::size_t i, double side, std::vector<OutlinePoint>& points) {
  const OutlineElement& element = feature.outline[i];
  const Corners corners = CornersOf(feature, i, side);
  const double length = LengthMm(element);
  const int count = std::max(1, static_cast<int>(std::lround(length / kPointSpacingMm)));
  for (int k = 0; k < count; ++k) {
    const double along = length * (k + 0.5) / count;
    OutlinePoint point;
    point.p = PlaceAt(element, along);
    point.n = point.n_beyond = side * LeftOf(TangentAt(element, along));
    point.weight_mm = length / count;
    if (corners.at_start) {
      point.to_corner_mm = along;
      point.n_beyond = corners.n_before;
    }
    if (corners.at_end && length - along < point.to_corner_mm) {
      point.to_corner_mm = length - along;
      point.n_beyond = corners.n_after;
    }
    points.push_back(point);
  }
}

struct Crossing {
  bool found = false;
  double t_mm = 0.0;
  double sense = 0.0;
};

// Visits each crossing of the point's normal with a piece that runs along the outline.
template <class Visit>
void ForEachCrossing(const SegmentGrid& grid, const OutlinePoint& point, double half_kerf_mm, double aligned,
                     Visit visit) {
  const Eigen::Vector2d along(point.n.y(), -point.n.x());
  grid.Near(point.p, [&](const CutSegment& s) {
    const double ua = along.dot(s.a - point.p);
    const double ub = along.dot(s.b - point.p);
    if ((ua < 0.0) == (ub < 0.0)) {
      return;
    }
    const double ta = point.n.dot(s.a - point.p);
    const double tb = point.n.dot(s.b - point.p);
    const double t = ta + (tb - ta) * ua / (ua - ub);
    const double cosine = along.dot(s.along);
    if (std::abs(t - half_kerf_mm) <= kSearchMm && std::abs(cosine) >= aligned) {
      visit(t, cosine > 0.0 ? 1.0 : -1.0);
    }
  });
}

// Whether the cut runs with or against the outline: the sense of most nearest crossings.
double SenseOfCut(const SegmentGrid& grid, const std::vector<OutlinePoint>& points, double half_kerf_mm) {
  double votes = 0.0;
  for (const OutlinePoint& point : points) {
    Crossing nearest;
    ForEachCrossing(grid, point, half_kerf_mm, kAligned, [&](double t, double sense) {
      if (!nearest.found || std::abs(t - half_kerf_mm) < std::abs(nearest.t_mm - half_kerf_mm)) {
        nearest = {true, t, sense};
      }
    });
    votes += nearest.sense;
  }
  return votes < 0.0 ? -1.0 : 1.0;
}

Crossing DeepestCrossing(const SegmentGrid& grid, const OutlinePoint& point, double half_kerf_mm,
                         double sense, double aligned) {
  Crossing deepest;
  ForEachCrossing(grid, point, half_kerf_mm, aligned, [&](double t, double runs) {
    if (runs == sense && (!deepest.found || t < deepest.t_mm)) {
      deepest = {true, t, runs};
    }
  });
  return deepest;
}

// Distance to the centre line, negative where it runs on the part's side of the corner.
Crossing NearestCut(const SegmentGrid& grid, const OutlinePoint& point, double half_kerf_mm) {
  double best = half_kerf_mm + kSearchMm;
  Crossing nearest;
  grid.Near(point.p, [&](const CutSegment& s) {
    const Eigen::Vector2d d = s.b - s.a;
    const double along = std::clamp(d.dot(point.p - s.a) / d.squaredNorm(), 0.0, 1.0);
    const Eigen::Vector2d gap = s.a + along * d - point.p;
    const double distance = gap.norm();
    if (distance <= best) {
      best = distance;
      const bool in_part = gap.dot(point.n) < 0.0 && gap.dot(point.n_beyond) < 0.0;
      nearest = {true, in_part ? -distance : distance, 0.0};
    }
  });
  return nearest;
}

Crossing FindCut(const SegmentGrid& grid, const OutlinePoint& point, double kerf_mm, double sense) {
  const double half = 0.5 * kerf_mm;
  if (point.to_corner_mm <= kerf_mm) {
    return NearestCut(grid, point, half);
  }
  Crossing crossing = DeepestCrossing(grid, point, half, sense, kAligned);
  if (!crossing.found) {
    crossing = DeepestCrossing(grid, point, half, sense, kSwinging);
  }
  return crossing.found || point.to_corner_mm > kSearchMm ? crossing : NearestCut(grid, point, half);
}

double Percentile(std::vector<std::pair<double, double>>& sorted_value_weight, double fraction) {
  double total = 0.0;
  for (const auto& [value, weight] : sorted_value_weight) {
    total += weight;
  }
  double below = 0.0;
  for (const auto& [value, weight] : sorted_value_weight) {
    below += weight;
    if (below >= fraction * total) {
      return value;
    }
  }
  return sorted_value_weight.empty() ? 0.0 : sorted_value_weight.back().first;
}

template <class ToleranceOf>
FeatureResult Summarise(std::span<const Deviation> deviations, ToleranceOf tolerance_of) {
  FeatureResult result;
  std::vector<std::pair<double, double>> sizes;
  double length = 0.0;
  double cut_length = 0.0;
  double squares = 0.0;
  result.points = static_cast<std::uint32_t>(deviations.size());
  for (const Deviation& d : deviations) {
    length += d.weight_mm;
    if (!d.cut) {
      ++result.not_cut;
      continue;
    }
    const double size = std::abs(d.deviation_mm);
    sizes.emplace_back(size, d.weight_mm);
    cut_length += d.weight_mm;
    squares += d.weight_mm * size * size;
    result.mean_mm += d.weight_mm * d.deviation_mm;
    result.max_mm = std::max(result.max_mm, size);
    result.conforming += size <= tolerance_of(d) ? d.weight_mm : 0.0;
  }
  if (cut_length > 0.0) {
    result.mean_mm /= cut_length;
    result.rms_mm = std::sqrt(squares / cut_length);
  }
  result.conforming = length > 0.0 ? result.conforming / length : 0.0;
  std::ranges::sort(sizes);
  result.p50_mm = Percentile(sizes, 0.50);
  result.p95_mm = Percentile(sizes, 0.95);
  return result;
}

// The circle that all of an outline's elements lie on.
const Arc* CircleOf(const Feature& feature) {
  const Arc* first = std::get_if<Arc>(&feature.outline.front());
  for (const OutlineElement& element : feature.outline) {
    const Arc* arc = std::get_if<Arc>(&element);
    if (first == nullptr || arc == nullptr || (arc->center_W_mm - first->center_W_mm).norm() > 1e-6 ||
        std::abs(arc->radius_mm - first->radius_mm) > 1e-6) {
      return nullptr;
    }
  }
  return first;
}

// Algebraic least squares about the nominal centre; the edge is so near a circle that a geometric fit moves
// nothing.
FittedCircle FitCircle(std::span<const Deviation> deviations, const Arc& nominal) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector2d> edge;
  for (const Deviation& d : deviations) {
    if (d.cut) {
      const Eigen::Vector2d e = d.p_W_mm + d.deviation_mm * d.n_W - nominal.center_W_mm;
      const Eigen::Vector3d row(2.0 * e.x(), 2.0 * e.y(), 1.0);
      A += d.weight_mm * row * row.transpose();
      b += d.weight_mm * row * e.squaredNorm();
      edge.push_back(e);
    }
  }
  FittedCircle circle;
  const Eigen::LDLT<Eigen::Matrix3d> solver(A);
  if (edge.size() < 8 || solver.rcond() < 1e-12) {
    return circle;
  }
  const Eigen::Vector3d x = solver.solve(b);
  const Eigen::Vector2d center = x.head<2>();
  const double square = x[2] + center.squaredNorm();
  if (!(square > 0.0)) {
    return circle;
  }
  double smallest = INFINITY;
  double largest = 0.0;
  for (const Eigen::Vector2d& e : edge) {
    smallest = std::min(smallest, (e - center).norm());
    largest = std::max(largest, (e - center).norm());
  }
  const double radius = std::sqrt(square);
  return {true,          nominal.center_W_mm + center,       radius,
          center.norm(), 2.0 * (radius - nominal.radius_mm), largest - smallest};
}

struct Box {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(INFINITY);
  Eigen::Vector2d high = Eigen::Vector2d::Constant(-INFINITY);
};

Box BoxOf(const std::vector<std::vector<OutlinePoint>>& outlines) {
  Box box;
  for (const auto& outline : outlines) {
    for (const OutlinePoint& point : outline) {
      box.low = box.low.cwiseMin(point.p);
      box.high = box.high.cwiseMax(point.p);
    }
  }
  return box;
}

FeatureResult InspectFeature(const SegmentGrid& grid, const Drawing& drawing, std::uint32_t index,
                             const std::vector<OutlinePoint>& points, std::vector<Deviation>& deviations) {
  const Feature& feature = drawing.features[index];
  const double half = 0.5 * drawing.kerf_width_mm;
  const double sense = SenseOfCut(grid, points, half);
  const std::size_t begin = deviations.size();
  for (const OutlinePoint& point : points) {
    const Crossing cut = FindCut(grid, point, drawing.kerf_width_mm, sense);
    deviations.push_back(
        {point.p, point.n, cut.found ? cut.t_mm - half : 0.0, point.weight_mm, index, cut.found});
  }
  const std::span<const Deviation> own = std::span(deviations).subspan(begin);
  FeatureResult result = Summarise(own, [&feature](const Deviation&) { return feature.tolerance_mm; });
  result.name = feature.name;
  result.tolerance_mm = feature.tolerance_mm;
  result.passed = result.not_cut == 0 && result.max_mm <= feature.tolerance_mm;
  if (const Arc* nominal = CircleOf(feature)) {
    result.circle = FitCircle(own, *nominal);
  }
  return result;
}

}  // namespace

Inspection CompareWithDrawing(const CutPath& path, const Drawing& drawing) {
  std::vector<std::vector<OutlinePoint>> outlines;
  for (const Feature& feature : drawing.features) {
    std::vector<OutlinePoint>& points = outlines.emplace_back();
    const double side = JetSide(feature);
    for (std::size_t i = 0; i < feature.outline.size(); ++i) {
      AddElement(feature, i, side, points);
    }
  }
  const Box box = BoxOf(outlines);
  const SegmentGrid grid(path, box.low, box.high, 0.5 * drawing.kerf_width_mm + kSearchMm);
  Inspection inspection;
  for (std::uint32_t i = 0; i < drawing.features.size(); ++i) {
    inspection.features.push_back(InspectFeature(grid, drawing, i, outlines[i], inspection.deviations));
  }
  inspection.all = Summarise(inspection.deviations, [&drawing](const Deviation& d) {
    return drawing.features[d.feature].tolerance_mm;
  });
  inspection.all.name = "all";
  inspection.all.tolerance_mm = std::ranges::min(drawing.features, {}, &Feature::tolerance_mm).tolerance_mm;
  inspection.all.passed = std::ranges::all_of(inspection.features, &FeatureResult::passed);
  return inspection;
}

}  // namespace lambdajet::inspection
