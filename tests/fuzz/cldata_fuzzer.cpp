// Any bytes as CLDATA: refused with line and reason, or operations that write and read back the same, with finite numbers.
#include <cmath>
#include <string>

#include "tests/fuzz/fuzz_target.hpp"
#include "trajectory/core/part_program/cldata_reader.hpp"
#include "trajectory/core/part_program/cldata_verification.hpp"
#include "trajectory/core/part_program/cldata_writer.hpp"

using namespace lambdajet::trajectory;
using lambdajet::fuzz::Promise;

namespace {

bool Finite(const Operation& o) {
  return std::isfinite(o.x_W_mm + o.y_W_mm + o.z_W_mm + o.a_rad + o.b_rad + o.c_rad + o.center_x_W_mm +
                       o.center_y_W_mm + o.center_z_W_mm + o.sweep_rad + o.feed_mm_per_s + o.kerf_offset_mm +
                       o.value);
}

void Read(std::string_view text, std::uint8_t axes) {
  CldataOptions options{.axes = axes};
  options.operation_limit = 20000;
  const PartProgram program = ReadCldata(text, options);
  for (const ProgramFault& fault : program.faults) {
    Promise(!fault.reason.empty() && !fault.message.empty(), "a refusal has a reason and a message");
    Promise(fault.line <= program.line_count + 1, "and a line of the program");
  }
  if (!program.faults.empty()) {
    return;
  }
  for (const Operation& o : program.operations) {
    Promise(Finite(o), "operations are finite");
  }
  const CldataText once = WriteCldata(program.operations, "part");
  Promise(once.faults.empty(), "what was read can be written");
  const PartProgram again = ReadCldata(once.text, options);
  Promise(again.faults.empty(), "and read");
  Promise(WriteCldata(again.operations, "part").text == once.text, "and is the same text then");
  const ProgramVerification verification = VerifyProgram(program.operations);
  Promise(verification.lines.size() == verification.arguments.size(), "every point has a line");
  VerifyProgram(program.operations, VerifyArgument::kTurn);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  LooksLikeCldata(text);
  Read(text, kPlanarAxes);
  Read(text, kSixAxes);
  return 0;
}
