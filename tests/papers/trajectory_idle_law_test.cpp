// Every printed digit of the idle-motion law of seed paper 003 (corrected): roots, peaks, bounds and tables.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iomanip>
#include <numbers>
#include <string>

#include "tests/support/figure.hpp"
#include "trajectory/core/idle_motion/idle_law.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kPhi2 = 3.420845333909;  // 196 degrees, the printed range of coordinate C

// The tables' numbers by how many decimals are printed: all must round to what is printed. Tells the worst of them at the end.
class Printed {
 public:
  Printed(const char* figure, double last_digit) : figure_(figure), last_digit_(last_digit) {}
  ~Printed() {
    std::printf("%s: %d numbers, at most %.3f of the last digit off\n", figure_, count_, worst_);
    tests::PrintFigure(figure_, worst_);
    tests::PrintFigure((std::string(figure_) + "_numbers").c_str(), count_);
  }

  void Expect(double ours, double printed) {
    const double off = std::abs(ours - printed) / last_digit_;
    EXPECT_LE(off, 0.5 + kRounding) << std::setprecision(15) << ours << " where " << printed << " is printed";
    worst_ = std::max(worst_, off);
    ++count_;
  }

 private:
  static constexpr double kRounding = 1e-2;  // of doubles, in a last digit of the tenth decimal
  const char* figure_;
  double last_digit_;
  double worst_ = 0.0;
  int count_ = 0;
};
Printed eight_decimals("idle.eight_decimals_off", 1e-8), ten_decimals("idle.ten_decimals_off", 1e-10);

// Normalised peaks |z''| phi2/|v| over r = (z_k - z_n)/(v phi2), v_k = 0; a negative number stands for "no law".
struct PeakRow {
  double r, phi1, two_zone, mirrored, quintic, bound;
};

const PeakRow kPeaks[] = {
    {-20, 0.00783164, 200.57058640, -1, 119.35821071, 82.01219331},
    {-5, 0.02984588, 52.63026005, -1, 32.75947686, 22.04536102},
    {-2, 0.06770714, 23.19986382, -1, 15.44512750, 10.09901951},
    {-1, 0.11586440, 13.55719519, -1, 9.67901235, 6.16227766},
    {-0.5, 0.17634712, 8.90741110, -1, 6.80128314, 4.23606798},
    {0, 0.33333333, 4.71238898, -1, 3.94023395, 2.41421356},
    {0.2, 0.46660005, 3.36647270, -1, 2.81681572, 1.76619038},
    {0.4, 0.66919918, 2.34727773, 1.66516288, 1.77777778, 1.21980390},
    {0.5, 0.79815875, 1.96802494, 1.96802494, 1.50000000, 1.00000000},
    {0.6, 0.94332893, 1.66516288, 2.34727773, 1.77777778, 1.21980390},
    {2 / kPi, 1.00000000, 1.57079633, 2.50736167, 1.94971390, 1.30989756},
    {0.7, -1, -1, 2.81255468, 2.27422685, 1.47703296},
    {1, -1, -1, 4.71238898, 3.94023395, 2.41421356},
    {2, -1, -1, 13.55719519, 9.67901235, 6.16227766},
};

TEST(IdleLawPaper, PeaksOverTheWholeRange) {
  for (const PeakRow& row : kPeaks) {
    SCOPED_TRACE(row.r);
    const IdleEnds ends{.z_n = 0.0, .z_k = row.r, .v_n = 1.0, .duration = 1.0};
    const IdleLaw two_zone = MakeTwoZone(ends), mirrored = MakeMirrored(ends);
    EXPECT_EQ(two_zone.exists, row.two_zone > 0);
    if (two_zone.exists) {
      eight_decimals.Expect(two_zone.phi1, row.phi1);
      eight_decimals.Expect(two_zone.peak_acceleration, row.two_zone);
    }
    EXPECT_TRUE(two_zone.exists || mirrored.exists);
    if (row.mirrored > 0) {
      ASSERT_TRUE(mirrored.exists);
      eight_decimals.Expect(mirrored.peak_acceleration, row.mirrored);
    } else {
      EXPECT_FALSE(mirrored.exists);
    }
    eight_decimals.Expect(MakeQuintic(ends).peak_acceleration, row.quintic);
    eight_decimals.Expect(BangBangBound(ends), row.bound);
  }
}

