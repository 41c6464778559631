// Solves the lambda mechanism and its special case, the biglide, on one rail or two: positions, velocities,
// accelerations, Jacobians to the tool and to every parameter, and how far a pose is from each singularity.
//
// Model: core/lambda_kernel.hpp; seed paper 000, (57)-(61) and |J| as corrected: det J = -l y [s1/c + s2 l/d]
// on one rail. Singularities are named as Gosselin and Angeles name them: type 1 (serial), a link stands
// square to its rail and the tool cannot leave along it; type 2 (parallel), the tool lies on the line of the
// sliders and the sliders cannot hold it. (The paper uses the two words the other way round.) Frames: the
// tool point is the origin of E, given in D. Actuator positions are encoder readings (rail position = reading
// + zero). Units: mm, s, rad. Validity: any finite geometry; nonsense is answered with BAD_GEOMETRY, never
// with an abort. No answer holds NaN or infinity. Threads: values and pure functions. Cost: no allocation; a
// batch inverse or forward 4 to 6 ns a pose on any rails. Errors: answers with a Reason; a field named
// `positioned` or `differentiable` says whether the numbers hold.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "foundation/machine/machine_description.hpp"
#include "kinematics/core/lambda_kernel.hpp"
#include "kinematics/core/reason.hpp"

namespace lambdajet::kinematics {

// The first nine entries of foundation's parameter vector are the mechanism's own.
inline constexpr int kMechanismParameterCount = 9;
using MechanismParameters = Eigen::Matrix<double, kMechanismParameterCount, 1>;
using LambdaParameterJacobian = Eigen::Matrix<double, 2, kMechanismParameterCount>;

// A travel or a distance without a limit; finite, so that margins stay finite.
inline constexpr double kUnlimitedMm = 1e9;

struct ActuatorTravel {
  double min_mm = -kUnlimitedMm;
  double max_mm = kUnlimitedMm;
};

// A mechanism as it stands: parameters, the branch it was assembled for, and what it may not pass.
struct LambdaMechanism {
  MechanismParameters parameters = MechanismParameters::Zero();
  WorkingMode working_mode;
  int assembly_mode = 1;
  std::array<ActuatorTravel, 2> travel;
  double singular_margin_mm = 0.0;

  lambda::Geometry<double> geometry;  // of `parameters`; kept by the functions below
  bool rails_apart = false;
  bool valid = false;  // lengths positive, everything finite, modes +-1

  static LambdaMechanism FromDescription(const MachineDescription& machine);
  static LambdaMechanism FromParameters(const MechanismParameters& parameters, WorkingMode working_mode = {},
                                        int assembly_mode = 1);

