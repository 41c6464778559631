// Homogeneous chains (seed paper 000, (3) to (23)) and the errors of their elements ((44) to (55)).
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>

#include "foundation/geometry/homogeneous_chain.hpp"
#include "kinematics/rpc/kinematics_answers.hpp"
#include "kinematics/rpc/wire_planar.hpp"
#include "kinematics/rpc/wire_spatial.hpp"
#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr std::size_t kMostFactors = 64;
constexpr double kLargest = 1e9;  // of any argument and any derivative
constexpr double kLargestVariance = 1e12;
constexpr std::size_t kPointNumbers = 9;

using Numbers = google::protobuf::RepeatedField<double>;
using SixBySix = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

// As many factors as any message may have; no message allocates.
struct Factors {
  std::array<ChainFactor, kMostFactors> factor;
  std::size_t count = 0;
  ChainMotion Product() const { return MultiplyChain({factor.data(), count}); }
};

bool IsMotion(int wire) { return wire >= v1::ELEMENTARY_MOTION_X && wire <= v1::ELEMENTARY_MOTION_GAMMA; }

ElementaryMotion MotionFromWire(int wire, const std::string& field, ArgumentChecks& checks) {
  checks.Require(IsMotion(wire), field, "OUT_OF_RANGE", "must be one of the six elementary motions");
  return IsMotion(wire) ? static_cast<ElementaryMotion>(wire - v1::ELEMENTARY_MOTION_X)
                        : ElementaryMotion::kX;
}

Factors ChainFromWire(const v1::Chain& wire, const std::string& field, ArgumentChecks& checks) {
  Factors factors;
  checks.CountInRange(field + ".factor", static_cast<std::size_t>(wire.factor_size()), 0, kMostFactors);
  for (int i = 0; checks.ok() && i < wire.factor_size(); ++i) {
    const v1::ChainFactor& factor = wire.factor(i);
    const std::string at = field + ".factor[" + std::to_string(i) + "]";
    checks.InRange(at + ".value", factor.value(), -kLargest, kLargest);
    checks.InRange(at + ".rate", factor.rate(), -kLargest, kLargest);
    checks.InRange(at + ".rate_of_rate", factor.rate_of_rate(), -kLargest, kLargest);
    factors.factor[factors.count++] = {MotionFromWire(factor.motion(), at + ".motion", checks),
                                       factor.value(), factor.rate(), factor.rate_of_rate()};
  }
  return factors;
}

Eigen::Vector3d TripleFromWire(const Numbers& wire, const std::string& field, ArgumentChecks& checks) {
  if (wire.empty()) {
    return Eigen::Vector3d::Zero();
  }
  checks.CountInRange(field, static_cast<std::size_t>(wire.size()), 3, 3);
  for (const double number : wire) {
    checks.InRange(field, number, -kLargest, kLargest);
  }
  return checks.ok() ? Eigen::Vector3d(wire[0], wire[1], wire[2]) : Eigen::Vector3d::Zero();
}

PointMotion PointFromWire(const v1::PointMotion& wire, ArgumentChecks& checks) {
  return {FromWire(wire.position(), "point.position", checks),
          TripleFromWire(wire.velocity_mm_per_s(), "point.velocity_mm_per_s", checks),
          TripleFromWire(wire.acceleration_mm_per_s2(), "point.acceleration_mm_per_s2", checks)};
}

void PointToWire(const PointMotion& point, v1::PointMotion& wire) {
  ToWire(point.r_mm, *wire.mutable_position());
  wire.mutable_velocity_mm_per_s()->Add(point.v_mm_per_s.data(), point.v_mm_per_s.data() + 3);
  wire.mutable_acceleration_mm_per_s2()->Add(point.a_mm_per_s2.data(), point.a_mm_per_s2.data() + 3);
}

Factors KindsFromWire(const google::protobuf::RepeatedField<int>& wire, const std::string& field,
                      ArgumentChecks& checks) {
  Factors factors;
  checks.CountInRange(field, static_cast<std::size_t>(wire.size()), 0, kMostFactors);
  for (int i = 0; checks.ok() && i < wire.size(); ++i) {
    const std::string at = field + "[" + std::to_string(i) + "]";
    factors.factor[factors.count++].motion = MotionFromWire(wire[i], at, checks);
  }
  return factors;
}

// Fills the arguments from three numbers a factor; returns what follows them.
const double* TakeArguments(const double* in, Factors& factors) {
  for (std::size_t i = 0; i < factors.count; ++i, in += 3) {
    factors.factor[i].value = in[0];
    factors.factor[i].rate = in[1];
    factors.factor[i].acceleration = in[2];
  }
  return in;
}

bool AllWithin(const double* numbers, std::size_t count) {
  return std::all_of(numbers, numbers + count, [](double number) { return std::abs(number) <= kLargest; });
}

Pose PlaceFromWire(const v1::ErrorElement& wire, const std::string& field, ArgumentChecks& checks) {
  checks.Require(wire.place_case() != v1::ErrorElement::PLACE_NOT_SET, field, "EMPTY",
                 "an element needs a chain or a pose");
  return wire.has_x_0k() ? FromWire(wire.x_0k(), field + ".X_0k", checks)
                         : ChainFromWire(wire.chain(), field + ".chain", checks).Product().pose();
}

// Everything of the question but its samples.
struct Stack {
  std::array<SixBySix, kMostFactors> map;
  std::size_t count = 0;
};

