#include "kinematics/core/hexapod.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "foundation/contract/expects.hpp"

namespace lambdajet::kinematics {
namespace {

void SetLane(kernel::Lanes& lanes, int strut, double value) {
  lanes.lane[strut] = value;
  if (strut == kStruts - 1) {
    lanes.lane[kStruts] = value;
    lanes.lane[kStruts + 1] = value;
  }
}

StrutVector StrutsOf(const kernel::Lanes& lanes) { return Eigen::Map<const StrutVector>(lanes.lane); }

kernel::RawPose RawPoseOf(const Pose& X) {
  kernel::RawPose raw;
  Eigen::Map<Eigen::Vector3d>(raw.p) = X.p_mm;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(raw.R) = X.R;
  return raw;
}

Pose PoseOf(const kernel::RawPose& raw) {
  return {Eigen::Map<const Eigen::Vector3d>(raw.p),
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(raw.R)};
}

kernel::StrutLanes StrutLanesOf(const HexapodGeometry& geometry) {
  kernel::StrutLanes lanes;
  for (int j = 0; j < kStruts; ++j) {
    SetLane(lanes.ax, j, geometry.p_MA_mm(0, j));
    SetLane(lanes.ay, j, geometry.p_MA_mm(1, j));
    SetLane(lanes.az, j, geometry.p_MA_mm(2, j));
    SetLane(lanes.bx, j, geometry.p_PB_mm(0, j));
    SetLane(lanes.by, j, geometry.p_PB_mm(1, j));
    SetLane(lanes.bz, j, geometry.p_PB_mm(2, j));
  }
  return lanes;
}

kernel::UniversalJointLanes JointLanesOf(const HexapodGeometry& geometry) {
  kernel::UniversalJointLanes lanes;
  for (int j = 0; j < kStruts; ++j) {
    const UniversalJoint& joint = geometry.joints[static_cast<std::size_t>(j)];
    const Eigen::Matrix3d R_MA = geometry.R_MA[static_cast<std::size_t>(j)];
    const Eigen::Matrix3d R_M1 = R_MA * RotationZ(joint.dz_rad) * RotationX(joint.dx_rad);
    const Eigen::Vector3d a1 =
        geometry.p_MA_mm.col(j) + R_MA * Eigen::Vector3d(joint.a1x_mm, joint.a1y_mm, joint.a1z_mm);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        SetLane(lanes.R_MA[3 * r + c], j, R_MA(r, c));
        SetLane(lanes.R_M1[3 * r + c], j, R_M1(r, c));
      }
    }
    SetLane(lanes.a1x, j, a1.x());
    SetLane(lanes.a1y, j, a1.y());
    SetLane(lanes.a1z, j, a1.z());
    SetLane(lanes.ex, j, joint.ex_mm);
    SetLane(lanes.ez, j, joint.ez_mm);
    SetLane(lanes.cos_eps, j, std::cos(joint.eps_rad));
    SetLane(lanes.sin_eps, j, std::sin(joint.eps_rad));
    SetLane(lanes.h, j, joint.h_mm);
    SetLane(lanes.cos_nu, j, std::cos(joint.nu_rad));
    SetLane(lanes.sin_nu, j, std::sin(joint.nu_rad));
  }
  return lanes;
}

// B_j - A_j of the nominal centres.
StrutPoints StrutVectors(const HexapodGeometry& geometry, const Pose& X_MP) {
  return ((X_MP.R * geometry.p_PB_mm).colwise() + X_MP.p_mm) - geometry.p_MA_mm;
}

void Blame(HexapodInverse& answer, Reason reason, HexapodBound bound, int strut, double excess) {
  answer.reason = reason;
  answer.bound = bound;
  answer.strut = strut;
  answer.excess = excess;
}

