#include "trajectory/drawing/dxf_file.hpp"

#include <dime/Input.h>
#include <dime/Model.h>
#include <dime/entities/Arc.h>
#include <dime/entities/Block.h>
#include <dime/entities/Circle.h>
#include <dime/entities/Ellipse.h>
#include <dime/entities/Insert.h>
#include <dime/entities/Line.h>
#include <dime/entities/Polyline.h>
#include <dime/entities/Spline.h>
#include <dime/entities/Vertex.h>
#include <dime/sections/EntitiesSection.h>
#include <dime/sections/HeaderSection.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <numbers>

#include "trajectory/drawing/dxf_guard.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;
constexpr double kDegree_rad = kPi / 180.0;
constexpr int kDeepestBlock = 16;
constexpr std::size_t kMostEntities = 200'000;
constexpr std::size_t kMostCurves = 2'000'000;
constexpr int kHighestDegree = 15;
constexpr double kFarthest_mm = 1e6;

// From the origin, at most.
double FarthestOf(const LineCurve& c) { return std::max(c.from.norm(), c.to.norm()); }
double FarthestOf(const ConicCurve& c) { return c.center.norm() + c.u.norm() + c.v.norm(); }
double FarthestOf(const SplineCurve& c) {
  double farthest = 0.0;
  for (const Vector2d& p : c.points) {
    farthest = std::max(farthest, p.norm());
  }
  return farthest;
}

// $INSUNITS, from the DXF reference.
double UnitMm(int code) {
  switch (code) {
    case 1:
      return 25.4;
    case 2:
      return 304.8;
    case 4:
      return 1.0;
    case 5:
      return 10.0;
    case 6:
      return 1000.0;
    case 8:
      return 25.4e-6;
    case 9:
      return 25.4e-3;
    case 10:
      return 914.4;
    case 13:
      return 1e-3;
    case 14:
      return 100.0;
    default:
      return 0.0;
  }
}

class DxfReader {
 public:
  explicit DxfReader(GuardedDxf guarded) : guarded_(std::move(guarded)) {
    drawing_.findings = guarded_.findings;
  }

  Drawing Read() {
    if (guarded_.text.empty()) {
      return std::move(drawing_);
    }
    const std::unique_ptr<FILE, int (*)(FILE*)> file(
        fmemopen(guarded_.text.data(), guarded_.text.size(), "r"), fclose);
    dimeModel model;
    dimeInput input;
    if (!file || !input.setFileHandle(file.get()) || !model.read(&input)) {
      Tell("BAD_STRUCTURE", "", 0, "the library cannot read the drawing");
      return std::move(drawing_);
    }
    ReadUnits(model);
    if (auto* entities = static_cast<dimeEntitiesSection*>(model.findSection("ENTITIES"))) {
      for (int i = 0; i < entities->getNumEntities() && !full_; ++i) {
        Add(*entities->getEntity(i), AffineMap{}, "", 0);
      }
    }
    TellHidden();
    return std::move(drawing_);
  }

 private:
  void Tell(std::string_view reason, std::string entity, std::uint32_t line, std::string message,
            bool blocks = true) {
    drawing_.findings.push_back(
        {reason, blocks, layer_, std::move(entity), line, at_, 0.0, std::move(message), HandleAt(line)});
  }
  // About the whole drawing, so that no option leaves it out.
  void TellWhole(std::string_view reason, std::uint32_t line, std::string message) {
    drawing_.findings.push_back({reason, true, "", "", line, {0, 0}, 0.0, std::move(message)});
    full_ = true;
  }
  std::uint64_t HandleAt(std::uint32_t line) const {
    const auto at = std::lower_bound(guarded_.handles.begin(), guarded_.handles.end(),
                                     std::pair<std::uint32_t, std::uint64_t>(line, 0));
    return at != guarded_.handles.end() && at->first == line ? at->second : 0;
  }
  void TellHidden() {
    for (const auto& [layer, count] : hidden_) {
      drawing_.findings.push_back({"LAYER_HIDDEN",
                                   false,
                                   layer,
                                   "",
                                   0,
                                   {0, 0},
                                   0.0,
                                   "layer " + layer + " is switched off or frozen; its " +
                                       std::to_string(count) + " entities are left out"});
    }
  }