Stack StackFromWire(const v1::SumErrorsRequest& request, ArgumentChecks& checks,
                    v1::SumErrorsResponse& response) {
  Stack stack;
  const auto count = static_cast<std::size_t>(request.element_size());
  checks.CountInRange("element", count, 1, kMostFactors);
  const Eigen::Vector3d point = FromWire(request.point(), "point", checks);
  for (std::size_t k = 0; checks.ok() && k < count; ++k) {
    const std::string field = "element[" + std::to_string(k) + "]";
    const Pose X_0k = PlaceFromWire(request.element(static_cast<int>(k)), field, checks);
    stack.map[k] = ErrorMap(X_0k.R, point - X_0k.p_mm);
    MatrixToWire(stack.map[k], *response.add_a_0k());
  }
  stack.count = count;
  return stack;
}

void CovarianceToWire(const Stack& stack, const Numbers& covariance, ArgumentChecks& checks,
                      v1::SumErrorsResponse& response) {
  checks.CountInRange("covariance", static_cast<std::size_t>(covariance.size()), 36 * stack.count,
                      36 * stack.count);
  for (const double number : covariance) {
    checks.InRange("covariance", number, -kLargestVariance, kLargestVariance);
  }
  if (!checks.ok()) {
    return;
  }
  SixBySix sum = SixBySix::Zero();
  for (std::size_t k = 0; k < stack.count; ++k) {
    sum += stack.map[k] * Eigen::Map<const SixBySix>(covariance.data() + 36 * k) * stack.map[k].transpose();
  }
  MatrixToWire(sum, *response.mutable_covariance());
}

}  // namespace

absl::Status KinematicsAnswers::CarryPoint(const v1::CarryPointRequest& request,
                                           v1::CarryPointResponse& response) const {
  ArgumentChecks checks;
  const Factors tool = ChainFromWire(request.tool(), "tool", checks);
  const Factors part = ChainFromWire(request.part(), "part", checks);
  const PointMotion point = PointFromWire(request.point(), checks);
  if (checks.ok()) {
    const ChainMotion chain = ToolInPart(tool.Product(), part.Product());
    PointToWire(lambdajet::CarryPoint(chain, point), *response.mutable_point());
    ToWire(chain.pose(), *response.mutable_pose());
  }
  return checks.status();
}

absl::Status KinematicsAnswers::AnswerBatch(const v1::CarryPointBatchRequest& request,
                                            v1::CarryPointBatchResponse& response) const {
  ArgumentChecks checks;
  Factors tool = KindsFromWire(request.tool(), "tool", checks);
  Factors part = KindsFromWire(request.part(), "part", checks);
  const std::size_t stride = 3 * (tool.count + part.count) + kPointNumbers;
  const auto numbers = static_cast<std::size_t>(request.sample_size());
  checks.Require(
      numbers % stride == 0, "sample", "BAD_STRIDE",
      std::to_string(numbers) + " numbers are not a whole number of samples of " + std::to_string(stride));
  const std::size_t count = numbers / stride;
  checks.CountInRange("sample", count, 1, std::min(kMostPosesPerMessage, kMostNumbersPerMessage / stride));
  if (!checks.ok()) {
    return checks.status();
  }
  response.mutable_point()->Resize(static_cast<int>(kPointNumbers * count), 0.0);
  double* out = response.mutable_point()->mutable_data();
  std::uint32_t refused = 0;
  for (std::size_t i = 0; i < count; ++i, out += kPointNumbers) {
    const double* const in = request.sample().data() + stride * i;
    if (!AllWithin(in, stride)) {
      response.add_reason(v1::REASON_NOT_FINITE);
      ++refused;
      continue;
    }
    const double* const r = TakeArguments(TakeArguments(in, tool), part);
    const PointMotion point =
        lambdajet::CarryPoint(ToolInPart(tool.Product(), part.Product()),
                              {{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, {r[6], r[7], r[8]}});
    std::copy_n(point.r_mm.data(), 3, out);
    std::copy_n(point.v_mm_per_s.data(), 3, out + 3);
    std::copy_n(point.a_mm_per_s2.data(), 3, out + 6);
    response.add_reason(v1::REASON_SOLVED);
  }
  response.set_refused_count(refused);
  return absl::OkStatus();
}

absl::Status KinematicsAnswers::AnswerBatch(const v1::SumErrorsRequest& request,
                                            v1::SumErrorsResponse& response) const {
  ArgumentChecks checks;
  const Stack stack = StackFromWire(request, checks, response);
  const std::size_t stride = 6 * std::max<std::size_t>(stack.count, 1);
  const auto numbers = static_cast<std::size_t>(request.error_size());
  checks.Require(
      numbers % stride == 0, "error", "BAD_STRIDE",
      std::to_string(numbers) + " numbers are not a whole number of samples of " + std::to_string(stride));
  checks.CountInRange("error", numbers / stride, 0, kMostPosesPerMessage);
  if (!checks.ok()) {
    return checks.status();
  }
  response.mutable_error()->Resize(static_cast<int>(6 * (numbers / stride)), 0.0);
  double* out = response.mutable_error()->mutable_data();
  for (const double* in = request.error().data(); in != request.error().data() + numbers;
       in += stride, out += 6) {
    const bool finite = AllWithin(in, stride);
    response.add_reason(finite ? v1::REASON_SOLVED : v1::REASON_NOT_FINITE);
    SmallErrors sum = SmallErrors::Zero();
    for (std::size_t k = 0; finite && k < stack.count; ++k) {
      sum += stack.map[k] * Eigen::Map<const SmallErrors>(in + 6 * k);
    }
    std::copy_n(sum.data(), 6, out);
  }
  if (!request.covariance().empty()) {
    CovarianceToWire(stack, request.covariance(), checks, response);
  }
  return checks.status();
}

}  // namespace lambdajet::kinematics
