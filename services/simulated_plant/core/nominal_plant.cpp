#include "simulated_plant/core/nominal_plant.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "simulated_plant/core/true_mechanism.hpp"

namespace lambdajet::simulated_plant {
namespace {

using P = Parameter;

constexpr double kDegree_rad = std::numbers::pi / 180.0;
// Seed paper 000: tilts of mixing chamber and focusing tube; the levers that give its range 0.04 to 0.29 mm.
constexpr double kMixingChamberTilt_rad = 0.064 * kDegree_rad;
constexpr double kFocusingTubeTilt_rad = 0.038 * kDegree_rad;
constexpr double kStackOffset_mm = 0.0744;

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double Normal(double sigma) { return sigma * normal_(engine_); }
  double Between(double low, double high) { return low + (high - low) * uniform_(engine_); }
  double Azimuth() { return Between(-std::numbers::pi, std::numbers::pi); }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
};

void SetMechanism(const ParameterVector& p, PlantTruth& truth) {
  const auto at = [&p](P parameter) { return p[static_cast<Eigen::Index>(parameter)]; };
  truth.main_link_length_mm = at(P::kMainLinkLengthMm);
  truth.attach_length_mm = at(P::kAttachLengthMm);
  truth.second_link_length_mm = at(P::kSecondLinkLengthMm);
  truth.rails[0].angle_rad = at(P::kRail1AngleRad);
  truth.rails[0].offset_mm = at(P::kRail1OffsetMm);
  truth.rails[1].angle_rad = at(P::kRail2AngleRad);
  truth.rails[1].offset_mm = at(P::kRail2OffsetMm);
  truth.actuators[0].zero_mm = at(P::kSlider1ZeroMm);
  truth.actuators[1].zero_mm = at(P::kSlider2ZeroMm);
  truth.X_DH = {at(P::kBaseXMm), at(P::kBaseYMm), at(P::kBaseThetaRad)};
  truth.X_EW = {at(P::kSheetXMm), at(P::kSheetYMm), at(P::kSheetThetaRad)};
  truth.camera.p_HC_x_mm = at(P::kCameraXMm);
  truth.camera.p_HC_y_mm = at(P::kCameraYMm);
  const double lag = at(P::kElasticLagS2);
  const double stiffness = 1e-3 * truth.levers.moving_mass_kg / lag;
  truth.levers.stiffness_x_n_per_mm = truth.levers.stiffness_y_n_per_mm = stiffness;
  // c/k = 2 z/w, w = sqrt(k/m).
  truth.levers.damping_ratio = 0.5 * at(P::kDampingTimeS) / std::sqrt(lag);
}

std::array<double, kActuatorCount> MiddlePosition(const MachineDescription& machine) {
  const double y =
      machine.X_DJ().y_mm -
      (machine.X_EW() * Eigen::Vector2d(0.5 * machine.sheet_width_mm, 0.5 * machine.sheet_height_mm)).y();
  const double x =
      machine.X_DJ().x_mm -
      (machine.X_EW() * Eigen::Vector2d(0.5 * machine.sheet_width_mm, 0.5 * machine.sheet_height_mm)).x();
  const double main = machine.value(P::kMainLinkLengthMm);
  const double ratio = machine.value(P::kAttachLengthMm) / main;
  const double second = machine.value(P::kSecondLinkLengthMm);
  const double c = std::sqrt(main * main - y * y);
  const double d = std::sqrt(second * second - ratio * ratio * y * y);
  const WorkingMode mode = machine.working_mode;
  const double q1 = x - mode.s1 * c;
  return {q1 - machine.value(P::kSlider1ZeroMm),
          q1 + mode.s1 * ratio * c + mode.s2 * d - machine.value(P::kSlider2ZeroMm)};
}

ValveTruth Valve(double on_s, double off_s) {
  ValveTruth valve;
  valve.on_delay_s = on_s;
  valve.off_delay_s = off_s;
  return valve;
}

void RoughenDrive(const MachineDescription& machine, Dice& dice, PlantTruth& truth) {
  const Uncertainties& u = machine.uncertainties;
  for (std::size_t i = 0; i < 2; ++i) {
    // Three waves whose sum has the stated standard deviation: each sine has amplitude^2/2.
    const double amplitude = u.straightness_mm * std::sqrt(2.0 / 3.0);
    const std::array<double, kWaves> lengths{2400.0, 900.0, 350.0};
    for (std::size_t w = 0; w < kWaves; ++w) {
      truth.rails[i].straightness[w] = {amplitude * dice.Between(0.5, 1.4),
                                        lengths[w] * dice.Between(0.8, 1.25), dice.Azimuth()};
    }
    ActuatorTruth& actuator = truth.actuators[i];
    actuator.encoder_step_mm = 0.001;
    actuator.encoder_wave = {dice.Between(0.0002, 0.001), 20.0, dice.Azimuth()};
    actuator.backlash_mm = u.backlash_mm * dice.Between(0.5, 1.5);
    actuator.servo_bandwidth_hz = dice.Between(35.0, 60.0);
    actuator.servo_damping = dice.Between(0.7, 1.0);
  }
  // Both sliders of the demonstration machine run on one rail: what is not straight is the same for both.
  if (machine.value(P::kRail1OffsetMm) == machine.value(P::kRail2OffsetMm)) {
    truth.rails[1].straightness = truth.rails[0].straightness;
  }
  const double stiffness = truth.levers.stiffness_x_n_per_mm;
  const double anisotropy = dice.Normal(0.02);
  truth.levers.stiffness_x_n_per_mm = stiffness * (1.0 + anisotropy);
  truth.levers.stiffness_y_n_per_mm = stiffness * (1.0 - anisotropy);
  truth.clamp.creep_mm = dice.Between(0.001, 0.004);
  truth.clamp.creep_turn_rad = dice.Between(1e-6, 5e-6);
  truth.clamp.creep_time_s = dice.Between(10.0, 40.0);
  truth.clamp.parallelogram = {dice.Between(0.0, 1e-5), dice.Between(600.0, 1500.0), dice.Azimuth()};
}

void RoughenJet(const MachineDescription& machine, Dice& dice, PlantTruth& truth) {
  const Uncertainties& u = machine.uncertainties;
  truth.stack = {.mixing_chamber_tilt_rad = kMixingChamberTilt_rad,
                 .mixing_chamber_azimuth_rad = dice.Azimuth(),
                 .focusing_tube_tilt_rad = kFocusingTubeTilt_rad,
                 .focusing_tube_azimuth_rad = dice.Azimuth(),
                 .radial_offset_mm = kStackOffset_mm,
                 .radial_azimuth_rad = dice.Azimuth()};
  truth.jet_wander_mm = u.jet_wander_mm * dice.Between(0.7, 1.2);
  truth.jet_wander_time_s = dice.Between(0.2, 1.0);
  truth.jet_lag_time_s =
      std::max(0.0, machine.process.jet_lag_time_s * (1.0 + dice.Normal(u.jet_lag_relative)));
  for (ValveTruth* valve : {&truth.jet_valve, &truth.abrasive_valve}) {
    valve->on_delay_s *= std::max(0.3, 1.0 + dice.Normal(0.05));
    valve->off_delay_s *= std::max(0.3, 1.0 + dice.Normal(0.05));
    valve->scatter_s = dice.Between(0.0001, 0.0002);
    valve->sensor_s = 0.00002;
  }
  truth.pump.ripple_mpa = dice.Between(2.0, 6.0);
  truth.pump.ripple_hz = dice.Between(0.8, 2.0);
  truth.camera.noise_mm = u.camera_mm * dice.Between(0.8, 1.1);
  for (SheetMark& mark : truth.marks) {
    mark.x_W_mm += dice.Normal(u.mark_mm);
    mark.y_W_mm += dice.Normal(u.mark_mm);
  }
}

}  // namespace

