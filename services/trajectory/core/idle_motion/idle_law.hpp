// Moves one coordinate through an idle zone: from where a pass ends to where the next begins, without a break in velocity
// and, but for the bang-bang bound, in acceleration.
//
// Model: seed paper 003. Two-zone law (1)-(8) and (9) with its second and third coefficient halved (as printed it neither
// joins nor ends), phi1 the positive root of (10); its mirrored form (run backwards); non-zero end velocity by adding the
// uniform motion; cycloid and simple harmonic where both velocities are equal (v = 0: the paper's coordinate A); quintic
// Hermite for any end accelerations. The argument is called t and may be a time or an angle. Where the duration is free,
// jerk_limited_move.hpp is the quickest.
// Validity: the two-zone law exists if r = (z_k - z_n - v_k T)/((v_n - v_k) T) <= 2/pi, the mirrored one if 1 - r <= 2/pi;
// at least one of them always does. Both begin and end with zero acceleration. The simple harmonic jumps in acceleration at
// both ends by pi^2 |h|/(2 T^2): it has the lowest peak of all where such jumps are allowed.
// Units: of the coordinate and of the argument. Threads: values. Cost: one sine and cosine a point.
// Errors: a law that does not exist for the ends is answered with exists = false and why.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace lambdajet::trajectory {

enum class IdleKind : std::uint8_t { kTwoZone, kMirrored, kCycloid, kQuintic, kSimpleHarmonic };
inline constexpr int kIdleKindCount = 5;

// UPPER_SNAKE.
std::string_view IdleKindName(IdleKind kind);

// Why a law does not exist for the ends.
enum class IdleRefusal : std::uint8_t {
  kNone,
  kTargetTooFarAhead,  // two-zone, mirrored: beyond 2/pi of what the change of velocity reaches
  kNoVelocityChange,   // two-zone, mirrored: v_n = v_k makes (10) degenerate, phi1 = 0
  kVelocitiesDiffer,   // cycloid, simple harmonic
  kEndAcceleration,    // all but the quintic begin and end with accelerations of their own
  kEndsNotFinite,      // or the duration is not positive
};
// UPPER_SNAKE.
std::string_view IdleRefusalName(IdleRefusal refusal);

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
  IdleRefusal refusal = IdleRefusal::kNone;
  IdleEnds ends;
  double phi1 = 0.0;       // joint of the zones, in the argument of the law as run (mirrored: reversed)
  double z_a = 0.0;        // second derivative at the joint
  double amplitude = 0.0;  // A of the law as run
  double peak_acceleration = 0.0;  // largest |z''|
  double acceleration_jump =
      0.0;  // larger of the jumps of z'' at the ends; 0: z, z' and z'' go on without a break

  IdlePoint At(double t) const;
};

IdleLaw MakeTwoZone(const IdleEnds& ends);
IdleLaw MakeMirrored(const IdleEnds& ends);
IdleLaw MakeCycloid(const IdleEnds& ends);         // v_n = v_k, a_n = a_k = 0
IdleLaw MakeSimpleHarmonic(const IdleEnds& ends);  // v_n = v_k; jumps in acceleration at the ends
IdleLaw MakeQuintic(const IdleEnds& ends);
// Every law for these ends, in the order of IdleKind; those that do not exist say why.
std::array<IdleLaw, kIdleKindCount> MakeIdleLaws(const IdleEnds& ends);

// The least |z''| that any law with these end positions and velocities can have (bang-bang).
double BangBangBound(const IdleEnds& ends);

struct IdleChoice {
  IdleLaw law;
  double bound = 0.0;
  std::string_view reason;  // why this law, in words

  // How far the peak is from what no law can undercut; 1 is the bound itself.
  double peak_to_bound_ratio() const { return bound > 0.0 ? law.peak_acceleration / bound : 1.0; }
};

// The law with the lowest peak among those that exist and meet the ends; one that jumps only where jumps are allowed.
IdleChoice ChooseIdleLaw(const IdleEnds& ends, bool allow_jumps = false);

}  // namespace lambdajet::trajectory