// The cones are judged by chords: |u - u_home| against 2 sin(cone / 2), so that no inverse cosine is taken in
// the loop.
bool WithinCones(const Hexapod& hexapod, const Pose& X_MP, HexapodInverse& answer) {
  const HexapodLimits& limits = hexapod.geometry().limits;
  const StrutPoints s = StrutVectors(hexapod.geometry(), X_MP);
  for (int j = 0; j < kStruts; ++j) {
    const Eigen::Vector3d u = s.col(j).normalized();
    const double base = std::acos(std::clamp(u.dot(hexapod.home_directions_M().col(j)), -1.0, 1.0));
    if (base > limits.base_cone_rad) {
      Blame(answer, Reason::kJointLimit, HexapodBound::kBaseJointCone, j, base - limits.base_cone_rad);
      return false;
    }
    const double platform =
        std::acos(std::clamp((X_MP.R.transpose() * u).dot(hexapod.home_directions_P().col(j)), -1.0, 1.0));
    if (platform > limits.platform_cone_rad) {
      Blame(answer, Reason::kJointLimit, HexapodBound::kPlatformJointCone, j,
            platform - limits.platform_cone_rad);
      return false;
    }
  }
  return true;
}

bool HasCones(const HexapodLimits& limits) {
  return limits.base_cone_rad < EIGEN_PI || limits.platform_cone_rad < EIGEN_PI;
}

bool WithinStrokes(const HexapodLimits& limits, HexapodInverse& answer) {
  if (answer.lengths_mm.minCoeff() >= limits.strut_min_mm &&
      answer.lengths_mm.maxCoeff() <= limits.strut_max_mm && std::isfinite(answer.lengths_mm.sum()))
      [[likely]] {
    return true;
  }
  for (int j = 0; j < kStruts; ++j) {
    const double length = answer.lengths_mm[j];
    if (!std::isfinite(length)) {
      Blame(answer, Reason::kNotFinite, HexapodBound::kNone, j, 0.0);
      answer.lengths_mm.setZero();
      answer.actuators_mm.setZero();
      return false;
    }
    if (length < limits.strut_min_mm) {
      Blame(answer, Reason::kActuatorLimit, HexapodBound::kStrutMin, j, limits.strut_min_mm - length);
      return false;
    }
    if (length > limits.strut_max_mm) {
      Blame(answer, Reason::kActuatorLimit, HexapodBound::kStrutMax, j, length - limits.strut_max_mm);
      return false;
    }
  }
  return true;
}

bool Finite(const Pose& X_MP) { return X_MP.p_mm.allFinite() && X_MP.R.allFinite(); }

// The kernel's sine and cosine reduce angles up to here; NaN fails every comparison.
constexpr double kLargestAngleRad = 1e5;

bool Finite(const PlatformPose& pose) {
  return std::isfinite(pose.x_mm + pose.y_mm + pose.z_mm) && std::abs(pose.psi_rad) <= kLargestAngleRad &&
         std::abs(pose.theta_rad) <= kLargestAngleRad && std::abs(pose.gamma_rad) <= kLargestAngleRad;
}

double ParityOf(const std::array<int, kStruts>& order) {
  int inversions = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t k = i + 1; k < order.size(); ++k) {
      inversions += order[i] > order[k] ? 1 : 0;
    }
  }
  return inversions % 2 == 0 ? 1.0 : -1.0;
}

void ChooseStrutOrder(const StrutPoints& directions, std::array<int, kStruts>& order, double& parity) {
  std::array<int, kStruts> trial = order;
  double best = -1.0;
  do {
    if (!(trial[0] < trial[1] && trial[1] < trial[2] && trial[3] < trial[4] && trial[4] < trial[5])) {
      continue;
    }
    const double volume =
        std::abs(directions.col(trial[0]).cross(directions.col(trial[1])).dot(directions.col(trial[2])));
    if (volume > best) {
      best = volume;
      order = trial;
    }
  } while (std::next_permutation(trial.begin(), trial.end()));
  parity = ParityOf(order);
}

double ScrewShiftPerRad(const Hexapod& hexapod) {
  return hexapod.geometry().screw_lead_mm / (2.0 * EIGEN_PI);
}