PlantTruth NominalPlant(const MachineDescription& machine) {
  PlantTruth truth;
  truth.name = "nominal";
  truth.machine_id = machine.machine_id;
  truth.assembly_mode = machine.assembly_mode;
  truth.levers.moving_mass_kg = machine.moving_mass_kg;
  SetMechanism(machine.parameters, truth);
  for (ActuatorTruth& actuator : truth.actuators) {
    actuator.encoder_step_mm = 0.0;
  }
  truth.home_position_mm = MiddlePosition(machine);
  truth.jet_lag_time_s = machine.process.jet_lag_time_s;
  truth.jet_valve = Valve(machine.process.jet_on_delay_s, machine.process.jet_off_delay_s);
  truth.abrasive_valve = Valve(machine.process.abrasive_on_delay_s, machine.process.abrasive_off_delay_s);
  truth.marks = machine.marks;
  return truth;
}

PlantTruth RandomPlant(const MachineDescription& machine, std::uint64_t seed) {
  Dice dice(seed);
  PlantTruth truth = NominalPlant(machine);
  truth.name = "random-" + std::to_string(seed);
  truth.seed = seed;
  ParameterVector drawn = machine.parameters;
  for (Eigen::Index i = 0; i < drawn.size(); ++i) {
    drawn[i] += dice.Normal(std::sqrt(std::max(0.0, machine.covariance(i, i))));
  }
  // A spring stays a spring, and damping damping, however far out the dice fall.
  const auto floor = [&](P parameter, double share) {
    const auto i = static_cast<Eigen::Index>(parameter);
    drawn[i] = std::max(drawn[i], share * machine.parameters[i]);
  };
  floor(P::kElasticLagS2, 0.5);
  floor(P::kDampingTimeS, 0.2);
  SetMechanism(drawn, truth);
  RoughenDrive(machine, dice, truth);
  RoughenJet(machine, dice, truth);
  return truth;
}

std::vector<DescriptionFault> Validate(const PlantTruth& truth) {
  std::vector<DescriptionFault> faults;
  const auto positive = [&](const std::string& key, double value) {
    if (!(std::isfinite(value) && value > 0.0)) {
      faults.push_back({key, value, "a finite number above 0"});
    }
  };
  positive("mechanism.main_link_length_mm", truth.main_link_length_mm);
  positive("mechanism.attach_length_mm", truth.attach_length_mm);
  positive("mechanism.second_link_length_mm", truth.second_link_length_mm);
  positive("levers.moving_mass_kg", truth.levers.moving_mass_kg);
  positive("levers.stiffness_x_n_per_mm", truth.levers.stiffness_x_n_per_mm);
  positive("levers.stiffness_y_n_per_mm", truth.levers.stiffness_y_n_per_mm);
  positive("clamp.creep_time_s", truth.clamp.creep_time_s);
  positive("jet.wander_time_s", truth.jet_wander_time_s);
  positive("pump.pressure_mpa", truth.pump.pressure_mpa);
  positive("pump.rise_time_s", truth.pump.rise_time_s);
  positive("camera.field_of_view_mm", truth.camera.field_of_view_mm);
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    positive("actuators." + std::to_string(i + 1) + ".servo_bandwidth_hz",
             truth.actuators[i].servo_bandwidth_hz);
    positive("actuators." + std::to_string(i + 1) + ".servo_damping", truth.actuators[i].servo_damping);
  }
  if (faults.empty() && !TruePoint(truth, truth.home_position_mm)) {
    faults.push_back(
        {"home_position_mm", truth.home_position_mm[0], "slider readings at which the links meet"});
  }
  return faults;
}

}  // namespace lambdajet::simulated_plant
