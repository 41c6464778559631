// Any bytes as a hexapod's file: refused with named violations, or a sound hexapod that stands at home and whose text reads
// back as the same hexapod.
#include <string>

#include "foundation/contract/trouble.hpp"
#include "kinematics/core/hexapod.hpp"
#include "platform/machine_file/hexapod_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"

using lambdajet::fuzz::Promise;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(bytes), size);
  const auto machine = lambdajet::ParseHexapod(text, "fuzz");
  if (!machine.ok()) {
    Promise(!lambdajet::TroubleReason(machine.status()).empty(), "a refusal has a reason");
    return 0;
  }
  const lambdajet::HexapodGeometry& geometry = machine->geometry;
  Promise(lambdajet::FaultOf(geometry).empty(), "what has been read is sound");
  const auto home = SolveInverse(lambdajet::kinematics::Hexapod(geometry), geometry.X_MP_home);
  Promise(home.lengths_mm.allFinite(), "the struts at home have finite lengths");
  const auto again = lambdajet::ParseHexapod(lambdajet::HexapodText(*machine), "canonical");
  Promise(again.ok(), "canonical text reads back");
  Promise(again->machine_id == machine->machine_id && again->geometry.p_MA_mm == geometry.p_MA_mm &&
              again->geometry.p_PB_mm == geometry.p_PB_mm && again->geometry.joints == geometry.joints,
          "and is the same hexapod");
  // The angles of a pose are found again from its rotation, at worst near pitch 90 degrees, where they lose half the digits.
  Promise((again->geometry.X_MP_home.R - geometry.X_MP_home.R).norm() < 1e-6,
          "that stands at home as before");
  return 0;
}
