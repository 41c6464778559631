// Any bytes as a DXF drawing: told what is wrong by name and place, or closed contours and a path that keeps clear of them.
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "trajectory/core/toolpath/program_text.hpp"
#include "trajectory/drawing/dxf_file.hpp"

using lambdajet::fuzz::Promise;
using namespace lambdajet::trajectory;

namespace {

void CheckFindings(const std::vector<Finding>& findings) {
  for (const Finding& finding : findings) {
    Promise(!finding.reason.empty() && !finding.message.empty(),
            "a finding has a reason and says what is wrong");
    Promise(finding.at_mm.allFinite(), "and a place");
  }
}

}  // namespace

// libdime frees the name of SEQEND and ENDBLK with delete instead of delete[]: harmless, and not ours to mend.
extern "C" const char* __asan_default_options() { return "alloc_dealloc_mismatch=0"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view file(reinterpret_cast<const char*>(bytes), size);
  const Drawing drawing = ReadDxf(file);
  CheckFindings(drawing.findings);
  ContourOptions options;
  options.curve_tolerance_mm = 0.05;
  const ContourSet set = FindContours(drawing, options);
  CheckFindings(set.findings);
  for (const Contour& contour : set.contours) {
    Promise(contour.pieces.size() > 1 && SignedArea_mm2(contour.pieces) > 0.0,
            "a contour runs counter-clockwise");
    for (std::size_t i = 0; i < contour.pieces.size(); ++i) {
      const Piece& next = contour.pieces[(i + 1) % contour.pieces.size()];
      Promise((contour.pieces[i].to_mm - next.from_mm).norm() < 1e-6, "a contour is closed");
    }
  }
  if (set.blocked()) {
    return 0;
  }
  const ToolpathOptions cut;
  const Toolpath toolpath = MakeToolpath(drawing, set, cut);
  CheckFindings(toolpath.findings);
  if (!toolpath.blocked()) {
    Promise(!ProgramText(set, toolpath, cut, "fuzz").empty(), "a toolpath is written");
  }
  return 0;
}