struct Example {
  const char* name;
  IdleKind kind;
  double z_n, z_k, v_n, v_k, phi1, z_a, A, quintic, bound;
};
const Example kExamples[] = {
    {"E1 return stroke", IdleKind::kTwoZone, 40, 25, 12, 0, 0.6970991740, -27.0399917602, 31.9271349902,
     21.1468393477, 13.0835804079},
    {"E2 ahead, valid", IdleKind::kTwoZone, 10, 22, 8, 0, 2.4519176200, -5.1251194215, 0.7657850387,
     3.7943902096, 2.6439378104},
    {"E2 mirrored (chosen)", IdleKind::kMirrored, 10, 22, 8, 0, 3.0298697085, 4.1474953788, 0.1009033090, -1,
     -1},
    {"E3 no root of (10)", IdleKind::kMirrored, 10, 60, 8, 0, 0.4506103903, 27.8874408674, 39.1570891820,
     20.3055444853, 12.8395757954},
    {"E5 end velocity", IdleKind::kTwoZone, 40, 25, 12, -5, 1.2079334923, -22.1067945592, 17.2295578459,
     18.5619998775, 11.3883565837},
    {"E6 negative v", IdleKind::kTwoZone, 40, 52, -12, 0, 0.7596876860, 24.8122435969, -27.9658081530,
     19.6765581853, 12.1319087188},
};

IdleLaw LawOf(const Example& e) {
  const IdleEnds ends{.z_n = e.z_n, .z_k = e.z_k, .v_n = e.v_n, .v_k = e.v_k, .duration = kPhi2};
  return e.kind == IdleKind::kMirrored ? MakeMirrored(ends) : MakeTwoZone(ends);
}

TEST(IdleLawPaper, WorkedExamples) {
  for (const Example& e : kExamples) {
    SCOPED_TRACE(e.name);
    const IdleLaw law = LawOf(e);
    ASSERT_TRUE(law.exists);
    ten_decimals.Expect(law.phi1, e.phi1);
    // Mirrored rows print the magnitude; z'' at the joint is negative there, as their own tables below show.
    const bool mirrored = e.kind == IdleKind::kMirrored;
    ten_decimals.Expect(law.z_a, mirrored ? -e.z_a : e.z_a);
    ten_decimals.Expect(law.At(mirrored ? kPhi2 - law.phi1 : law.phi1).second, law.z_a);
    ten_decimals.Expect(law.amplitude, e.A);
    ten_decimals.Expect(law.peak_acceleration, std::abs(e.z_a));
    if (e.quintic > 0) {
      ten_decimals.Expect(MakeQuintic(law.ends).peak_acceleration, e.quintic);
      ten_decimals.Expect(BangBangBound(law.ends), e.bound);
    }
  }
}

TEST(IdleLawPaper, CoordinateFromRestToRest) {
  const IdleEnds ends{.z_n = -20, .z_k = 20, .duration = kPhi2};
  ten_decimals.Expect(MakeCycloid(ends).peak_acceleration, 21.4769685805);
  ten_decimals.Expect(MakeQuintic(ends).peak_acceleration, 19.7347889408);
  ten_decimals.Expect(BangBangBound(ends), 13.6726628489);
  EXPECT_FALSE(MakeTwoZone(ends).exists);  // v = 0: (10) gives phi1 = 0
  EXPECT_EQ(ChooseIdleLaw(ends).law.kind, IdleKind::kQuintic);
}

TEST(IdleLawPaper, TooFarAheadTakesTheMirroredLaw) {
  const IdleEnds ends{.z_n = 10, .z_k = 60, .v_n = 8, .duration = kPhi2};
  EXPECT_FALSE(MakeTwoZone(ends).exists);
  EXPECT_TRUE(MakeMirrored(ends).exists);
}

struct Row {
  double z, first, second;
};
void ExpectTable(const IdleLaw& law, const Row (&rows)[11]) {
  for (int i = 0; i <= 10; ++i) {
    SCOPED_TRACE(i);
    const IdlePoint p = law.At(kPhi2 * i / 10);
    ten_decimals.Expect(p.z, rows[i].z);
    ten_decimals.Expect(p.first, rows[i].first);
    ten_decimals.Expect(p.second, rows[i].second);
  }
}

