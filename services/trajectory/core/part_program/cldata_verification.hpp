// Verifies a part program as written: every coordinate and its first two derivatives over the argument, and where one of
// them breaks.
//
// Model: seed paper 003, fig. 4. Two arguments:
//   path length s (planar and spatial contours): lines and arcs are exact, so derivatives by s are too; a break in the first
//   is a corner (mm/mm), in the second a step of curvature (1/mm). A traverse begins a new piece: its shape is not the
//   program's.
//   C, the turn of the workpiece (four-axis grinding): GOTO points are samples of X, Z and A over C. At every point the
//   derivatives are taken twice, from the four points that end and the four that begin there; where both disagree by far
//   more than they do in the neighbourhood, something breaks: the value, or what a least-squares fit of a kink, a step of the
//   second and one of the third derivative makes of the gaps; a step of the third alone is none of the paper's business.
//   Two breaks less than seven points apart are told as one, breaks below a thousandth of the coordinate's
//   peak are not told, and pieces of less than 13 points are not judged.
// Units: mm and rad; derivatives by mm or by rad. Threads: pure. Cost: about 1 us a point. Errors: a program that has
// nothing to verify gives no series.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

enum class VerifyArgument : std::uint8_t { kByContent, kPathLength, kTurn };

struct ProgramBreak {
  std::uint32_t line = 0;
  std::size_t coordinate = 0;  // index into coordinates
  int order = 0;               // 0: value, 1 and 2: derivatives
  double argument = 0.0;
  double size = 0.0;  // in the unit of that coordinate and derivative
};

// One coordinate over the argument.
struct CoordinateSeries {
  std::string name;  // with unit
  std::vector<double> values;
  std::vector<double> first;
  std::vector<double> second;
  double peak_first = 0.0;  // largest magnitudes away from breaks
  double peak_second = 0.0;
};

struct ProgramVerification {
  VerifyArgument over = VerifyArgument::kPathLength;
  std::vector<double> arguments;  // mm or rad
  std::vector<std::uint32_t> lines;
  std::vector<std::size_t> begins;  // where a new piece begins, 0 first
  std::vector<CoordinateSeries> series;
  std::vector<ProgramBreak> breaks;  // in the program's order
};

ProgramVerification VerifyProgram(const std::vector<Operation>& operations,
                                  VerifyArgument argument = VerifyArgument::kByContent);

}  // namespace lambdajet::trajectory
