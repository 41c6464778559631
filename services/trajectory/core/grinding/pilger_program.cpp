#include "trajectory/core/grinding/pilger_program.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace lambdajet::trajectory {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kTurn = 2.0 * kPi;
constexpr int kLooksAlong = 24;  // over the zone, for scallop and curvature
constexpr std::size_t kMostPasses = 2000;
constexpr double kScallopShare = 0.995;  // of Rz that a step aims at
constexpr double kTouch_mm = 1e-6;       // a clearance below this is a gouge

std::string Text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string Degrees(double rad) { return Text(rad * 180.0 / kPi) + " deg"; }

PilgerProgram Refused(PilgerRefusal refusal, std::string message) {
  PilgerProgram program;
  program.refusal = refusal;
  program.message = std::move(message);
  return program;
}

PilgerProgram CheckNumbers(const PilgerDie& d) {
  const bool sound = d.groove.die_radius_mm > 0.0 && d.wheel.profile_radius_mm > 0.0 &&
                     d.wheel.radius_mm > d.wheel.profile_radius_mm && d.groove.zone_rad > 0.0 &&
                     d.alpha_from_rad < d.alpha_to_rad && d.alpha_from_rad > -0.5 * kPi &&
                     d.alpha_to_rad < 0.5 * kPi && d.scallop_mm > 0.0 && d.step_rad > 0.0005 &&
                     d.step_rad <= 0.2 && d.turn_s > 0.0 && d.approach_mm > 0.0 && d.wheel.radius_mm < 1e5 &&
                     d.groove.die_radius_mm < 1e5;
  if (!sound) {
    return Refused(PilgerRefusal::kNumberOutOfRange,
                   "radii, Rz, step (0.03 to 11 deg), time of a turn and approach are above 0, the wheel "
                   "larger than its "
                   "profile, alpha rises within -90 to 90 deg");
  }
  if (d.groove.zone_rad > kPi) {
    return Refused(PilgerRefusal::kZoneTooLong, "the cutting zone is " + Degrees(d.groove.zone_rad) +
                                                    "; at most 180 deg leave an idle zone to come back in");
  }
  for (int i = 0; i <= 4 * kLooksAlong; ++i) {
    const double phi = d.groove.zone_rad * i / (4 * kLooksAlong);
    const double a = d.groove.width.At(phi)[0], b = d.groove.depth.At(phi)[0];
    if (!(a > 0.0 && b > 0.0 && b < d.groove.die_radius_mm)) {
      return Refused(PilgerRefusal::kGrooveNotSound,
                     "at " + Degrees(phi) + " the half-axes are " + Text(a) + " and " + Text(b) +
                         " mm; both must be above 0 and the depth below the die's "
                         "radius");
    }
  }
  return {};
}

// Whether the wheel fits in the groove at each looked-at contact of a pass, to second order.
PilgerProgram CheckCurvature(const PilgerDie& d, double alpha, double& largest_profile_mm) {
  for (int i = 0; i <= kLooksAlong; ++i) {
    const double phi = d.groove.zone_rad * i / kLooksAlong;
    const WheelPose pose = PoseAt(d.groove, d.wheel, phi, alpha);
    const ContactCurvature k = CurvatureAt(d.groove, d.wheel, phi, alpha);
    const double along = 1.0 / d.wheel.profile_radius_mm - k.along_per_mm;
    const double across = 1.0 / d.wheel.radius_mm - k.across_per_mm;
    const std::string place = "at " + Degrees(phi) + " of the zone, alpha " + Degrees(alpha);
    if (k.along_per_mm > 0.0) {
      largest_profile_mm = std::min(largest_profile_mm, 1.0 / k.along_per_mm);
    }
    if (!(along > 0.0)) {
      return Refused(PilgerRefusal::kWheelProfileTooLarge,
                     place + " the groove's radius of curvature is " + Text(1.0 / k.along_per_mm) +
                         " mm; the profile radius " + Text(d.wheel.profile_radius_mm) +
                         " mm must be smaller");
    }
    if (!(across > 0.0)) {
      return Refused(PilgerRefusal::kWheelTooLarge,
                     place + " the groove is hollow along the die with a radius of " +
                         Text(1.0 / k.across_per_mm) + " mm; the wheel's " + Text(d.wheel.radius_mm) +
                         " mm must be smaller");
    }
    if (!(along * across > k.mixed_per_mm * k.mixed_per_mm)) {
      return Refused(PilgerRefusal::kWheelGouges,
                     place +
                         " the wheel cuts into the groove oblique to the pass; a smaller "
                         "wheel or profile radius is needed");
    }
    if (!std::isfinite(pose.x_mm.second) ||
        !std::isfinite(PoseAtC(d.groove, d.wheel, pose.c_rad, alpha).c_rad)) {
      return Refused(PilgerRefusal::kDieDoesNotAdvance,
                     place +
                         " the wheel's centre would run back around the die; a "
                         "smaller wheel is needed");
    }
  }
  return {};
}

