// Identification on machines it knows nothing of: the measuring program, planned by trajectory, played by both modules on their
// simulated plants, identified, and judged by where the plant's truth puts the jet on the sheet.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>

#include "calibration/core/identification.hpp"
#include "calibration/core/measuring_plan.hpp"
#include "calibration/core/verification.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "simulated_plant/core/nominal_plant.hpp"
#include "simulated_plant/core/true_mechanism.hpp"
#include "simulated_plant/plant_file/plant_file.hpp"
#include "tests/support/virtual_cell.hpp"
#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::calibration {
namespace {

using simulated_plant::PlantTruth;

std::string Source() { return std::getenv("LAMBDAJET_SOURCE_DIR"); }

Measurement FromModule(const lambdajet::Measurement& m) {
  Measurement look;
  look.kind = KindOf(m.gate, m.mark);
  look.seen = m.seen;
  look.mark = m.mark;
  look.exposure_ns = m.exposure_ns;
  look.p_C_mm = {m.x_C_mm, m.y_C_mm};
  look.actuator_position_mm = {m.actuator_position_mm[0], m.actuator_position_mm[1]};
  look.actuator_velocity_mm_per_s = {m.actuator_velocity_mm_per_s[0], m.actuator_velocity_mm_per_s[1]};
  look.pierce_actuator_position_mm = {m.jet_pierce_actuator_position_mm[0],
                                      m.jet_pierce_actuator_position_mm[1]};
  return look;
}

std::vector<Measurement> Play(tests::VirtualCell& cell, const std::string& program,
                              const MachineDescription& machine) {
  const auto planned = trajectory::PlanPartProgram(program, machine, {});
  for (const auto& fault : planned.faults) {
    ADD_FAILURE() << "line " << fault.line << " " << fault.reason << ": " << fault.message;
  }
  const auto run = cell.Run(planned.plan);
  EXPECT_TRUE(run.complete) << Name(cell.drive().mode) << " " << Name(cell.drive().reason) << " / "
                            << Name(cell.main_motion().mode) << " " << Name(cell.main_motion().reason)
                            << " gate " << cell.drive().gate_waiting << " s " << cell.drive().s_mm
                            << " after " << run.duration_s;
  std::vector<Measurement> looks;
  for (const auto& m : run.measurements) {
    looks.push_back(FromModule(m));
  }
  return looks;
}

// Where the true machine puts the jet at rest, driven for p_W with what is believed; mm off.
std::optional<Eigen::Vector2d> TrueMiss(const PlantTruth& truth, const MachineDescription& machine,
                                        const ParameterVector& believed, const Eigen::Vector2d& p_W) {
  const auto q = ReadingsForJet(machine, believed, p_W);
  const auto p_DE = q ? simulated_plant::TruePoint(truth, {q->x(), q->y()}) : std::nullopt;
  if (!p_DE) {
    return std::nullopt;
  }
  const Eigen::Vector2d jet = truth.X_DJ().translation_mm() - *p_DE;
  return Eigen::Vector2d(truth.X_EW.Inverse() * jet - p_W);
}

struct Judgement {
  double rms_before = 0.0, worst_before = 0.0, rms = 0.0, worst = 0.0;
  int within_95 = 0, places = 0;
};

Judgement Judge(const PlantTruth& truth, const MachineDescription& machine, const Identification& found) {
  Judgement j;
  for (const PlaceAccuracy& place : found.places) {
    const auto before = TrueMiss(truth, machine, machine.parameters, place.p_W_mm);
    const auto after = TrueMiss(truth, machine, found.parameters, place.p_W_mm);
    if (!before || !after) {
      continue;
    }
    ++j.places;
    j.rms_before += before->squaredNorm();
    j.rms += after->squaredNorm();
    j.worst_before = std::max(j.worst_before, before->norm());
    j.worst = std::max(j.worst, after->norm());
    // How straight the rails are is no parameter: at a place it comes on top of what the parameters are known to.
    const Eigen::Matrix2d R_WD = machine.X_EW().rotation().transpose();
    const Eigen::Matrix2d straightness_mm2 =
        StraightnessCovariance(machine, PlaceEffector(machine, found.parameters, place.actuator_position_mm));
    j.within_95 +=
        after->norm() < Radius95(place.covariance_mm2 + R_WD * straightness_mm2 * R_WD.transpose());
  }
  j.rms_before = std::sqrt(j.rms_before / j.places);
  j.rms = std::sqrt(j.rms / j.places);
  return j;
}

void Print(const char* name, const Identification& found, const Judgement& j, const PlantTruth& truth,
           const std::vector<Measurement>& looks) {
  int outliers = 0;
  for (const LookResidual& r : found.residuals) {
    outliers += r.outlier;
  }
  std::printf(
      "%s: %zu looks (%zu refused, %d outliers); jet on the sheet rms %.3f -> %.3f mm, worst %.3f -> %.3f "
      "mm, bound (95 %%) "
      "%.3f mm; looks rms %.3f -> %.4f mm, held out %.4f mm, chi-square %.0f/%zu, inflation %.2f, tracking "
      "noise %.1f; m/k %.3f "
      "(true %.3f / %.3f) "
      "1e-3 s^2\n",
      name, looks.size(), found.refused.size(), outliers, j.rms_before, j.rms, j.worst_before, j.worst,
      found.worst_place_mm, found.rms_before_mm, found.rms_after_mm, found.hold_out_after_mm,
      found.chi_square, found.degrees_of_freedom, found.covariance_inflation, found.tracking_noise_ratio,
      1e3 * found.parameters[At(Parameter::kElasticLagS2)],
      truth.levers.moving_mass_kg / truth.levers.stiffness_x_n_per_mm,
      truth.levers.moving_mass_kg / truth.levers.stiffness_y_n_per_mm);
}

class OnTheVirtualCell : public testing::Test {
 protected:
  OnTheVirtualCell() : machine_(*ReadMachineFile(Source() + "/deploy/config/machine.yaml")) {}

