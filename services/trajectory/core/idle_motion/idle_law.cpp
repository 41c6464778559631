#include "trajectory/core/idle_motion/idle_law.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lambdajet::trajectory {
namespace {

constexpr double kPi = std::numbers::pi;

// The positive root of (10); its product with the other is -T^2/3, so there is exactly one.
double Joint(double z_n, double z_k, double v, double duration) {
  const double p = duration + kPi * (z_n - z_k) / v;
  const double root = std::sqrt(p * p + 3.0 * duration * duration);
  return p > 0.0 ? duration * duration / (p + root) : (root - p) / 3.0;
}

// Sets the law that runs from z_n with velocity v to rest at z_k; phi1, z_a and A as in the paper.
void SetTwoZone(IdleLaw& law, double z_n, double z_k, double v) {
  const double duration = law.ends.duration;
  if (v == 0.0) {
    law.refusal = IdleRefusal::kNoVelocityChange;
    return;
  }
  law.phi1 = Joint(z_n, z_k, v, duration);
  law.exists = law.phi1 <= duration * (1.0 + 1e-12);
  if (!law.exists) {
    law.refusal = IdleRefusal::kTargetTooFarAhead;
    return;
  }
  law.phi1 = std::min(law.phi1, duration);
  const double delta = duration - law.phi1;
  law.z_a = -kPi * v / (2.0 * law.phi1);
  law.amplitude = v * delta * delta / (4.0 * law.phi1);
  law.peak_acceleration = std::abs(law.z_a);
}

IdlePoint TwoZoneAt(double z_n, double z_k, double v, double phi1, double amplitude, double duration,
                    double t) {
  const double z_a = -kPi * v / (2.0 * phi1);
  if (t <= phi1) {
    const double w = kPi / (2.0 * phi1);
    const double s = std::sin(w * t), c = std::cos(w * t);
    return {z_n + v / w * s, v * c, z_a * s, z_a * w * c};  // (1)-(4)
  }
  const double delta = duration - phi1;
  const double w = kPi / delta;
  const double x = w * (duration - t);
  const double c1 = std::cos(x), c2 = std::cos(2.0 * x);
  const double s1 = std::sin(x), s2 = std::sin(2.0 * x);
  return {z_k + amplitude / kPi * (0.75 - c1 + 0.25 * c2), -amplitude / delta * (s1 - 0.5 * s2),
          amplitude * kPi / (delta * delta) * (c1 - c2),
          amplitude * kPi * w / (delta * delta) * (s1 - 2.0 * s2)};
}

double QuinticPeak(const IdleLaw& law);

}  // namespace