  // The same mechanism on another branch, or with other parameters.
  LambdaMechanism WithModes(WorkingMode mode, int assembly) const;
  LambdaMechanism WithParameters(const MechanismParameters& changed) const;
};

// One-rail machine with ideal rails: what the paper draws. Attach = main gives the biglide.
MechanismParameters IdealLambda(double main_mm, double attach_mm, double second_mm);
// Rails y = 0 and y = height, links meeting in the tool.
MechanismParameters TwoRailBiglide(double main_mm, double second_mm, double height_mm);

struct InverseAnswer {
  Reason reason = Reason::kNotFinite;
  bool positioned = false;  // the positions below close the mechanism, whatever else is wrong
  Eigen::Vector2d actuator_position_mm = Eigen::Vector2d::Zero();
  WorkingMode working_mode;  // the branch solved for
  int assembly_mode = 0;     // the side the pose lies on; 0 on the line of the sliders
  double reach_margin_mm =
      0.0;  // of the link nearest to its reach, measured across its rail; negative: out of reach
  double serial_distance_mm = 0.0;    // tool to the nearest type 1 line; negative beyond
  double parallel_distance_mm = 0.0;  // tool to the type 2 line; negative on the other assembly's side
  double travel_margin_mm = 0.0;      // to the nearest end of travel; negative beyond
  double excess_mm = 0.0;             // by how much the limit that `reason` names is passed; 0 when solved
};

struct ForwardAnswer {
  Reason reason = Reason::kNotFinite;
  bool positioned = false;
  Eigen::Vector2d p_DE_mm = Eigen::Vector2d::Zero();
  WorkingMode working_mode;      // read off the pose
  int assembly_mode = 0;         // the side solved for
  double reach_margin_mm = 0.0;  // of the sliders' distance to |attach - second| and attach + second
  double serial_distance_mm = 0.0;
  double parallel_distance_mm = 0.0;
  double travel_margin_mm = 0.0;
  double excess_mm = 0.0;
};

// Where the tool must be driven by the sliders, on the mechanism's working mode.
InverseAnswer SolveInverse(const LambdaMechanism& mechanism, const Eigen::Vector2d& p_DE_mm);

// Where the sliders hold the tool, on the mechanism's assembly mode. A pose of another working mode than the
// mechanism's is positioned and refused with MODE_MISMATCH.
ForwardAnswer SolveForward(const LambdaMechanism& mechanism, const Eigen::Vector2d& actuator_position_mm);

// A position with its first and second time derivative, of the tool (in D) or of the actuators.
struct Motion {
  Eigen::Vector2d position_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity_mm_per_s = Eigen::Vector2d::Zero();
  Eigen::Vector2d acceleration_mm_per_s2 = Eigen::Vector2d::Zero();
};

struct MotionAnswer {
  Reason reason = Reason::kNotFinite;  // as of the position
  bool differentiable = false;         // velocity and acceleration hold
  Motion motion;
};

// q' = J x', q'' = J x'' + (x'^T H_i x')_i, without forming H.
MotionAnswer SolveInverseMotion(const LambdaMechanism& mechanism, const Motion& tool);
// The same read backwards: x' = J^-1 q', x'' = J^-1 (q'' - (x'^T H_i x')_i).
MotionAnswer SolveForwardMotion(const LambdaMechanism& mechanism, const Motion& actuators);

struct LambdaJacobians {
  Reason reason = Reason::kNotFinite;  // as of the position
  bool differentiable = false;         // J_q_x and J_q_parameters hold
  bool invertible = false;             // J_x_q and J_x_parameters hold too
  Eigen::Matrix2d J_q_x = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d J_x_q = Eigen::Matrix2d::Zero();
  LambdaParameterJacobian J_q_parameters = LambdaParameterJacobian::Zero();  // of the inverse, the tool held
  LambdaParameterJacobian J_x_parameters =
      LambdaParameterJacobian::Zero();  // of the forward, the readings held
  double determinant = 0.0;             // of J_q_x
  double condition = 0.0;               // 2-norm; 0 where not invertible
  double smallest_singular_value = 0.0;
  double largest_singular_value = 0.0;
};

LambdaJacobians ComputeJacobians(const LambdaMechanism& mechanism, const Eigen::Vector2d& p_DE_mm);

enum class SingularityType : std::uint8_t {
  kRegular = 1,
  kSerial = 2,
  kParallel = 3,
  kSerialAndParallel = 4
};

// How a pose stands to each singular locus.
struct SingularityReport {
  Reason reason = Reason::kNotFinite;
  SingularityType type = SingularityType::kRegular;  // within the mechanism's margin; kRegular outside
  double main_link_distance_mm = 0.0;    // tool to the type 1 line of the main link (square to rail 1)
  double second_link_distance_mm = 0.0;  // tool to the type 1 line of the second link
  double parallel_distance_mm =
      0.0;                   // tool to the nearest type 2 point; positive on the mechanism's assembly side
  double determinant = 0.0;  // det J_q_x
  double serial_determinant_mm2 = 0.0;    // det B = 4 (T-b1).u1 (P-b2).u2 of the closure equations
  double parallel_determinant_mm2 = 0.0;  // det A, likewise
  double condition = 0.0;
  double smallest_singular_value = 0.0;
};

SingularityReport ReportSingularity(const LambdaMechanism& mechanism, const Eigen::Vector2d& p_DE_mm);

// Many poses at once: x, y interleaved as [x0 y0 x1 y1 …] in, [q1 q2 …] out, one reason a pose. The reasons
// are those of SolveInverse; positions are 0 where the pose cannot be closed. Sizes must match (2 n, 2 n, n):
// a contract.
void SolveInverseBatch(const LambdaMechanism& mechanism, std::span<const double> p_DE_mm,
                       std::span<double> actuator_position_mm, std::span<Reason> reasons);
// The same for forward: [q1 q2 …] in, [x y …] out.
void SolveForwardBatch(const LambdaMechanism& mechanism, std::span<const double> actuator_position_mm,
                       std::span<double> p_DE_mm, std::span<Reason> reasons);

}  // namespace lambdajet::kinematics
