// The pilger die's program: every contact lies on the groove and normal to it, crests stay below Rz, nothing is gouged, zones
// join without a break, and what is written is what was meant; measured by other means than the generator's own.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "trajectory/core/grinding/pilger_program.hpp"
#include "trajectory/core/part_program/cldata_reader.hpp"
#include "trajectory/core/part_program/cldata_verification.hpp"
#include "trajectory/core/part_program/cldata_writer.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector3d;

constexpr double kDeg = std::numbers::pi / 180.0;

PilgerDie Die(IdleWish idle = IdleWish::kSmooth) {
  PilgerDie d;
  d.groove.die_radius_mm = 150;
  d.groove.zone_rad = 164 * kDeg;
  std::vector<double> angle,
      width = {23.4, 21.973, 20.392, 19.007, 17.987, 17.275, 16.816, 16.554, 16.435, 16.404, 16.4};
  for (const double deg : {0, 12, 28, 46, 64, 82, 100, 118, 136, 150, 164}) {
    angle.push_back(deg * kDeg);
  }
  d.groove.width = *HalfAxisLaw::MakeTable(angle, width);
  d.groove.depth = HalfAxisLaw::MakePower(d.groove.zone_rad, 22.4, 15.9, 3);
  d.wheel = {150, 7};
  d.alpha_from_rad = -56 * kDeg;
  d.alpha_to_rad = 56 * kDeg;
  d.scallop_mm = 0.05;
  d.step_rad = 2 * kDeg;
  d.turn_s = 12;
  d.idle = idle;
  return d;
}

TEST(HalfAxisLaw, MeetsItsTableAndItsOwnDerivatives) {
  const PilgerDie d = Die();
  EXPECT_NEAR(d.groove.width.At(46 * kDeg)[0], 19.007, 1e-12);
  EXPECT_NEAR(d.groove.width.At(164 * kDeg)[0], 16.4, 1e-12);
  const HalfAxisLaw polynomial = HalfAxisLaw::MakePolynomial(2.0, {3, -1, 2, 0.5, -0.25});
  constexpr double h = 1e-5;
  for (const HalfAxisLaw* law : {&d.groove.width, &d.groove.depth, &polynomial}) {
    for (double at = 0.05; at < 1.9; at += 0.0371) {
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(law->At(at)[k + 1], (law->At(at + h)[k] - law->At(at - h)[k]) / (2 * h), 2e-6)
            << at << " " << k;
      }
    }
  }
  EXPECT_NEAR(polynomial.At(2.0)[0], 3 - 1 + 2 + 0.5 - 0.25, 1e-12);
  EXPECT_FALSE(HalfAxisLaw::MakeTable({0, 1, 1}, {1, 2, 3}));
  EXPECT_FALSE(HalfAxisLaw::MakeTable({0}, {1}));
}

TEST(WheelPath, DerivativesByTheTurnAreThoseOfTheMotion) {
  const PilgerDie d = Die();
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) {
    const double alpha = std::uniform_real_distribution<>(-0.97, 0.97)(random);
    const double c = std::uniform_real_distribution<>(0.1, 2.7)(random);
    constexpr double h = 1e-4;
    const WheelPose low = PoseAtC(d.groove, d.wheel, c - h, alpha),
                    here = PoseAtC(d.groove, d.wheel, c, alpha),
                    high = PoseAtC(d.groove, d.wheel, c + h, alpha);
    EXPECT_NEAR(here.c_rad, c, 1e-13);
    for (const auto axis : {&WheelPose::x_mm, &WheelPose::z_mm, &WheelPose::a_rad}) {
      EXPECT_NEAR((here.*axis).first, ((high.*axis).value - (low.*axis).value) / (2 * h), 1e-5);
      EXPECT_NEAR((here.*axis).second, ((high.*axis).first - (low.*axis).first) / (2 * h), 1e-4);
    }
  }
}

// Distance of a surface point from the circle along which the wheel's rim is rounded: no formula of the generator.
double RimDistance(const WheelPlace& place, const Wheel& wheel, const Vector3d& p) {
  const Vector3d q = p - place.center_P_mm;
  const double height = q.dot(place.axis_P);
  return std::hypot((q - height * place.axis_P).norm() - (wheel.radius_mm - wheel.profile_radius_mm), height);
}

