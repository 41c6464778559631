// Checks a DXF file group by group before the library sees it, and rewrites what it needs in a form that cannot hurt it.
//
// Model: the library (libdime 2011) keeps real numbers in single precision, counts vertices in 16 bits and copies lines of
// any length into fixed arrays. So the guard reads every pair of group code and value itself, refuses what is malformed or
// too large by name and line, keeps only the entities and codes that a contour can be made of, and hands each real number
// through the library as its place in a table: what comes back is the exact double that the file says. Counts are
// recounted, missing optional codes written out, light polylines written as old ones (the library never frees theirs).
// What nobody sees is left out: paper space, invisible entities, and, by the reader, layers switched off or frozen. What is
// wrong within a block is told where the block is inserted.
// Format: AutoCAD DXF reference, ASCII. Threads: pure. Cost: about 50 ns a pair.
// Errors: findings BINARY_DXF, DXF_TOO_LARGE, BAD_GROUP_CODE, BAD_NUMBER, NUMBER_TOO_LARGE, LINE_TOO_LONG, TRUNCATED_FILE,
// BAD_STRUCTURE, MISSING_VALUE, TOO_MANY_VERTICES, UNKNOWN_ENTITY, UNKNOWN_BLOCK, DUPLICATE_BLOCK, EXTERNAL_REFERENCE,
// CLIPPED_INSERTION, ENTITY_NOT_IN_PLANE. Told without blocking: ENTITY_INVISIBLE, PAPER_SPACE, WIDE_POLYLINE.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trajectory/core/toolpath/drawing.hpp"

namespace lambdajet::trajectory {

inline constexpr std::size_t kLargestDxfBytes = std::size_t{64} << 20;

enum class HiddenLayer : std::uint8_t {
  kOff,     // of an insertion, what stands on layers of its own is seen
  kFrozen,  // nothing is
};

struct GuardedDxf {
  std::string text;             // canonical DXF; empty if the file cannot be read at all
  std::vector<double> numbers;  // real numbers of the text are places in here
  std::vector<Finding> findings;
  std::map<std::string, HiddenLayer> hidden_layers;  // by name in upper case
  std::vector<std::pair<std::uint32_t, std::uint64_t>>
      handles;  // of the entities that have one, by rising line
};

// What Z may differ by in one plane, in the drawing's unit.
inline constexpr double kFlat = 1e-6;

// The group code that carries the line an entity begins on (a line type scale otherwise, which no contour needs).
inline constexpr int kLineCarrierCode = 48;
// And the one that says that a polyline was a light one (a line type's dash otherwise).
inline constexpr int kLightCarrierCode = 49;

GuardedDxf GuardDxf(std::string_view file);

}  // namespace lambdajet::trajectory
