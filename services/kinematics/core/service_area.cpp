#include "kinematics/core/service_area.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "foundation/contract/expects.hpp"

namespace lambdajet::kinematics {
namespace {

// Integral of sqrt(R^2 - (x - c)^2) over [from, to]; clipped where the circle does not reach.
double UnderArc(double radius, double centre, double from, double to) {
  const auto primitive = [&](double x) {
    const double u = std::clamp((x - centre) / radius, -1.0, 1.0);
    return 0.5 * radius * radius * (u * std::sqrt(1.0 - u * u) + std::asin(u));
  };
  return primitive(to) - primitive(from);
}

double UnderLine(double slope, double offset, double from, double to) {
  return 0.5 * slope * (to * to - from * from) + offset * (to - from);
}

// Smaller root of (x - cx)^2 + (slope x + offset)^2 = R^2.
std::optional<double> LeftMeeting(double cx, double slope, double offset, double radius) {
  const double a = 1.0 + slope * slope;
  const double half_b = slope * offset - cx;
  const double discriminant = half_b * half_b - a * (cx * cx + offset * offset - radius * radius);
  if (!(discriminant >= 0.0)) {
    return std::nullopt;
  }
  return (-half_b - std::sqrt(discriminant)) / a;
}

// Where print and geometry differ in the closed form.
struct Reading {
  double lever;                   // of H sin phi in (14)-(17), (21)-(25), (30): 2, printed 1
  double radical_slope;           // of H / b in (3), (4): -2, printed -1
  bool wall_meets_outer = false;  // (12), (13): L where l must stand
  bool table_sign_kept = true;    // last integral of (30)
};
constexpr Reading kCorrected{2.0, -2.0, false, true};
constexpr Reading kPrinted{1.0, -1.0, true, false};

struct Shape {
  double X, s, c, a, b, l, L, H, height, top, bottom;
  explicit Shape(const ServiceAreaMachine& m)
      : X(m.base_joint_spacing_mm - m.platform_joint_spacing_mm * std::cos(m.tilt_rad)),
        s(std::sin(m.tilt_rad)),
        c(std::cos(m.tilt_rad)),
        a(m.base_joint_spacing_mm),
        b(m.platform_joint_spacing_mm),
        l(m.strut_min_mm),
        L(m.strut_max_mm),
        H(m.tool_length_mm),
        height(m.height_mm),
        top(m.frame_top_ratio * m.base_joint_spacing_mm),
        bottom(m.frame_bottom_ratio * m.base_joint_spacing_mm) {}
};

PaperServiceArea ClosedForm(const ServiceAreaMachine& machine, const Reading& reading) {
  const Shape m(machine);
  PaperServiceArea r;
  const double x_O2 = m.X + 2.0 * m.H * m.s;               // (1): right in print
  const double x_outer = m.X + reading.lever * m.H * m.s;  // the same circle, as (14) ff. have it
  const double x_inner = 2.0 * m.H * m.s;
  r.c1_mm = (4.0 * m.H * m.X + 4.0 * m.H * m.H * m.s - m.b * m.b * m.s) / (2.0 * m.b);
  r.c2 = reading.radical_slope * m.H / m.b;
  r.x_M_mm = -(m.top - x_O2) / 2.0;
  r.y_M_mm = -m.H * m.c - 0.5 * m.b * m.s;
  r.k = -2.0 * m.height / (m.bottom - m.top);
  const double q = r.y_M_mm - r.k * r.x_M_mm;
  r.x_K_mm = x_outer / 2.0;
  r.y_D_mm = m.height - m.H * m.c - 0.5 * m.b * m.s;
  const auto x_E = LeftMeeting(x_O2, r.c2, r.c1_mm, m.L);
  const auto x_A = LeftMeeting(x_inner, r.k, q + m.b * m.s, reading.wall_meets_outer ? m.L : m.l);
  const auto x_B = LeftMeeting(x_outer, r.k, q, m.L);
  if (!x_E || !x_A || !x_B) {
    return r;
  }
  r.defined = true;
  r.x_E_mm = *x_E;
  r.x_A_mm = *x_A;
  r.x_B_mm = *x_B;
  const double drop = r.y_D_mm + m.b * m.s;
  const bool table_met = m.L > drop;
  r.x_D_mm = table_met ? m.X - std::sqrt(m.L * m.L - drop * drop) : r.x_K_mm;
  r.s1_mm2 = UnderArc(m.L, x_outer, r.x_A_mm, r.x_E_mm) - UnderArc(m.l, x_inner, r.x_A_mm, r.x_E_mm) +
             m.b * m.s * (r.x_E_mm - r.x_A_mm);
  r.s2_mm2 = UnderArc(m.L, m.X, r.x_E_mm, r.x_K_mm) - UnderArc(m.l, x_inner, r.x_E_mm, r.x_K_mm);
  r.s3_mm2 = UnderArc(m.L, x_outer, r.x_B_mm, r.x_A_mm) - UnderLine(r.k, q, r.x_B_mm, r.x_A_mm);
  const double table =
      reading.table_sign_kept ? -m.b * m.s - r.y_D_mm : -m.height - m.H * m.c + 0.5 * m.b * m.s;
  r.s4_mm2 =
      r.x_D_mm < r.x_K_mm ? UnderArc(m.L, m.X, r.x_D_mm, r.x_K_mm) + table * (r.x_K_mm - r.x_D_mm) : 0.0;
  r.area_mm2 = 2.0 * (r.s1_mm2 + r.s2_mm2 + r.s3_mm2 - r.s4_mm2);
  r.in_order = r.x_B_mm <= r.x_A_mm && r.x_A_mm <= r.x_E_mm && r.x_E_mm <= r.x_D_mm;
  return r;
}

struct Circle {
  double x, y, radius;
};

// A curve y(x): half of a circle, or a line.
struct Curve {
  bool arc = false;
  Circle circle{};
  double sign = 1.0;  // +1 the lower half in the drawing (larger y)
  double slope = 0.0, offset = 0.0;