const Row kE1[11] = {
    {40.0000000000, 12.0000000000, 0},
    {43.7104031285, 8.6079894965, -18.8396016299},
    {45.3231851930, 0.3495805287, -27.0285154915},
    {43.9039265401, -8.3787433600, -22.3636034640},
    {39.9449314823, -14.0547393687, -9.9688371307},
    {34.8357629681, -15.0080309938, 4.0901297843},
    {30.1574250848, -11.8088516590, 13.4176767209},
    {26.9689925300, -6.7567644007, 14.7703537400},
    {25.4438094219, -2.4586672173, 9.6251860007},
    {25.0299987838, -0.3462136712, 2.9568102044},
    {25.0000000000, 0, 0},
};
const Row kE1Quintic[11] = {
    {40.0000000000, 12.0000000000, 0},
    {43.7619221475, 9.1404738963, -15.0087715978},
    {45.8568555941, 2.7764113266, -20.8535926321},
    {45.5795136548, -4.3311976757, -19.7202135977},
    {43.0412113728, -10.1690745152, -13.7943849895},
    {38.9140850011, -13.4716520347, -5.2618573022},
    {34.1753114836, -13.7210745152, 3.6916189692},
    {29.8513279374, -11.1471976757, 10.8802933300},
    {26.7620511336, -6.7275886734, 14.1184152852},
    {25.2650969795, -2.1875261037, 11.2202343402},
    {25.0000000000, 0, 0},
};
const Row kE2[11] = {
    {10.0000000000, 8.0000000000, 0},
    {12.7961129705, 8.1900733281, -3.3816809535},
    {15.3596682242, 6.7886587741, -4.0996742397},
    {17.4448846014, 5.4125639458, -3.9245769075},
    {19.0720423060, 4.1176380322, -3.6263640116},
    {20.2759473837, 2.9445033825, -3.2143906111},
    {21.1046834861, 1.9299617049, -2.7015804781},
    {21.6181034673, 1.1058395818, -2.1040206735},
    {21.8859517756, 0.4979900573, -1.4404568902},
    {21.9856765417, 0.1254816166, -0.7317053920},
    {22.0000000000, 0, 0},
};
const Row kE3[11] = {
    {10.0000000000, 8.0000000000, 0},
    {12.7628011509, 8.3021387848, 2.5914891358},
    {15.8647250962, 10.1874297921, 8.7315292936},
    {19.9837673269, 14.2209372494, 14.3794658479},
    {25.7377356055, 19.4708994245, 15.2383236187},
    {33.2048875330, 23.8346028455, 9.0983106466},
    {41.6787487650, 25.0238153029, -2.8252280772},
    {49.8066666658, 21.7247428706, -16.2598236082},
    {56.0705658830, 14.3494459316, -25.7966377066},
    {59.3959857743, 5.0451696138, -25.9154879276},
    {60.0000000000, 0, 0},
};
const Row kE5[11] = {
    {40.0000000000, 12.0000000000, 0},
    {43.9151018821, 10.3455035495, -9.5129832509},
    {46.7352143055, 5.7040563750, -17.1742962639},
    {47.5784838319, -1.0208994205, -21.4926901935},
    {45.9498676837, -8.4700856535, -20.6947269491},
    {42.0092651985, -13.9476054829, -9.9450703635},
    {36.9380933994, -14.8892127679, 4.1204610155},
    {32.2857333433, -11.8566408522, 12.0238635852},
    {28.9415602969, -7.8011752954, 10.2521743664},
    {26.7470838013, -5.4202205504, 3.5386287379},
    {25.0000000000, -5.0000000000, 0},
};

TEST(IdleLawPaper, TablesOfTheExamples) {
  const IdleEnds e1{.z_n = 40, .z_k = 25, .v_n = 12, .duration = kPhi2};
  ExpectTable(MakeTwoZone(e1), kE1);
  ExpectTable(MakeQuintic(e1), kE1Quintic);
  ExpectTable(MakeMirrored({.z_n = 10, .z_k = 22, .v_n = 8, .duration = kPhi2}), kE2);
  ExpectTable(MakeMirrored({.z_n = 10, .z_k = 60, .v_n = 8, .duration = kPhi2}), kE3);
  ExpectTable(MakeTwoZone({.z_n = 40, .z_k = 25, .v_n = 12, .v_k = -5, .duration = kPhi2}), kE5);
}

