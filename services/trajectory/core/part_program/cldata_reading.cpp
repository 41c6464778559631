#include "trajectory/core/part_program/cldata_reading.hpp"

#include <cmath>
#include <cstdio>

namespace lambdajet::trajectory {

bool CldataReading::Count(std::size_t least, std::size_t most) {
  return (Size() >= least && Size() <= most) ||
         Fault(statement_.place, "PARAMETER_COUNT",
               statement_.major + " takes " + std::to_string(least) +
                   (most == least ? "" : " to " + std::to_string(most)) + " parameters, not " +
                   std::to_string(Size()));
}

Operation* CldataReading::Add(OperationKind kind) {
  Operation& o = program_.operations.emplace_back();
  o.kind = kind;
  o.axes = options_.axes;
  o.line = statement_.place.line;
  o.feed_mm_per_s = feed_mm_per_s_;
  SetPosition(o, position_);
  if (program_.operations.size() >= options_.operation_limit) {
    Fault({0, 0, {}}, "PROGRAM_TOO_LONG", "more operations than the limit; split the program");
    stopped_ = true;
  }
  return &o;
}

void CldataReading::SetPosition(Operation& o, const Vector& p) const {
  o.x_W_mm = p[0];
  o.y_W_mm = p[1];
  if (Has(kAxisZ)) {
    o.z_W_mm = p[2];
    const HeadAngles angles = AnglesOf(options_.tool_angles, axis_);
    o.a_rad = angles.a_rad;
    o.b_rad = angles.b_rad;
  }
}

Operation& CldataReading::Move(OperationKind kind, const Vector& target) {
  position_ = target;
  stands_ = axis_;
  moved_ = true;
  cut_ = cut_ || kind != OperationKind::kTraverse;
  Operation* o = Add(kind);
  o->kerf_offset_mm = kerf_offset_mm_;
  return *o;
}

std::string CldataReading::Number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

bool CldataReading::Fault(const CldataPlace& place, const char* reason, std::string message) {
  program_.faults.push_back({place.line, place.column, reason, std::string(place.text), std::move(message)});
  return false;
}

}  // namespace lambdajet::trajectory
