// Any bytes as a G-code program, for a machine of two axes and one of six: refused with reason, line and column, or a list of
// finite operations that ends.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "trajectory/core/part_program/gcode_reader.hpp"

using lambdajet::fuzz::Promise;
using lambdajet::trajectory::GcodeOptions;
using lambdajet::trajectory::Operation;
using lambdajet::trajectory::OperationKind;
using lambdajet::trajectory::PartProgram;

namespace {

void Check(const Operation& o, std::uint32_t lines, bool planar) {
  for (const double v :
       {o.x_W_mm, o.y_W_mm, o.z_W_mm, o.a_rad, o.b_rad, o.c_rad, o.center_x_W_mm, o.center_y_W_mm,
        o.center_z_W_mm, o.sweep_rad, o.feed_mm_per_s, o.kerf_offset_mm, o.value}) {
    Promise(std::isfinite(v), "every number is finite");
  }
  Promise(o.line >= 1 && o.line <= lines, "an operation names its line");
  Promise(o.feed_mm_per_s >= 0.0, "no feed is negative");
  Promise(!planar || (o.z_W_mm == 0.0 && o.a_rad == 0.0 && o.b_rad == 0.0 && o.c_rad == 0.0),
          "axes that the machine does not have stay where they are");
  const bool cuts = o.kind == OperationKind::kFeedLine || o.kind == OperationKind::kFeedArc;
  Promise(!cuts || o.feed_mm_per_s > 0.0 || o.value >= 0.0, "what is cut has a feed or a duration");
}

void Check(const PartProgram& program, std::uint32_t lines, bool planar) {
  if (!program.faults.empty()) {
    for (const auto& fault : program.faults) {
      Promise(!fault.reason.empty() && !fault.message.empty(), "a fault has a reason and a message");
      Promise(fault.line <= lines && fault.column <= 1001, "a fault stands in the program");
    }
    return;
  }
  Promise(!program.operations.empty() && program.operations.back().kind == OperationKind::kEnd,
          "what is read ends");
  for (const Operation& o : program.operations) {
    Check(o, lines, planar);
    Promise(!FormatOperation(o).empty(), "an operation can be listed");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  const auto lines = static_cast<std::uint32_t>(std::count(text.begin(), text.end(), '\n') + 1);
  GcodeOptions options;
  options.kerf_width_mm = 0.8;
  options.fault_limit = 20;
  options.operation_limit = 4000;
  options.line_limit = 4000;
  options.jump_limit = 1000;
  Check(ReadGcode(text, options), lines, true);
  options.axes = lambdajet::trajectory::kSixAxes;
  Check(ReadGcode(text, options), lines, false);
  return 0;
}
