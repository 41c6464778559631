// Asks what kinematics.proto can be asked about a hexapod, with any bytes as the request: what the fuzz target and the
// mutation test have in common.
//
// A request that names no mechanism is asked about the worked hexapod, so that short inputs reach the cores too.
#pragma once

#include <string>

namespace lambdajet::fuzz {

inline constexpr int kHexapodQuestions = 8;

struct HexapodOutcome {
  bool understood = false;  // the bytes were a request
  bool answered = false;    // and its answer was no Status
};

// Aborts on a broken promise (fuzz_target.hpp). Questions: inverse, forward, inverse batch, forward batch, Jacobian,
// singularity, workspace, service area; each 0 <= question < kHexapodQuestions.
HexapodOutcome AskHexapod(int question, const std::string& bytes);

// A request of that kind that is answered.
std::string HexapodSeed(int question);

}  // namespace lambdajet::fuzz