// Everything after the lengths of ideal struts are known.
void FinishInverse(const Hexapod& hexapod, const Pose* X_MP, HexapodInverse& answer) {
  answer.actuators_mm = answer.lengths_mm - hexapod.geometry().length_zero_mm;
  if (hexapod.geometry().screw_lead_mm != 0.0) {
    answer.actuators_mm -=
        ScrewShiftPerRad(hexapod) * (ScrewTwists(hexapod, *X_MP) - hexapod.home_twists_rad());
  }
  if (WithinStrokes(hexapod.geometry().limits, answer) && HasCones(hexapod.geometry().limits)) {
    WithinCones(hexapod, *X_MP, answer);
  }
}

bool NeedsRotation(const Hexapod& hexapod) {
  return !hexapod.ideal() || hexapod.geometry().screw_lead_mm != 0.0 || HasCones(hexapod.geometry().limits);
}

// Newton's answer in the caller's words.
HexapodForward ForwardOf(const Hexapod& hexapod, const kernel::NewtonResult& result) {
  HexapodForward answer;
  answer.X_MP = PoseOf(result.pose);
  answer.iterations = result.iterations;
  answer.residual_mm = result.residual_mm;
  const double determinant = hexapod.order_parity() * result.determinant_end;
  answer.assembly_sign = determinant > 0.0 ? 1 : determinant < 0.0 ? -1 : 0;
  if (!result.converged) {
    answer.reason = Reason::kNotConverged;
  } else if (result.determinant_start * result.determinant_end < 0.0) {
    answer.reason = Reason::kModeMismatch;
  }
  return answer;
}

kernel::NewtonSettings SettingsFor(const Hexapod& hexapod, const StrutVector& lengths_mm) {
  kernel::NewtonSettings settings;
  settings.lever_mm = hexapod.lever_mm();
  settings.largest_shift_mm = hexapod.home_lengths_mm().maxCoeff();
  settings.residual_tolerance_mm = 1e-12 * lengths_mm.minCoeff();
  std::copy(hexapod.strut_order().begin(), hexapod.strut_order().end(), settings.strut_order);
  settings.order_parity = hexapod.order_parity();
  return settings;
}

kernel::NewtonResult SolveLengths(const Hexapod& hexapod, const StrutVector& lengths_mm,
                                  const Pose& X_MP_start) {
  kernel::Lanes lanes;
  for (int j = 0; j < kStruts; ++j) {
    SetLane(lanes, j, lengths_mm[j]);
  }
  const kernel::NewtonSettings settings = SettingsFor(hexapod, lengths_mm);
  return hexapod.ideal() ? kernel::SolvePose(hexapod.strut_lanes(), lanes, RawPoseOf(X_MP_start), settings)
                         : kernel::SolvePoseNonIdeal(hexapod.strut_lanes(), hexapod.joint_lanes(), lanes,
                                                     RawPoseOf(X_MP_start), settings);
}

// The screw's shift is small and smooth: it is put into the lengths and solved for again until it no longer
// moves.
HexapodForward SolveForwardWithScrews(const Hexapod& hexapod, const StrutVector& readings_mm,
                                      const Pose& X_MP_start) {
  constexpr int kRounds = 40;
  Pose X_MP = X_MP_start;
  HexapodForward answer;
  int iterations = 0;
  for (int round = 0; round < kRounds; ++round) {
    const StrutVector shift =
        ScrewShiftPerRad(hexapod) * (ScrewTwists(hexapod, X_MP) - hexapod.home_twists_rad());
    answer = ForwardOf(hexapod, SolveLengths(hexapod, readings_mm + shift, round == 0 ? X_MP_start : X_MP));
    iterations += answer.iterations;
    answer.iterations = iterations;
    if (answer.reason != Reason::kSolved) {
      return answer;
    }
    const double moved =
        (answer.X_MP.p_mm - X_MP.p_mm).norm() + hexapod.lever_mm() * (answer.X_MP.R - X_MP.R).norm();
    X_MP = answer.X_MP;
    if (round > 0 && moved < 1e-11 * hexapod.lever_mm()) {
      return answer;
    }
  }
  answer.reason = Reason::kNotConverged;
  return answer;
}

}  // namespace

