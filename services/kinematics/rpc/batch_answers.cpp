// Batches of poses: each entry has its own answer, numbers that do not hold are 0.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "kinematics/core/hexapod_singularity.hpp"
#include "kinematics/rpc/kinematics_answers.hpp"
#include "kinematics/rpc/mechanism_selection.hpp"
#include "kinematics/rpc/wire_planar.hpp"
#include "kinematics/rpc/wire_spatial.hpp"
#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::kinematics {
namespace {

using Numbers = google::protobuf::RepeatedField<double>;
using SixVector = Eigen::Matrix<double, 6, 1>;

std::uint32_t FreedomsOf(const SelectedMechanism& selected) { return selected.hexapod ? kStruts : 2; }

// `answer_numbers`: how many numbers one answer has.
absl::Status CheckBatch(std::uint32_t stride, std::uint32_t wanted_stride, std::size_t numbers,
                        const char* field, std::size_t answer_numbers) {
  ArgumentChecks checks;
  checks.Require(stride == wanted_stride, "stride", "BAD_STRIDE",
                 fmt::format("{} numbers a pose; this mechanism takes {}", stride, wanted_stride));
  checks.Require(numbers % wanted_stride == 0, field, "BAD_STRIDE",
                 fmt::format("{} numbers are not a whole number of strides of {}", numbers, wanted_stride));
  const std::size_t most = std::min(
      kMostPosesPerMessage, kMostNumbersPerMessage / std::max<std::size_t>(answer_numbers, wanted_stride));
  checks.CountInRange(field, numbers / wanted_stride, 1, most);
  return checks.status();
}

absl::Status CheckDerivatives(std::uint32_t derivatives) {
  ArgumentChecks checks;
  checks.Require(derivatives <= 2, "derivatives", "OUT_OF_RANGE",
                 fmt::format("{} is not 0, 1 or 2", derivatives));
  return checks.status();
}

void ReasonsToWire(std::span<const Reason> reasons, google::protobuf::RepeatedField<int>& wire,
                   std::uint32_t& refused) {
  wire.Resize(static_cast<int>(reasons.size()), 0);
  int* const out = wire.mutable_data();
  std::uint32_t solved = 0;
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    out[i] = static_cast<int>(reasons[i]);
    solved += reasons[i] == Reason::kSolved;
  }
  refused = static_cast<std::uint32_t>(reasons.size()) - solved;
}

bool AllFinite(const double* numbers, std::size_t count) {
  return std::all_of(numbers, numbers + count, [](double number) { return std::abs(number) <= 1e9; });
}

// The second and third group of `freedoms` numbers, 0 where there are none.
SixVector DerivativeIn(const double* in, std::uint32_t derivatives, std::uint32_t order) {
  return derivatives >= order ? SixVector(Eigen::Map<const SixVector>(in + kStruts * order))
                              : SixVector(SixVector::Zero());
}

void Put(const SixVector& numbers, double* out) { std::copy_n(numbers.data(), 6, out); }

void Put(const Eigen::Vector3d& first, const Eigen::Vector3d& second, double* out) {
  std::copy_n(first.data(), 3, out);
  std::copy_n(second.data(), 3, out + 3);
}

Pose PlatformOf(const Hexapod& hexapod, const double* in) {
  const PlatformPose tool{in[0], in[1], in[2], in[3], in[4], in[5]};
  return PlatformFromTool(hexapod, tool.X_MP());
}

Reason InverseOf(const Hexapod& hexapod, std::uint32_t derivatives, const double* in, double* out) {
  if (!AllFinite(in, kStruts * (1 + derivatives))) {
    return Reason::kNotFinite;
  }
  const Pose X_MP = PlatformOf(hexapod, in);
  const HexapodInverse answer = SolveInverseWithMargin(hexapod, X_MP);
  if (answer.actuators_mm.allFinite()) {
    Put(answer.actuators_mm, out);
  }
  if (derivatives > 0 && answer.reason == Reason::kSolved) {
    const SixVector twist = DerivativeIn(in, derivatives, 1), rate = DerivativeIn(in, derivatives, 2);
    const ActuatorMotion motion = ActuatorMotionOfTool(hexapod, X_MP, {twist.head<3>(), twist.tail<3>()},
                                                       {rate.head<3>(), rate.tail<3>()})
                                      .motion;
    Put(motion.velocity_mm_per_s, out + kStruts);
    if (derivatives == 2) {
      Put(motion.acceleration_mm_per_s2, out + 2 * kStruts);
    }
  }
  return answer.reason;
}

