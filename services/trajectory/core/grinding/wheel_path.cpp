#include "trajectory/core/grinding/wheel_path.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr int kNewtonSteps = 30;
constexpr int kBisections = 40;

// A number with its first two derivatives by phi.
struct Jet {
  double v = 0.0, d = 0.0, dd = 0.0;
};
Jet operator+(Jet a, Jet b) { return {a.v + b.v, a.d + b.d, a.dd + b.dd}; }
Jet operator-(Jet a, Jet b) { return {a.v - b.v, a.d - b.d, a.dd - b.dd}; }
Jet operator*(Jet a, Jet b) {
  return {a.v * b.v, a.d * b.v + a.v * b.d, a.dd * b.v + 2.0 * a.d * b.d + a.v * b.dd};
}
Jet operator*(double s, Jet a) { return {s * a.v, s * a.d, s * a.dd}; }

// f(a) with f' and f'' at a.v.
Jet Through(Jet a, double f, double f1, double f2) { return {f, f1 * a.d, f1 * a.dd + f2 * a.d * a.d}; }
Jet Inverse(Jet a) { return Through(a, 1.0 / a.v, -1.0 / (a.v * a.v), 2.0 / (a.v * a.v * a.v)); }
Jet Root(Jet a) {
  const double r = std::sqrt(a.v);
  return Through(a, r, 0.5 / r, -0.25 / (r * a.v));
}
Jet Sine(Jet a) { return Through(a, std::sin(a.v), std::cos(a.v), -std::sin(a.v)); }
Jet Cosine(Jet a) { return Through(a, std::cos(a.v), -std::sin(a.v), -std::cos(a.v)); }
// Angle of the point (x, y), x > 0.
Jet Angle(Jet y, Jet x) {
  const Jet t = y * Inverse(x);
  const double s = 1.0 / (1.0 + t.v * t.v);
  return Through(t, std::atan2(y.v, x.v), s, -2.0 * t.v * s * s);
}

Vector3d Radial(double phi) { return {0.0, -std::sin(phi), std::cos(phi)}; }
Vector3d Tangential(double phi) { return {0.0, -std::cos(phi), -std::sin(phi)}; }

// The normal's components along x, e_r and e_t, of any length; h is a or b with three derivatives.
struct NormalParts {
  Jet x, r, t, radius;
};
NormalParts NormalOf(const Groove& groove, double phi, double alpha) {
  const auto a4 = groove.width.At(phi), b4 = groove.depth.At(phi);
  const Jet a{a4[0], a4[1], a4[2]}, b{b4[0], b4[1], b4[2]};
  const Jet a1{a4[1], a4[2], a4[3]}, b1{b4[1], b4[2], b4[3]};
  const double s = std::sin(alpha), c = std::cos(alpha);
  const Jet r = Jet{groove.die_radius_mm, 0.0, 0.0} - c * b;
  return {-s * (r * b), c * (r * a), (s * s) * (a1 * b) + (c * c) * (b1 * a), r};
}

AxisMotion ByC(Jet q, Jet c) {
  const double first = q.d / c.d;
  return {q.v, first, (q.dd - first * c.dd) / (c.d * c.d)};
}

// Centre of the rim's rounding for the contact at (phi, alpha).
Vector3d TubeCenter(const Groove& groove, const Wheel& wheel, double phi, double alpha) {
  const GroovePoint at = PointOf(groove, phi, alpha);
  return at.p_P_mm + wheel.profile_radius_mm * at.normal_P;
}

// Distance of p from the curve of tube centres of one pass, and the direction from there.
double DistanceFromPass(const Groove& groove, const Wheel& wheel, double alpha, const Vector3d& p, double phi,
                        Vector3d& towards) {
  constexpr double kStep = 1e-4;
  const auto square = [&](double at) { return (TubeCenter(groove, wheel, at, alpha) - p).squaredNorm(); };
  for (int i = 0; i < 3; ++i) {
    const double low = square(phi - kStep), here = square(phi), high = square(phi + kStep);
    const double curvature = low - 2.0 * here + high;
    if (!(curvature > 0.0)) {
      break;
    }
    phi -= 0.5 * kStep * (high - low) / curvature;
  }
  towards = p - TubeCenter(groove, wheel, phi, alpha);
  return towards.norm();
}

