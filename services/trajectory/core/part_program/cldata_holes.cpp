#include <algorithm>
#include <cmath>

#include "trajectory/core/part_program/cldata_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kSamePlace_mm = 1e-3;  // posts write three to six decimals
constexpr double kLeastRise =
    0.5;  // cosine between two tools' axes up to which one rises over the other's hole

}  // namespace

bool CldataReading::Cycle() {
  const bool on = Size() == 1 && At(0).word == "ON";
  if (on || (Size() == 1 && At(0).word == "OFF")) {
    drills_ = on;
    return !on || cycle_ ||
           Fault(statement_.place, "CYCLE_UNKNOWN", "CYCLE/ON goes on with a cycle, and none stands before");
  }
  drills_ = false;
  if (!Has(kAxisZ)) {
    return Fault(statement_.place, "CYCLE_AXIS_NOT_DRIVEN", "drilling cycles need a machine that moves Z");
  }
  CldataCycle cycle;
  CldataFault fault;
  if (!ReadCycle(statement_, {unit_mm_, spindle_per_min_}, cycle, fault)) {
    return Fault(fault.place, fault.reason, fault.message);
  }
  cycle_ = cycle;
  return drills_ = true;
}

bool CldataReading::Drill(const Vector& entry) {
  if (!cycle_) {
    return false;  // after a CYCLE/ON that was refused
  }
  const double feed_mm_per_s = cycle_->feed_mm_per_s > 0.0 ? cycle_->feed_mm_per_s : feed_mm_per_s_;
  if (!DrillsHere(feed_mm_per_s) || !WithinReach(entry) || !RiseOver(entry)) {
    return false;
  }
  const double height = moved_ ? HeightOver(entry, position_) : 0.0;
  if (height > cycle_->heights.clear_mm + kSamePlace_mm) {
    Move(OperationKind::kTraverse, Over(entry, height));
  }
  const std::vector<HoleStep> steps = StepsOf(cycle_->heights);
  for (std::size_t i = StandsAt(Over(entry, steps.front().height_mm)) ? 1 : 0; i < steps.size() && !stopped_;
       ++i) {
    if (i + 1 == steps.size() && cycle_->dwell_s > 0.0) {
      Add(OperationKind::kDwell)->value = cycle_->dwell_s;
    }
    Operation& o = Move(steps[i].feeds ? OperationKind::kFeedLine : OperationKind::kTraverse,
                        Over(entry, steps[i].height_mm));
    o.feed_mm_per_s = feed_mm_per_s;
  }
  return !stopped_;
}

bool CldataReading::StandsAt(const Vector& p) const {
  const double turned = std::hypot(stands_[0] - axis_[0], stands_[1] - axis_[1], stands_[2] - axis_[2]);
  return moved_ && turned < kCldataAxisTolerance &&
         std::hypot(p[0] - position_[0], p[1] - position_[1], p[2] - position_[2]) < kSamePlace_mm;
}

bool CldataReading::DrillsHere(double feed_mm_per_s) {
  if (kerf_offset_mm_ != 0.0) {
    return Fault(statement_.place, "CYCLE_WITH_COMPENSATION", "TLCOMP/OFF must stand before a hole");
  }
  if (cycle_->feed_mm_per_s == 0.0 && move_s_ > 0.0) {
    return Fault(statement_.place, "CYCLE_INVERSE_TIME", "a cycle feeds in millimetres or inches a minute");
  }
  if (axis_[2] < kLeastRise) {
    return Leans();
  }
  return feed_mm_per_s > 0.0 ||
         Fault(statement_.place, "FEED_MISSING", "CYCLE or FEDRAT must say the feed before the first hole");
}

CldataVector CldataReading::Over(const Vector& entry, double height_mm) const {
  return {entry[0] + height_mm * axis_[0], entry[1] + height_mm * axis_[1], entry[2] + height_mm * axis_[2]};
}

// Along the tool's axis over the plane of W in which the hole begins, as G81 counts.
double CldataReading::HeightOver(const Vector& entry, const Vector& p) const {
  return (p[2] - entry[2]) / axis_[2];
}

bool CldataReading::WithinReach(const Vector& entry) {
  const HoleHeights& h = cycle_->heights;
  for (const double height : {h.clear_mm, h.bottom_mm}) {
    if (!CoordinatesFit(Over(entry, height))) {
      return false;
    }
  }
  return true;
}

bool CldataReading::CoordinatesFit(const Vector& p) {
  const bool fit = std::all_of(p.begin(), p.end(),
                               [this](double x) { return std::abs(x) <= options_.largest_coordinate_mm; });
  return fit || Fault(statement_.place, "COORDINATE_TOO_LARGE", "a coordinate is at most 1e6 mm");
}

// From below the height at which the next hole is gone to: out along the tool as it stands.
bool CldataReading::RiseOver(const Vector& entry) {
  const double missing_mm = cycle_->heights.clear_mm - HeightOver(entry, position_);
  if (!moved_ || missing_mm <= kSamePlace_mm) {
    return true;
  }
  if (stands_[2] < kLeastRise) {
    return Leans();
  }
  const Vector axis = axis_;
  axis_ = stands_;
  const Vector risen = Over(position_, missing_mm * axis[2] / stands_[2]);
  const bool fits = CoordinatesFit(risen);
  if (fits) {
    Move(OperationKind::kTraverse, risen);
  }
  axis_ = axis;
  return fits;
}

bool CldataReading::Leans() {
  return Fault(statement_.place, "CYCLE_TOOL_LEANS",
               "in a cycle, and on the way to it, the tool leans by at most 60 degrees from Z");
}

}  // namespace lambdajet::trajectory
