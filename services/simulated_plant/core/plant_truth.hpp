// Says what the simulated machine truly is: what no controller knows and only inspection may compare with.
//
// Model: the machine of seed paper 000 with everything that keeps it from being its drawing: link lengths, rails that are
// turned, shifted and not straight, encoder zeros, steps and sub-division errors, backlash, servo lag, a mass on levers of
// finite stiffness, a sheet that creeps in its clamp, a head that stands elsewhere, a jet axis off its head (nozzle, mixing
// chamber and focusing tube, tilts 0.064 and 0.038 degrees in the paper), valves with delay and scatter, a pump with
// ripple, a camera with noise. Distributions of random plants: deploy/plants/README.md.
// Frames: foundation/geometry/frames.md, and H: the head, parallel to J; the jet leaves at jet_offset_H_mm() in H, the
// camera looks from p_HC. Units: mm, s, rad, kg, N, MPa. Threads: values.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "foundation/geometry/planar_pose.hpp"
#include "foundation/machine/machine_description.hpp"
#include "foundation/motion/plan.hpp"

namespace lambdajet::simulated_plant {

struct Wave {
  double amplitude_mm = 0.0;
  double length_mm = 1000.0;
  double phase_rad = 0.0;
};
inline constexpr std::size_t kWaves = 3;

struct RailTruth {
  double angle_rad = 0.0;
  double offset_mm = 0.0;
  std::array<Wave, kWaves> straightness;  // along the rail's normal
};

struct ActuatorTruth {
  double zero_mm = 0.0;  // place along the rail = reading + zero
  double encoder_step_mm = 0.001;
  Wave encoder_wave;         // sub-division error of the scale
  double backlash_mm = 0.0;  // full width, between the scale and the joint
  double servo_bandwidth_hz = 45.0;
  double servo_damping = 0.8;
};

struct LeversTruth {
  double moving_mass_kg = 20.0;
  double stiffness_x_n_per_mm = 50.0;
  double stiffness_y_n_per_mm = 50.0;
  double damping_ratio = 0.12;
};

// What moves the sheet in its clamp and the clamp on its parallelogram.
struct ClampTruth {
  double creep_mm = 0.0;        // one sigma, each coordinate
  double creep_turn_rad = 0.0;  // one sigma
  double creep_time_s = 20.0;   // correlation time
  Wave parallelogram;           // turn of E over D's x; amplitude in rad
};

struct JetStackTruth {
  double mixing_chamber_tilt_rad = 0.0;
  double mixing_chamber_lever_mm = 147.7;  // nozzle joint to tube exit
  double mixing_chamber_azimuth_rad = 0.0;
  double focusing_tube_tilt_rad = 0.0;
  double focusing_tube_lever_mm = 76.2;
  double focusing_tube_azimuth_rad = 0.0;
  double radial_offset_mm = 0.0;
  double radial_azimuth_rad = 0.0;
};

struct ValveTruth {
  double on_delay_s = 0.0;
  double off_delay_s = 0.0;
  double scatter_s = 0.0;  // one sigma of each switching
  double sensor_s = 0.0;   // one sigma of the sensor that sees the effect
};

struct PumpTruth {
  double pressure_mpa = 380.0;
  double ripple_mpa = 4.0;
  double ripple_hz = 1.3;
  double rise_time_s = 0.35;
  double abrasive_g_per_min = 350.0;
};

struct CameraTruth {
  double p_HC_x_mm = 0.0;
  double p_HC_y_mm = 0.0;
  double noise_mm = 0.0;          // one sigma, each coordinate
  double field_of_view_mm = 8.0;  // half width
  double latency_s = 0.01;        // exposure to reading
};

enum class FaultKind : std::uint8_t {
  kStall,
  kSensorFreeze,
  kSensorFault,
  kPressureLoss,
  kValveDelay,
  kHopperEmpty
};

struct Fault {
  FaultKind kind = FaultKind::kStall;
  int index = 0;        // actuator or valve
  double from_s = 0.0;  // after the plant's start
  double for_s = 0.0;
  double value = 0.0;  // delay: s
};

struct PlantTruth {
  std::string name;
  std::string machine_id;
  std::uint64_t seed = 1;  // of everything random while it runs

  double main_link_length_mm = 0.0;
  double attach_length_mm = 0.0;
  double second_link_length_mm = 0.0;
  int assembly_mode = 1;
  std::array<RailTruth, 2> rails;
  std::array<ActuatorTruth, kActuatorCount> actuators;
  std::array<double, kActuatorCount> home_position_mm{};  // reading after homing
  LeversTruth levers;
  ClampTruth clamp;
  PlanarPose X_DH;
  PlanarPose X_EW;
  JetStackTruth stack;
  double jet_wander_mm = 0.0;  // one sigma, each coordinate
  double jet_wander_time_s = 0.5;
  double jet_lag_time_s = 0.0;
  ValveTruth jet_valve;
  ValveTruth abrasive_valve;
  PumpTruth pump;
  CameraTruth camera;
  std::vector<SheetMark> marks;  // where they truly are
  std::vector<Fault> faults;

  Eigen::Vector2d jet_offset_H_mm() const {
    const auto turned = [](double length, double azimuth) {
      return Eigen::Vector2d(length * std::cos(azimuth), length * std::sin(azimuth));
    };
    return turned(std::tan(stack.mixing_chamber_tilt_rad) * stack.mixing_chamber_lever_mm,
                  stack.mixing_chamber_azimuth_rad) +
           turned(std::tan(stack.focusing_tube_tilt_rad) * stack.focusing_tube_lever_mm,
                  stack.focusing_tube_azimuth_rad) +
           turned(stack.radial_offset_mm, stack.radial_azimuth_rad);
  }
  PlanarPose X_DJ() const { return X_DH * PlanarPose{jet_offset_H_mm().x(), jet_offset_H_mm().y(), 0.0}; }
  Eigen::Vector2d p_JC_mm() const {
    return Eigen::Vector2d(camera.p_HC_x_mm, camera.p_HC_y_mm) - jet_offset_H_mm();
  }
};

// What may not differ from a description's own kind of machine; empty if the truth can be simulated.
std::vector<DescriptionFault> Validate(const PlantTruth& truth);

}  // namespace lambdajet::simulated_plant
