// The numbers of seed paper 002 (service area for tilted drilling), as corrected: every printed digit.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "kinematics/core/service_area.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr double kDeg = M_PI / 180.0;
constexpr double kDigits6 = 6e-7;
constexpr double kDigits9 = 6e-10;

ServiceAreaMachine Base() {
  ServiceAreaMachine machine;
  machine.tilt_rad = 15.0 * kDeg;
  return machine;
}

TEST(PaperServiceArea, ReproducesEveryIntermediatePointOfTheBaseSet) {
  const PaperServiceArea r = PaperClosedForm(Base());
  ASSERT_TRUE(r.defined);
  EXPECT_NEAR(r.c1_mm, 292.462835271, kDigits9);
  EXPECT_NEAR(r.c2, -0.4, 1e-15);
  EXPECT_NEAR(r.x_E_mm, -358.853345572, kDigits9);
  EXPECT_NEAR(r.x_M_mm, -283.099552062, kDigits9);
  EXPECT_NEAR(r.y_M_mm, -161.297343905, kDigits9);
  EXPECT_NEAR(r.k, -8.888888889, kDigits9);
  EXPECT_NEAR(r.x_A_mm, -323.818408333, kDigits9);
  EXPECT_NEAR(r.x_B_mm, -352.380249028, kDigits9);
  EXPECT_NEAR(r.x_K_mm, 459.400447938, kDigits9);
  EXPECT_NEAR(r.x_D_mm, 190.269816594, kDigits9);
  EXPECT_NEAR(r.y_D_mm, 1038.702656095, kDigits9);
  EXPECT_NEAR(r.s1_mm2, -10662.578068539, kDigits9);
  EXPECT_NEAR(r.s2_mm2, 485146.217992039, kDigits9);
  EXPECT_NEAR(r.s3_mm2, 4699.505118356, kDigits9);
  EXPECT_NEAR(r.s4_mm2, 17573.989089869, kDigits9);
  EXPECT_NEAR(r.area_mm2, 923218.311903975, 2 * kDigits9);
  EXPECT_FALSE(r.in_order);
}

TEST(PaperServiceArea, ShowsWhatTheLiteralPrintGives) {
  const PaperServiceArea r = PaperAsPrinted(Base());
  ASSERT_TRUE(r.defined);
  EXPECT_NEAR(r.c2, -0.2, 1e-15);
  EXPECT_NEAR(r.x_E_mm, -379.945854, kDigits6);
  EXPECT_NEAR(r.x_A_mm, -428.621198, kDigits6);
  EXPECT_NEAR(r.x_B_mm, -358.278190, kDigits6);
  EXPECT_NEAR(r.x_K_mm, 446.459496, kDigits6);
  EXPECT_NEAR(r.s1_mm2, 14491.877886, kDigits6);
  EXPECT_NEAR(r.s2_mm2, 478127.270131, kDigits6);
  EXPECT_NEAR(r.s3_mm2, 29250.541531, kDigits6);
  EXPECT_NEAR(r.s4_mm2, -276.178519, kDigits6);
  EXPECT_NEAR(r.area_mm2, 1044291.736133, 2 * kDigits6);
}

TEST(PaperServiceArea, LiteralPrintIsUndefinedWithoutTilt) {
  ServiceAreaMachine machine = Base();
  machine.tilt_rad = 0.0;
  EXPECT_FALSE(PaperAsPrinted(machine).defined);
  EXPECT_TRUE(PaperClosedForm(machine).defined);
}

struct EndPoint {
  const char* name;
  double tilt_deg, b, l, L, H, a;
  double x_E, x_A, x_B, x_K, x_D, s1, s2, s3, s4;
  double paper, paper_exact, intersection, union_of_both;
};

class ServiceAreaEndPoint : public testing::TestWithParam<EndPoint> {};