std::string_view BoundName(HexapodBound bound) {
  switch (bound) {
    case HexapodBound::kNone:
      return "NONE";
    case HexapodBound::kStrutMin:
      return "STRUT_MIN";
    case HexapodBound::kStrutMax:
      return "STRUT_MAX";
    case HexapodBound::kBaseJointCone:
      return "BASE_JOINT_CONE";
    case HexapodBound::kPlatformJointCone:
      return "PLATFORM_JOINT_CONE";
    case HexapodBound::kSingularMargin:
      return "SINGULAR_MARGIN";
  }
  return "UNKNOWN";
}

Hexapod::Hexapod(const HexapodGeometry& geometry) : geometry_(geometry) {
  Expects(FaultOf(geometry).empty(), "Hexapod: a geometry without fault");
  ideal_ = geometry.joints == std::array<UniversalJoint, kStruts>{};
  lever_mm_ = std::sqrt(geometry.p_PB_mm.squaredNorm() / kStruts);
  struts_ = StrutLanesOf(geometry);
  joints_ = JointLanesOf(geometry);
  const StrutPoints s = StrutVectors(geometry, geometry.X_MP_home);
  home_lengths_mm_ = s.colwise().norm().transpose();
  home_directions_M_ = s.colwise().normalized();
  home_directions_P_ = geometry.X_MP_home.R.transpose() * home_directions_M_;
  ChooseStrutOrder(home_directions_M_, strut_order_, order_parity_);
  home_twists_rad_ = ScrewTwists(*this, geometry.X_MP_home);
}

HexapodInverse SolveInverse(const Hexapod& hexapod, const Pose& X_MP) {
  HexapodInverse answer;
  if (!Finite(X_MP)) {
    answer.reason = Reason::kNotFinite;
    return answer;
  }
  if (hexapod.ideal()) {
    kernel::Lanes lengths;
    kernel::StrutLengths(hexapod.strut_lanes(), RawPoseOf(X_MP), lengths);
    answer.lengths_mm = StrutsOf(lengths);
  } else {
    kernel::JointAngles solved;
    kernel::SolveJoints(hexapod.strut_lanes(), hexapod.joint_lanes(), RawPoseOf(X_MP), 8, solved);
    answer.lengths_mm = StrutsOf(solved.length);
    const StrutVector residual = StrutsOf(solved.residual);
    for (int j = 0; j < kStruts; ++j) {
      if (!(residual[j] <= 1e-9)) {
        Blame(answer, Reason::kNotConverged, HexapodBound::kNone, j,
              std::isfinite(residual[j]) ? residual[j] : 0.0);
        answer.lengths_mm.setZero();
        return answer;
      }
    }
  }
  FinishInverse(hexapod, &X_MP, answer);
  return answer;
}

HexapodInverse SolveInverse(const Hexapod& hexapod, const PlatformPose& pose) {
  if (!Finite(pose)) {
    HexapodInverse answer;
    answer.reason = Reason::kNotFinite;
    return answer;
  }
  if (NeedsRotation(hexapod)) {
    return SolveInverse(hexapod, pose.X_MP());
  }
  HexapodInverse answer;
  const double raw[6] = {pose.x_mm, pose.y_mm, pose.z_mm, pose.psi_rad, pose.theta_rad, pose.gamma_rad};
  kernel::Lanes lengths;
  kernel::StrutLengthsOfKrylov(hexapod.strut_lanes(), raw, lengths);
  answer.lengths_mm = StrutsOf(lengths);
  FinishInverse(hexapod, nullptr, answer);
  return answer;
}

void SolveInverseBlock(const Hexapod& hexapod, const PlatformPoseColumns& poses, std::size_t count,
                       const StrutLengthColumns& lengths_mm) {
  kernel::StrutLengthsBlock(hexapod.strut_lanes(), poses.columns.data(), count, lengths_mm.columns.data());
}

