// The numbers of seed paper 004 (hexapod, Krylov angles, imperfect universal joints), as checked: every printed digit.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "kinematics/core/hexapod.hpp"
#include "kinematics/core/hexapod_jacobian.hpp"
#include "kinematics/core/hexapod_singularity.hpp"
#include "tests/papers/kinematics_hexapod_cases.hpp"

namespace lambdajet::kinematics {
namespace {

using worked::kDeg;
using worked::kPoses;

// Half a unit of the last printed digit, and a little for its rounding.
constexpr double kDigits9 = 6e-10;
constexpr double kDigits6 = 6e-7;

TEST(PaperEquationOne, HasTheNineCoefficientsOfThePrint) {
  const double p = 0.3, t = -0.7, g = 1.1;
  const double Sp = std::sin(p), Cp = std::cos(p), St = std::sin(t), Ct = std::cos(t), Sg = std::sin(g),
               Cg = std::cos(g);
  Eigen::Matrix3d printed;
  printed << Cp * Cg + Sp * St * Sg, Sp * Ct, Sp * St * Cg - Cp * Sg,  //
      Cp * St * Sg - Sp * Cg, Cp * Ct, Sp * Sg + Cp * St * Cg,         //
      Ct * Sg, -St, Ct * Cg;
  EXPECT_LT((KrylovAngles{p, t, g}.Rotation() - printed).cwiseAbs().maxCoeff(), 1e-15);
  double kernel_R[9];
  const double angles[3] = {p, t, g};
  kernel::RotationOfKrylov(angles, kernel_R);
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(kernel_R[i], printed(i / 3, i % 3), 2e-16);
  }
}

TEST(PaperEquationOne, TurnsTheSecondPoseAsPrinted) {
  Eigen::Matrix3d printed;
  printed << 0.973117365, 0.172987394, -0.152045897, -0.183903703, 0.981060262, -0.060829188, 0.138643505,
      0.087155743, 0.986499800;
  EXPECT_LT((kPoses[1].X_MP().R - printed).cwiseAbs().maxCoeff(), kDigits9);
}

TEST(PaperJointFrame, IsTheOneOfTheFirstStrut) {
  Eigen::Matrix3d printed;
  printed << -0.852730875, 0.198929347, -0.482987752, -0.173092655, -0.980013834, -0.098039880, -0.492837688,
      0, 0.870121263;
  EXPECT_LT((worked::Geometry().R_MA[0] - printed).cwiseAbs().maxCoeff(), kDigits9);
}

constexpr std::array<std::array<double, 6>, 5> kIdealLengths = {{
    {890.680451713, 890.680451713, 890.680451713, 890.680451713, 890.680451713, 890.680451713},
    {921.395482749, 914.118943930, 1039.712429869, 935.339167535, 921.974723478, 929.016417425},
    {906.777241385, 922.724549521, 724.850263363, 866.157036319, 901.419618815, 912.304028377},
    {949.289179099, 833.733357763, 832.336519223, 884.440070192, 902.234459350, 964.684143550},
    {929.122668892, 912.425649222, 981.878104036, 971.092118196, 1112.470484896, 1088.379045888},
}};
constexpr std::array<std::array<double, 6>, 5> kNonIdealLengths = {{
    {890.680460309, 890.580460309, 890.680460310, 890.780440310, 890.680460309, 890.580460309},
    {921.399207991, 914.010645050, 1039.708477572, 935.439829629, 921.973615420, 928.915549154},
    {906.773762006, 922.638210347, 724.858327343, 866.253483064, 901.420494005, 912.206736147},
    {949.290923224, 833.635105353, 832.333407725, 884.540942550, 902.235180712, 964.582287924},
    {929.131605855, 912.319680647, 981.879626603, 971.181232308, 1112.464801491, 1088.284339959},
}};

void ExpectLengths(const Hexapod& hexapod, const std::array<std::array<double, 6>, 5>& printed) {
  for (std::size_t i = 0; i < kPoses.size(); ++i) {
    const HexapodInverse answer = SolveInverse(hexapod, kPoses[i]);
    ASSERT_EQ(answer.reason, Reason::kSolved);
    for (std::size_t j = 0; j < 6; ++j) {
      EXPECT_NEAR(answer.lengths_mm[static_cast<int>(j)], printed[i][j], kDigits9)
          << "P" << i + 1 << " L" << j + 1;
    }
  }
}

TEST(PaperLengths, IdealAtFivePoses) { ExpectLengths(Hexapod(worked::Geometry()), kIdealLengths); }
TEST(PaperLengths, NonIdealAtFivePoses) {
  ExpectLengths(Hexapod(worked::NonIdealGeometry()), kNonIdealLengths);
}

TEST(PaperNewton, RowsOfTheFirstJointAtTheSecondPose) {
  const Hexapod hexapod(worked::NonIdealGeometry());
  struct Row {
    double q1, q2, length, residual;
  };
  constexpr std::array<Row, 2> kRows = {{{-0.077761902165, -0.093600479448, 921.3954827488, 2.9e-1},
                                         {-0.077922296526, -0.093869282600, 921.3991629471, 4.5e-5}}};
  for (int updates = 0; updates < 2; ++updates) {
    const SolvedJoint joint = SolveUniversalJoints(hexapod, kPoses[1].X_MP(), updates)[0];
    const Row& row = kRows[static_cast<std::size_t>(updates)];
    EXPECT_NEAR(joint.q1_rad, row.q1, 6e-13);
    EXPECT_NEAR(joint.q2_rad, row.q2, 6e-13);
    EXPECT_NEAR(joint.length_mm, row.length, 1e-10);
    EXPECT_NEAR(joint.residual_mm / row.residual, 1.0, 0.02);
  }
  const SolvedJoint last = SolveUniversalJoints(hexapod, kPoses[1].X_MP(), 2)[0];
  EXPECT_NEAR(last.q1_rad, -0.077922299937, 6e-13);
  EXPECT_NEAR(last.q2_rad, -0.093869280317, 6e-13);
  EXPECT_NEAR(last.length_mm, 921.3992079914, 1e-10);
  EXPECT_LT(last.residual_mm, 4e-13);
}

// Residuals before each of Newton's steps from P1 to P2, the largest of the six lengths.
std::array<double, 5> ForwardResiduals(const Hexapod& hexapod) {
  const StrutVector target = SolveInverse(hexapod, kPoses[1]).lengths_mm;
  std::array<double, 5> residuals{};
  Pose X_MP = kPoses[0].X_MP();
  for (double& residual : residuals) {
    const StrutVector off = target - SolveInverse(hexapod, X_MP).lengths_mm;
    residual = off.cwiseAbs().maxCoeff();
    const Eigen::Matrix<double, 6, 1> step =
        ActuatorJacobianKrylov(hexapod, PlatformPose::Of(X_MP)).fullPivLu().solve(off);
    PlatformPose next = PlatformPose::Of(X_MP);
    next = {next.x_mm + step[0],    next.y_mm + step[1],      next.z_mm + step[2],
            next.psi_rad + step[3], next.theta_rad + step[4], next.gamma_rad + step[5]};
    X_MP = next.X_MP();
  }
  return residuals;
}

TEST(PaperNewton, ForwardResidualsFromTheFirstPoseToTheSecond) {
  for (const HexapodGeometry& geometry : {worked::Geometry(), worked::NonIdealGeometry()}) {
    const std::array<double, 5> r = ForwardResiduals(Hexapod(geometry));
    std::printf("forward residuals P1 to P2, mm: %.3g %.3g %.3g %.3g %.3g\n", r[0], r[1], r[2], r[3], r[4]);
    EXPECT_NEAR(r[0] / 1.5e2, 1.0, 0.04);
    EXPECT_NEAR(r[1] / 1.8e1, 1.0, 0.04);
    EXPECT_NEAR(r[2] / 2.2e-1, 1.0, 0.04);
    EXPECT_NEAR(r[3] / 3.2e-5, 1.0, 0.04);
    EXPECT_LT(r[4], 2e-12);
  }
}

TEST(PaperDeterminants, OfTheFivePoses) {
  const Hexapod hexapod(worked::Geometry());
  constexpr std::array<double, 5> kPrinted = {4.51277427e+07, 3.61857899e+07, 3.92416041e+07, 3.70341407e+07,
                                              3.39113133e+07};
  for (std::size_t i = 0; i < kPoses.size(); ++i) {
    EXPECT_NEAR(ActuatorJacobianKrylov(hexapod, kPoses[i]).determinant(), kPrinted[i], 0.6e-1) << i;
    EXPECT_NEAR(AnalyseSingularity(hexapod, kPoses[i].X_MP()).determinant_krylov_mm3, kPrinted[i], 0.6e-1)
        << i;
  }
}

TEST(PaperJointDistance, IsNoFunctionOfTheLengthAlone) {
  const UniversalJoint joint = worked::JointOf(worked::SignsOf(0));
  struct Row {
    double q1_deg, q2_deg, off_um;
  };
  constexpr std::array<Row, 5> kRows = {
      {{0, 0, 0.001393}, {20, 0, 20.120696}, {-20, 0, -14.088043}, {0, 20, 0.008233}, {20, 20, 18.914977}}};
  for (const Row& row : kRows) {
    const Eigen::Vector3d b = StrutEnd(joint, row.q1_deg * kDeg, row.q2_deg * kDeg, 900.0);
    EXPECT_NEAR((b.norm() - 900.0) * 1e3, row.off_um, kDigits6) << row.q1_deg << " " << row.q2_deg;
  }
  const Eigen::Vector3d a1(joint.a1x_mm, joint.a1y_mm, joint.a1z_mm);
  EXPECT_NEAR(((StrutEnd(joint, 0.3, 0.0, 900.0) - a1).norm() - 900.0) * 1e3, 49.992777, kDigits6);
  EXPECT_NEAR(((StrutEnd(joint, 0.3, 20 * kDeg, 900.0) - a1).norm() - 900.0) * 1e3, 46.973200, kDigits6);
}

// Where the machine really goes when the ideal model's lengths are commanded.
Pose Real(const Hexapod& real, const Hexapod& believed, const PlatformPose& wanted) {
  const HexapodForward answer =
      SolveForward(real, SolveInverse(believed, wanted).actuators_mm, wanted.X_MP());
  EXPECT_EQ(answer.reason, Reason::kSolved);
  return answer.X_MP;
}

TEST(PaperPoseError, IfTheImperfectionIsIgnored) {
  constexpr std::array<std::array<double, 9>, 5> kPrinted = {{
      {18.465685, 148.835470, 19.126383, -154.041349, -110.820824, 330.644617, 151.191260, 381.221986,
       136.674253},
      {29.332656, 153.754316, 22.280992, -192.219441, -135.286324, 398.696200, 158.105146, 448.152076,
       145.619469},
      {17.202403, 151.902110, 8.210843, -112.252158, -113.877869, 275.597281, 153.093408, 338.205856,
       128.189961},
      {42.517394, 171.469359, 27.350899, -92.755834, -173.227306, 390.885922, 178.766724, 464.971445,
       150.308096},
      {25.946449, 172.087508, -8.598899, -187.054256, -143.649588, 266.699119, 174.244856, 368.024029,
       155.652110},
  }};
  const Hexapod ideal(worked::Geometry());
  const Hexapod real(worked::NonIdealGeometry());
  for (std::size_t i = 0; i < kPoses.size(); ++i) {
    const Pose wanted = kPoses[i].X_MP();
    const Pose got = Real(real, ideal, kPoses[i]);
    const PlatformPose angles = PlatformPose::Of(got);
    const Eigen::Vector3d tip(0, 0, 200);
    const Eigen::Vector3d dC = got.p_mm - wanted.p_mm;
    const std::array<double, 9> measured = {
        dC.x() * 1e3,
        dC.y() * 1e3,
        dC.z() * 1e3,
        (angles.psi_rad - kPoses[i].psi_rad) * 1e6,
        (angles.theta_rad - kPoses[i].theta_rad) * 1e6,
        (angles.gamma_rad - kPoses[i].gamma_rad) * 1e6,
        dC.norm() * 1e3,
        std::sin(TurnBetween(wanted.R, got.R).norm()) * 1e6,  // printed: the sine of the angle
        (got * tip - wanted * tip).norm() * 1e3};
    for (std::size_t k = 0; k < measured.size(); ++k) {
      EXPECT_NEAR(measured[k], kPrinted[i][k], 1.1e-6) << "P" << i + 1 << " column " << k;
    }
  }
}

// The pose errors with only some of the imperfections left.
template <class Keep>
std::array<double, 5> ShiftsWith(const Keep& keep) {
  HexapodGeometry geometry = worked::NonIdealGeometry();
  for (UniversalJoint& joint : geometry.joints) {
    joint = keep(joint);
  }
  const Hexapod ideal(worked::Geometry());
  const Hexapod real(geometry);
  std::array<double, 5> shifts{};
  for (std::size_t i = 0; i < kPoses.size(); ++i) {
    shifts[i] = (Real(real, ideal, kPoses[i]).p_mm - kPoses[i].X_MP().p_mm).norm() * 1e3;
  }
  return shifts;
}

void ExpectShifts(const std::array<double, 5>& shifts, const std::array<double, 5>& printed) {
  for (std::size_t i = 0; i < shifts.size(); ++i) {
    EXPECT_NEAR(shifts[i], printed[i], 1.1e-6) << "P" << i + 1;
  }
}

TEST(PaperPoseError, ByParameter) {
  ExpectShifts(ShiftsWith([](const UniversalJoint& j) {
                 UniversalJoint kept;
                 kept.a1x_mm = j.a1x_mm;
                 kept.a1z_mm = j.a1z_mm;
                 return kept;
               }),
               {90.418385, 103.722261, 90.408746, 121.913478, 101.797246});
  ExpectShifts(ShiftsWith([](const UniversalJoint& j) {
                 UniversalJoint kept;
                 kept.ez_mm = j.ez_mm;
                 return kept;
               }),
               {121.198329, 130.936998, 114.849942, 119.814341, 132.261937});
  const std::array<double, 5> second_order = {0.001613, 0.001521, 0.001719, 0.001637, 0.001430};
  ExpectShifts(ShiftsWith([](const UniversalJoint& j) {
                 UniversalJoint kept;
                 kept.ex_mm = j.ex_mm;
                 return kept;
               }),
               second_order);
  ExpectShifts(ShiftsWith([](const UniversalJoint& j) {
                 UniversalJoint kept;
                 kept.h_mm = j.h_mm;
                 return kept;
               }),
               second_order);
  ExpectShifts(ShiftsWith([](const UniversalJoint& j) {
                 UniversalJoint kept;
                 kept.dx_rad = j.dx_rad;
                 kept.dz_rad = j.dz_rad;
                 kept.eps_rad = j.eps_rad;
                 kept.nu_rad = j.nu_rad;
                 return kept;
               }),
               {0, 0, 0, 0, 0});
}

TEST(PaperPoseError, OverRandomSignPatterns) {
  std::mt19937_64 random(300);
  std::bernoulli_distribution coin;
  const Hexapod ideal(worked::Geometry());
  std::vector<double> shifts;
  for (int n = 0; n < 3000; ++n) {
    HexapodGeometry geometry = worked::Geometry();
    for (UniversalJoint& joint : geometry.joints) {
      std::array<double, 9> sign{};
      for (double& s : sign) {
        s = coin(random) ? 1.0 : -1.0;
      }
      joint = worked::JointOf(sign);
    }
    shifts.push_back((Real(Hexapod(geometry), ideal, kPoses[1]).p_mm - kPoses[1].X_MP().p_mm).norm() * 1e3);
  }
  std::sort(shifts.begin(), shifts.end());
  double mean = 0.0;
  for (const double shift : shifts) {
    mean += shift / static_cast<double>(shifts.size());
  }
  // Printed from 300 patterns: mean 129, 95 % 228, max 331; their sampling error is about 3 and 8 um.
  std::printf("3000 sign patterns at P2: mean %.1f um, 95 %% %.1f um, max %.1f um\n", mean, shifts[2850],
              shifts[2999]);
  EXPECT_NEAR(mean, 129.0, 10.0);
  EXPECT_NEAR(shifts[2850], 228.0, 20.0);
  EXPECT_GT(shifts[2999], 300.0);
}

std::vector<PlatformPose> RefitPoses() {
  std::vector<PlatformPose> poses;
  const double t = 15 * kDeg;
  for (const double x : {-150.0, 0.0, 150.0})
    for (const double y : {-150.0, 0.0, 150.0})
      for (const double z : {750.0, 850.0, 950.0})
        for (const double psi : {-t, 0.0, t})
          for (const double theta : {-t, 0.0, t})
            for (const double gamma : {-t, 0.0, t}) poses.push_back({x, y, z, psi, theta, gamma});
  return poses;
}

// Gauss-Newton on A_j and l0_j of the ideal model against readings of the imperfect machine.
HexapodGeometry Refitted(const Hexapod& real, const std::vector<PlatformPose>& poses) {
  HexapodGeometry fitted = worked::Geometry();
  for (int round = 0; round < 6; ++round) {
    const Hexapod hexapod(fitted);
    std::array<Eigen::Matrix4d, 6> normal;
    std::array<Eigen::Vector4d, 6> right;
    normal.fill(Eigen::Matrix4d::Zero());
    right.fill(Eigen::Vector4d::Zero());
    for (const PlatformPose& pose : poses) {
      const StrutVector off =
          SolveInverse(real, pose).actuators_mm - SolveInverse(hexapod, pose).actuators_mm;
      const ParameterJacobian J = ActuatorParameterJacobian(hexapod, pose.X_MP());
      for (int j = 0; j < kStruts; ++j) {
        const Eigen::Vector4d row(J(j, 0), J(j, 1), J(j, 2),
                                  J(j, static_cast<int>(StrutParameter::kLengthZero)));
        normal[static_cast<std::size_t>(j)] += row * row.transpose();
        right[static_cast<std::size_t>(j)] += row * off[j];
      }
    }
    for (int j = 0; j < kStruts; ++j) {
      const Eigen::Vector4d step =
          normal[static_cast<std::size_t>(j)].fullPivLu().solve(right[static_cast<std::size_t>(j)]);
      fitted.p_MA_mm.col(j) += step.head<3>();
      fitted.length_zero_mm[j] += step[3];
    }
  }
  return fitted;
}

TEST(PaperRefit, OfTheIdealModelLeavesLessThanAMicrometre) {
  const Hexapod real(worked::NonIdealGeometry());
  const std::vector<PlatformPose> poses = RefitPoses();
  const Hexapod refitted(Refitted(real, poses));
  double largest = 0.0;
  double squares = 0.0;
  for (const PlatformPose& pose : poses) {
    const StrutVector off = SolveInverse(real, pose).actuators_mm - SolveInverse(refitted, pose).actuators_mm;
    largest = std::max(largest, off.cwiseAbs().maxCoeff());
    squares += off.squaredNorm();
  }
  const double rms = std::sqrt(squares / (6.0 * static_cast<double>(poses.size())));
  std::printf("refit of A_j, l0_j on %zu poses: largest %.4f um, rms %.4f um\n", poses.size(), largest * 1e3,
              rms * 1e3);
  EXPECT_NEAR(largest * 1e3, 1.4719, 1.1e-4);
  EXPECT_NEAR(rms * 1e3, 0.3692, 1.1e-4);
  constexpr std::array<double, 5> kShifts = {0.1775, 0.4095, 0.4333, 0.2556, 0.7555};
  for (std::size_t i = 0; i < kPoses.size(); ++i) {
    EXPECT_NEAR((Real(real, refitted, kPoses[i]).p_mm - kPoses[i].X_MP().p_mm).norm() * 1e3, kShifts[i],
                1.1e-4);
  }
}

}  // namespace
}  // namespace lambdajet::kinematics
