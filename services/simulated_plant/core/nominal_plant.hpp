// Makes true machines: the one that is exactly its description, and random ones around it.
//
// Model: every parameter of the description is drawn from a normal distribution with the description's own one-sigma
// figure (what the machine's maker admits); what no parameter describes (straightness, backlash, encoder, servo, creep,
// jet stack, valves, camera, marks) is drawn around typical sizes, see deploy/plants/README.md for each distribution.
// Units: as in plant_truth.hpp. Threads: pure functions. Errors: none; a drawn plant always passes Validate().
#pragma once

#include <cstdint>

#include "foundation/machine/machine_description.hpp"
#include "simulated_plant/core/plant_truth.hpp"

namespace lambdajet::simulated_plant {

// Nothing differs from the description; servo, levers and delays are those of a good machine. No noise.
PlantTruth NominalPlant(const MachineDescription& machine);

PlantTruth RandomPlant(const MachineDescription& machine, std::uint64_t seed);

}  // namespace lambdajet::simulated_plant