  // The double that the file says; what the library carries is its place in the table.
  double Exact(float place) const {
    const auto index = static_cast<std::size_t>(std::max(0.0f, place));
    return index < guarded_.numbers.size() ? guarded_.numbers[index] : 0.0;
  }
  Vector3d Exact(const dimeVec3f& v) const { return {Exact(v[0]), Exact(v[1]), Exact(v[2])}; }

  void ReadUnits(const dimeModel& model) {
    const auto* header = static_cast<const dimeHeaderSection*>(model.findSection("HEADER"));
    int code = 0;
    dimeParam value;
    if (header != nullptr && header->getVariable("$INSUNITS", &code, &value, 1) == 1 && code == 70) {
      drawing_.unit_mm = UnitMm(value.int16_data);
    }
  }

  // ---- entities ----

  void Add(dimeEntity& entity, const AffineMap& map, const std::string& inserted_on, int depth) {
    dimeParam carried;
    line_ = entity.getRecord(kLineCarrierCode, carried)
                ? static_cast<std::uint32_t>(Exact(carried.double_data))
                : 0;
    layer_ = entity.getLayerName() == nullptr ? "0" : entity.getLayerName();
    if (layer_ == "0" && depth > 0) {
      layer_ = inserted_on;
    }
    type_ = entity.getRecord(kLightCarrierCode, carried) ? "LWPOLYLINE" : entity.getEntityName();
    curves_.clear();
    if (Hidden(entity)) {
      return;
    }
    const std::size_t told = drawing_.findings.size();
    switch (entity.typeId()) {
      case dimeBase::dimeInsertType:
        return Insert(static_cast<dimeInsert&>(entity), map, depth);
      case dimeBase::dimeLineType:
        Line(static_cast<dimeLine&>(entity), map);
        break;
      case dimeBase::dimeArcType:
        Arc(static_cast<dimeArc&>(entity), map);
        break;
      case dimeBase::dimeCircleType:
        Circle(static_cast<dimeCircle&>(entity), map);
        break;
      case dimeBase::dimeEllipseType:
        Ellipse(static_cast<dimeEllipse&>(entity), map);
        break;
      case dimeBase::dimePolylineType:
        Polyline(static_cast<dimePolyline&>(entity), map);
        break;
      case dimeBase::dimeSplineType:
        Spline(static_cast<dimeSpline&>(entity), map);
        break;
      default:
        Tell("UNKNOWN_ENTITY", type_, line_, type_ + " is no contour");
    }
    if (curves_.empty() && drawing_.findings.size() == told) {
      Tell("NO_LENGTH", type_, line_, "begins and ends in one place without a way between; left out", false);
    }
    Keep();
  }