  bool Reaches(double x) const { return !arc || std::abs(x - circle.x) <= circle.radius; }
  double At(double x) const {
    if (!arc) {
      return slope * x + offset;
    }
    const double dx = x - circle.x;
    return circle.y + sign * std::sqrt(std::max(0.0, circle.radius * circle.radius - dx * dx));
  }
  double Under(double from, double to) const {
    return arc ? circle.y * (to - from) + sign * UnderArc(circle.radius, circle.x, from, to)
               : UnderLine(slope, offset, from, to);
  }
};

template <class T, std::size_t kRoom>
class Few {
 public:
  void Add(const T& item) {
    Expects(size_ < kRoom, "service area: room for every curve and crossing");
    items_[size_++] = item;
  }
  T* begin() { return items_.data(); }
  T* end() { return items_.data() + size_; }
  const T* begin() const { return items_.data(); }
  const T* end() const { return items_.data() + size_; }
  std::size_t size() const { return size_; }
  const T& operator[](std::size_t i) const { return items_[i]; }

 private:
  std::array<T, kRoom> items_{};
  std::size_t size_ = 0;
};

// Circles of the two tilts with the frame; index 0 is +phi, 1 is -phi.
struct Scene {
  Shape m;
  std::array<Circle, 2> first, second;  // c1, c2; radius unset
  double axis;

  explicit Scene(const ServiceAreaMachine& machine) : m(machine), axis(m.a / 2.0) {
    for (std::size_t t = 0; t < 2; ++t) {
      const double s = t == 0 ? m.s : -m.s;
      first[t] = {0.5 * m.b * m.c - m.H * s, 0.5 * m.b * s + m.H * m.c, 0.0};
      second[t] = {m.a - 0.5 * m.b * m.c - m.H * s, -0.5 * m.b * s + m.H * m.c, 0.0};
    }
  }