Vector3d Surface(const Groove& g, double phi, double alpha) {
  const double rho = g.die_radius_mm - g.depth.At(phi)[0] * std::cos(alpha);
  return {g.width.At(phi)[0] * std::sin(alpha), -rho * std::sin(phi), rho * std::cos(phi)};
}

// From the written program: the groove's point nearest to each wheel is at the rounding's distance, and is where it should be.
TEST(PilgerProgram, EveryContactLiesOnTheGrooveAndNormalToIt) {
  const PilgerDie d = Die();
  std::vector<double> told;
  const PilgerProgram program = PlanPilgerDie(d, [&told](double ratio) { told.push_back(ratio); });
  ASSERT_EQ(program.refusal, PilgerRefusal::kNone) << program.message;
  ASSERT_EQ(told.size(), program.passes.size());
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_EQ(told.front(), 0.0);
  EXPECT_EQ(told.back(), 1.0);
  const CldataText text = WriteCldata(OperationsOf(program, d), "die");
  const PartProgram read = ReadCldata(text.text, {.axes = kSixAxes});
  ASSERT_TRUE(read.faults.empty());
  std::vector<const Operation*> moves;
  for (const Operation& o : read.operations) {
    if (o.kind == OperationKind::kFeedLine) {
      moves.push_back(&o);
    }
  }
  ASSERT_EQ(moves.size(), program.points.size() + 1);  // and the retreat
  std::size_t pass = 0;
  double worst_gap = 0.0, worst_normal = 0.0;
  for (std::size_t i = 0; i < program.points.size(); ++i) {
    if (i > 0 && program.points[i].cutting && !program.points[i - 1].cutting) {
      ++pass;
    }
    if (!program.points[i].cutting) {
      continue;
    }
    const Operation& o = *moves[i];
    const WheelPlace place{
        {o.x_W_mm, o.y_W_mm, o.z_W_mm},
        {std::sin(o.b_rad), -std::sin(o.a_rad) * std::cos(o.b_rad), std::cos(o.a_rad) * std::cos(o.b_rad)}};
    // Newton on the distance, from near the intended contact.
    double phi = program.points[i].c_rad - 2 * std::numbers::pi * static_cast<double>(pass),
           alpha = program.passes[pass].alpha_rad;
    const auto distance = [&](double p, double a) {
      return RimDistance(place, d.wheel, Surface(d.groove, p, a));
    };
    for (int k = 0; k < 12; ++k) {
      constexpr double h = 1e-4;
      const double f = distance(phi, alpha);
      const double gp = (distance(phi + h, alpha) - distance(phi - h, alpha)) / (2 * h);
      const double ga = (distance(phi, alpha + h) - distance(phi, alpha - h)) / (2 * h);
      const double pp = (distance(phi + h, alpha) - 2 * f + distance(phi - h, alpha)) / (h * h);
      const double aa = (distance(phi, alpha + h) - 2 * f + distance(phi, alpha - h)) / (h * h);
      const double pa = (distance(phi + h, alpha + h) - distance(phi + h, alpha - h) -
                         distance(phi - h, alpha + h) + distance(phi - h, alpha - h)) /
                        (4 * h * h);
      const double det = pp * aa - pa * pa;
      ASSERT_GT(det, 0.0);
      phi -= (aa * gp - pa * ga) / det;
      alpha -= (pp * ga - pa * gp) / det;
    }
    worst_gap = std::max(worst_gap, std::abs(distance(phi, alpha) - d.wheel.profile_radius_mm));
    EXPECT_NEAR(alpha, program.passes[pass].alpha_rad, 1e-6);
    // Normal: the contact's own tangents are square to the direction from the centre, which is square to the wheel's axis.
    const double wanted_phi =
        PoseAtC(d.groove, d.wheel, program.points[i].c_rad - 2 * std::numbers::pi * static_cast<double>(pass),
                program.passes[pass].alpha_rad)
            .phi_rad;
    const Vector3d contact = Surface(d.groove, wanted_phi, program.passes[pass].alpha_rad);
    const Vector3d radius = (place.center_P_mm - contact).normalized();
    const auto tangent = [&](double by_phi, double by_alpha) {
      const auto at = [&](double h) {
        return Surface(d.groove, wanted_phi + h * by_phi, program.passes[pass].alpha_rad + h * by_alpha);
      };
      constexpr double h = 5e-4;
      return Vector3d((8.0 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))).normalized());
    };
    const Vector3d along = tangent(1, 0), section = tangent(0, 1);
    worst_normal = std::max({worst_normal, std::abs(radius.dot(along)), std::abs(radius.dot(section)),
                             std::abs(radius.dot(place.axis_P))});
    EXPECT_NEAR((place.center_P_mm - contact).norm(), d.wheel.radius_mm, 1e-9);
  }
  EXPECT_LE(worst_gap, 1e-9);
  EXPECT_LE(worst_normal, 1e-9);
  RecordProperty("worst_gap_mm", std::to_string(worst_gap));
}

