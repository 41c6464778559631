// Says how far the jet leaves the axis of its head when nozzle, mixing chamber and focusing tube are each a
// little askew.
//
// Model: seed paper 000, (44)-(55) with signs corrected (foundation/geometry/homogeneous_chain.hpp carries
// the small errors); the paper gives tilts of 0.064 and 0.038 degrees but no lengths, offsets or
// distributions. Taken here: fixed magnitudes and free azimuths, deviation = |a + b e^{i t1} + e e^{i t2}|, a
// = psi1 r1, b = psi2 r2, e the stack's radial offset, r1 from the nozzle's joint to the tube's exit, r2 the
// tube's length. The cut's edge adds the tube's bore radius, triangular. Units: mm, rad. Threads: pure. Cost:
// the mean is a sum over 256 x 256 azimuths; a draw some 100 ns.
#pragma once

#include <cstdint>

namespace lambdajet::accuracy {

struct JetStack {
  double nozzle_tilt_rad = 0.0;    // psi1
  double tube_tilt_rad = 0.0;      // psi2
  double nozzle_to_exit_mm = 0.0;  // r1
  double tube_length_mm = 0.0;     // r2
  double radial_offset_mm = 0.0;   // e
};

// The paper's tilts with the lengths and the offset that give its range of 0.04 to 0.29 mm.
inline JetStack TypicalJetStack() { return {1.1170107e-3, 6.632251e-4, 147.7, 76.2, 0.0744}; }

// Radius of the focusing tube's bore, new to worn.
struct BoreRadius {
  double min_mm = 0.0;
  double mode_mm = 0.0;
  double max_mm = 0.0;
};

struct Spread {
  double mean_mm = 0.0;
  double rms_mm = 0.0;
  double min_mm = 0.0;
  double max_mm = 0.0;
};

// Deviation of the jet's axis at the tube's exit.
Spread AxisDeviation(const JetStack& stack);

// Deviation of the jet's edge, sampled; the same seed and count give the same numbers.
Spread EdgeDeviation(const JetStack& stack, const BoreRadius& bore, std::uint64_t seed, int draws);

}  // namespace lambdajet::accuracy
