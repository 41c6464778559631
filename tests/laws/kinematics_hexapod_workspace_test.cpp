// Laws of the hexapod's workspace: slices against an independent fine grid, borders against single answers, symmetry.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "kinematics/core/hexapod_workspace.hpp"
#include "kinematics/core/service_rectangle.hpp"
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

TEST(HexapodSlice, RectangleIsServedThroughoutCannotGrowAndNamesItsBounds) {
  HexapodGeometry geometry = worked::Geometry();
  geometry.limits.strut_min_mm = 700;
  geometry.limits.strut_max_mm = 1150;
  geometry.limits.base_cone_rad = 0.6;
  const Hexapod hexapod(geometry);
  HexapodWorkspaceRequest request;
  request.box = {-700, 700, -700, 700, 850, 850};
  request.step_mm = 10.0;
  const HexapodSlice slice = CutSlice(hexapod, request, 850.0);
  const HexapodRectangle found = LargestRectangle(hexapod, request, slice);
  const Rectangle& r = found.rectangle;
  std::printf(
      "largest rectangle of the slice: %.1f to %.1f by %.1f to %.1f mm, %.0f of %.0f mm2; bound by %s, %s, "
      "%s, %s\n",
      r.x_min_mm, r.x_max_mm, r.y_min_mm, r.y_max_mm, r.area_mm2(), slice.area_mm2,
      std::string(BoundName(found.binding[0].bound)).c_str(),
      std::string(BoundName(found.binding[1].bound)).c_str(),
      std::string(BoundName(found.binding[2].bound)).c_str(),
      std::string(BoundName(found.binding[3].bound)).c_str());
  ASSERT_GT(r.area_mm2(), 0.3 * slice.area_mm2);
  const auto served = [&](double x, double y) {
    return SolveInAllOrientations(hexapod, request, {x, y, 850.0}).reason == Reason::kSolved;
  };
  for (int i = 0; i <= 100; ++i) {
    for (int j = 0; j <= 100; ++j) {
      ASSERT_TRUE(served(r.x_min_mm + 0.05 + (r.x_max_mm - r.x_min_mm - 0.1) * i / 100.0,
                         r.y_min_mm + (r.y_max_mm - r.y_min_mm) * j / 100.0));
    }
  }
  const auto side_leaves = [&](bool upright, double at) {
    bool leaves = false;
    for (int i = 0; i <= 2000; ++i) {
      const double share = i / 2000.0;
      leaves = leaves || !(upright ? served(at, r.y_min_mm + (r.y_max_mm - r.y_min_mm) * share)
                                   : served(r.x_min_mm + (r.x_max_mm - r.x_min_mm) * share, at));
    }
    return leaves;
  };
  EXPECT_TRUE(side_leaves(true, r.x_min_mm - 0.2));
  EXPECT_TRUE(side_leaves(true, r.x_max_mm + 0.2));
  EXPECT_TRUE(side_leaves(false, r.y_min_mm - request.step_mm));
  EXPECT_TRUE(side_leaves(false, r.y_max_mm + request.step_mm));
  for (const HexapodBorder& border : found.binding) {
    EXPECT_NE(border.bound, HexapodBound::kNone);
  }
}

std::vector<ServiceAreaMachine> ServiceMachines() {
  std::vector<ServiceAreaMachine> machines;
  for (int figure = 0; figure < kServiceSweeps; ++figure) {
    const ServiceSweep sweep = PaperSweep(figure);
    machines.push_back(AtSweepValue(sweep, sweep.from));
    machines.push_back(AtSweepValue(sweep, sweep.to));
  }
  machines.push_back(machines[2]);
  machines.back().frame_bottom_ratio = machines.back().frame_top_ratio;  // upright walls
  machines.push_back(machines[2]);
  machines.back().frame_bottom_ratio = 0.5;  // walls that lean in
  return machines;
}