  bool InFrame(double x, double y) const {
    const double half = 0.5 * (m.top + (m.bottom - m.top) * y / m.height);
    return y <= m.height && std::abs(x - axis) <= half;
  }
  static double Distance(const Circle& c, double x, double y) { return std::hypot(x - c.x, y - c.y); }
  bool Reached(const Circle& c, double x, double y) const {
    const double distance = Distance(c, x, y);
    return distance >= m.l && distance <= m.L && y >= c.y;
  }
  bool Served(std::size_t tilt, double x, double y) const {
    return Reached(first[tilt], x, y) && Reached(second[tilt], x, y);
  }
  // Left half of the paper's region, the right one is its mirror image.
  bool InPaperRegion(double x, double y) const {
    const double left = x <= axis ? x : 2.0 * axis - x;
    return Distance(second[0], left, y) <= m.L && Distance(second[1], left, y) <= m.L &&
           Distance(first[1], left, y) >= m.l && y >= first[1].y;
  }
  bool Inside(ServiceRegion region, double x, double y) const {
    if (!InFrame(x, y)) {
      return false;
    }
    switch (region) {
      case ServiceRegion::kPaper:
        return InPaperRegion(x, y);
      case ServiceRegion::kIntersection:
        return Served(0, x, y) && Served(1, x, y);
      case ServiceRegion::kUnion:
        return Served(0, x, y) || Served(1, x, y);
      case ServiceRegion::kSingleTilt:
        return Served(0, x, y);
    }
    return false;
  }
};

constexpr std::size_t kCurves = 32;
constexpr std::size_t kCrossings = 1200;
using Curves = Few<Curve, kCurves>;
using Crossings = Few<double, kCrossings>;

void AddCircle(const Circle& centre, double radius, Curves& curves) {
  const Circle circle{centre.x, centre.y, radius};
  curves.Add({true, circle, 1.0, 0.0, 0.0});
  curves.Add({true, circle, -1.0, 0.0, 0.0});
}

Curves CurvesOf(const Scene& scene) {
  Curves curves;
  for (std::size_t t = 0; t < 2; ++t) {
    for (const Circle& centre : {scene.first[t], scene.second[t]}) {
      AddCircle(centre, scene.m.l, curves);
      AddCircle(centre, scene.m.L, curves);
    }
    // y >= c_y; both tilts have the same pair of heights.
    curves.Add({false, {}, 1.0, 0.0, scene.first[t].y});
  }
  const double slope = 2.0 * scene.m.height / (scene.m.bottom - scene.m.top);
  if (std::isfinite(slope)) {  // |x - axis| = half width
    curves.Add({false, {}, 1.0, slope, -slope * (scene.axis + 0.5 * scene.m.top)});
    curves.Add({false, {}, 1.0, -slope, slope * (scene.axis - 0.5 * scene.m.top)});
  }
  curves.Add({false, {}, 1.0, 0.0, scene.m.height});
  return curves;
}

void CrossCircles(const Circle& p, const Circle& q, Crossings& xs) {
  const double dx = q.x - p.x;
  const double dy = q.y - p.y;
  const double d2 = dx * dx + dy * dy;
  if (d2 == 0.0) {
    return;
  }
  const double along = 0.5 * (d2 + p.radius * p.radius - q.radius * q.radius) / d2;
  const double h2 = p.radius * p.radius / d2 - along * along;
  if (h2 < 0.0) {
    return;
  }
  const double h = std::sqrt(h2);
  xs.Add(p.x + along * dx - h * dy);
  xs.Add(p.x + along * dx + h * dy);
}

void CrossLine(const Circle& p, double slope, double offset, Crossings& xs) {
  const double a = 1.0 + slope * slope;
  const double half_b = slope * (offset - p.y) - p.x;
  const double discriminant =
      half_b * half_b - a * (p.x * p.x + (offset - p.y) * (offset - p.y) - p.radius * p.radius);
  if (discriminant < 0.0) {
    return;
  }
  xs.Add((-half_b - std::sqrt(discriminant)) / a);
  xs.Add((-half_b + std::sqrt(discriminant)) / a);
}

void Cross(const Curve& p, const Curve& q, Crossings& xs) {
  if (p.arc && q.arc) {
    CrossCircles(p.circle, q.circle, xs);
  } else if (p.arc) {
    CrossLine(p.circle, q.slope, q.offset, xs);
  } else if (q.arc) {
    CrossLine(q.circle, p.slope, p.offset, xs);
  } else if (p.slope != q.slope) {
    xs.Add((q.offset - p.offset) / (p.slope - q.slope));
  }
}

// Every x at which the order of the curves may change.
Crossings CrossingsOf(const Scene& scene, const Curves& curves) {
  Crossings xs;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    if (curves[i].arc && curves[i].sign < 0.0) {
      continue;  // the other half of a circle that has been seen
    }
    if (curves[i].arc) {
      xs.Add(curves[i].circle.x - curves[i].circle.radius);
      xs.Add(curves[i].circle.x + curves[i].circle.radius);
    }
    for (std::size_t j = i + 1; j < curves.size(); ++j) {
      if (!(curves[j].arc && curves[j].sign < 0.0)) {
        Cross(curves[i], curves[j], xs);
      }
    }
  }
  xs.Add(scene.axis);
  xs.Add(scene.axis - 0.5 * std::max(scene.m.top, scene.m.bottom));
  xs.Add(scene.axis + 0.5 * std::max(scene.m.top, scene.m.bottom));
  if (scene.m.top == scene.m.bottom) {
    xs.Add(scene.axis - 0.5 * scene.m.top);
    xs.Add(scene.axis + 0.5 * scene.m.top);
  }
  std::sort(xs.begin(), xs.end());
  return xs;
}

using CurvesHere = Few<const Curve*, kCurves>;

CurvesHere CurvesAt(const Curves& curves, double x) {
  CurvesHere here;
  for (const Curve& curve : curves) {
    if (curve.Reaches(x)) {
      here.Add(&curve);
    }
  }
  std::sort(here.begin(), here.end(), [x](const Curve* p, const Curve* q) { return p->At(x) < q->At(x); });
  return here;
}

// Area between two neighbouring crossings, where the curves keep their order.
double SliceArea(const Scene& scene, const Curves& curves, ServiceRegion region, double from, double to) {
  const double middle = 0.5 * (from + to);
  const CurvesHere here = CurvesAt(curves, middle);
  double area = 0.0;
  for (std::size_t i = 0; i + 1 < here.size(); ++i) {
    const double y = 0.5 * (here[i]->At(middle) + here[i + 1]->At(middle));
    if (scene.Inside(region, middle, y)) {
      area += here[i + 1]->Under(from, to) - here[i]->Under(from, to);
    }
  }
  return area;
}

ServiceAreaMachine PrintedBase(double platform_mm, double tilt_deg) {
  ServiceAreaMachine machine;
  machine.platform_joint_spacing_mm = platform_mm;
  machine.tilt_rad = tilt_deg * M_PI / 180.0;
  return machine;
}

}  // namespace