// How high above the surface, along its normal, the swept rim of a pass begins.
double HeightUnderPass(const Groove& groove, const Wheel& wheel, double phi, double alpha,
                       double alpha_pass) {
  const GroovePoint at = PointOf(groove, phi, alpha);
  double height = 0.0;
  for (int i = 0; i < 6; ++i) {
    Vector3d towards;
    const double gap =
        DistanceFromPass(groove, wheel, alpha_pass, at.p_P_mm + height * at.normal_P, phi, towards) -
        wheel.profile_radius_mm;
    const double slope = -at.normal_P.dot(towards.normalized());
    if (slope < 0.05) {
      return std::numeric_limits<double>::infinity();  // the normal passes the rim by
    }
    height += gap / slope;
    if (std::abs(gap) < 1e-10) {
      break;
    }
  }
  return height;
}

}  // namespace

GroovePoint PointOf(const Groove& groove, double phi_rad, double alpha_rad) {
  const double a = groove.width.At(phi_rad)[0];
  const NormalParts n = NormalOf(groove, phi_rad, alpha_rad);
  const Vector3d radial = Radial(phi_rad);
  const Vector3d normal = n.x.v * Vector3d::UnitX() + n.r.v * radial + n.t.v * Tangential(phi_rad);
  return {a * std::sin(alpha_rad) * Vector3d::UnitX() + n.radius.v * radial, normal.normalized()};
}

WheelPose PoseAt(const Groove& groove, const Wheel& wheel, double phi_rad, double alpha_rad) {
  const NormalParts n = NormalOf(groove, phi_rad, alpha_rad);
  const auto a4 = groove.width.At(phi_rad);
  const Jet scale = wheel.radius_mm * Inverse(Root(n.x * n.x + n.r * n.r + n.t * n.t));
  const Jet x = std::sin(alpha_rad) * Jet{a4[0], a4[1], a4[2]} + scale * n.x;
  const Jet w_r = n.radius + scale * n.r, w_t = scale * n.t;
  const Jet ahead = Angle(w_t, w_r);  // C - phi
  const Jet c = ahead + Jet{phi_rad, 1.0, 0.0};
  const Jet n_r = n.r * Cosine(ahead) + n.t * Sine(ahead);  // along e_r(C)
  return {phi_rad, c.v, ByC(x, c), ByC(Root(w_r * w_r + w_t * w_t), c), ByC(Angle(n.x, n_r), c)};
}

WheelPose PoseAtC(const Groove& groove, const Wheel& wheel, double c_rad, double alpha_rad) {
  double phi = c_rad;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const double error = PoseAt(groove, wheel, phi, alpha_rad).c_rad - c_rad;
    constexpr double kStep = 1e-5;
    const double slope = (PoseAt(groove, wheel, phi + kStep, alpha_rad).c_rad - error - c_rad) / kStep;
    if (!(slope > 0.05)) {
      phi = std::numeric_limits<double>::quiet_NaN();
      break;
    }
    phi -= error / slope;
    if (std::abs(error) < 1e-14 * (1.0 + std::abs(c_rad))) {
      break;
    }
  }
  return PoseAt(groove, wheel, phi, alpha_rad);
}

WheelPlace PlaceOf(double x_mm, double z_mm, double a_rad, double c_rad) {
  const Vector3d radial = Radial(c_rad);
  return {x_mm * Vector3d::UnitX() + z_mm * radial,
          std::cos(a_rad) * Vector3d::UnitX() - std::sin(a_rad) * radial};
}