// Clearance of a point from the wheel as it sweeps by on one pass.
double SweptClearance(const PilgerDie& d, double alpha, const Vector3d& p, double phi) {
  const auto at = [&](double s) {
    const WheelPose pose = PoseAt(d.groove, d.wheel, s, alpha);
    return Clearance(PlaceOf(pose.x_mm.value, pose.z_mm.value, pose.a_rad.value, pose.c_rad), d.wheel, p);
  };
  double best = phi, least = 1e9;
  for (double s = phi - 0.06; s <= phi + 0.06; s += 0.002) {
    const double clearance = at(s);
    if (clearance < least) {
      least = clearance;
      best = s;
    }
  }
  for (double step = 0.001; step > 1e-8; step *= 0.5) {
    for (const double s : {best - step, best + step}) {
      const double clearance = at(s);
      if (clearance < least) {
        least = clearance;
        best = s;
      }
    }
  }
  return least;
}

TEST(PilgerProgram, CrestsStayBelowRzAndNothingIsGouged) {
  const PilgerDie d = Die();
  const PilgerProgram program = PlanPilgerDie(d);
  ASSERT_EQ(program.refusal, PilgerRefusal::kNone) << program.message;
  EXPECT_LE(program.largest_scallop_mm, d.scallop_mm);
  std::mt19937_64 random(4);
  double highest = 0.0;
  for (int i = 0; i < 150; ++i) {
    const std::size_t pass = random() % (program.passes.size() - 1);
    const double from = program.passes[pass].alpha_rad, to = program.passes[pass + 1].alpha_rad;
    const double alpha = from + (to - from) * (0.3 + 0.4 * std::generate_canonical<double, 53>(random));
    const double phi = d.groove.zone_rad * (0.03 + 0.94 * std::generate_canonical<double, 53>(random));
    const GroovePoint at = PointOf(d.groove, phi, alpha);
    const auto clearance = [&](double height) {
      const Vector3d p = at.p_P_mm + height * at.normal_P;
      return std::min(SweptClearance(d, from, p, phi), SweptClearance(d, to, p, phi));
    };
    EXPECT_GE(clearance(0.0), -1e-6) << "gouged at " << phi / kDeg << " alpha " << alpha / kDeg;
    double low = 0.0, high = 2 * d.scallop_mm;
    ASSERT_LE(clearance(high), 0.0);
    for (int k = 0; k < 16; ++k) {
      const double middle = 0.5 * (low + high);
      (clearance(middle) > 0.0 ? low : high) = middle;
    }
    highest = std::max(highest, high);
    EXPECT_LE(high, d.scallop_mm * (1 + 1e-4)) << phi / kDeg << " alpha " << alpha / kDeg;
  }
  EXPECT_GE(highest, 0.7 * d.scallop_mm) << "steps are needlessly small";
}

