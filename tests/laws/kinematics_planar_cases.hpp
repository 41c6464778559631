// Lists the planar mechanisms and working areas that the laws of the kinematics core are tried on.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "kinematics/core/lambda_mechanism.hpp"

namespace lambdajet::kinematics {

struct PlanarCase {
  std::string name;
  MechanismParameters parameters;
  std::vector<WorkingMode> modes;
  double x_min_mm, x_max_mm, y_min_mm,
      y_max_mm;  // inside the workspace for every mode, away from singular lines
};

inline MechanismParameters WithRails(MechanismParameters p, double angle_1, double offset_1, double angle_2,
                                     double offset_2, double zero_1, double zero_2) {
  p.tail<6>() << angle_1, offset_1, angle_2, offset_2, zero_1, zero_2;
  return p;
}

inline const std::vector<WorkingMode> kAllModes = {{1, 1}, {1, -1}, {-1, 1}, {-1, -1}};

inline std::vector<PlanarCase> PlanarCases() {
  return {
      {"lambda, second link longer than attachment", IdealLambda(1200, 600, 700), kAllModes, -900, 900, 60,
       1190},
      {"lambda, second link shorter than attachment", IdealLambda(1200, 600, 500), kAllModes, -900, 900, 60,
       990},
      {"lambda, equal", IdealLambda(1200, 600, 600), {{1, 1}, {-1, -1}}, -900, 900, 60, 1190},
      {"lambda with imperfect rails",
       WithRails(IdealLambda(1200.7, 599.4, 701.3), 1.5e-3, 0.31, -0.9e-3, -0.42, 12.5, -7.25), kAllModes,
       -900, 900, 160, 1180},  // rails that cross tilt the type 2 line: in the mixed modes it climbs to 80 mm
      {"lambda below its rail", WithRails(IdealLambda(1200, 600, 700), 0.0, 0.0, 0.0, 0.0, 100.0, 200.0),
       kAllModes, -900, 900, -1190, -60},
      {"biglide, equal links", IdealLambda(1200, 1200, 1200), {{1, 1}, {-1, -1}}, -900, 900, 60, 1190},
      {"biglide, unequal links", IdealLambda(1200, 1200, 1000), kAllModes, -900, 900, 60, 990},
      {"two-rail biglide, sliders on the same side",
       TwoRailBiglide(1200, 1200, 1500),
       {{1, -1}, {-1, 1}},
       -900,
       900,
       310,
       1190},
      {"two-rail biglide, sliders opposite, below the middle",
       TwoRailBiglide(1200, 1200, 1500),
       {{1, 1}, {-1, -1}},
       -900,
       900,
       310,
       730},
      {"two rails at an angle",
       WithRails(IdealLambda(1200, 1150, 1250), 0.05, 10, -0.08, 1500, 3, 4),
       {{1, -1}, {-1, 1}},
       -400,
       400,
       400,
       1100},
  };
}

// The assembly mode a case's area lies on, read off its middle.
inline int AssemblyModeOf(const PlanarCase& c, WorkingMode mode) {
  const auto m = LambdaMechanism::FromParameters(c.parameters, mode, 1);
  return SolveInverse(m, {0.5 * (c.x_min_mm + c.x_max_mm), 0.5 * (c.y_min_mm + c.y_max_mm)}).assembly_mode;
}

inline Eigen::Vector2d RandomPose(const PlanarCase& c, std::mt19937_64& random) {
  return {std::uniform_real_distribution(c.x_min_mm, c.x_max_mm)(random),
          std::uniform_real_distribution(c.y_min_mm, c.y_max_mm)(random)};
}

}  // namespace lambdajet::kinematics