std::string_view FaultOf(const ServiceAreaMachine& m) {
  const double sum = m.base_joint_spacing_mm + m.platform_joint_spacing_mm + m.strut_min_mm + m.strut_max_mm +
                     m.tool_length_mm + m.tilt_rad + m.height_mm + m.frame_top_ratio + m.frame_bottom_ratio;
  if (!std::isfinite(sum)) {
    return "every dimension must be a finite number";
  }
  if (!(m.base_joint_spacing_mm > 0.0 && m.platform_joint_spacing_mm > 0.0 && m.height_mm > 0.0)) {
    return "joint spacings and height must be above 0";
  }
  if (!(m.strut_min_mm > 0.0 && m.strut_max_mm > m.strut_min_mm)) {
    return "strut lengths must be 0 < strut_min_mm < strut_max_mm";
  }
  if (!(m.tool_length_mm >= 0.0 && m.tilt_rad >= 0.0 && m.tilt_rad < M_PI / 2.0)) {
    return "tool length must be 0 or above, tilt from 0 to below 90 deg";
  }
  if (!(m.frame_top_ratio > 0.0 && m.frame_bottom_ratio > 0.0)) {
    return "frame ratios must be above 0";
  }
  return {};
}

PaperServiceArea PaperClosedForm(const ServiceAreaMachine& machine) {
  return ClosedForm(machine, kCorrected);
}

PaperServiceArea PaperAsPrinted(const ServiceAreaMachine& machine) {
  if (machine.tilt_rad == 0.0) {
    return {};  // (3), (4) divide by sin phi
  }
  return ClosedForm(machine, kPrinted);
}

std::string_view RegionName(ServiceRegion region) {
  switch (region) {
    case ServiceRegion::kPaper:
      return "PAPER";
    case ServiceRegion::kIntersection:
      return "INTERSECTION";
    case ServiceRegion::kUnion:
      return "UNION";
    case ServiceRegion::kSingleTilt:
      return "SINGLE_TILT";
  }
  return "UNKNOWN";
}

