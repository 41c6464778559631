// Sets a grinding wheel normal to the groove of a pilger die, and says where the four axes stand for each point of it.
//
// Model (seed paper 003, fig. 1 and 2; the geometry is exact where the paper leaves it to a drawing):
//   Die frame P: x along the die's axis, angle phi about x from z; e_r(phi) = (0, -sin phi, cos phi), e_t = d e_r / d phi.
//   Groove: in the plane at phi half an ellipse about the cylinder's surface (radius R) with half-axes a(phi) along x and
//   b(phi) inwards; alpha is the polar angle of the section, 0 at the bottom:
//     S(phi, alpha) = a sin(alpha) x + (R - b cos(alpha)) e_r(phi)
//   Normal out of the die: N = S_phi x S_alpha
//     = -r b sin(alpha) x + r a cos(alpha) e_r + (a' b sin^2(alpha) + b' a cos^2(alpha)) e_t,   r = R - b cos(alpha)
//   Wheel: a disc of radius Rw whose rim is rounded with Ro (a torus about its axis w, tube Ro, centre circle Rw - Ro). Set
//   normal means that the surface's normal n lies in the wheel's middle plane, so the centre is on the normal:
//     W = S + Rw n,   w perpendicular to n
//   Machine: the die turns by C about x, the headstock moves along X and Z, the wheel turns by A about the tangential axis,
//   and there is no third way: C is the angle at which W comes to lie in the plane of X and Z, W = X x + Z e_r(C), and
//   w = cos(A) x - sin(A) e_r(C) with tan(A) = n_x / n_r(C). C runs ahead of or behind phi where the groove's depth changes.
//   Derivatives by C follow from those by phi (second order, exact): X_C = X'/C', X_CC = (X'' - X_C C'')/C'^2.
//   Contact without gouge: the wheel's curvatures 1/Ro along w and 1/Rw across exceed the groove's in every direction.
//   Scallop between two passes at the distance s: s^2/8 (1/Ro - 1/Rg) with the section's radius of curvature Rg to second
//   order; the generator measures the crest between the two swept rims instead.
// Units: mm, rad. Threads: values and pure functions. Cost: about 0.4 us a point. Errors: verdicts.
#pragma once

#include <Eigen/Core>
#include <array>

#include "trajectory/core/grinding/half_axis_law.hpp"

namespace lambdajet::trajectory {

struct Groove {
  double die_radius_mm = 0.0;
  double zone_rad = 0.0;  // angle along the die that is ground
  HalfAxisLaw width;      // a
  HalfAxisLaw depth;      // b
};

struct Wheel {
  double radius_mm = 0.0;          // Rw
  double profile_radius_mm = 0.0;  // Ro
};

struct GroovePoint {
  Eigen::Vector3d p_P_mm;
  Eigen::Vector3d normal_P;
};
GroovePoint PointOf(const Groove& groove, double phi_rad, double alpha_rad);

// One coordinate with its first two derivatives by C.
struct AxisMotion {
  double value = 0.0;
  double first = 0.0;
  double second = 0.0;
};

struct WheelPose {
  double phi_rad = 0.0;  // of the contact
  double c_rad = 0.0;
  AxisMotion x_mm, z_mm, a_rad;
};
// The wheel touching at (phi, alpha); c_rad as far as it follows from phi within its turn.
WheelPose PoseAt(const Groove& groove, const Wheel& wheel, double phi_rad, double alpha_rad);
// The same for a given C; phi is sought. Not finite if C does not rise with phi there.
WheelPose PoseAtC(const Groove& groove, const Wheel& wheel, double c_rad, double alpha_rad);

// Centre and axis of the wheel in the die's frame.
struct WheelPlace {
  Eigen::Vector3d center_P_mm;
  Eigen::Vector3d axis_P;
};
WheelPlace PlaceOf(double x_mm, double z_mm, double a_rad, double c_rad);

// X, Z, A and C, in this order, of a wheel's centre and axis; C within a turn of `near_c_rad`. The inverse of PlaceOf.
std::array<double, 4> FourAxesOf(const WheelPlace& place, double near_c_rad);

// How far a point is from the wheel's body, negative inside: the body is a flat disc of radius Rw - Ro, thickened by Ro.
double Clearance(const WheelPlace& place, const Wheel& wheel, const Eigen::Vector3d& p_P_mm);

// Curvatures of the groove towards the wheel at a contact, along the wheel's axis and across, and their mixed part.
struct ContactCurvature {
  double along_per_mm = 0.0;
  double across_per_mm = 0.0;
  double mixed_per_mm = 0.0;
};
ContactCurvature CurvatureAt(const Groove& groove, const Wheel& wheel, double phi_rad, double alpha_rad);

// Height that two neighbouring passes leave between them at phi: the crest where the swept rims meet, along the normal.
double ScallopHeight(const Groove& groove, const Wheel& wheel, double phi_rad, double alpha_1_rad,
                     double alpha_2_rad);

}  // namespace lambdajet::trajectory
