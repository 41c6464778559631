#include <algorithm>
#include <cmath>
#include <numbers>

#include "trajectory/core/part_program/cldata_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFull = 2.0 * kPi;
constexpr double kAngleTolerance_rad = 1e-3;

using Vector = CldataVector;

// The two coordinates of a circle's plane, in the order that makes it right-handed about its axis.
double First(const CldataCircle& c, const Vector& p) {
  return p[(c.normal + 1) % 3] - c.center[(c.normal + 1) % 3];
}

double Second(const CldataCircle& c, const Vector& p) {
  return p[(c.normal + 2) % 3] - c.center[(c.normal + 2) % 3];
}

double RadiusOf(const CldataCircle& c, const Vector& p) { return std::hypot(First(c, p), Second(c, p)); }

double AngleOf(const CldataCircle& c, const Vector& p) { return std::atan2(Second(c, p), First(c, p)); }

// The centre moved onto the bisector of the chord, so that start and end lie on one circle; left as it is where they do.
Vector CenterBetween(const CldataCircle& c, const Vector& end) {
  Vector center = c.center;
  center[c.normal] = end[c.normal];
  const double from = RadiusOf(c, c.start), to = RadiusOf(c, end);
  const double u = First(c, end) - First(c, c.start), v = Second(c, end) - Second(c, c.start);
  const double chord2 = u * u + v * v;
  if (std::abs(from - to) < 1e-9 || chord2 < 1e-12) {
    return center;
  }
  const double along =
      -0.5 * ((First(c, c.start) + First(c, end)) * u + (Second(c, c.start) + Second(c, end)) * v) / chord2;
  center[(c.normal + 1) % 3] -= along * u;
  center[(c.normal + 2) % 3] -= along * v;
  return center;
}

}  // namespace

bool CldataReading::CircleFrom(CldataCircle& circle) {
  for (std::size_t i = 0; i < Size() && i < 7; ++i) {
    if (!Coordinate(At(i))) {
      return false;
    }
  }
  const bool short_form = Size() == 4;  // x,y,z,r: about Z
  const Vector axis = short_form ? Vector{0.0, 0.0, 1.0} : Vector{At(3).value, At(4).value, At(5).value};
  const CldataParameter& radius = At(short_form ? 3 : 6);
  const double length = std::sqrt(Dot(axis, axis));
  circle.normal = static_cast<std::size_t>(
      std::max_element(axis.begin(), axis.end(),
                       [](double a, double b) { return std::abs(a) < std::abs(b); }) -
      axis.begin());
  if (std::abs(length - 1.0) > kCldataVectorTolerance ||
      std::abs(axis[circle.normal]) < length * (1.0 - kCldataAxisTolerance)) {
    return Fault(At(3).place, "CIRCLE_AXIS_OBLIQUE", "a circle's axis is along X, Y or Z, of length 1");
  }
  if (circle.normal != 2 && !Has(kAxisZ)) {
    return Fault(At(3).place, "AXIS_NOT_DRIVEN", "the sheet is the XY plane; a circle's axis is 0,0,1");
  }
  if (!(radius.value * unit_mm_ > 1e-9)) {
    return Fault(radius.place, "ARC_RADIUS_ZERO", "a circle has a radius above 0");
  }
  circle.center = {At(0).value * unit_mm_, At(1).value * unit_mm_, At(2).value * unit_mm_};
  circle.radius_mm = radius.value * unit_mm_;
  circle.start = position_;
  circle.place = statement_.place;
  circle.said_sweep_rad = axis[circle.normal] > 0.0 ? 1.0 : -1.0;  // MOVARC: times its angle
  return StartsOn(circle);
}

bool CldataReading::StartsOn(const CldataCircle& circle) {
  if (!moved_) {
    return Fault(statement_.place, "CIRCLE_WITHOUT_START", "FROM or GOTO must say where the arc begins");
  }
  const double off = RadiusOf(circle, position_) - circle.radius_mm;
  return std::abs(off) <= options_.arc_radius_tolerance_mm ||
         Fault(statement_.place, "ARC_RADIUS_DIFFERS",
               "the arc's start lies " + Number(off) + " mm off the circle; at most " +
                   Number(options_.arc_radius_tolerance_mm) + " mm are allowed");
}