std::string_view IdleKindName(IdleKind kind) {
  static constexpr std::array<std::string_view, kIdleKindCount> kNames = {"TWO_ZONE", "MIRRORED", "CYCLOID",
                                                                          "QUINTIC", "SIMPLE_HARMONIC"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string_view IdleRefusalName(IdleRefusal refusal) {
  static constexpr std::array<std::string_view, 6> kNames = {
      "NONE",           "TARGET_TOO_FAR_AHEAD", "NO_VELOCITY_CHANGE", "VELOCITIES_DIFFER", "END_ACCELERATION",
      "ENDS_NOT_FINITE"};
  return kNames[static_cast<std::size_t>(refusal)];
}

namespace {

bool Sound(const IdleEnds& e) {
  return e.duration > 0.0 && std::isfinite(e.z_n) && std::isfinite(e.z_k) && std::isfinite(e.v_n) &&
         std::isfinite(e.v_k) && std::isfinite(e.a_n) && std::isfinite(e.a_k) && std::isfinite(e.duration);
}

// What keeps a law with accelerations of its own from these ends, apart from its velocities.
IdleRefusal RefusalOf(const IdleEnds& e) {
  return !Sound(e)                      ? IdleRefusal::kEndsNotFinite
         : e.a_n != 0.0 || e.a_k != 0.0 ? IdleRefusal::kEndAcceleration
                                        : IdleRefusal::kNone;
}

}  // namespace

IdleLaw MakeTwoZone(const IdleEnds& e) {
  IdleLaw law{.kind = IdleKind::kTwoZone, .refusal = RefusalOf(e), .ends = e};
  if (law.refusal == IdleRefusal::kNone) {
    SetTwoZone(law, e.z_n + e.v_k * e.duration, e.z_k, e.v_n - e.v_k);
  }
  return law;
}

IdleLaw MakeMirrored(const IdleEnds& e) {
  IdleLaw law{.kind = IdleKind::kMirrored, .refusal = RefusalOf(e), .ends = e};
  if (law.refusal == IdleRefusal::kNone) {
    SetTwoZone(law, e.z_k - e.v_n * e.duration, e.z_n, e.v_n - e.v_k);
  }
  return law;
}

IdleLaw MakeCycloid(const IdleEnds& e) {
  IdleLaw law{.kind = IdleKind::kCycloid, .refusal = RefusalOf(e), .ends = e};
  if (law.refusal == IdleRefusal::kNone && e.v_n != e.v_k) {
    law.refusal = IdleRefusal::kVelocitiesDiffer;
  }
  law.exists = law.refusal == IdleRefusal::kNone;
  law.amplitude = e.z_k - e.z_n - e.v_n * e.duration;
  law.peak_acceleration = 2.0 * kPi * std::abs(law.amplitude) / (e.duration * e.duration);
  return law;
}

IdleLaw MakeSimpleHarmonic(const IdleEnds& e) {
  IdleLaw law{.kind = IdleKind::kSimpleHarmonic, .ends = e};
  law.refusal = !Sound(e)        ? IdleRefusal::kEndsNotFinite
                : e.v_n != e.v_k ? IdleRefusal::kVelocitiesDiffer
                                 : IdleRefusal::kNone;
  law.exists = law.refusal == IdleRefusal::kNone;
  law.amplitude = e.z_k - e.z_n - e.v_n * e.duration;
  const double end = kPi * kPi * law.amplitude / (2.0 * e.duration * e.duration);
  law.peak_acceleration = std::abs(end);
  law.acceleration_jump = std::max(std::abs(end - e.a_n), std::abs(-end - e.a_k));
  return law;
}

IdleLaw MakeQuintic(const IdleEnds& e) {
  IdleLaw law{.kind = IdleKind::kQuintic, .exists = Sound(e), .ends = e};
  law.refusal = law.exists ? IdleRefusal::kNone : IdleRefusal::kEndsNotFinite;
  law.peak_acceleration = law.exists ? QuinticPeak(law) : 0.0;
  return law;
}

std::array<IdleLaw, kIdleKindCount> MakeIdleLaws(const IdleEnds& ends) {
  return {MakeTwoZone(ends), MakeMirrored(ends), MakeCycloid(ends), MakeQuintic(ends),
          MakeSimpleHarmonic(ends)};
}

namespace {

std::array<double, 3> QuinticCoefficients(const IdleEnds& e) {
  const double T = e.duration;
  const double h = e.z_k - e.z_n - e.v_n * T - 0.5 * e.a_n * T * T;
  const double g = (e.v_k - e.v_n - e.a_n * T) * T;
  const double m = (e.a_k - e.a_n) * T * T;
  return {10 * h - 4 * g + 0.5 * m, -15 * h + 7 * g - m, 6 * h - 3 * g + 0.5 * m};
}

IdlePoint QuinticAt(const IdleEnds& e, double t) {
  const auto [c3, c4, c5] = QuinticCoefficients(e);
  const double T = e.duration;
  const double x = t / T;
  return {e.z_n + e.v_n * t + 0.5 * e.a_n * t * t + ((c5 * x + c4) * x + c3) * x * x * x,
          e.v_n + e.a_n * t + ((5 * c5 * x + 4 * c4) * x + 3 * c3) * x * x / T,
          e.a_n + ((20 * c5 * x + 12 * c4) * x + 6 * c3) * x / (T * T),
          ((60 * c5 * x + 24 * c4) * x + 6 * c3) / (T * T * T)};
}

// z'' is a cubic: its extrema are at the ends and at the roots of z''' inside.
double QuinticPeak(const IdleLaw& law) {
  const auto [c3, c4, c5] = QuinticCoefficients(law.ends);
  double peak = std::max(std::abs(law.ends.a_n), std::abs(law.ends.a_k));
  const double a = 60 * c5, b = 24 * c4, c = 6 * c3;
  const double root2 = b * b - 4 * a * c;
  if (root2 >= 0.0) {
    const double q = -0.5 * (b + std::copysign(std::sqrt(root2), b));
    for (const double x : {a != 0.0 ? q / a : -1.0, q != 0.0 ? c / q : -1.0}) {
      if (x > 0.0 && x < 1.0) {
        peak = std::max(peak, std::abs(QuinticAt(law.ends, x * law.ends.duration).second));
      }
    }
  }
  return peak;
}

}  // namespace

IdlePoint IdleLaw::At(double t) const {
  const double T = ends.duration;
  switch (kind) {
    case IdleKind::kTwoZone: {
      const double v_k = ends.v_k;
      IdlePoint p = TwoZoneAt(ends.z_n + v_k * T, ends.z_k, ends.v_n - v_k, phi1, amplitude, T, t);
      p.z += v_k * (t - T);
      p.first += v_k;
      return p;
    }
    case IdleKind::kMirrored: {
      const double v_n = ends.v_n;
      IdlePoint p = TwoZoneAt(ends.z_k - v_n * T, ends.z_n, v_n - ends.v_k, phi1, amplitude, T, T - t);
      return {p.z + v_n * t, v_n - p.first, p.second, -p.third};
    }
    case IdleKind::kCycloid: {
      const double w = 2.0 * kPi / T;
      return {ends.z_n + ends.v_n * t + amplitude * (t / T - std::sin(w * t) / (2.0 * kPi)),
              ends.v_n + amplitude / T * (1.0 - std::cos(w * t)), amplitude / T * w * std::sin(w * t),
              amplitude / T * w * w * std::cos(w * t)};
    }
    case IdleKind::kSimpleHarmonic: {
      const double w = kPi / T, half = 0.5 * amplitude;
      const double s = std::sin(w * t), c = std::cos(w * t);
      return {ends.z_n + ends.v_n * t + half * (1.0 - c), ends.v_n + half * w * s, half * w * w * c,
              -half * w * w * w * s};
    }
    case IdleKind::kQuintic:
      break;
  }
  return QuinticAt(ends, t);
}

double BangBangBound(const IdleEnds& e) {
  const double T = e.duration;
  const double E = e.z_k - e.z_n - 0.5 * T * (e.v_n + e.v_k);
  const double dv = T * (e.v_k - e.v_n);
  return (2.0 * std::abs(E) + std::sqrt(4.0 * E * E + dv * dv)) / (T * T);
}

namespace {

std::string_view ReasonOf(IdleKind kind) {
  switch (kind) {
    case IdleKind::kTwoZone:
      return "the two-zone law has the lowest peak";
    case IdleKind::kMirrored:
      return "the mirrored two-zone law has the lowest peak";
    case IdleKind::kCycloid:
      return "the cycloid has the lowest peak";
    case IdleKind::kSimpleHarmonic:
      return "the simple harmonic has the lowest peak, and jumps in acceleration are allowed at the ends";
    case IdleKind::kQuintic:
      break;
  }
  return "the quintic has the lowest peak of the laws that exist";
}

}  // namespace

IdleChoice ChooseIdleLaw(const IdleEnds& ends, bool allow_jumps) {
  IdleChoice choice{MakeQuintic(ends), 0.0, ReasonOf(IdleKind::kQuintic)};
  if (!choice.law.exists) {
    choice.reason = "no law: the ends must be finite and the zone longer than nothing";
    return choice;
  }
  choice.bound = BangBangBound(ends);
  for (const IdleLaw& law : MakeIdleLaws(ends)) {
    const bool meets = law.exists && (allow_jumps || law.acceleration_jump == 0.0);
    if (meets && law.peak_acceleration < choice.law.peak_acceleration) {
      choice.law = law;
      choice.reason = ReasonOf(law.kind);
    }
  }
  if ((ends.a_n != 0.0 || ends.a_k != 0.0) && choice.law.kind == IdleKind::kQuintic) {
    choice.reason = "only the quintic meets accelerations at the ends";
  }
  return choice;
}

}  // namespace lambdajet::trajectory