// Takes `X_MP_start` to the pose found, if there is one.
Reason ForwardOf(const Hexapod& hexapod, std::uint32_t derivatives, const double* in, Pose& X_MP_start,
                 double* out) {
  if (!AllFinite(in, kStruts * (1 + derivatives))) {
    return Reason::kNotFinite;
  }
  const HexapodForward answer = SolveForward(hexapod, Eigen::Map<const StrutVector>(in), X_MP_start);
  if (answer.reason != Reason::kSolved) {
    return answer.reason;
  }
  X_MP_start = answer.X_MP;
  const PlatformPose tool = PlatformPose::Of(ToolFromPlatform(hexapod, answer.X_MP));
  Put({tool.x_mm, tool.y_mm, tool.z_mm}, {tool.psi_rad, tool.theta_rad, tool.gamma_rad}, out);
  if (derivatives > 0) {
    const ToolMotion motion = ToolMotionOf(
        hexapod, answer.X_MP, {DerivativeIn(in, derivatives, 1), DerivativeIn(in, derivatives, 2)});
    Put(motion.twist.v_mm_per_s, motion.twist.w_rad_per_s, out + kStruts);
    if (derivatives == 2) {
      Put(motion.rate.a_mm_per_s2, motion.rate.alpha_rad_per_s2, out + 2 * kStruts);
    }
  }
  return answer.reason;
}

using SolvePlanarMotion = MotionAnswer (*)(const LambdaMechanism&, const Motion&);

Reason PlanarMotionOf(const LambdaMechanism& m, SolvePlanarMotion solve, std::uint32_t derivatives,
                      const double* in, double* out) {
  Motion motion{{in[0], in[1]}, {in[2], in[3]}, Eigen::Vector2d::Zero()};
  if (derivatives == 2) {
    motion.acceleration_mm_per_s2 = {in[4], in[5]};
  }
  const MotionAnswer answer = solve(m, motion);
  std::copy_n(answer.motion.position_mm.data(), 2, out);
  std::copy_n(answer.motion.velocity_mm_per_s.data(), 2, out + 2);
  if (derivatives == 2) {
    std::copy_n(answer.motion.acceleration_mm_per_s2.data(), 2, out + 4);
  }
  return answer.reason;
}

using SolvePlanarBatch = void (*)(const LambdaMechanism&, std::span<const double>, std::span<double>,
                                  std::span<Reason>);

void SolvePlanar(const LambdaMechanism& m, SolvePlanarBatch positions, SolvePlanarMotion motions,
                 std::uint32_t derivatives, const Numbers& in, Numbers& out, std::span<Reason> reasons) {
  if (derivatives == 0) {
    const auto count = static_cast<std::size_t>(in.size());
    return positions(m, {in.data(), count}, {out.mutable_data(), count}, reasons);
  }
  const std::size_t stride = 2 * (1 + derivatives);
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    reasons[i] =
        PlanarMotionOf(m, motions, derivatives, in.data() + stride * i, out.mutable_data() + stride * i);
  }
}

// A finite pose of either mechanism: what Jacobians and singularities are asked at.
template <class Planar, class Spatial>
void ForEachPose(const SelectedMechanism& selected, const Numbers& poses, std::span<Reason> reasons,
                 Planar planar, Spatial spatial) {
  const std::size_t freedoms = FreedomsOf(selected);
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    const double* const in = poses.data() + freedoms * i;
    if (!AllFinite(in, freedoms)) {
      reasons[i] = Reason::kNotFinite;
    } else if (selected.hexapod) {
      reasons[i] = spatial(i, PlatformOf(*selected.hexapod, in));
    } else {
      reasons[i] = planar(i, Eigen::Vector2d(in[0], in[1]));
    }
  }
}

template <class Derived>
void PutRows(const Eigen::MatrixBase<Derived>& matrix, Numbers& out, std::size_t entry) {
  double* to = out.mutable_data() + static_cast<std::size_t>(matrix.size()) * entry;
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      *to++ = matrix(i, j);
    }
  }
}

Reason PlanarJacobianOf(const LambdaMechanism& m, const Eigen::Vector2d& p_DE_mm, std::size_t entry,
                        v1::ComputeJacobianBatchResponse& response) {
  const LambdaJacobians J = ComputeJacobians(m, p_DE_mm);
  PutRows(J.J_q_x, *response.mutable_j_q_x(), entry);
  if (!response.j_q_parameters().empty()) {
    PutRows(J.J_q_parameters, *response.mutable_j_q_parameters(), entry);
  }
  return J.reason;
}