// Whether the wheel's body stays clear of the whole groove, its edges and the cylinder beside them.
PilgerProgram CheckBody(const PilgerDie& d, double alpha, double& least_mm) {
  constexpr int kPoses = 8, kAlong = 30, kSection = 36;
  for (int i = 0; i <= kPoses; ++i) {
    const WheelPose pose = PoseAt(d.groove, d.wheel, d.groove.zone_rad * i / kPoses, alpha);
    const WheelPlace place = PlaceOf(pose.x_mm.value, pose.z_mm.value, pose.a_rad.value, pose.c_rad);
    for (int j = 0; j <= kAlong; ++j) {
      const double phi = d.groove.zone_rad * j / kAlong;
      for (int k = -kSection - 4; k <= kSection + 4; ++k) {
        const double section = 0.5 * kPi * std::clamp(k, -kSection, kSection) / kSection;
        Eigen::Vector3d p = PointOf(d.groove, phi, section).p_P_mm;
        p.x() +=
            std::abs(k) > kSection ? 0.25 * (k > 0 ? k - kSection : k + kSection) * std::abs(p.x()) : 0.0;
        const double clearance = Clearance(place, d.wheel, p);
        least_mm = std::min(least_mm, clearance);
        if (clearance < -kTouch_mm) {
          return Refused(PilgerRefusal::kWheelHitsGroove,
                         "touching at " + Degrees(pose.phi_rad) + " of the zone, alpha " + Degrees(alpha) +
                             ", the wheel's body reaches " + Text(-clearance) + " mm into the die at " +
                             Degrees(phi) + (std::abs(k) >= kSection ? " (edge of the groove)" : "") +
                             "; a smaller profile radius or range of alpha is needed");
        }
      }
    }
  }
  return {};
}

double LargestScallop(const PilgerDie& d, double alpha, double next, int looks) {
  double largest = 0.0;
  for (int i = 0; i <= looks; ++i) {
    largest = std::max(largest, ScallopHeight(d.groove, d.wheel, d.groove.zone_rad * i / looks, alpha, next));
  }
  return largest;
}

// From the effective radius first; then the measured crest, which grows with the square of the step, corrects it.
double NextAlpha(const PilgerDie& d, double alpha, double& scallop_mm) {
  double step = 1.0;
  for (int i = 0; i <= kLooksAlong; ++i) {
    const double phi = d.groove.zone_rad * i / kLooksAlong;
    const double relative =
        1.0 / d.wheel.profile_radius_mm - CurvatureAt(d.groove, d.wheel, phi, alpha).along_per_mm;
    const double a = d.groove.width.At(phi)[0] * std::cos(alpha),
                 b = d.groove.depth.At(phi)[0] * std::sin(alpha);
    step = std::min(step, std::sqrt(8.0 * d.scallop_mm / relative) / std::hypot(a, b));
  }
  for (int i = 0; i < 8; ++i) {
    const double next = std::min(alpha + step, d.alpha_to_rad);
    scallop_mm = LargestScallop(d, alpha, next, kLooksAlong);
    const double wanted = kScallopShare * d.scallop_mm;
    const bool small_enough = scallop_mm <= wanted * 1.004;
    if (small_enough && (next == d.alpha_to_rad || scallop_mm > 0.96 * wanted)) {
      break;
    }
    step = (next - alpha) * std::clamp(std::sqrt(wanted / scallop_mm), 0.3, 2.0);
  }
  return std::min(alpha + step, d.alpha_to_rad);
}

// Round-off is no acceleration.
double Snapped(double value, double scale) { return std::abs(value) < 1e-9 * scale ? 0.0 : value; }

