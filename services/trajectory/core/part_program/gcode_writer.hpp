// Writes canonical operations as G-code that reads back as the same operations, whatever units, offsets and modes they came from.
//
// Model: absolute millimetres in W, a block an operation; arcs by I, J, K from the start, in G17, G18 or G19 where the plane
// changes; motions that carry a kerf offset stand between G41.1 or G42.1 and G40. Coordinates have as many digits as read back
// exactly, other numbers ten decimals: reading gives every number to 1e-9 (mm, rad, s, mm/s), and writing what was read gives
// the same text. An arc too short for the reader to tell from a full turn is written as the line to its end.
// Frames: W. Units: millimetres, degrees, mm/min. Threads: one object, one thread. Cost: about 1 us an operation.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

class GcodeWriter {
 public:
  explicit GcodeWriter(std::string_view title);

  void Append(const Operation& operation);
  void End();
  std::size_t size() const { return text_.size(); }
  // What has been written since it was last asked.
  std::string Take();

 private:
  void Line(const std::string& line);
  void Feed(double mm_per_s);
  std::string Pace(const Operation& o);
  void Kerf(double offset_mm);
  void Plane(ArcPlane plane);
  void Motion(const Operation& o);
  std::string ArcWords(const Operation& o, const std::array<double, 3>& end) const;
  int Turns(const Operation& o, const std::array<double, 3>& end) const;

  std::string text_;
  std::array<double, 3> at_{};
  ArcPlane plane_ = ArcPlane::kXy;
  double feed_ = -1.0;
  double kerf_mm_ = 0.0;
  bool timed_ = false;  // G93
};

// What of a text may stand in a comment: neither brackets nor line ends, nor what a reader may take for another alphabet.
std::string GcodeComment(std::string_view text);

// All of them at once.
std::string WriteGcode(const std::vector<Operation>& operations, std::string_view title);

}  // namespace lambdajet::trajectory