HexapodForward SolveForward(const Hexapod& hexapod, const StrutVector& actuators_mm, const Pose& X_MP_start) {
  const StrutVector lengths = actuators_mm + hexapod.geometry().length_zero_mm;
  for (int j = 0; j < kStruts; ++j) {
    if (!(lengths[j] > 0.0 && std::isfinite(lengths[j]))) {
      HexapodForward answer;
      answer.reason = std::isfinite(lengths[j]) ? Reason::kOutOfReach : Reason::kNotFinite;
      answer.strut = j;
      return answer;
    }
  }
  if (!Finite(X_MP_start)) {
    HexapodForward answer;
    answer.reason = Reason::kNotFinite;
    return answer;
  }
  if (hexapod.geometry().screw_lead_mm != 0.0) {
    return SolveForwardWithScrews(hexapod, lengths, X_MP_start);
  }
  return ForwardOf(hexapod, SolveLengths(hexapod, lengths, X_MP_start));
}

HexapodForward SolveForwardFromHome(const Hexapod& hexapod, const StrutVector& actuators_mm) {
  return SolveForward(hexapod, actuators_mm, hexapod.geometry().X_MP_home);
}

// The yoke's second axis stands square to the fixed axis f and to the strut u: along f x u.
StrutVector ScrewTwists(const Hexapod& hexapod, const Pose& X_MP) {
  const HexapodGeometry& geometry = hexapod.geometry();
  const StrutPoints s = StrutVectors(geometry, X_MP);
  const Eigen::Matrix3d R_turn = X_MP.R * geometry.X_MP_home.R.transpose();
  StrutVector twists;
  for (int j = 0; j < kStruts; ++j) {
    const Eigen::Vector3d u = s.col(j).normalized();
    const Eigen::Vector3d fixed = geometry.R_MA[static_cast<std::size_t>(j)].col(1);
    const Eigen::Vector3d base = fixed.cross(u);
    const Eigen::Vector3d platform = (R_turn * fixed).cross(u);
    twists[j] = std::atan2(base.cross(platform).dot(u), base.dot(platform));
  }
  return twists;
}

// With w = f x (f x u) square to the yoke's two axes, the strut-side yoke's turn about u follows from its
// turn being free of w: base: t_b = -(u x u').w_b / (u.w_b); platform, seen from P: t_p = (omega.w_p - (u x
// u').w_p) / (u.w_p); tau' = t_p - t_b.
ScrewTwistGradient ScrewTwistGradients(const Hexapod& hexapod, const Pose& X_MP) {
  const HexapodGeometry& geometry = hexapod.geometry();
  const StrutPoints s = StrutVectors(geometry, X_MP);
  const Eigen::Matrix3d R_turn = X_MP.R * geometry.X_MP_home.R.transpose();
  ScrewTwistGradient gradient;
  for (int j = 0; j < kStruts; ++j) {
    const double length = s.col(j).norm();
    const Eigen::Vector3d u = s.col(j) / length;
    const Eigen::Vector3d fixed = geometry.R_MA[static_cast<std::size_t>(j)].col(1);
    const Eigen::Vector3d on_platform = R_turn * fixed;
    const Eigen::Vector3d w_base = fixed.cross(fixed.cross(u)).eval();
    const Eigen::Vector3d w_platform = on_platform.cross(on_platform.cross(u)).eval();
    const Eigen::Vector3d k_base = w_base / u.dot(w_base);
    const Eigen::Vector3d k_platform = w_platform / u.dot(w_platform);
    // (u x u').k = u'.(k x u), u' = (v_B - u (u.v_B)) / L, and k x u is square to u.
    const Eigen::Vector3d by_v_B = (k_base - k_platform).cross(u) / length;
    const Eigen::Vector3d turned = X_MP.R * geometry.p_PB_mm.col(j);
    gradient.by_strut_M.col(j) = by_v_B;
    gradient.by_pose.row(j) << by_v_B.transpose(), (turned.cross(by_v_B) + k_platform).transpose();
  }
  return gradient;
}

}  // namespace lambdajet::kinematics