bool CldataReading::ReadCircle() {
  if (!Count(4, kMostParameters)) {
    return false;
  }
  if (Size() == 5 || Size() == 6) {
    return Fault(statement_.place, "PARAMETER_COUNT", "a circle is x,y,z,i,j,k,r or x,y,z,r");
  }
  CldataCircle circle;
  if (!HasFeed() || !CircleFrom(circle)) {
    return false;
  }
  circle.said_sweep_rad = 0.0;
  circle_ = circle;
  return true;
}

bool CldataReading::MoveArc() {
  if (!Count(9, 9)) {
    return false;
  }
  CldataCircle circle;
  if (!HasFeed() || !CircleFrom(circle)) {
    return false;
  }
  const double angle = At(8).value * kPi / 180.0;
  if (At(7).word != "ANGLE" || !At(8).is_number || !(angle > 0.0 && angle <= 1000.0 * kFull)) {
    return Fault(At(7).place, "ARC_ANGLE_MISSING", "MOVARC ends in ANGLE and an angle above 0 degrees");
  }
  circle.said_sweep_rad *= angle;
  circle_ = circle;
  return true;
}

CldataReading::Verdict CldataReading::AlongCircle(const Vector& target) {
  CldataCircle& c = *circle_;
  const double off = RadiusOf(c, target) - c.radius_mm;
  if (std::abs(off) > options_.arc_radius_tolerance_mm) {
    if (c.begun) {
      return Verdict::kNotOnCircle;
    }
    Fault(statement_.place, "ARC_RADIUS_DIFFERS",
          "the point lies " + Number(off) + " mm off the circle; at most " +
              Number(options_.arc_radius_tolerance_mm) + " mm are allowed");
    return Verdict::kFault;
  }
  double turn = std::remainder(AngleOf(c, target) - AngleOf(c, position_), kFull);
  if (c.said_sweep_rad != 0.0) {
    turn = c.said_sweep_rad + std::remainder(turn - c.said_sweep_rad, kFull);
  }
  if (!DirectionKnown(c, turn)) {
    return Verdict::kFault;
  }
  if (turn != 0.0 && !Sweep(c, target, turn)) {
    return Verdict::kFault;
  }
  if (c.said_sweep_rad != 0.0) {
    circle_.reset();
  }
  return Verdict::kMoved;
}

bool CldataReading::DirectionKnown(const CldataCircle& c, double turn) {
  if (c.said_sweep_rad != 0.0) {
    return std::abs(turn - c.said_sweep_rad) <= kAngleTolerance_rad ||
           Fault(statement_.place, "ARC_ANGLE_DIFFERS", "the point is not where the angle of MOVARC leads");
  }
  if (std::abs(turn) > kPi - kAngleTolerance_rad) {
    return Fault(statement_.place, "CIRCLE_DIRECTION_UNKNOWN",
                 "half a turn or more from the point before; write points between, or MOVARC");
  }
  return !c.begun || turn * c.swept_rad >= 0.0 ||
         Fault(statement_.place, "CIRCLE_TURNS_BACK",
               "the points of a circle turn one way; write CIRCLE again");
}

// Begins the arc's operation or goes on with it.
bool CldataReading::Sweep(CldataCircle& c, const Vector& target, double turn) {
  if (!c.begun) {
    c.operation = program_.operations.size();
    c.begun = true;
    Move(OperationKind::kFeedArc, target);
  }
  c.swept_rad += turn;
  Operation& o = program_.operations[c.operation];
  SetPosition(o, target);
  position_ = target;
  // From start, end and centre alone, so that the points between leave no trace in the last digits.
  CldataCircle settled = c;
  settled.center = CenterBetween(c, target);
  const double direct = AngleOf(settled, target) - AngleOf(settled, c.start);
  o.sweep_rad = direct + kFull * std::round((c.swept_rad - direct) / kFull);
  o.plane = c.normal == 2 ? ArcPlane::kXy : c.normal == 1 ? ArcPlane::kZx : ArcPlane::kYz;
  o.center_x_W_mm = settled.center[0];
  o.center_y_W_mm = settled.center[1];
  o.center_z_W_mm = Has(kAxisZ) ? settled.center[2] : 0.0;
  return SetPace(o, std::hypot(c.radius_mm * o.sweep_rad, target[c.normal] - c.start[c.normal]));
}

}  // namespace lambdajet::trajectory
