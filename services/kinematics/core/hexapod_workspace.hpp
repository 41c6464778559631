// Finds where a hexapod may stand: slices at a height and voxels, with strut, joint and singular limits.
//
// Model: a point belongs to the workspace if SolveInverseWithMargin serves it in every one of the asked orientations.
// A slice is cut into rows along x; along a row the border is found by sampling at `step_mm` and then halving to
// `tolerance_mm`, so a gap narrower than the step can be missed; the area is the trapezoid sum over the rows.
// Frames: points are where the tool's origin stands, in M; orientations are the tool's. Units: mm, rad.
// Threads: any. Cost: (width / step) * rows * orientations inverses, about 6 us each with a singular margin and 0.1 us
// without. Errors: FaultOf names a request that is not one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "kinematics/core/hexapod.hpp"
#include "kinematics/core/hexapod_singularity.hpp"
#include "kinematics/core/rectangle.hpp"

namespace lambdajet::kinematics {

struct HexapodBox {
  double x_min_mm = 0.0, x_max_mm = 0.0;
  double y_min_mm = 0.0, y_max_mm = 0.0;
  double z_min_mm = 0.0, z_max_mm = 0.0;
};

struct HexapodWorkspaceRequest {
  HexapodBox box;
  double step_mm = 10.0;
  double tolerance_mm = 0.05;
  std::vector<Eigen::Matrix3d> R_MT = {Eigen::Matrix3d::Identity()};
  std::function<bool()> cancelled;  // asked once a row; the answer then ends there
};
inline constexpr double kMostWorkspaceSamples = 5e7;
std::string_view FaultOf(const HexapodWorkspaceRequest& request);

// What binds at one end of a span; kNone where the box ends.
struct HexapodBorder {
  HexapodBound bound = HexapodBound::kNone;
  int strut = -1;
};

struct HexapodSpan {
  double y_mm = 0.0;
  double from_x_mm = 0.0, to_x_mm = 0.0;
  HexapodBorder from, to;
};

struct HexapodSlice {
  double z_mm = 0.0;
  std::vector<HexapodSpan> spans;  // by rising y, then x
  double area_mm2 = 0.0;
};
HexapodSlice CutSlice(const Hexapod& hexapod, const HexapodWorkspaceRequest& request, double z_mm);

// The largest rectangle with sides along x and y inside a slice, with what binds each side. Lower and upper side lie on rows of
// the slice, so it is the largest to one step; between two rows it is as true as the spans are.
struct HexapodRectangle {
  Rectangle rectangle;                     // empty where nothing is served
  std::array<HexapodBorder, 4> binding{};  // left, right, lower y, upper y; kNone where the box ends
};
HexapodRectangle LargestRectangle(const Hexapod& hexapod, const HexapodWorkspaceRequest& request,
                                  const HexapodSlice& slice);

// The whole box by its voxels' centres.
struct HexapodVoxels {
  int count_x = 0, count_y = 0, count_z = 0;
  double step_mm = 0.0;
  std::vector<std::uint8_t> reason;  // of kinematics::Reason, x fastest, then y, then z
  double volume_mm3 = 0.0;           // of the voxels that are served
  Reason at(int ix, int iy, int iz) const {
    return static_cast<Reason>(reason[static_cast<std::size_t>((iz * count_y + iy) * count_x + ix)]);
  }
};
HexapodVoxels FillVoxels(const Hexapod& hexapod, const HexapodWorkspaceRequest& request);

// The first orientation's refusal, or kSolved.
HexapodInverse SolveInAllOrientations(const Hexapod& hexapod, const HexapodWorkspaceRequest& request,
                                      const Eigen::Vector3d& p_MT_mm);

}  // namespace lambdajet::kinematics