TEST(PilgerProgram, SmoothZonesJoinWithoutABreak) {
  PilgerDie d = Die();
  d.step_rad = 1 * kDeg;
  const PilgerProgram program = PlanPilgerDie(d);
  ASSERT_EQ(program.refusal, PilgerRefusal::kNone) << program.message;
  for (std::size_t i = 0; i + 1 < program.passes.size(); ++i) {
    const GrindingPass& pass = program.passes[i];
    const WheelPose from = PoseAt(d.groove, d.wheel, d.groove.zone_rad, pass.alpha_rad);
    const WheelPose to = PoseAt(d.groove, d.wheel, 0.0, program.passes[i + 1].alpha_rad);
    const double duration = program.passes[i + 1].c_from_rad - pass.c_to_rad;
    EXPECT_NEAR(duration / kDeg, 196, 6);
    const AxisMotion begins[3] = {from.x_mm, from.z_mm, from.a_rad}, ends[3] = {to.x_mm, to.z_mm, to.a_rad};
    for (std::size_t k = 0; k < 3; ++k) {
      const IdleLaw& law = pass.idle[k].choice.law;
      const IdlePoint a = law.At(0.0), b = law.At(duration);
      EXPECT_NEAR(a.z, begins[k].value, 1e-9);
      EXPECT_NEAR(a.first, begins[k].first, 1e-9);
      EXPECT_NEAR(a.second, begins[k].second, 1e-7);
      EXPECT_NEAR(b.z, ends[k].value, 1e-9);
      EXPECT_NEAR(b.first, ends[k].first, 1e-9);
      EXPECT_NEAR(b.second, ends[k].second, 1e-7);
      EXPECT_EQ(pass.idle[k].acceleration_jump, 0.0);
      EXPECT_GE(pass.idle[k].choice.peak_to_bound_ratio(), 1.0);
    }
  }
  const PartProgram read = ReadCldata(WriteCldata(OperationsOf(program, d), "die").text, {.axes = kSixAxes});
  const ProgramVerification v = VerifyProgram(read.operations);
  EXPECT_EQ(v.over, VerifyArgument::kTurn);
  for (const ProgramBreak& b : v.breaks) {
    ADD_FAILURE() << "break of order " << b.order << " of " << v.series[b.coordinate].name << " at C "
                  << b.argument / kDeg << " size " << b.size;
  }
}

// The paper's laws end without acceleration; where the passes have some, the jump is told, and the verifier finds it.
TEST(PilgerProgram, ThePapersLawsTellTheirJumpsAndTheVerifierFindsThem) {
  PilgerDie d = Die(IdleWish::kPaper);
  d.step_rad = 1 * kDeg;
  d.scallop_mm = 0.5;
  const PilgerProgram program = PlanPilgerDie(d);
  ASSERT_EQ(program.refusal, PilgerRefusal::kNone) << program.message;
  double largest = 0.0;
  for (std::size_t i = 0; i + 1 < program.passes.size(); ++i) {
    for (const IdleMotion& motion : program.passes[i].idle) {
      EXPECT_NE(motion.choice.law.kind, IdleKind::kQuintic);
    }
    largest = std::max(largest, program.passes[i].idle[1].acceleration_jump);
  }
  ASSERT_GT(largest, 1.0);
  const PartProgram read = ReadCldata(WriteCldata(OperationsOf(program, d), "die").text, {.axes = kSixAxes});
  const ProgramVerification v = VerifyProgram(read.operations);
  double found = 0.0;
  for (const ProgramBreak& b : v.breaks) {
    // A zone of the law that is shorter than the verifier's four points rises as fast as a kink to it.
    EXPECT_GE(b.order, 1);
    EXPECT_TRUE(b.order == 2 || b.coordinate != 1) << "at C " << b.argument / kDeg << " size " << b.size;
    found = std::max(found, b.coordinate == 1 ? std::abs(b.size) : 0.0);
  }
  EXPECT_NEAR(found, largest, 0.1 * largest);
}

TEST(PilgerProgram, RefusesByName) {
  const auto refusal = [](auto change) {
    PilgerDie d = Die();
    change(d);
    const PilgerProgram program = PlanPilgerDie(d);
    EXPECT_TRUE(program.points.empty());
    EXPECT_FALSE(program.message.empty());
    return program.refusal;
  };
  EXPECT_EQ(refusal([](PilgerDie& d) { d.wheel.profile_radius_mm = 17; }),
            PilgerRefusal::kWheelProfileTooLarge);
  EXPECT_EQ(refusal([](PilgerDie& d) { d.alpha_from_rad = -1.45; }), PilgerRefusal::kWheelHitsGroove);
  EXPECT_EQ(refusal([](PilgerDie& d) { d.groove.zone_rad = 3.3; }), PilgerRefusal::kZoneTooLong);
  EXPECT_EQ(refusal([](PilgerDie& d) { d.scallop_mm = 0; }), PilgerRefusal::kNumberOutOfRange);
  EXPECT_EQ(refusal([](PilgerDie& d) { d.scallop_mm = 1e-9; }), PilgerRefusal::kTooManyPasses);
  EXPECT_EQ(refusal([](PilgerDie& d) { d.groove.depth = HalfAxisLaw::MakePolynomial(1, {-1}); }),
            PilgerRefusal::kGrooveNotSound);
  // A pocket in the groove's depth, hollow along the die with a radius below the wheel's.
  const PilgerRefusal pocket = refusal([](PilgerDie& d) {
    d.groove.zone_rad = 40 * kDeg;
    d.groove.depth = HalfAxisLaw::MakePolynomial(d.groove.zone_rad, {15, 60, -60});
    d.alpha_from_rad = -0.05;
  });
  EXPECT_TRUE(pocket == PilgerRefusal::kWheelTooLarge || pocket == PilgerRefusal::kDieDoesNotAdvance);
}