TEST_P(ServiceAreaEndPoint, MatchesEveryPrintedDigit) {
  const EndPoint& row = GetParam();
  ServiceAreaMachine machine;
  machine.tilt_rad = row.tilt_deg * kDeg;
  machine.platform_joint_spacing_mm = row.b;
  machine.strut_min_mm = row.l;
  machine.strut_max_mm = row.L;
  machine.tool_length_mm = row.H;
  machine.base_joint_spacing_mm = row.a;
  const PaperServiceArea r = PaperClosedForm(machine);
  ASSERT_TRUE(r.defined);
  EXPECT_NEAR(r.x_E_mm, row.x_E, kDigits6);
  EXPECT_NEAR(r.x_A_mm, row.x_A, kDigits6);
  EXPECT_NEAR(r.x_B_mm, row.x_B, kDigits6);
  EXPECT_NEAR(r.x_K_mm, row.x_K, kDigits6);
  EXPECT_NEAR(r.x_D_mm, row.x_D, kDigits6);
  EXPECT_NEAR(r.s1_mm2, row.s1, kDigits6);
  EXPECT_NEAR(r.s2_mm2, row.s2, kDigits6);
  EXPECT_NEAR(r.s3_mm2, row.s3, kDigits6);
  EXPECT_NEAR(r.s4_mm2, row.s4, kDigits6);
  EXPECT_NEAR(r.area_mm2, row.paper, 6e-6);
  EXPECT_NEAR(ExactArea(machine, ServiceRegion::kPaper), row.paper_exact, 6e-6);
  EXPECT_NEAR(ExactArea(machine, ServiceRegion::kIntersection), row.intersection, 6e-6);
  EXPECT_NEAR(ExactArea(machine, ServiceRegion::kUnion), row.union_of_both, 6e-6);
  EXPECT_NEAR(ExactArea(machine, ServiceRegion::kIntersection) + ExactArea(machine, ServiceRegion::kUnion),
              2.0 * ExactArea(machine, ServiceRegion::kSingleTilt), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(
    Printed, ServiceAreaEndPoint,
    testing::Values(EndPoint{"phi0b400",   0.0,          400.0,        500.0,         1350.0,
                             100.0,        1350.0,       -257.476708,  -321.801475,   -327.764204,
                             475.000000,   167.376208,   8078.099062,  429095.879681, 209.398696,
                             27800.105898, 819166.54308, 819166.54308, 819166.54308,  819166.54308},
                    EndPoint{"phi30b400", 30.0,         400.0,        500.0,         1350.0,
                             100.0,       1350.0,       -149.738878,  -231.325123,   -233.028686,
                             551.794919,  411.841070,   13745.538437, 430761.654997, 22.917007,
                             4327.833178, 880404.55453, 880404.55453, 642971.64146,  965403.36155},
                    EndPoint{"b300",       15.0,         300.0,        500.0,         1350.0,
                             100.0,        1350.0,       -36.492634,   -238.784277,   -223.755955,
                             555.993031,   340.632090,   19831.361192, 390966.785881, 2082.583541,
                             12727.677836, 800306.10556, 806908.07226, 729775.49505,  839785.05761},
                    EndPoint{"b500",       15.0,         500.0,         500.0,         1350.0,
                             100.0,        1350.0,       -358.853346,   -323.818408,   -352.380249,
                             459.400448,   190.269817,   -10662.578069, 485146.217992, 4699.505118,
                             17573.989090, 923218.31190, 923251.22799,  728544.75236,  984171.47748},
                    EndPoint{"min400",     15.0,          500.0,         400.0,         1350.0,
                             100.0,        1350.0,        -358.853346,   -306.663226,   -352.380249,
                             459.400448,   190.269817,    -28106.145483, 591002.098698, 11953.670132,
                             17573.989090, 1114551.26851, 1114584.18460, 932319.20689,  1174600.55870},
                    EndPoint{"min800",     15.0,         500.0,        800.0,         1350.0,
                             100.0,        1350.0,       -358.853346,  -363.605074,   -352.380249,
                             459.400448,   190.269817,   -602.452435,  217501.471909, 741.002012,
                             17573.989090, 400132.06479, 410480.41160, 251096.38897,  461394.58242},
                    EndPoint{"max1250",  15.0,         500.0,        500.0,         1250.0,
                             100.0,      1350.0,       -265.871780,  -323.818408,   -320.014927,
                             459.400448, 422.049516,   3454.437267,  359649.493737, 121.564376,
                             257.289180, 725936.41240, 726336.01698, 547876.44342,  809428.72061},
                    EndPoint{"max1450",    15.0,          500.0,         500.0,         1450.0,
                             100.0,        1350.0,        -451.816408,   -323.818408,   -374.913861,
                             459.400448,   7.959711,      -68127.914460, 640412.825123, 14032.417130,
                             57840.058491, 1056954.53861, 1060203.27667, 865496.80104,  1103377.05452},
                    EndPoint{"H50",       15.0,         500.0,         500.0,         1350.0,
                             50.0,        1350.0,       -442.223587,   -333.323164,   -364.132547,
                             446.459496,  281.502772,   -29211.455274, 489587.544145, 5363.941650,
                             5824.647570, 919830.76590, 927318.21388,  728860.18429,  1033124.93143},
                    EndPoint{"H250",       15.0,         500.0,         500.0,         1350.0,
                             250.0,        1350.0,       -20.656857,    -294.069868,   -314.835044,
                             498.223305,   -13.595679,   113361.553837, 373843.151433, 2727.852040,
                             82775.624742, 814313.86514, 814313.86514,  623068.38684,  860686.39643},
                    EndPoint{"a1250",      15.0,         500.0,         500.0,         1350.0,
                             100.0,        1250.0,       -458.853346,   -316.635393,   -362.896790,
                             409.400448,   90.269817,    -72961.530023, 548597.511748, 12110.766293,
                             23895.937276, 927701.62148, 932723.74290,  746293.99826,  987224.52981},
                    EndPoint{"a1450",      15.0,         500.0,        500.0,         1350.0,
                             100.0,        1450.0,       -258.853346,  -330.846927,   -324.190318,
                             509.400448,   290.269817,   4593.684894,  443141.623387, 462.842373,
                             12044.213699, 872307.87391, 873277.63806, 692111.75856,  935702.31490}),
    [](const testing::TestParamInfo<EndPoint>& parameter) { return std::string(parameter.param.name); });

double ChangePercent(const ServiceSweep& sweep, double (*area)(const ServiceAreaMachine&)) {
  return 100.0 * (area(AtSweepValue(sweep, sweep.to)) / area(AtSweepValue(sweep, sweep.from)) - 1.0);
}

TEST(ServiceAreaSweeps, ReproduceTheSixPrintedSensitivities) {
  for (int i = 0; i < kServiceSweeps; ++i) {
    const ServiceSweep sweep = PaperSweep(i);
    const double change =
        ChangePercent(sweep, [](const ServiceAreaMachine& m) { return PaperClosedForm(m).area_mm2; });
    std::printf("%s %-26s printed %7.1f %%  closed form %9.4f %%\n", sweep.figure.data(),
                sweep.parameter_name.data(), sweep.printed_percent, change);
    EXPECT_NEAR(change, sweep.printed_percent, 0.05) << sweep.figure;
  }
}

TEST(ServiceAreaSweeps, MatchTheTableOfModels) {
  constexpr std::array<double, 6> kCorrected = {7.4756, 15.3581, -64.0993, 45.5988, -11.4713, -5.9711};
  constexpr std::array<double, 6> kExactPaper = {7.4756, 14.4184, -63.1719, 45.9660, -12.1861, -6.3734};
  constexpr std::array<double, 6> kIntersection = {-21.5090, -0.1686, -73.0676, 57.9730, -14.5147, -7.2602};
  constexpr std::array<double, 6> kUnion = {17.8519, 17.1933, -60.7190, 36.3155, -16.6910, -5.2189};
  constexpr std::array<double, 6> kSingle = {-1.8286, 9.1207, -66.1833, 45.0576, -15.7907, -6.0977};
  constexpr double kDigits4 = 6e-5;
  for (int i = 0; i < kServiceSweeps; ++i) {
    const ServiceSweep s = PaperSweep(i);
    const auto at = static_cast<std::size_t>(i);
    EXPECT_NEAR(ChangePercent(s, [](const ServiceAreaMachine& m) { return PaperClosedForm(m).area_mm2; }),
                kCorrected[at], kDigits4);
    EXPECT_NEAR(
        ChangePercent(s, [](const ServiceAreaMachine& m) { return ExactArea(m, ServiceRegion::kPaper); }),
        kExactPaper[at], kDigits4);
    EXPECT_NEAR(
        ChangePercent(s,
                      [](const ServiceAreaMachine& m) { return ExactArea(m, ServiceRegion::kIntersection); }),
        kIntersection[at], kDigits4);
    EXPECT_NEAR(
        ChangePercent(s, [](const ServiceAreaMachine& m) { return ExactArea(m, ServiceRegion::kUnion); }),
        kUnion[at], kDigits4);
    EXPECT_NEAR(ChangePercent(
                    s, [](const ServiceAreaMachine& m) { return ExactArea(m, ServiceRegion::kSingleTilt); }),
                kSingle[at], kDigits4);
  }
}

}  // namespace
}  // namespace lambdajet::kinematics
