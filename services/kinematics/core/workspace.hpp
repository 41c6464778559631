// Finds where a lambda's or a biglide's tool may be: the region inside every link's reach, every travel and the singular
// margin, as polygons, and the largest rectangle in it with what binds each side.
//
// Model: a pose is usable where the smallest of seven signed margins is not negative (UsableMargin): both type 1 lines and the
// type 2 line, each less the singular margin, and both ends of both travels. The boundary is the zero line of that smallest
// margin, traced on a grid, every crossing found by bisection, corners (two margins zero at once) by Newton, and every edge
// split until its middle lies within the tolerance. Features narrower than the grid are not seen.
// Frames: D. Units: mm, mm^2. Validity: the mechanism needs travel limits on both sliders, else the region has no end.
// Threads: pure. Cost: about 0.1 us a grid point and 0.1 us a refinement; some 50 ms for a machine of the paper's size.
// Errors: answers: kBadGeometry, kActuatorLimit (no travel limits), kOutOfReach (nothing is usable).
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string_view>
#include <vector>

#include "kinematics/core/lambda_mechanism.hpp"
#include "kinematics/core/rectangle.hpp"

namespace lambdajet::kinematics {

enum class PoseLimit {
  kMainLink,
  kSecondLink,
  kParallel,
  kSlider1Lower,
  kSlider1Upper,
  kSlider2Lower,
  kSlider2Upper
};
inline constexpr std::size_t kPoseLimits = 7;
std::string_view PoseLimitSentence(PoseLimit limit);  // for people
Reason PoseLimitReason(PoseLimit limit);

struct UsableMargin {
  double margin_mm = 0.0;  // of the tightest limit; negative: not usable
  PoseLimit tightest = PoseLimit::kMainLink;
};
UsableMargin FindUsableMargin(const LambdaMechanism& mechanism, const Eigen::Vector2d& p_DE_mm);

using Outline = std::vector<Eigen::Vector2d>;  // closed; the usable side lies to the left of every edge

struct WorkspaceOptions {
  double tolerance_mm = 0.1;  // of the polygons
  double grid_mm = 10.0;
  std::function<bool()> cancelled;  // asked between rows; empty: never
};

struct Workspace {
  Reason reason = Reason::kBadGeometry;
  std::vector<Outline> outlines;  // outer ones counter-clockwise, holes clockwise
  double area_mm2 = 0.0;
  Rectangle rectangle;                 // largest with sides along D's axes
  std::array<PoseLimit, 4> binding{};  // of its left, right, bottom and top side
};

Workspace ComputeWorkspace(const LambdaMechanism& mechanism, const WorkspaceOptions& options = {});

}  // namespace lambdajet::kinematics
