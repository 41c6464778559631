// Says why the mechanism cannot hold the jet at a place on the sheet, as a fault of the program's line.
//
// Frames: W. Units: mm. Threads: pure. Cost: one inverse solution.
#pragma once

#include <Eigen/Core>
#include <cstdio>

#include "trajectory/core/feed/sheet_motion.hpp"
#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

inline ProgramFault ReachFault(const SheetMotion& sheet, const Eigen::Vector2d& p_W_mm, std::uint32_t line) {
  const kinematics::InverseAnswer answer = sheet.Position(p_W_mm);
  char text[200];
  std::snprintf(text, sizeof text,
                "the machine cannot hold the jet at X%.3f Y%.3f mm of the sheet: beyond its limit by %.3f "
                "mm; move the part",
                p_W_mm.x(), p_W_mm.y(), answer.excess_mm);
  return {line, 0, kinematics::ReasonName(answer.reason), "", text};
}

}  // namespace lambdajet::trajectory
