#include "inspection/drawing_file/drawing_file.hpp"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <vector>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::inspection {
namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180.0;

class Reader {
 public:
  Drawing Read(const YAML::Node& root) {
    Drawing drawing;
    if (!Keys(root, "drawing", {"name", "kerf_width_mm", "features"})) {
      return drawing;
    }
    drawing.name = Text(root["name"], "name");
    drawing.kerf_width_mm = Number(root["kerf_width_mm"], "kerf_width_mm");
    const YAML::Node features = root["features"];
    if (!features || !features.IsSequence()) {
      Fault(root, "features", "BAD_KEY", "must be a list of features");
      return drawing;
    }
    for (std::size_t i = 0; i < features.size(); ++i) {
      drawing.features.push_back(ReadFeature(features[i], "features[" + std::to_string(i) + "]"));
    }
    return drawing;
  }

  std::vector<FieldViolation> Take() { return std::move(violations_); }

 private:
  void Fault(const YAML::Node& node, const std::string& key, const std::string& reason,
             const std::string& should) {
    const int line = node.IsDefined() && node.Mark().line >= 0 ? node.Mark().line + 1 : 0;
    violations_.push_back({key, "line " + std::to_string(line) + ": " + should, reason});
  }

  bool Keys(const YAML::Node& node, const std::string& at, const std::set<std::string>& known) {
    if (!node || !node.IsMap()) {
      Fault(node, at, "BAD_KEY", "must be a map");
      return false;
    }
    for (const auto& entry : node) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
      if (!known.contains(key)) {
        Fault(entry.first, at + "." + key, "UNKNOWN_KEY", "is not a key here");
      }
    }
    return true;
  }

  std::string Text(const YAML::Node& node, const std::string& at) {
    if (!node || !node.IsScalar()) {
      Fault(node, at, "BAD_VALUE", "must be a word");
      return {};
    }
    return node.Scalar();
  }

  double Number(const YAML::Node& node, const std::string& at) {
    double value = NAN;
    if (!node || !node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
      Fault(node, at, "BAD_VALUE", "must be a finite number");
      return 0.0;
    }
    return value;
  }

  std::vector<double> Numbers(const YAML::Node& node, const std::string& at, std::size_t count) {
    std::vector<double> values(count, 0.0);
    if (!node || !node.IsSequence() || node.size() != count) {
      Fault(node, at, "BAD_VALUE", "must be a list of " + std::to_string(count) + " numbers");
      return values;
    }
    for (std::size_t i = 0; i < count; ++i) {
      values[i] = Number(node[i], at + "[" + std::to_string(i) + "]");
    }
    return values;
  }

  template <class Value>
  Value OneOf(const YAML::Node& node, const std::string& at, const char* first, Value if_first,
              const char* second, Value if_second) {
    const std::string word = Text(node, at);
    if (word != first && word != second) {
      Fault(node, at, "BAD_VALUE", "'" + word + "' must be " + first + " or " + second);
    }
    return word == second ? if_second : if_first;
  }

  Feature ReadFeature(const YAML::Node& node, const std::string& at) {
    Feature feature;
    if (!Keys(node, at, {"name", "kind", "side", "tolerance_mm", "outline"})) {
      return feature;
    }
    feature.name = Text(node["name"], at + ".name");
    feature.kind =
        OneOf(node["kind"], at + ".kind", "contour", FeatureKind::kContour, "hole", FeatureKind::kHole);
    feature.side = OneOf(node["side"], at + ".side", "inside", Side::kInside, "outside", Side::kOutside);
    feature.tolerance_mm = Number(node["tolerance_mm"], at + ".tolerance_mm");
    const YAML::Node outline = node["outline"];
    if (!outline || !outline.IsSequence()) {
      Fault(node, at + ".outline", "BAD_KEY", "must be a list of line, arc and circle");
      return feature;
    }
    for (std::size_t i = 0; i < outline.size(); ++i) {
      ReadElement(outline[i], at + ".outline[" + std::to_string(i) + "]", feature.outline);
    }
    return feature;
  }

  void ReadElement(const YAML::Node& node, const std::string& at, std::vector<OutlineElement>& outline) {
    if (!Keys(node, at, {"line", "arc", "circle"}) || node.size() != 1) {
      Fault(node, at, "BAD_ELEMENT", "must be exactly one of line, arc, circle");
      return;
    }
    if (node["line"]) {
      const auto v = Numbers(node["line"], at + ".line", 4);
      outline.emplace_back(Line{{v[0], v[1]}, {v[2], v[3]}});
    } else if (node["arc"]) {
      outline.emplace_back(ReadArc(node["arc"], at + ".arc", false));
    } else {
      outline.emplace_back(ReadArc(node["circle"], at + ".circle", true));
    }
  }

  Arc ReadArc(const YAML::Node& node, const std::string& at, bool whole) {
    Arc arc;
    const std::set<std::string> keys =
        whole ? std::set<std::string>{"center", "radius"}
              : std::set<std::string>{"center", "radius", "start_deg", "sweep_deg"};
    if (!Keys(node, at, keys)) {
      return arc;
    }
    const auto center = Numbers(node["center"], at + ".center", 2);
    arc.center_W_mm = {center[0], center[1]};
    arc.radius_mm = Number(node["radius"], at + ".radius");
    arc.start_rad = whole ? 0.0 : kRadPerDegree * Number(node["start_deg"], at + ".start_deg");
    arc.sweep_rad =
        whole ? 2.0 * std::numbers::pi : kRadPerDegree * Number(node["sweep_deg"], at + ".sweep_deg");
    return arc;
  }

  std::vector<FieldViolation> violations_;
};

absl::Status BadDrawing(const std::vector<FieldViolation>& violations) {
  const FieldViolation& first = violations.front();
  return InvalidFields("BAD_DRAWING", "drawing: " + first.field + ": " + first.description, violations);
}

}  // namespace

absl::StatusOr<Drawing> ReadDrawing(const std::string& yaml) {
  if (yaml.size() > kLargestDrawingBytes) {
    return BadDrawing({{"drawing", std::to_string(yaml.size()) + " bytes; 4 MiB at most", "TOO_LARGE"}});
  }
  Reader reader;
  Drawing drawing;
  try {
    drawing = reader.Read(YAML::Load(yaml));
  } catch (const YAML::Exception& e) {
    return BadDrawing({{"drawing", e.what(), "NOT_YAML"}});
  }
  std::vector<FieldViolation> violations = reader.Take();
  if (violations.empty()) {
    for (const DrawingFault& fault : ValidateDrawing(drawing)) {
      violations.push_back({fault.key, fault.message, fault.reason});
    }
  }
  if (!violations.empty()) {
    return BadDrawing(violations);
  }
  return drawing;
}

}  // namespace lambdajet::inspection
