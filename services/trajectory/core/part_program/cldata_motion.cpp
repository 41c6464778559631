#include <cmath>

#include "trajectory/core/part_program/cldata_reading.hpp"

namespace lambdajet::trajectory {

bool CldataReading::From() {
  if (moved_) {
    return Fault(statement_.place, "FROM_AFTER_MOTION", "FROM says where the program begins; GOTO moves");
  }
  Vector target;
  return Target(target) && Traverse(target);
}

bool CldataReading::Goto() {
  Vector target;
  if (!Target(target)) {
    return false;
  }
  if (drills_) {
    return Drill(target);
  }
  if (rapid_) {
    return Traverse(target);
  }
  if (circle_) {
    const Verdict verdict = AlongCircle(target);
    if (verdict != Verdict::kNotOnCircle) {
      return verdict == Verdict::kMoved;
    }
    circle_.reset();
  }
  return Line(target);
}

// Along the coordinates, or with one number along the tool's axis.
bool CldataReading::GoDelta() {
  if (!Count(1, 3)) {
    return false;
  }
  if (Size() == 2) {
    return Fault(statement_.place, "PARAMETER_COUNT",
                 "GODLTA takes dx,dy,dz or one distance along the tool's axis");
  }
  Vector target = position_;
  for (std::size_t i = 0; i < 3; ++i) {
    const CldataParameter& p = At(Size() == 1 ? 0 : i);
    if (!Coordinate(p)) {
      return false;
    }
    target[i] += p.value * unit_mm_ * (Size() == 1 ? axis_[i] : 1.0);
  }
  if (!CoordinatesFit(target) || !Driven(target)) {
    return false;
  }
  return rapid_ ? Traverse(target) : Line(target);
}

bool CldataReading::Traverse(const Vector& target) {
  rapid_ = false;
  if (jet_on_) {
    return Fault(statement_.place, "TRAVERSE_WITH_JET_ON",
                 "the jet is on; switch it off or cut with a feed. SPINDL pierces where the jet stands: "
                 "behind the way there");
  }
  Move(OperationKind::kTraverse, target);
  return true;
}

bool CldataReading::Line(const Vector& target) {
  if (!HasFeed()) {
    return false;
  }
  const double length =
      std::hypot(target[0] - position_[0], target[1] - position_[1], target[2] - position_[2]);
  return SetPace(Move(OperationKind::kFeedLine, target), length);
}

// A time instead of a feed: a feed where there is a way, a duration where there is none.
bool CldataReading::SetPace(Operation& o, double length_mm) {
  if (move_s_ > 0.0) {
    o.feed_mm_per_s = length_mm / move_s_;
    o.value = length_mm > 0.0 ? 0.0 : move_s_;
  }
  return o.feed_mm_per_s <= kFastestFeed_mm_per_s ||
         Fault(statement_.place, "FEED_OUT_OF_RANGE",
               "the time of FEDRAT/INVERS asks for " + Number(o.feed_mm_per_s) + " mm/s here; at most 1e7");
}

bool CldataReading::HasFeed() {
  return feed_mm_per_s_ > 0.0 || move_s_ > 0.0 ||
         Fault(statement_.place, "FEED_MISSING", "FEDRAT must stand before the first GOTO that cuts");
}

// GOTO/x,y,z or, with MULTAX, GOTO/x,y,z,i,j,k; checks the machine's axes.
bool CldataReading::Target(Vector& target) {
  if (!Count(2, 6)) {
    return false;
  }
  if (Size() == 4 || Size() == 5) {
    return Fault(statement_.place, "PARAMETER_COUNT", "a point is x,y,z or x,y,z,i,j,k");
  }
  for (std::size_t i = 0; i < Size(); ++i) {
    if (!Coordinate(At(i))) {
      return false;
    }
  }
  target = {At(0).value * unit_mm_, At(1).value * unit_mm_,
            Size() > 2 ? At(2).value * unit_mm_ : position_[2]};
  return (Size() < 6 || ToolAxis(3)) && Driven(target);
}

bool CldataReading::Coordinate(const CldataParameter& p) {
  if (!p.is_number) {
    return Fault(p.place, "BAD_NUMBER", "a coordinate is a number");
  }
  return std::abs(p.value * unit_mm_) <= options_.largest_coordinate_mm ||
         Fault(p.place, "COORDINATE_TOO_LARGE", "a coordinate is at most 1e6 mm");
}

// Of three parameters from `first` on.
bool CldataReading::ToolAxis(std::size_t first) {
  Vector axis;
  for (std::size_t i = 0; i < 3; ++i) {
    const CldataParameter& p = At(first + i);
    if (!p.is_number) {
      return Fault(p.place, "BAD_NUMBER", "a tool axis is three numbers");
    }
    axis[i] = p.value;
  }
  const double length = std::sqrt(Dot(axis, axis));
  if (std::abs(length - 1.0) > kCldataVectorTolerance) {
    return Fault(At(first).place, "TOOL_AXIS_NOT_UNIT",
                 "a tool axis has the length 1, not " + Number(length));
  }
  const bool upright = Upright(axis);
  if (!multax_ && !upright) {
    return Fault(At(first).place, "MULTAX_MISSING",
                 "MULTAX/ON must stand before a tool axis other than 0,0,1");
  }
  if (!upright && !Has(kAxisA) && !Has(kAxisB)) {
    return Fault(At(first).place, "AXIS_NOT_DRIVEN",
                 "this machine's jet does not tilt; the tool axis is 0,0,1");
  }
  axis_ = {axis[0] / length, axis[1] / length, axis[2] / length};
  return true;
}

bool CldataReading::Upright(const Vector& axis) {
  return std::abs(axis[0]) < kCldataAxisTolerance && std::abs(axis[1]) < kCldataAxisTolerance &&
         axis[2] > 0.0;
}

// A machine without Z keeps the height that the program began at.
bool CldataReading::Driven(const Vector& target) {
  if (!Has(kAxisZ) && moved_ && std::abs(target[2] - position_[2]) > 1e-9) {
    return Fault(
        At(Size() == 1 ? 0 : 2).place, "AXIS_NOT_DRIVEN",
        "part programs of this machine move X and Y only; Z was " + Number(position_[2]) + " mm before");
  }
  return true;
}

}  // namespace lambdajet::trajectory
