// Moves one coordinate through an idle zone: from where a pass ends to where the next begins, without a break in velocity
// and, but for the bang-bang bound, in acceleration.
//
// Model: seed paper 003. Two-zone law (1)-(8) and (9) with its second and third coefficient halved (as printed it neither
// joins nor ends), phi1 the positive root of (10); its mirrored form (run backwards); non-zero end velocity by adding the
// uniform motion; cycloid where both velocities are equal; quintic Hermite for any end accelerations. The argument is
// called t and may be a time or an angle.
// Validity: the two-zone law exists if r = (z_k - z_n - v_k T)/((v_n - v_k) T) <= 2/pi, the mirrored one if 1 - r <= 2/pi;
// at least one of them always does. Both begin and end with zero acceleration.
// Units: of the coordinate and of the argument. Threads: values. Cost: one sine and cosine a point.
// Errors: a law that does not exist for the ends is answered with exists = false.
#pragma once

#include <cstdint>
#include <string_view>

namespace lambdajet::trajectory {

enum class IdleKind : std::uint8_t { kTwoZone, kMirrored, kCycloid, kQuintic };

// UPPER_SNAKE.
std::string_view IdleKindName(IdleKind kind);

// n: start of the idle zone, k: its end; duration > 0.
struct IdleEnds {
  double z_n = 0.0;
  double z_k = 0.0;
  double v_n = 0.0;
  double v_k = 0.0;
  double a_n = 0.0;
  double a_k = 0.0;
  double duration = 0.0;
};

struct IdlePoint {
  double z = 0.0;
  double first = 0.0;
  double second = 0.0;
  double third = 0.0;
};

struct IdleLaw {
  IdleKind kind = IdleKind::kQuintic;
  bool exists = false;
  IdleEnds ends;
  double phi1 = 0.0;       // joint of the zones, in the argument of the law as run (mirrored: reversed)
  double z_a = 0.0;        // second derivative at the joint
  double amplitude = 0.0;  // A of the law as run
  double peak_acceleration = 0.0;  // largest |z''|

  IdlePoint At(double t) const;
};

IdleLaw MakeTwoZone(const IdleEnds& ends);
IdleLaw MakeMirrored(const IdleEnds& ends);
IdleLaw MakeCycloid(const IdleEnds& ends);  // v_n = v_k, a_n = a_k = 0
IdleLaw MakeQuintic(const IdleEnds& ends);

// The least |z''| that any law with these end positions and velocities can have (bang-bang).
double BangBangBound(const IdleEnds& ends);

struct IdleChoice {
  IdleLaw law;
  double bound = 0.0;
  std::string_view reason;  // why this law, in words
};

// The law with the lowest peak among those that exist and meet the ends.
IdleChoice ChooseIdleLaw(const IdleEnds& ends);

}  // namespace lambdajet::trajectory