TEST(ServiceRectangle, IsServedFromBothSidesThroughoutAndCannotGrow) {
  for (const ServiceAreaMachine& machine : ServiceMachines()) {
    const ServiceRectangle found = LargestServiceRectangle(machine);
    const Rectangle& r = found.rectangle;
    ASSERT_GT(r.area_mm2(), 0.0);
    EXPECT_LT(r.area_mm2(), ExactArea(machine, ServiceRegion::kIntersection));
    const auto inside = [&](double x, double y) {
      return InRegion(machine, ServiceRegion::kIntersection, x, y);
    };
    const double e = 1e-4;
    const auto at = [](double from, double to, int i) { return from + (to - from) * i / 2000.0; };
    bool all[4] = {true, true, true, true};
    for (int i = 0; i <= 2000; ++i) {
      const double x = at(r.x_min_mm + e, r.x_max_mm - e, i), y = at(r.y_min_mm + e, r.y_max_mm - e, i);
      ASSERT_TRUE(inside(x, r.y_min_mm + e) && inside(x, r.y_max_mm - e)) << x;
      ASSERT_TRUE(inside(r.x_min_mm + e, y) && inside(r.x_max_mm - e, y)) << y;
      all[0] = all[0] && inside(r.x_min_mm - 0.05, y);
      all[1] = all[1] && inside(r.x_max_mm + 0.05, y);
      all[2] = all[2] && inside(x, r.y_min_mm - 0.05);
      all[3] = all[3] && inside(x, r.y_max_mm + 0.05);
    }
    for (std::size_t side = 0; side < 4; ++side) {
      EXPECT_FALSE(all[side]) << side;
      EXPECT_NE(found.binding[side].limit, ServiceLimit::kNone);
    }
  }
}

// Every pair of columns of an independent raster, the height between them read off the raster's own spans.
TEST(ServiceRectangle, IsTheLargest) {
  for (const ServiceAreaMachine& machine : ServiceMachines()) {
    std::vector<std::array<double, 3>> columns;  // x, from y, to y
    for (double x = -400.0; x < 1800.0; x += 2.0) {
      const ServiceSpans spans = RegionAt(machine, ServiceRegion::kIntersection, x);
      columns.push_back(
          {x, spans.count > 0 ? spans.from_y_mm[0] : 0.0, spans.count > 0 ? spans.to_y_mm[0] : 0.0});
    }
    double best = 0.0;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      double from = columns[i][1], to = columns[i][2];
      for (std::size_t j = i; j < columns.size() && to > from; ++j) {
        from = std::max(from, columns[j][1]);
        to = std::min(to, columns[j][2]);
        best = std::max(best, (to - from) * (columns[j][0] - columns[i][0]));
      }
    }
    const double area = LargestServiceRectangle(machine).rectangle.area_mm2();
    EXPECT_GE(area, (1.0 - 1e-5) * best);
    EXPECT_LE(area, 1.05 * best);
  }
}

TEST(ServiceRectangle, OfThePapersBaseSetNamesItsBounds) {
  ServiceAreaMachine machine = PaperSweep(1).base;
  machine.platform_joint_spacing_mm = 500.0;
  const ServiceRectangle found = LargestServiceRectangle(machine);
  const Rectangle& r = found.rectangle;
  std::printf("largest rectangle served from both sides: %.2f by %.2f mm, %.0f of %.0f mm2\n",
              r.x_max_mm - r.x_min_mm, r.y_max_mm - r.y_min_mm, r.area_mm2(),
              ExactArea(machine, ServiceRegion::kIntersection));
  EXPECT_NEAR(r.x_min_mm + r.x_max_mm, machine.base_joint_spacing_mm, 1e-3);  // its own mirror image
  EXPECT_EQ(found.binding[2].limit, ServiceLimit::kStrutShortest);
  EXPECT_GT(found.binding[2].joint, 0);
}

}  // namespace
}  // namespace lambdajet::kinematics