Reason HexapodJacobianOf(const Hexapod& hexapod, const Pose& X_MP, std::size_t entry,
                         v1::ComputeJacobianBatchResponse& response) {
  const PoseJacobian J = ActuatorJacobian(hexapod, X_MP);
  if (!J.allFinite()) {
    return Reason::kSingular;
  }
  PutRows(J, *response.mutable_j_q_x(), entry);
  if (!response.j_q_parameters().empty()) {
    const ParameterJacobian by_parameters = ActuatorParameterJacobian(hexapod, X_MP);
    if (!by_parameters.allFinite()) {
      return Reason::kSingular;
    }
    PutRows(by_parameters, *response.mutable_j_q_parameters(), entry);
  }
  return Reason::kSolved;
}

constexpr std::size_t kPlanarReportNumbers = 6;
constexpr std::size_t kHexapodReportNumbers = 4;

Reason PlanarReportOf(const LambdaMechanism& m, const Eigen::Vector2d& p_DE_mm, double* out, int& type) {
  const SingularityReport r = lambdajet::kinematics::ReportSingularity(m, p_DE_mm);
  const std::array<double, kPlanarReportNumbers> numbers = {
      r.main_link_distance_mm,  r.second_link_distance_mm, r.parallel_distance_mm, r.determinant, r.condition,
      r.smallest_singular_value};
  std::copy(numbers.begin(), numbers.end(), out);
  type = static_cast<int>(r.type);
  return r.reason;
}

Reason HexapodReportOf(const Hexapod& hexapod, const Pose& X_MP, double* out, int& type) {
  const HexapodSingularity s = AnalyseSingularity(hexapod, X_MP);
  if (!std::isfinite(s.determinant)) {
    type = v1::SINGULARITY_TYPE_PARALLEL;
    return Reason::kSingular;
  }
  const std::array<double, kHexapodReportNumbers> numbers = {s.determinant,
                                                             std::isfinite(s.condition) ? s.condition : 0.0,
                                                             s.smallest_singular_value, s.signed_margin};
  std::copy(numbers.begin(), numbers.end(), out);
  const bool regular = s.signed_margin > hexapod.geometry().limits.singular_margin;
  type = regular ? v1::SINGULARITY_TYPE_REGULAR : v1::SINGULARITY_TYPE_PARALLEL;
  return Reason::kSolved;
}

}  // namespace

