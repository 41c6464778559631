// Laws of the hexapod's workspace: slices against an independent fine grid, borders against single answers, symmetry.
#include <gtest/gtest.h>

#include <cmath>

#include "kinematics/core/hexapod_workspace.hpp"
#include "tests/papers/kinematics_hexapod_cases.hpp"

namespace lambdajet::kinematics {
namespace {

using worked::kDeg;

Hexapod Limited() {
  HexapodGeometry geometry = worked::Geometry();
  geometry.limits.strut_min_mm = 750;
  geometry.limits.strut_max_mm = 1050;
  geometry.limits.base_cone_rad = 25 * kDeg;
  geometry.limits.platform_cone_rad = 35 * kDeg;
  geometry.limits.singular_margin = 0.2;
  geometry.X_PT.p_mm = {0, 0, -100};
  return Hexapod(geometry);
}

HexapodWorkspaceRequest Request(double step_mm) {
  HexapodWorkspaceRequest request;
  request.box = {-500, 500, -500, 500, 500, 950};
  request.step_mm = step_mm;
  request.tolerance_mm = 0.02;
  return request;
}

TEST(HexapodSlice, AreaMatchesAnIndependentFineGrid) {
  const Hexapod hexapod = Limited();
  HexapodWorkspaceRequest request = Request(4.0);
  for (const double tilt_deg : {0.0, 15.0}) {
    request.R_MT = {RotationX(tilt_deg * kDeg)};
    const HexapodSlice slice = CutSlice(hexapod, request, 700.0);
    ASSERT_FALSE(slice.spans.empty());
    long served = 0;
    const double cell = 1.0;
    for (double x = -500 + cell / 2; x < 500; x += cell) {
      for (double y = -500 + cell / 2; y < 500; y += cell) {
        // Struts and cones stated again, from the geometry alone; the singular margin does not bind here.
        const Eigen::Vector3d C = Eigen::Vector3d(x, y, 700) - request.R_MT[0] * Eigen::Vector3d(0, 0, -100);
        bool inside = true;
        for (int j = 0; j < kStruts && inside; ++j) {
          const HexapodGeometry& g = hexapod.geometry();
          const Eigen::Vector3d s = C + request.R_MT[0] * g.p_PB_mm.col(j) - g.p_MA_mm.col(j);
          const Eigen::Vector3d home = g.X_MP_home * Eigen::Vector3d(g.p_PB_mm.col(j)) - g.p_MA_mm.col(j);
          const double base = std::acos(s.normalized().dot(home.normalized()));
          const double platform =
              std::acos((request.R_MT[0].transpose() * s).normalized().dot(home.normalized()));
          inside = s.norm() >= 750 && s.norm() <= 1050 && base <= 25 * kDeg && platform <= 35 * kDeg;
        }
        served += inside ? 1 : 0;
      }
    }
    const double grid = static_cast<double>(served) * cell * cell;
    std::printf("slice at z 700 tilted %.0f deg: %.0f mm^2, grid %.0f mm^2\n", tilt_deg, slice.area_mm2,
                grid);
    EXPECT_NEAR(slice.area_mm2 / grid, 1.0, 1e-3);
  }
}

TEST(HexapodSlice, BordersLieWithinToleranceAndNameWhatBinds) {
  const Hexapod hexapod = Limited();
  const HexapodWorkspaceRequest request = Request(10.0);
  const HexapodSlice slice = CutSlice(hexapod, request, 700.0);
  int borders = 0;
  for (const HexapodSpan& span : slice.spans) {
    const auto served = [&](double x) {
      return SolveInAllOrientations(hexapod, request, {x, span.y_mm, 700.0}).reason == Reason::kSolved;
    };
    if (span.to.bound == HexapodBound::kNone || span.to_x_mm - span.from_x_mm < 0.5) {
      continue;
    }
    ++borders;
    EXPECT_TRUE(served(span.to_x_mm - 0.05));
    EXPECT_FALSE(served(span.to_x_mm + 0.05));
    EXPECT_GE(span.to.strut, 0);
  }
  EXPECT_GT(borders, 20);
}

TEST(HexapodVoxels, AreSymmetricLikeTheMachineAndShrinkWithOrientations) {
  // The worked machine is its own mirror image in the xz plane.
  const Hexapod hexapod = Limited();
  HexapodWorkspaceRequest request = Request(50.0);
  const HexapodVoxels upright = FillVoxels(hexapod, request);
  ASSERT_GT(upright.volume_mm3, 0.0);
  for (int iz = 0; iz < upright.count_z; ++iz) {
    for (int iy = 0; iy < upright.count_y; ++iy) {
      for (int ix = 0; ix < upright.count_x; ++ix) {
        ASSERT_EQ(upright.at(ix, iy, iz) == Reason::kSolved,
                  upright.at(ix, upright.count_y - 1 - iy, iz) == Reason::kSolved);
      }
    }
  }
  request.R_MT = {RotationX(0), RotationX(15 * kDeg), RotationX(-15 * kDeg)};
  const HexapodVoxels tilted = FillVoxels(hexapod, request);
  EXPECT_GT(tilted.volume_mm3, 0.0);
  EXPECT_LT(tilted.volume_mm3, upright.volume_mm3);
  for (std::size_t i = 0; i < tilted.reason.size(); ++i) {
    if (tilted.reason[i] == static_cast<std::uint8_t>(Reason::kSolved)) {
      ASSERT_EQ(upright.reason[i], static_cast<std::uint8_t>(Reason::kSolved));
    }
  }
}

TEST(HexapodWorkspaceRequest, NamesItsFaults) {
  EXPECT_EQ(FaultOf(Request(10.0)), "");
  EXPECT_NE(FaultOf(Request(0.0)), "");
  EXPECT_NE(FaultOf(Request(0.01)), "");
  HexapodWorkspaceRequest request = Request(10.0);
  request.R_MT.clear();
  EXPECT_NE(FaultOf(request), "");
  request = Request(10.0);
  request.box.x_max_mm = -600;
  EXPECT_NE(FaultOf(request), "");
}

}  // namespace
}  // namespace lambdajet::kinematics