TEST(Verification, FindsBreaksOfEveryOrderWithTheirSizes) {
  // A wheel's program made by hand: X over C with a jump, a kink and a step of curvature in turn.
  for (int order = 0; order < 3; ++order) {
    std::vector<Operation> list;
    for (int i = 0; i <= 200; ++i) {
      const double c = 0.02 * i, after = std::max(0.0, c - 2.0);
      const double extra = order == 0   ? (i > 100 ? 0.3 : 0.0)
                           : order == 1 ? 0.5 * after
                                        : 0.5 * 4.0 * after * after;
      const double x = 10 * std::sin(c) + extra;
      const WheelPlace place = PlaceOf(x, 300 + 5 * std::cos(2 * c), 0.2 * std::sin(c), c);
      Operation& o = list.emplace_back();
      o.kind = i == 0 ? OperationKind::kTraverse : OperationKind::kFeedLine;
      o.axes = kSixAxes;
      o.line = static_cast<std::uint32_t>(i + 1);
      o.x_W_mm = place.center_P_mm.x();
      o.y_W_mm = place.center_P_mm.y();
      o.z_W_mm = place.center_P_mm.z();
      o.a_rad = std::atan2(-place.axis_P.y(), place.axis_P.z());
      o.b_rad = std::atan2(place.axis_P.x(), std::hypot(place.axis_P.y(), place.axis_P.z()));
    }
    SCOPED_TRACE(order);
    const ProgramVerification v = VerifyProgram(list);
    ASSERT_EQ(v.breaks.size(), 1u);
    EXPECT_EQ(v.breaks[0].coordinate, 0u);
    EXPECT_EQ(v.breaks[0].order, order);
    EXPECT_EQ(v.breaks[0].line, order == 0 ? 102u : 101u);
    const double size = order == 0 ? 0.3 : order == 1 ? 0.5 : 4.0;
    EXPECT_NEAR(v.breaks[0].size, size, 0.03 * size);
    EXPECT_NEAR(v.series[1].peak_second, 20.0, 0.3);
  }
}

TEST(Verification, NamesCornersAndStepsOfCurvatureOfAContour) {
  const PartProgram p = ReadCldata(
      "FROM/0,0,0\nFEDRAT/600,MMPM\nGOTO/100,0,0\nCIRCLE/100,20,0,0,0,1,20\nGOTO/120,20,0\nGOTO/"
      "120,50,0\nGOTO/0,50,0\n"
      "RAPID\nGOTO/0,0,0\nGOTO/5,5,0\nFINI\n");
  ASSERT_TRUE(p.faults.empty());
  const ProgramVerification v = VerifyProgram(p.operations);
  EXPECT_EQ(v.begins.size(), 2u);
  ASSERT_EQ(v.breaks.size(), 4u);
  EXPECT_EQ(v.breaks[0].line, 5u);  // into the arc: Y steps to 1/20
  EXPECT_EQ(v.breaks[0].order, 2);
  EXPECT_NEAR(v.breaks[0].size, 0.05, 1e-12);
  EXPECT_EQ(v.breaks[1].line, 6u);  // out of it: X steps back from -1/20
  EXPECT_NEAR(v.breaks[1].size, 0.05, 1e-12);
  EXPECT_EQ(v.breaks[2].line, 7u);  // a corner, in both coordinates
  EXPECT_EQ(v.breaks[2].order, 1);
  EXPECT_NEAR(v.breaks[2].size, -1.0, 1e-12);
}

}  // namespace
}  // namespace lambdajet::trajectory
