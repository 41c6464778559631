// Finds where the lambda mechanism truly holds the tool, over rails that are not straight.
//
// Model: two slider points S1, S2 on their rails (turned, shifted, wavy); the joint P of the second link lies at the
// attach length from S1 and at the second link's length from S2; the tool lies on the line S1 P at the main link's length.
// On purpose not the kinematics house's code: a simulated machine that shared the controller's formulas would share its
// mistakes. Frames: D. Units: mm, rad. Threads: values. Cost: about 100 ns.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "simulated_plant/core/plant_truth.hpp"

namespace lambdajet::simulated_plant {

// reading_mm: what the encoders would say, without step and sub-division error. Nothing where the links do not meet.
std::optional<Eigen::Vector2d> TruePoint(const PlantTruth& truth,
                                         const std::array<double, kActuatorCount>& reading_mm);

double ValueOf(const Wave& wave, double x_mm);

}  // namespace lambdajet::simulated_plant
