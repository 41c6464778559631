// Places one spatial frame in another: the pose X_AB of frame B in frame A, its velocity, and the angles it
// is written in.
//
// Model: rotation matrices; the angles are conventions of reading them. Krylov angles as in seed paper 004,
// equation (1):
//   R = Rz(-psi) Rx(-theta) Ry(-gamma) = (Ry(gamma) Rx(theta) Rz(psi))^T,
// so with right-handed signs its turns are clockwise; singular at theta = +-90 deg.
// Roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll), fixed axes x then y then z; singular at pitch = +-90 deg.
// Quaternions are unit, Hamilton, scalar part w; q and -q are one rotation, the one with w >= 0 is given out.
// Frames: monograms as in foundation/geometry/frames.md; neighbours meet, X_AC = X_AB * X_BC, p_A = X_AB *
// p_B. Units: mm, rad, s. Threads: values.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace lambdajet {

inline Eigen::Matrix3d RotationX(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return (Eigen::Matrix3d() << 1, 0, 0, 0, c, -s, 0, s, c).finished();
}

inline Eigen::Matrix3d RotationY(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return (Eigen::Matrix3d() << c, 0, s, 0, 1, 0, -s, 0, c).finished();
}

inline Eigen::Matrix3d RotationZ(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return (Eigen::Matrix3d() << c, -s, 0, s, c, 0, 0, 0, 1).finished();
}

// The matrix of w x.
inline Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& w) {
  return (Eigen::Matrix3d() << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0).finished();
}

struct KrylovAngles {
  double psi_rad = 0.0;
  double theta_rad = 0.0;
  double gamma_rad = 0.0;

  Eigen::Matrix3d Rotation() const {
    return RotationZ(-psi_rad) * RotationX(-theta_rad) * RotationY(-gamma_rad);
  }

  // theta in [-90, 90] deg; at theta = +-90 deg, where psi and gamma turn about one axis, gamma = 0 is given
  // out.
  static KrylovAngles Of(const Eigen::Matrix3d& R) {
    const double level = std::sqrt(R(0, 1) * R(0, 1) + R(1, 1) * R(1, 1));
    const double theta = std::atan2(-R(2, 1), level);
    if (level < 1e-12) {
      return {std::atan2(-R(1, 0), R(0, 0)), theta, 0.0};
    }
    return {std::atan2(R(0, 1), R(1, 1)), theta, std::atan2(R(2, 0), R(2, 2))};
  }

  // Columns: angular velocity in A per unit rate of psi, theta, gamma. Its determinant is cos(theta) up to
  // sign.
  Eigen::Matrix3d AngularVelocityPerRate() const {
    const Eigen::Matrix3d R_psi = RotationZ(-psi_rad);
    Eigen::Matrix3d columns;
    columns << Eigen::Vector3d(0, 0, -1), -R_psi.col(0), -(R_psi * RotationX(-theta_rad)).col(1);
    return columns;
  }
};

struct RollPitchYaw {
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double yaw_rad = 0.0;

  Eigen::Matrix3d Rotation() const { return RotationZ(yaw_rad) * RotationY(pitch_rad) * RotationX(roll_rad); }

  // pitch in [-90, 90] deg; at pitch = +-90 deg roll = 0 is given out.
  static RollPitchYaw Of(const Eigen::Matrix3d& R) {
    const double level = std::sqrt(R(0, 0) * R(0, 0) + R(1, 0) * R(1, 0));
    const double pitch = std::atan2(-R(2, 0), level);
    if (level < 1e-12) {
      return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
    }
    return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
  }
};

inline Eigen::Quaterniond UnitQuaternionOf(const Eigen::Matrix3d& R) {
  Eigen::Quaterniond q(R);
  q.normalize();
  return q.w() < 0.0 ? Eigen::Quaterniond(-q.coeffs()) : q;
}

struct Pose {
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();

  static Pose FromKrylov(const Eigen::Vector3d& p_mm, const KrylovAngles& angles) {
    return {p_mm, angles.Rotation()};
  }
  static Pose FromRollPitchYaw(const Eigen::Vector3d& p_mm, const RollPitchYaw& angles) {
    return {p_mm, angles.Rotation()};
  }
  static Pose FromQuaternion(const Eigen::Vector3d& p_mm, const Eigen::Quaterniond& q) {
    return {p_mm, q.normalized().toRotationMatrix()};
  }

  KrylovAngles krylov() const { return KrylovAngles::Of(R); }
  RollPitchYaw roll_pitch_yaw() const { return RollPitchYaw::Of(R); }
  Eigen::Quaterniond quaternion() const { return UnitQuaternionOf(R); }

  Pose Inverse() const { return {-(R.transpose() * p_mm), R.transpose()}; }

  friend Eigen::Vector3d operator*(const Pose& X_AB, const Eigen::Vector3d& p_B_mm) {
    return X_AB.R * p_B_mm + X_AB.p_mm;
  }
  friend Pose operator*(const Pose& X_AB, const Pose& X_BC) { return {X_AB * X_BC.p_mm, X_AB.R * X_BC.R}; }
};

// Velocity of frame B in A: of B's origin, and angular, both written in A.
struct Twist {
  Eigen::Vector3d v_mm_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d w_rad_per_s = Eigen::Vector3d::Zero();
};

// Its rate: acceleration of B's origin and angular acceleration, both written in A.
struct TwistRate {
  Eigen::Vector3d a_mm_per_s2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d alpha_rad_per_s2 = Eigen::Vector3d::Zero();
};

// What another point of the same body does, `lever` away and written in A; the body turns as before.
inline Twist AtLever(const Twist& twist, const Eigen::Vector3d& lever_mm) {
  return {twist.v_mm_per_s + twist.w_rad_per_s.cross(lever_mm), twist.w_rad_per_s};
}
inline TwistRate AtLever(const Twist& twist, const TwistRate& rate, const Eigen::Vector3d& lever_mm) {
  return {rate.a_mm_per_s2 + rate.alpha_rad_per_s2.cross(lever_mm) +
              twist.w_rad_per_s.cross(twist.w_rad_per_s.cross(lever_mm)),
          rate.alpha_rad_per_s2};
}

// Turns a pose by a rotation vector written in A, about B's origin, and shifts it.
inline Pose Displaced(const Pose& X_AB, const Eigen::Vector3d& shift_mm, const Eigen::Vector3d& turn_rad) {
  const double angle = turn_rad.norm();
  const Eigen::Matrix3d R_turn = angle > 0.0 ? Eigen::AngleAxisd(angle, turn_rad / angle).toRotationMatrix()
                                             : Eigen::Matrix3d::Identity();
  return {X_AB.p_mm + shift_mm, R_turn * X_AB.R};
}

// The rotation vector that turns R_AB into R_AC, written in A; its norm is the angle between the two.
inline Eigen::Vector3d TurnBetween(const Eigen::Matrix3d& R_AB, const Eigen::Matrix3d& R_AC) {
  const Eigen::Matrix3d R = R_AC * R_AB.transpose();
  const Eigen::Vector3d twice_sine(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  const double sine = 0.5 * twice_sine.norm();
  const double angle = std::atan2(sine, 0.5 * (R.trace() - 1.0));
  if (sine > 1e-9) {
    return twice_sine * (0.5 * angle / sine);
  }
  if (angle < 1.0) {
    return 0.5 * twice_sine;
  }
  const Eigen::AngleAxisd half_turn(R);
  return half_turn.axis() * half_turn.angle();
}

}  // namespace lambdajet