// As printed, (9) has its second and third coefficient twice too big: it neither joins nor ends.
TEST(IdleLawPaper, PrintedNinthEquationNeitherJoinsNorEnds) {
  const double v = 12, z_k = 25,
               phi1 = MakeTwoZone({.z_n = 40, .z_k = 25, .v_n = 12, .duration = kPhi2}).phi1;
  const double delta = kPhi2 - phi1, unit = v * delta * delta / (kPi * phi1);
  const auto printed = [&](double x) {
    return z_k + unit * (3.0 / 8.0 - 0.25 * std::cos(x) + std::cos(2 * x) / 8.0);
  };
  eight_decimals.Expect(printed(kPi), 55.48816811);
  eight_decimals.Expect(printed(0.0) - z_k, 10.16272270);
}

// Against the quintic the paper's law is worse below r = 0.58399959 and better only up to 2/pi.
TEST(IdleLawPaper, IsBetterThanTheQuinticOnlyInANarrowWindow) {
  const auto ratio = [](double r) {
    const IdleEnds ends{.z_n = 0, .z_k = r, .v_n = 1, .duration = 1};
    return MakeTwoZone(ends).peak_acceleration / MakeQuintic(ends).peak_acceleration;
  };
  EXPECT_GT(ratio(0.58399959 - 1e-6), 1.0);
  EXPECT_LT(ratio(0.58399959 + 1e-6), 1.0);
  EXPECT_NEAR(ratio(0.1124), 1.186089, 1e-6);
  EXPECT_NEAR(ratio(-1e7), 1.709466, 1e-5);
  EXPECT_NEAR(ratio(2 / kPi), 0.8057, 5e-5);
}

// Section by section what the paper's law has at its ends and joint, and where its second zone peaks.
TEST(IdleLawPaper, EndsJointAndPeaksOfTheZones) {
  const double v = 12.0;
  const IdleLaw law = MakeTwoZone({.z_n = 40, .z_k = 25, .v_n = v, .duration = kPhi2});
  const double delta = kPhi2 - law.phi1;
  ten_decimals.Expect(law.At(law.phi1).z, 45.3254454098);
  EXPECT_NEAR(law.At(law.phi1).z - 25.0, v * delta * delta / (2 * kPi * law.phi1), 1e-12);
  EXPECT_NEAR(law.At(law.phi1).first, 0.0, 1e-12);
  EXPECT_NEAR(law.At(law.phi1).third, 0.0, 1e-9);
  EXPECT_NEAR(law.At(law.phi1 * (1 + 1e-12)).third, 0.0, 1e-9);
  EXPECT_NEAR(law.At(0.0).third, -kPi * kPi * v / (4 * law.phi1 * law.phi1), 1e-12);
  EXPECT_NEAR(law.At(kPhi2).third, 0.0, 1e-9);
  const double at_second_peak = kPhi2 - delta / kPi * std::acos(0.25);
  EXPECT_NEAR(law.At(at_second_peak).second, -9.0 / 16.0 * law.z_a, 1e-9);
  const double at_return_peak = kPhi2 - delta * 2.0 / 3.0;
  EXPECT_NEAR(law.At(at_return_peak).first, -0.75 * std::sqrt(3.0) * law.amplitude / delta, 1e-9);
  // (10) has the other root on the negative side: their product is -phi2^2/3.
  const double p = kPhi2 + kPi * 15.0 / v;
  EXPECT_NEAR(3 * law.phi1 * law.phi1 + 2 * p * law.phi1 - kPhi2 * kPhi2, 0.0, 1e-12);
}

TEST(IdleLawPaper, SecondDerivativesOfThePrintedNinthEquation) {
  const IdleLaw law = MakeTwoZone({.z_n = 40, .z_k = 25, .v_n = 12, .duration = kPhi2});
  const double delta = kPhi2 - law.phi1, w = kPi / delta, unit = 12 * delta * delta / (kPi * law.phi1);
  const auto second = [&](double x) { return unit * w * w * (0.25 * std::cos(x) - 0.5 * std::cos(2 * x)); };
  eight_decimals.Expect(second(kPi), -40.55998764);
  eight_decimals.Expect(second(0.0), -13.51999588);
}