  Judgement IdentifyPlant(const char* name, const PlantTruth& truth, std::uint64_t seed) {
    tests::CellOptions options;
    options.seed = seed;
    tests::VirtualCell cell(machine_, truth, options);
    const auto plan = PlanMeasuringRun(machine_);
    EXPECT_EQ(plan.reason, PlanReason::kPlanned) << plan.explanation;
    const auto looks = Play(cell, plan.program, machine_);
    const auto found = Identify(machine_, looks);
    EXPECT_EQ(found.reason, IdentificationReason::kIdentified) << found.explanation;
    EXPECT_TRUE(found.elasticity_identified);
    const double lag = 0.5e-3 * truth.levers.moving_mass_kg *
                       (1.0 / truth.levers.stiffness_x_n_per_mm + 1.0 / truth.levers.stiffness_y_n_per_mm);
    EXPECT_NEAR(found.parameters[At(Parameter::kElasticLagS2)], lag, 0.05 * lag);
    const Judgement j = Judge(truth, machine_, found);
    Print(name, found, j, truth, looks);
    return j;
  }

  Verification Verify(tests::VirtualCell& cell, const MachineDescription& machine, const char* when) {
    const auto plan = PlanVerification(machine);
    EXPECT_EQ(plan.reason, PlanReason::kPlanned) << plan.explanation;
    const Verification found = VerifyBase(machine, Play(cell, plan.program, machine));
    std::printf("%s: %s, %s\n", when, std::string(VerdictName(found.verdict)).c_str(),
                found.explanation.c_str());
    return found;
  }

  MachineDescription machine_;
};

TEST_F(OnTheVirtualCell, TheBaseIsVerifiedWithSoftLeversThatSwing) {
  const auto shipped = simulated_plant::ReadPlantFile(Source() + "/deploy/plants/shipped.yaml");
  ASSERT_TRUE(shipped.ok()) << shipped.status();
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    PlantTruth truth = seed == 1 ? *shipped : simulated_plant::RandomPlant(machine_, seed);
    tests::CellOptions options;
    options.seed = seed;
    tests::VirtualCell cell(machine_, truth, options);
    // As the crew left it nothing is known well enough; but nothing contradicts what is known either.
    const Verification as_set_up = Verify(cell, machine_, "as set up");
    EXPECT_EQ(as_set_up.verdict, Verdict::kUncertain);
    EXPECT_GE(as_set_up.p_value, 1e-3);
    const auto found = Identify(machine_, Play(cell, PlanMeasuringRun(machine_).program, machine_));
    ASSERT_EQ(found.reason, IdentificationReason::kIdentified) << found.explanation;
    MachineDescription identified = machine_;
    identified.parameters = found.parameters;
    identified.covariance = found.covariance;
    identified.version = 1;
    cell.AdoptMachine(identified);
    const Verification standing = Verify(cell, identified, "identified");
    EXPECT_EQ(standing.verdict, Verdict::kPass);

    truth.X_DH.x_mm += 0.1;
    tests::VirtualCell moved(identified, truth, options);
    EXPECT_EQ(Verify(moved, identified, "moved by 100 um").verdict, Verdict::kMoved);
  }
}

TEST_F(OnTheVirtualCell, TheShippedPlantIsFound) {
  const auto truth = simulated_plant::ReadPlantFile(Source() + "/deploy/plants/shipped.yaml");
  ASSERT_TRUE(truth.ok()) << truth.status();
  const Judgement j = IdentifyPlant("shipped", *truth, 1);
  EXPECT_GT(j.rms_before, 0.3);
  EXPECT_LT(j.worst, 0.08);
}

TEST_F(OnTheVirtualCell, RandomPlantsAreFoundWithinTheirBound) {
  int within = 0;
  int places = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const PlantTruth truth = simulated_plant::RandomPlant(machine_, seed);
    const Judgement j = IdentifyPlant(("random " + std::to_string(seed)).c_str(), truth, seed);
    EXPECT_LT(j.worst, 0.12);
    within += j.within_95;
    places += j.places;
  }
  std::printf("%.1f %% of the places within their own 95 %% circle\n", 100.0 * within / places);
  EXPECT_GE(within, 0.92 * places);
}

}  // namespace
}  // namespace lambdajet::calibration