IdleMotion Between(const AxisMotion& from, const AxisMotion& to, double duration, IdleWish wish) {
  const double scale = 1.0 + std::abs(to.value - from.value);
  IdleEnds ends{.z_n = from.value,
                .z_k = to.value,
                .v_n = Snapped(from.first, scale),
                .v_k = Snapped(to.first, scale),
                .a_n = Snapped(from.second, scale),
                .a_k = Snapped(to.second, scale),
                .duration = duration};
  if (wish == IdleWish::kSmooth) {
    return {ChooseIdleLaw(ends), 0.0};
  }
  const double a_n = ends.a_n, a_k = ends.a_k;
  ends.a_n = ends.a_k = 0.0;
  IdleMotion motion{ChooseIdleLaw(ends, true), 0.0};
  if (motion.choice.law.kind == IdleKind::kQuintic) {  // not among the paper's laws
    for (const IdleLaw& law : MakeIdleLaws(ends)) {
      const bool better = motion.choice.law.kind == IdleKind::kQuintic ||
                          law.peak_acceleration < motion.choice.law.peak_acceleration;
      if (law.exists && law.kind != IdleKind::kQuintic && better) {
        motion.choice.law = law;
        motion.choice.reason = "of the paper's laws that exist it has the lowest peak";
      }
    }
  }
  motion.acceleration_jump = std::max(std::abs(motion.choice.law.At(0.0).second - a_n),
                                      std::abs(motion.choice.law.At(duration).second - a_k));
  return motion;
}

void AddPass(const PilgerDie& d, const GrindingPass& pass, std::vector<GrindingPoint>& points) {
  const double turns = pass.c_from_rad - PoseAt(d.groove, d.wheel, 0.0, pass.alpha_rad).c_rad;
  const int steps = std::max(8, static_cast<int>(std::ceil((pass.c_to_rad - pass.c_from_rad) / d.step_rad)));
  for (int i = 0; i <= steps; ++i) {
    const double c = pass.c_from_rad + (pass.c_to_rad - pass.c_from_rad) * i / steps;
    const WheelPose pose = PoseAtC(d.groove, d.wheel, c - turns, pass.alpha_rad);
    points.push_back({c, pose.x_mm.value, pose.z_mm.value, pose.a_rad.value, true});
  }
}

void AddIdle(const PilgerDie& d, const GrindingPass& pass, double to_c_rad,
             std::vector<GrindingPoint>& points) {
  const double duration = to_c_rad - pass.c_to_rad;
  const int steps = std::max(8, static_cast<int>(std::ceil(duration / d.step_rad)));
  for (int i = 1; i < steps; ++i) {
    const double t = duration * i / steps;
    points.push_back({pass.c_to_rad + t, pass.idle[0].choice.law.At(t).z, pass.idle[1].choice.law.At(t).z,
                      pass.idle[2].choice.law.At(t).z, false});
  }
}

// Every pass's place in the turns of the die, the idle laws between, and the points.
void LayOut(const PilgerDie& d, PilgerProgram& program) {
  for (std::size_t i = 0; i < program.passes.size(); ++i) {
    GrindingPass& pass = program.passes[i];
    const double turns = kTurn * static_cast<double>(i);
    pass.c_from_rad = PoseAt(d.groove, d.wheel, 0.0, pass.alpha_rad).c_rad + turns;
    pass.c_to_rad = PoseAt(d.groove, d.wheel, d.groove.zone_rad, pass.alpha_rad).c_rad + turns;
  }
  for (std::size_t i = 0; i < program.passes.size(); ++i) {
    GrindingPass& pass = program.passes[i];
    AddPass(d, pass, program.points);
    if (i + 1 == program.passes.size()) {
      break;
    }
    const GrindingPass& next = program.passes[i + 1];
    const WheelPose from = PoseAt(d.groove, d.wheel, d.groove.zone_rad, pass.alpha_rad);
    const WheelPose to = PoseAt(d.groove, d.wheel, 0.0, next.alpha_rad);
    const double duration = next.c_from_rad - pass.c_to_rad;
    pass.idle = {Between(from.x_mm, to.x_mm, duration, d.idle), Between(from.z_mm, to.z_mm, duration, d.idle),
                 Between(from.a_rad, to.a_rad, duration, d.idle)};
    AddIdle(d, pass, next.c_from_rad, program.points);
  }
}

// A new feed for every hair's breadth of the wheel's height would double the file.
double FourDigits(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 3.0);
  return std::round(value / unit) * unit;
}

double Rounded(double mm) { return std::round(mm * 1e10) * 1e-10; }

}  // namespace