std::array<double, 4> FourAxesOf(const WheelPlace& place, double near_c_rad) {
  const Vector3d& p = place.center_P_mm;
  const double c = near_c_rad + std::remainder(std::atan2(-p.y(), p.z()) - near_c_rad, 2.0 * kPi);
  const double along = place.axis_P.dot(Radial(c));
  return {p.x(), std::hypot(p.y(), p.z()), std::atan2(-along, place.axis_P.x()), c};
}

double Clearance(const WheelPlace& place, const Wheel& wheel, const Vector3d& p_P_mm) {
  const Vector3d q = p_P_mm - place.center_P_mm;
  const double height = q.dot(place.axis_P);
  const double out = (q - height * place.axis_P).norm() - (wheel.radius_mm - wheel.profile_radius_mm);
  return (out > 0.0 ? std::hypot(out, height) : std::abs(height)) - wheel.profile_radius_mm;
}

ContactCurvature CurvatureAt(const Groove& groove, const Wheel& wheel, double phi_rad, double alpha_rad) {
  const auto a = groove.width.At(phi_rad), b = groove.depth.At(phi_rad);
  const double s = std::sin(alpha_rad), c = std::cos(alpha_rad), r = groove.die_radius_mm - b[0] * c;
  const Vector3d x = Vector3d::UnitX(), e_r = Radial(phi_rad), e_t = Tangential(phi_rad);
  const Vector3d by_phi = a[1] * s * x - b[1] * c * e_r + r * e_t, by_alpha = a[0] * c * x + b[0] * s * e_r;
  const Vector3d phi_phi = a[2] * s * x - (b[2] * c + r) * e_r - 2.0 * b[1] * c * e_t;
  const Vector3d phi_alpha = a[1] * c * x + b[1] * s * e_r + b[0] * s * e_t;
  const Vector3d alpha_alpha = -a[0] * s * x + b[0] * c * e_r;
  const GroovePoint at = PointOf(groove, phi_rad, alpha_rad);
  const WheelPose pose = PoseAt(groove, wheel, phi_rad, alpha_rad);
  const Vector3d axis = PlaceOf(pose.x_mm.value, pose.z_mm.value, pose.a_rad.value, pose.c_rad).axis_P;
  const Vector3d across = axis.cross(at.normal_P);
  Eigen::Matrix2d second, base;
  second << at.normal_P.dot(phi_phi), at.normal_P.dot(phi_alpha), at.normal_P.dot(phi_alpha),
      at.normal_P.dot(alpha_alpha);
  base << axis.dot(by_phi), axis.dot(by_alpha), across.dot(by_phi), across.dot(by_alpha);
  const double det = base(0, 0) * base(1, 1) - base(0, 1) * base(1, 0);
  Eigen::Matrix2d inverse;
  inverse << base(1, 1), -base(0, 1), -base(1, 0), base(0, 0);
  inverse /= det;
  const Eigen::Matrix2d k = inverse.transpose() * second * inverse;
  return {k(0, 0), k(1, 1), k(0, 1)};
}

double ScallopHeight(const Groove& groove, const Wheel& wheel, double phi_rad, double alpha_1_rad,
                     double alpha_2_rad) {
  double low = alpha_1_rad, high = alpha_2_rad, height = 0.0;
  for (int i = 0; i < kBisections && high - low > 1e-9; ++i) {
    // Where both rims begin at the same height: a secant would do, the crest is nearly half way.
    const double middle = 0.5 * (low + high);
    const double first = HeightUnderPass(groove, wheel, phi_rad, middle, alpha_1_rad);
    const double second = HeightUnderPass(groove, wheel, phi_rad, middle, alpha_2_rad);
    height = std::min(first, second);
    (first < second ? low : high) = middle;
    if (std::abs(first - second) < 1e-8) {
      break;
    }
  }
  return height;
}

}  // namespace lambdajet::trajectory