TEST(IdleLawPaper, RestToRestPeaksInUnitsOfTheStroke) {
  const IdleEnds unit{.z_n = 0, .z_k = 1, .duration = 1};
  eight_decimals.Expect(BangBangBound(unit), 4.0);
  eight_decimals.Expect(MakeSimpleHarmonic(unit).peak_acceleration, 4.93480220);
  eight_decimals.Expect(MakeQuintic(unit).peak_acceleration, 5.77350269);
  eight_decimals.Expect(MakeCycloid(unit).peak_acceleration, 6.28318531);
  // v -> 0: the two-zone law becomes a double harmonic that starts with its peak.
  eight_decimals.Expect(MakeTwoZone({.z_n = 0, .z_k = 1, .v_n = -1e-9, .duration = 1}).peak_acceleration,
                        9.86960440);
  const IdleEnds e4{.z_n = -20, .z_k = 20, .duration = kPhi2};
  ten_decimals.Expect(MakeSimpleHarmonic(e4).peak_acceleration, 16.8679716785);
  ten_decimals.Expect(MakeSimpleHarmonic(e4).acceleration_jump, 16.8679716785);
  ten_decimals.Expect(kPi * kPi * 40 / (kPhi2 * kPhi2), 33.7359433569);
  EXPECT_NEAR(MakeTwoZone({.z_n = -20, .z_k = 20, .v_n = -1e-10, .duration = kPhi2}).peak_acceleration,
              33.7359433569, 1e-8);
}

TEST(IdleLawPaper, SimpleHarmonicIsTheLowestWhereJumpsAreAllowed) {
  const IdleEnds ends{.z_n = -20, .z_k = 20, .duration = kPhi2};
  const IdleChoice choice = ChooseIdleLaw(ends, true);
  EXPECT_EQ(choice.law.kind, IdleKind::kSimpleHarmonic);
  eight_decimals.Expect(choice.peak_to_bound_ratio(), 4.93480220 / 4.0);
  ten_decimals.Expect(choice.law.At(0.0).second, 16.8679716785);
  ten_decimals.Expect(choice.law.At(kPhi2).second, -16.8679716785);
  EXPECT_NEAR(choice.law.At(kPhi2).z, 20.0, 1e-12);
  EXPECT_EQ(ChooseIdleLaw(ends).law.acceleration_jump, 0.0);
}

TEST(IdleLawPaper, RefusedCasesAreNamed) {
  const IdleEnds ahead{.z_n = 10, .z_k = 60, .v_n = 8, .duration = kPhi2};
  EXPECT_EQ(MakeTwoZone(ahead).refusal, IdleRefusal::kTargetTooFarAhead);
  EXPECT_EQ(MakeCycloid(ahead).refusal, IdleRefusal::kVelocitiesDiffer);
  EXPECT_EQ(MakeSimpleHarmonic(ahead).refusal, IdleRefusal::kVelocitiesDiffer);
  EXPECT_EQ(MakeTwoZone({.z_n = 0, .z_k = 1, .duration = 1}).refusal, IdleRefusal::kNoVelocityChange);
  EXPECT_EQ(MakeMirrored({.z_n = 0, .z_k = 1, .v_n = 1, .a_k = 1, .duration = 1}).refusal,
            IdleRefusal::kEndAcceleration);
  EXPECT_EQ(MakeQuintic({.z_n = 0, .z_k = 1}).refusal, IdleRefusal::kEndsNotFinite);
  EXPECT_FALSE(ChooseIdleLaw({.z_n = 0, .z_k = 1, .duration = -1}).law.exists);
  for (const IdleLaw& law : MakeIdleLaws(ahead)) {
    EXPECT_EQ(law.exists, law.refusal == IdleRefusal::kNone);
  }
}

// The ranges of the claim "minimum acceleration" as far as they are printed.
TEST(IdleLawPaper, DistanceFromTheBoundAndTheQuinticOverTheRange) {
  double least_to_bound = 1e9, most_near_045 = 0.0;
  for (int i = -40000; i <= 6366; ++i) {
    const double r = i * 1e-4;
    const IdleEnds ends{.z_n = 0, .z_k = r, .v_n = 1, .duration = 1};
    const IdleLaw law = MakeTwoZone(ends);
    ASSERT_TRUE(law.exists);
    const double to_bound = law.peak_acceleration / BangBangBound(ends);
    least_to_bound = std::min(least_to_bound, to_bound);
    if (r <= 0.3) {
      EXPECT_GE(to_bound, 1.895);
      EXPECT_LE(to_bound, 2.475);
    }
    if (r > 0.3) {
      most_near_045 = std::max(most_near_045, law.peak_acceleration / MakeQuintic(ends).peak_acceleration);
    }
  }
  EXPECT_NEAR(least_to_bound, 1.199, 6e-4);
  EXPECT_NEAR(most_near_045, 1.36, 5e-3);
}

}  // namespace
}  // namespace lambdajet::trajectory