double ExactArea(const ServiceAreaMachine& machine, ServiceRegion region) {
  Expects(FaultOf(machine).empty(), "ExactArea: a machine without fault");
  const Scene scene(machine);
  const Curves curves = CurvesOf(scene);
  const Crossings xs = CrossingsOf(scene, curves);
  double area = 0.0;
  for (std::size_t i = 0; i + 1 < xs.size(); ++i) {
    if (xs[i + 1] - xs[i] > 0.0) {
      area += SliceArea(scene, curves, region, xs[i], xs[i + 1]);
    }
  }
  return area;
}

ServiceSpans RegionAt(const ServiceAreaMachine& machine, ServiceRegion region, double x_mm) {
  const Scene scene(machine);
  const Curves curves = CurvesOf(scene);
  const CurvesHere here = CurvesAt(curves, x_mm);
  ServiceSpans spans;
  bool open = false;
  for (std::size_t i = 0; i + 1 < here.size(); ++i) {
    const double low = here[i]->At(x_mm);
    const double high = here[i + 1]->At(x_mm);
    const bool inside = high > low && scene.Inside(region, x_mm, 0.5 * (low + high));
    if (inside && !open && spans.count < kMostServiceSpans) {
      spans.from_y_mm[spans.count++] = low;
      open = true;
    }
    if (inside && open) {
      spans.to_y_mm[spans.count - 1] = high;
    }
    open = open && (inside || high == low);
  }
  return spans;
}

ServicePoint ArcCentre(const ServiceAreaMachine& machine, int joint, int tilt_sign) {
  const Scene scene(machine);
  const std::size_t tilt = tilt_sign > 0 ? 0 : 1;
  const Circle& centre = joint == 1 ? scene.first[tilt] : scene.second[tilt];
  return {centre.x, centre.y};
}

ServicePoint ClosedFormOrigin(const ServiceAreaMachine& machine) { return ArcCentre(machine, 1, 1); }

bool InRegion(const ServiceAreaMachine& machine, ServiceRegion region, double x_mm, double y_mm) {
  return Scene(machine).Inside(region, x_mm, y_mm);
}

ServiceSweep PaperSweep(int index) {
  constexpr double kDeg = M_PI / 180.0;
  switch (index) {
    case 0:
      return {"Fig. 3", ServiceParameter::kTilt, "tilt_rad", 0.0, 30.0 * kDeg, 7.5, PrintedBase(400.0, 0.0)};
    case 1:
      return {"Fig. 4",
              ServiceParameter::kPlatformSpacing,
              "platform_joint_spacing_mm",
              300.0,
              500.0,
              15.4,
              PrintedBase(500.0, 15.0)};
    case 2:
      return {"Fig. 5", ServiceParameter::kStrutMin, "strut_min_mm", 400.0, 800.0,
              -64.1,    PrintedBase(500.0, 15.0)};
    case 3:
      return {"Fig. 6", ServiceParameter::kStrutMax, "strut_max_mm", 1250.0, 1450.0,
              45.6,     PrintedBase(500.0, 15.0)};
    case 4:
      return {"Fig. 7", ServiceParameter::kToolLength, "tool_length_mm", 50.0, 250.0,
              -11.5,    PrintedBase(500.0, 15.0)};
    default:
      Expects(index == 5, "PaperSweep: index 0 to 5");
      return {"Fig. 8", ServiceParameter::kBaseSpacing, "base_joint_spacing_mm", 1250.0, 1450.0,
              -6.0,     PrintedBase(500.0, 15.0)};
  }
}

ServiceAreaMachine AtSweepValue(const ServiceSweep& sweep, double value) {
  ServiceAreaMachine machine = sweep.base;
  switch (sweep.parameter) {
    case ServiceParameter::kTilt:
      machine.tilt_rad = value;
      break;
    case ServiceParameter::kPlatformSpacing:
      machine.platform_joint_spacing_mm = value;
      break;
    case ServiceParameter::kStrutMin:
      machine.strut_min_mm = value;
      break;
    case ServiceParameter::kStrutMax:
      machine.strut_max_mm = value;
      break;
    case ServiceParameter::kToolLength:
      machine.tool_length_mm = value;
      break;
    case ServiceParameter::kBaseSpacing:
      machine.base_joint_spacing_mm = value;
      break;
  }
  return machine;
}

}  // namespace lambdajet::kinematics