  // An insertion on a layer that is only off shows what stands on other layers.
  bool Hidden(dimeEntity& entity) {
    std::string name = layer_;
    std::transform(name.begin(), name.end(), name.begin(),
                   [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
    const auto found = guarded_.hidden_layers.find(name);
    if (found == guarded_.hidden_layers.end() ||
        (entity.typeId() == dimeBase::dimeInsertType && found->second == HiddenLayer::kOff)) {
      return false;
    }
    ++hidden_[layer_];
    return true;
  }

  void StandAt(const AffineMap& map, const Vector2d& point) { at_ = map.linear * point + map.offset; }

  void Keep() {
    if (curves_.empty() || !Near()) {
      return;
    }
    curve_count_ += curves_.size();
    drawing_.entities.push_back({type_, layer_, line_, std::move(curves_), HandleAt(line_)});
    curves_.clear();
    if (drawing_.entities.size() >= kMostEntities || curve_count_ >= kMostCurves) {
      TellWhole("DXF_TOO_LARGE", 0, "the drawing has more than 200000 entities or two million curves");
    }
  }

  // Contours of whole countries cost hours to compare with each other, and no sheet holds them.
  bool Near() {
    double farthest = 0.0;
    for (const Curve& curve : curves_) {
      farthest = std::max(farthest, std::visit([](const auto& c) { return FarthestOf(c); }, curve));
    }
    const double farthest_mm = farthest * (drawing_.unit_mm > 0.0 ? drawing_.unit_mm : 1.0);
    if (farthest_mm > kFarthest_mm) {
      char text[160];
      std::snprintf(text, sizeof text,
                    "reaches %.4g m from the origin, 1000 m is the most; move the drawing to the origin, or "
                    "mend its unit",
                    farthest_mm / 1e3);
      Tell("ENTITY_TOO_FAR", type_, line_, text);
      return false;
    }
    return true;
  }

  void Push(const AffineMap& map, const Curve& curve) { curves_.push_back(Mapped(map, curve)); }

  // Object coordinates seen from below are mirrored; other directions do not lie in the plane.
  bool InPlane(const dimeVec3f& extrusion, const AffineMap& map, AffineMap& object) {
    const Vector3d n = Exact(extrusion);
    object = map;
    if (n.head<2>().norm() > kFlat * std::abs(n.z()) || n.z() == 0.0) {
      Tell("ENTITY_NOT_IN_PLANE", type_, line_, "the entity does not lie in the plane of the drawing");
      return false;
    }
    if (n.z() < 0.0) {
      AffineMap mirror;
      mirror.linear(0, 0) = -1.0;
      object = map * mirror;
    }
    return true;
  }
  bool Flat(double dz) {
    if (std::abs(dz) > kFlat) {
      Tell("ENTITY_NOT_IN_PLANE", type_, line_, "the entity climbs; its Z must not change");
      return false;
    }
    return true;
  }
  bool Sound(bool holds, const char* message) {
    if (!holds) {
      Tell("BAD_CURVE", type_, line_, message);
    }
    return holds;
  }

  void Line(const dimeLine& line, const AffineMap& map) {
    const Vector3d a = Exact(line.getCoords(0)), b = Exact(line.getCoords(1));
    StandAt(map, a.head<2>());
    if (Flat(a.z() - b.z()) && a.head<2>() != b.head<2>()) {
      Push(map, LineCurve{a.head<2>(), b.head<2>()});
    }
  }

  void PushArc(const AffineMap& map, const Vector2d& center, double radius, double start, double sweep) {
    if (Sound(radius > 0.0, "the radius must be above 0")) {
      Push(map, ConicCurve{center, {radius, 0.0}, {0.0, radius}, start, sweep});
    }
  }

  void Arc(const dimeArc& arc, const AffineMap& map) {
    AffineMap object;
    dimeVec3f center;
    arc.getCenter(center);
    StandAt(map, Exact(center).head<2>());
    if (!InPlane(arc.getExtrusionDir(), map, object)) {
      return;
    }
    StandAt(object, Exact(center).head<2>());
    const double start = Exact(arc.getStartAngle()) * kDegree_rad;
    double sweep = std::fmod(Exact(arc.getEndAngle()) * kDegree_rad - start, 2.0 * kPi);
    sweep = sweep <= 1e-12 ? sweep + 2.0 * kPi : sweep;
    PushArc(object, Exact(center).head<2>(), Exact(arc.getRadius()), start, sweep);
  }

  void Circle(const dimeCircle& circle, const AffineMap& map) {
    AffineMap object;
    StandAt(map, Exact(circle.getCenter()).head<2>());
    if (InPlane(circle.getExtrusionDir(), map, object)) {
      StandAt(object, Exact(circle.getCenter()).head<2>());
      PushArc(object, Exact(circle.getCenter()).head<2>(), Exact(circle.getRadius()), 0.0, 2.0 * kPi);
    }
  }

  void Ellipse(const dimeEllipse& ellipse, const AffineMap& map) {
    AffineMap unused;
    const Vector3d major = Exact(ellipse.getMajorAxisEndpoint());
    StandAt(map, Exact(ellipse.getCenter()).head<2>());
    if (!InPlane(ellipse.getExtrusionDir(), map, unused) || !Flat(major.z())) {
      return;
    }
    const double ratio = Exact(ellipse.getMinorMajorRatio());
    const double hand = Exact(ellipse.getExtrusionDir()).z() < 0.0 ? -1.0 : 1.0;
    const double start = Exact(ellipse.getStartParam());
    double sweep = Exact(ellipse.getEndParam()) - start;
    if (!Sound(ratio > 0.0 && ratio <= 1.0 + 1e-9 && major.norm() > 0.0,
               "an ellipse needs axes and a ratio above 0, at most 1") ||
        !Sound(std::abs(sweep) <= 4.0 * kPi, "an ellipse's parameters are angles in radians")) {
      return;
    }
    while (sweep <= 1e-12) {
      sweep += 2.0 * kPi;
    }
    sweep = std::abs(sweep - 2.0 * kPi) < 1e-6 ? 2.0 * kPi : std::min(sweep, 2.0 * kPi);
    const Vector2d u = major.head<2>();
    Push(map, ConicCurve{Exact(ellipse.getCenter()).head<2>(), u, hand * ratio * Vector2d(-u.y(), u.x()),
                         start, sweep});
  }

  // A line, or the arc whose quarter sweep has the bulge for its tangent.
  void Edge(const AffineMap& map, const Vector2d& from, const Vector2d& to, double bulge) {
    const Vector2d chord = to - from;
    if (chord.norm() == 0.0) {
      return;
    }
    if (std::abs(bulge) < 1e-12) {
      Push(map, LineCurve{from, to});
      return;
    }
    const double sweep = 4.0 * std::atan(bulge);
    const double height = (1.0 - bulge * bulge) / (4.0 * bulge);  // of the centre over the chord, in chords
    const Vector2d center = from + 0.5 * chord + height * Vector2d(-chord.y(), chord.x());
    const Vector2d out = from - center;
    PushArc(map, center, out.norm(), std::atan2(out.y(), out.x()), sweep);
  }

  void Polyline(dimePolyline& polyline, const AffineMap& map) {
    AffineMap object;
    constexpr int kMesh = dimePolyline::IS_POLYMESH_3D | dimePolyline::IS_POLYFACE_MESH;
    if ((polyline.getFlags() & kMesh) != 0) {
      return Tell("UNKNOWN_ENTITY", type_, line_, "a mesh is no contour");
    }
    const int n = polyline.getNumCoordVertices();
    const auto at = [&](int i) -> Vector2d {
      return Exact(polyline.getCoordVertex(i)->getCoords()).head<2>();
    };
    StandAt(map, n > 0 ? at(0) : Vector2d(Vector2d::Zero()));
    if (!InPlane(polyline.getExtrusionDir(), map, object)) {
      return;
    }
    StandAt(object, n > 0 ? at(0) : Vector2d(Vector2d::Zero()));
    const int edges = n < 2 ? 0 : (polyline.getFlags() & 1) != 0 ? n : n - 1;
    for (int i = 0; i < edges; ++i) {
      dimeParam bulge;
      const bool bent = polyline.getCoordVertex(i)->getRecord(42, bulge);
      Edge(object, at(i), at((i + 1) % n), bent ? Exact(bulge.double_data) : 0.0);
    }
  }

  void Spline(const dimeSpline& spline, const AffineMap& map) {
    SplineCurve curve;
    curve.degree = spline.getDegree();
    const int n = spline.getNumControlPoints();
    StandAt(map, n > 0 ? Vector2d(Exact(spline.getControlPoint(0)).head<2>()) : Vector2d(Vector2d::Zero()));
    for (int i = 0; i < spline.getNumKnots(); ++i) {
      curve.knots.push_back(Exact(spline.getKnotValue(i)));
    }
    for (int i = 0; i < n; ++i) {
      const Vector3d p = Exact(spline.getControlPoint(i));
      if (!Flat(p.z() - Exact(spline.getControlPoint(0)).z())) {
        return;
      }
      curve.points.push_back(p.head<2>());
      if (spline.hasWeights()) {
        curve.weights.push_back(Exact(spline.getWeight(i)));
      }
    }
    const bool knots = std::is_sorted(curve.knots.begin(), curve.knots.end()) &&
                       static_cast<int>(curve.knots.size()) == n + curve.degree + 1;
    const bool weights =
        std::all_of(curve.weights.begin(), curve.weights.end(), [](double w) { return w > 1e-6 && w < 1e6; });
    if (Sound(curve.degree >= 1 && curve.degree <= kHighestDegree && n > curve.degree,
              "a spline has degree 1 to 15 and more control points") &&
        Sound(knots, "a spline's knots do not decrease, and there are points + degree + 1 of them") &&
        Sound(weights, "a spline's weights are above 1e-6 and below 1e6")) {
      Push(map, curve);
    }
  }

  // ---- insertions ----

  void Insert(const dimeInsert& insert, const AffineMap& map, int depth) {
    AffineMap object;
    dimeBlock* block = insert.getBlock();
    StandAt(map, Exact(insert.getInsertionPoint()).head<2>());
    if (block == nullptr) {
      return Tell("UNKNOWN_BLOCK", type_, line_, "the file has no block of that name");
    }
    if (depth >= kDeepestBlock) {
      return TellWhole("BLOCK_TOO_DEEP", line_,
                       "this insertion of block '" + std::string(block->getName()) +
                           "' is nested more than 16 deep, or the block holds itself");
    }
    if (!InPlane(ExtrusionOf(insert), map, object)) {
      return;
    }
    StandAt(object, Exact(insert.getInsertionPoint()).head<2>());
    dimeParam param;
    const int columns = insert.getRecord(70, param) ? std::max<int>(1, param.int16_data) : 1;
    const int rows = insert.getRecord(71, param) ? std::max<int>(1, param.int16_data) : 1;
    const double column_step = insert.getRecord(44, param) ? Exact(param.double_data) : 0.0;
    const double row_step = insert.getRecord(45, param) ? Exact(param.double_data) : 0.0;
    const double turn = Exact(insert.getRotAngle()) * kDegree_rad;
    AffineMap place, scale;
    place.linear << std::cos(turn), -std::sin(turn), std::sin(turn), std::cos(turn);
    const Vector3d factors = Exact(insert.getScale());
    scale.linear = factors.head<2>().asDiagonal();
    scale.offset = -(scale.linear * Exact(block->getBasePoint()).head<2>());
    const std::string layer = layer_;
    if (!Sound(factors.x() != 0.0 && factors.y() != 0.0, "an insertion's scale is not 0")) {
      return;
    }
    for (int row = 0; row < rows && !full_; ++row) {
      for (int column = 0; column < columns && !full_; ++column) {
        place.offset = Exact(insert.getInsertionPoint()).head<2>() +
                       place.linear * Vector2d(column * column_step, row * row_step);
        InsertOnce(*block, object * place * scale, layer, depth);
      }
    }
  }

  void InsertOnce(dimeBlock& block, const AffineMap& map, const std::string& layer, int depth) {
    if (++insertions_ > kMostEntities) {
      return TellWhole("DXF_TOO_LARGE", line_, "the drawing makes more than 200000 insertions");
    }
    for (int i = 0; i < block.getNumEntities() && !full_; ++i) {
      Add(*block.getEntity(i), map, layer, depth + 1);
    }
  }

  static dimeVec3f ExtrusionOf(const dimeInsert& insert) {
    dimeVec3f extrusion;
    for (int i = 0; i < 3; ++i) {
      dimeParam param;
      extrusion[i] = insert.getRecord(210 + 10 * i, param) ? param.double_data : (i == 2 ? 1.0f : 0.0f);
    }
    return extrusion;
  }

  GuardedDxf guarded_;
  Drawing drawing_;
  std::vector<Curve> curves_;
  std::string layer_, type_;
  Vector2d at_ = Vector2d::Zero();
  std::map<std::string, std::size_t> hidden_;  // entities by layer
  std::uint32_t line_ = 0;
  std::size_t curve_count_ = 0;
  std::size_t insertions_ = 0;
  bool full_ = false;
};

}  // namespace

Drawing ReadDxf(std::string_view file) {
  try {
    return DxfReader(GuardDxf(file)).Read();
  } catch (const std::exception& error) {  // the library's, or no memory
    Drawing drawing;
    drawing.findings.push_back({"DXF_TOO_LARGE", true, "", "", 0, {0, 0}, 0.0, error.what()});
    return drawing;
  }
}

}  // namespace lambdajet::trajectory
