#include "inspection/core/drawing.hpp"

#include <cmath>
#include <numbers>

namespace lambdajet::inspection {
namespace {

constexpr double kClosureMm = 1e-3;
constexpr double kLargestMm = 1e5;

bool Sound(const OutlineElement& element) {
  if (const Line* line = std::get_if<Line>(&element)) {
    return line->from_W_mm.allFinite() && line->to_W_mm.allFinite() && line->from_W_mm.norm() < kLargestMm &&
           line->to_W_mm.norm() < kLargestMm && (line->to_W_mm - line->from_W_mm).norm() > 0.0;
  }
  const Arc& arc = std::get<Arc>(element);
  return arc.center_W_mm.allFinite() && arc.center_W_mm.norm() < kLargestMm && arc.radius_mm > 0.0 &&
         arc.radius_mm < kLargestMm && std::isfinite(arc.start_rad) && arc.sweep_rad != 0.0 &&
         std::abs(arc.sweep_rad) <= 2.0 * std::numbers::pi + 1e-9;
}

void CheckFeature(const Feature& feature, const std::string& at, std::vector<DrawingFault>& faults) {
  if (feature.name.empty()) {
    faults.push_back({at + ".name", "EMPTY_NAME", "a feature needs a name"});
  }
  if (!(feature.tolerance_mm > 0.0 && feature.tolerance_mm < kLargestMm)) {
    faults.push_back({at + ".tolerance_mm", "BAD_TOLERANCE",
                      std::to_string(feature.tolerance_mm) + " mm: must be finite and above 0"});
  }
  if (feature.outline.empty()) {
    faults.push_back({at + ".outline", "EMPTY_OUTLINE", "an outline needs at least one element"});
    return;
  }
  for (std::size_t i = 0; i < feature.outline.size(); ++i) {
    const std::string element = at + ".outline[" + std::to_string(i) + "]";
    if (!Sound(feature.outline[i])) {
      faults.push_back({element, "BAD_ELEMENT", "must be finite, of some length, within 100 m and one turn"});
      return;
    }
  }
  for (std::size_t i = 0; i < feature.outline.size(); ++i) {
    const OutlineElement& next = feature.outline[(i + 1) % feature.outline.size()];
    const double gap =
        (PlaceAt(next, 0.0) - PlaceAt(feature.outline[i], LengthMm(feature.outline[i]))).norm();
    if (gap > kClosureMm) {
      faults.push_back(
          {at + ".outline[" + std::to_string(i) + "]", "OPEN_OUTLINE",
           "the next element starts " + std::to_string(gap) + " mm from its end; 0.001 mm at most"});
    }
  }
}

}  // namespace

double LengthMm(const OutlineElement& element) {
  if (const Line* line = std::get_if<Line>(&element)) {
    return (line->to_W_mm - line->from_W_mm).norm();
  }
  const Arc& arc = std::get<Arc>(element);
  return arc.radius_mm * std::abs(arc.sweep_rad);
}

Eigen::Vector2d PlaceAt(const OutlineElement& element, double along_mm) {
  if (const Line* line = std::get_if<Line>(&element)) {
    return line->from_W_mm + TangentAt(element, along_mm) * along_mm;
  }
  const Arc& arc = std::get<Arc>(element);
  const double angle = arc.start_rad + std::copysign(along_mm / arc.radius_mm, arc.sweep_rad);
  return arc.center_W_mm + arc.radius_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle));
}

Eigen::Vector2d TangentAt(const OutlineElement& element, double along_mm) {
  if (const Line* line = std::get_if<Line>(&element)) {
    return (line->to_W_mm - line->from_W_mm).normalized();
  }
  const Arc& arc = std::get<Arc>(element);
  const double sense = std::copysign(1.0, arc.sweep_rad);
  const double angle = arc.start_rad + sense * along_mm / arc.radius_mm;
  return sense * Eigen::Vector2d(-std::sin(angle), std::cos(angle));
}

double SignedAreaMm2(const std::vector<OutlineElement>& outline) {
  double twice = 0.0;
  for (const OutlineElement& element : outline) {
    const Eigen::Vector2d a = PlaceAt(element, 0.0);
    const Eigen::Vector2d b = PlaceAt(element, LengthMm(element));
    twice += a.x() * b.y() - a.y() * b.x();
    if (const Arc* arc = std::get_if<Arc>(&element)) {  // the segment between chord and arc
      twice += arc->radius_mm * arc->radius_mm * (arc->sweep_rad - std::sin(arc->sweep_rad));
    }
  }
  return twice;
}

std::vector<DrawingFault> ValidateDrawing(const Drawing& drawing) {
  std::vector<DrawingFault> faults;
  if (!(drawing.kerf_width_mm > 0.0 && drawing.kerf_width_mm <= 10.0)) {
    faults.push_back(
        {"kerf_width_mm", "BAD_KERF", std::to_string(drawing.kerf_width_mm) + " mm: must be in (0, 10]"});
  }
  if (drawing.features.empty()) {
    faults.push_back({"features", "NO_FEATURES", "a drawing needs at least one feature"});
  }
  for (std::size_t i = 0; i < drawing.features.size(); ++i) {
    CheckFeature(drawing.features[i], "features[" + std::to_string(i) + "]", faults);
  }
  return faults;
}

}  // namespace lambdajet::inspection