std::string_view PilgerRefusalName(PilgerRefusal refusal) {
  static constexpr std::array<std::string_view, 10> kNames = {"NONE",
                                                              "NUMBER_OUT_OF_RANGE",
                                                              "ZONE_TOO_LONG",
                                                              "GROOVE_NOT_SOUND",
                                                              "WHEEL_PROFILE_TOO_LARGE",
                                                              "WHEEL_TOO_LARGE",
                                                              "WHEEL_GOUGES",
                                                              "WHEEL_HITS_GROOVE",
                                                              "DIE_DOES_NOT_ADVANCE",
                                                              "TOO_MANY_PASSES"};
  return kNames[static_cast<std::size_t>(refusal)];
}

PilgerProgram PlanPilgerDie(const PilgerDie& d, const std::function<void(double)>& watch) {
  PilgerProgram program = CheckNumbers(d);
  if (program.refusal != PilgerRefusal::kNone) {
    return program;
  }
  program.largest_profile_radius_mm = program.least_clearance_mm = 1e9;
  for (double alpha = d.alpha_from_rad;;) {
    if (watch) {
      watch((alpha - d.alpha_from_rad) / (d.alpha_to_rad - d.alpha_from_rad));
    }
    PilgerProgram fault = CheckCurvature(d, alpha, program.largest_profile_radius_mm);
    if (fault.refusal == PilgerRefusal::kNone) {
      fault = CheckBody(d, alpha, program.least_clearance_mm);
    }
    if (fault.refusal != PilgerRefusal::kNone) {
      return fault;
    }
    GrindingPass& pass = program.passes.emplace_back();
    pass.alpha_rad = alpha;
    if (alpha >= d.alpha_to_rad) {
      break;
    }
    const double from = alpha;
    alpha = NextAlpha(d, alpha, pass.scallop_mm);
    // Steps differ along the section by less than three times: the first one tells a hopeless case at once.
    const bool hopeless = (d.alpha_to_rad - from) / (alpha - from) > 3.0 * kMostPasses;
    if (hopeless || program.passes.size() == kMostPasses) {
      return Refused(PilgerRefusal::kTooManyPasses,
                     "more than 2000 passes; a larger Rz or profile radius is needed");
    }
    program.largest_scallop_mm = std::max(program.largest_scallop_mm, pass.scallop_mm);
  }
  LayOut(d, program);
  return program;
}

std::vector<Operation> OperationsOf(const PilgerProgram& program, const PilgerDie& die) {
  std::vector<Operation> list;
  const auto add = [&](OperationKind kind, const GrindingPoint& point, double above_mm) -> Operation& {
    const WheelPlace place = PlaceOf(point.x_mm, point.z_mm + above_mm, point.a_rad, point.c_rad);
    Operation& o = list.emplace_back();
    o.kind = kind;
    o.axes = kSixAxes;
    o.x_W_mm = Rounded(place.center_P_mm.x());
    o.y_W_mm = Rounded(place.center_P_mm.y());
    o.z_W_mm = Rounded(place.center_P_mm.z());
    o.a_rad = std::atan2(-place.axis_P.y(), place.axis_P.z());
    o.b_rad = std::atan2(place.axis_P.x(), std::hypot(place.axis_P.y(), place.axis_P.z()));
    return o;
  };
  if (program.points.empty()) {
    return list;
  }
  add(OperationKind::kTraverse, program.points.front(), die.approach_mm);
  const double slowest_mm_per_s = die.groove.die_radius_mm * kTurn / die.turn_s * 0.1;
  add(OperationKind::kFeedLine, program.points.front(), 0.0).feed_mm_per_s = slowest_mm_per_s;
  for (std::size_t i = 1; i < program.points.size(); ++i) {
    const Operation before = list.back();
    Operation& o = add(OperationKind::kFeedLine, program.points[i], 0.0);
    const double way =
        std::hypot(o.x_W_mm - before.x_W_mm, o.y_W_mm - before.y_W_mm, o.z_W_mm - before.z_W_mm);
    o.feed_mm_per_s =
        FourDigits(way / ((program.points[i].c_rad - program.points[i - 1].c_rad) / kTurn * die.turn_s));
  }
  add(OperationKind::kFeedLine, program.points.back(), die.approach_mm).feed_mm_per_s = slowest_mm_per_s;
  add(OperationKind::kEnd, program.points.back(), die.approach_mm);
  return list;
}

}  // namespace lambdajet::trajectory