absl::Status KinematicsAnswers::AnswerBatch(const v1::SolveInverseBatchRequest& request,
                                            v1::SolveInverseBatchResponse& response) const {
  const auto selected = SelectMechanism(slot_, request.mechanism(), ModeIn(request), std::nullopt,
                                        *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  if (absl::Status status = CheckDerivatives(request.derivatives()); !status.ok()) {
    return status;
  }
  const std::uint32_t stride = FreedomsOf(*selected) * (1 + request.derivatives());
  const auto numbers = static_cast<std::size_t>(request.pose_size());
  if (absl::Status status = CheckBatch(request.stride(), stride, numbers, "pose", stride); !status.ok()) {
    return status;
  }
  Numbers& out = *response.mutable_actuator_position_mm();
  out.Resize(request.pose_size(), 0.0);
  std::vector<Reason> reasons(numbers / stride);
  if (selected->hexapod) {
    for (std::size_t i = 0; i < reasons.size(); ++i) {
      reasons[i] = InverseOf(*selected->hexapod, request.derivatives(), request.pose().data() + stride * i,
                             out.mutable_data() + stride * i);
    }
  } else {
    SolvePlanar(selected->planar, SolveInverseBatch, SolveInverseMotion, request.derivatives(),
                request.pose(), out, reasons);
  }
  std::uint32_t refused = 0;
  ReasonsToWire(reasons, *response.mutable_reason(), refused);
  response.set_stride(stride);
  response.set_refused_count(refused);
  return absl::OkStatus();
}

absl::Status KinematicsAnswers::AnswerBatch(const v1::SolveForwardBatchRequest& request,
                                            v1::SolveForwardBatchResponse& response) const {
  const auto selected = SelectMechanism(slot_, request.mechanism(), ModeIn(request), AssemblyIn(request),
                                        *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  if (absl::Status status = CheckDerivatives(request.derivatives()); !status.ok()) {
    return status;
  }
  const std::uint32_t stride = FreedomsOf(*selected) * (1 + request.derivatives());
  const Numbers& in = request.actuator_position_mm();
  const auto numbers = static_cast<std::size_t>(in.size());
  if (absl::Status status = CheckBatch(request.stride(), stride, numbers, "actuator_position_mm", stride);
      !status.ok()) {
    return status;
  }
  Numbers& out = *response.mutable_pose();
  out.Resize(in.size(), 0.0);
  std::vector<Reason> reasons(numbers / stride);
  if (selected->hexapod) {
    const Hexapod& hexapod = *selected->hexapod;
    ArgumentChecks checks;
    const Pose X_MP_start =
        request.has_x_mt_start()
            ? PlatformFromTool(hexapod, FromWire(request.x_mt_start(), "X_MT_start", checks))
            : hexapod.geometry().X_MP_home;
    if (!checks.ok()) {
      return checks.status();
    }
    Pose start = X_MP_start;
    for (std::size_t i = 0; i < reasons.size(); ++i) {
      start = request.start_from_previous() ? start : X_MP_start;
      reasons[i] = ForwardOf(hexapod, request.derivatives(), in.data() + stride * i, start,
                             out.mutable_data() + stride * i);
    }
  } else {
    SolvePlanar(selected->planar, SolveForwardBatch, SolveForwardMotion, request.derivatives(), in, out,
                reasons);
  }
  std::uint32_t refused = 0;
  ReasonsToWire(reasons, *response.mutable_reason(), refused);
  response.set_stride(stride);
  response.set_refused_count(refused);
  return absl::OkStatus();
}

absl::Status KinematicsAnswers::AnswerBatch(const v1::ComputeJacobianBatchRequest& request,
                                            v1::ComputeJacobianBatchResponse& response) const {
  const auto selected = SelectMechanism(slot_, request.mechanism(), ModeIn(request), std::nullopt,
                                        *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  const std::uint32_t freedoms = FreedomsOf(*selected);
  const std::size_t by_parameters =
      request.parameters() ? freedoms * (selected->hexapod ? kStrutParameters : kMechanismParameterCount) : 0;
  const auto numbers = static_cast<std::size_t>(request.pose_size());
  if (absl::Status status =
          CheckBatch(request.stride(), freedoms, numbers, "pose", freedoms * freedoms + by_parameters);
      !status.ok()) {
    return status;
  }
  std::vector<Reason> reasons(numbers / freedoms);
  response.mutable_j_q_x()->Resize(static_cast<int>(reasons.size() * freedoms * freedoms), 0.0);
  response.mutable_j_q_parameters()->Resize(static_cast<int>(reasons.size() * by_parameters), 0.0);
  ForEachPose(
      *selected, request.pose(), reasons,
      [&](std::size_t i, const Eigen::Vector2d& p_DE_mm) {
        return PlanarJacobianOf(selected->planar, p_DE_mm, i, response);
      },
      [&](std::size_t i, const Pose& X_MP) {
        return HexapodJacobianOf(*selected->hexapod, X_MP, i, response);
      });
  if (request.parameters()) {
    ParameterNamesToWire(selected->hexapod.has_value(), *response.mutable_parameter_name());
  }
  std::uint32_t refused = 0;
  ReasonsToWire(reasons, *response.mutable_reason(), refused);
  response.set_refused_count(refused);
  return absl::OkStatus();
}

absl::Status KinematicsAnswers::AnswerBatch(const v1::ReportSingularityBatchRequest& request,
                                            v1::ReportSingularityBatchResponse& response) const {
  const auto selected = SelectMechanism(slot_, request.mechanism(), ModeIn(request), std::nullopt,
                                        *response.mutable_model_version());
  if (!selected.ok()) {
    return selected.status();
  }
  const std::uint32_t freedoms = FreedomsOf(*selected);
  const std::size_t each = selected->hexapod ? kHexapodReportNumbers : kPlanarReportNumbers;
  const auto numbers = static_cast<std::size_t>(request.pose_size());
  if (absl::Status status = CheckBatch(request.stride(), freedoms, numbers, "pose", each); !status.ok()) {
    return status;
  }
  std::vector<Reason> reasons(numbers / freedoms);
  response.mutable_number()->Resize(static_cast<int>(reasons.size() * each), 0.0);
  response.mutable_type()->Resize(static_cast<int>(reasons.size()), v1::SINGULARITY_TYPE_UNSPECIFIED);
  double* const out = response.mutable_number()->mutable_data();
  int* const types = response.mutable_type()->mutable_data();
  ForEachPose(
      *selected, request.pose(), reasons,
      [&](std::size_t i, const Eigen::Vector2d& p_DE_mm) {
        return PlanarReportOf(selected->planar, p_DE_mm, out + each * i, types[i]);
      },
      [&](std::size_t i, const Pose& X_MP) {
        return HexapodReportOf(*selected->hexapod, X_MP, out + each * i, types[i]);
      });
  std::uint32_t refused = 0;
  ReasonsToWire(reasons, *response.mutable_reason(), refused);
  response.set_stride(static_cast<std::uint32_t>(each));
  response.set_refused_count(refused);
  return absl::OkStatus();
}

}  // namespace lambdajet::kinematics
