// Stands in for the drive module's iron: servos, scales, links, levers and sheet, integrated at four steps a millisecond.
//
// Model: a servo with velocity feed-forward is a second-order loop on the error to the interpolated set-point; the joint
// follows the slider through a play (backlash); the links give the rigid tool point (true_mechanism.hpp); the sheet is a
// mass on a damped spring to that point, each coordinate its own exact oscillator; creep and the parallelogram turn it.
// Time passes when the hardware is read: the plant is brought up to that instant, whatever the caller's loop has missed.
// Frames: D, E, W. Units: mm, s, rad; common time ns. Threads: one. Cost: about 1 us a simulated millisecond.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <random>

#include "drive/core/drive_hardware.hpp"
#include "simulated_plant/core/oscillator.hpp"
#include "simulated_plant/core/plant_truth.hpp"
#include "simulated_plant/core/sheet_truth.hpp"

namespace lambdajet::simulated_plant {

class DrivePlant final : public drive::DriveHardware {
 public:
  DrivePlant(const PlantTruth& truth, std::uint64_t seed);

  drive::DriveReadings ReadState(std::int64_t now_ns) override;
  void WriteSetpoint(const drive::Setpoint& setpoint) override;
  void SetEnabled(bool enabled) override;
  void BeginHoming() override;

  // From the time of the call on; times of the fault count from there.
  void Inject(const Fault& fault);

  // True poses of the sheet, one a millisecond; the plant keeps them, TakeSheetSample hands each over once.
  const SheetTruthSource& sheet() const { return sheet_; }
  std::optional<SheetSample> TakeSheetSample();
  bool broken() const { return broken_; }  // the links do not meet: no further truth

 private:
  struct Servo {
    Oscillator loop;
    double position_mm = 0.0;  // slider, as the scale counts
    double velocity_mm_per_s = 0.0;
    double wanted_mm = 0.0;
    double wanted_rate_mm_per_s = 0.0;
    double last_rate_mm_per_s = 0.0;
    double joint_mm = 0.0;  // behind the backlash
    double frozen_mm = 0.0;
    bool frozen = false;
  };
  void Advance(std::int64_t now_ns);
  void Substep();
  void FollowSetpoint();
  void Brake(double step_s);
  void MoveServos();
  void MoveSheet();
  void Creep();
  double Reading(std::size_t i, double ahead_s);
  const Fault* Active(FaultKind kind, int index) const;

  static constexpr std::int64_t kStep_ns = 250'000;
  static constexpr std::int64_t kSample_ns = 1'000'000;
  static constexpr std::size_t kQueue = 1024;
  static constexpr std::size_t kFaults = 32;
  static constexpr std::size_t kOutbox = 4096;

  PlantTruth truth_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::array<Servo, kActuatorCount> servos_;
  std::array<drive::Setpoint, kQueue> queue_{};  // ring, in time order
  std::size_t queue_first_ = 0;
  std::size_t queue_count_ = 0;
  drive::Setpoint played_;
  bool dry_ = true;
  bool enabled_ = false;
  std::uint32_t late_ = 0;
  std::uint32_t missing_ = 0;

  std::array<Oscillator, 2> levers_;
  Eigen::Vector2d rigid_mm_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d rigid_rate_mm_per_s_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d bend_mm_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d bend_rate_mm_per_s_ = Eigen::Vector2d::Zero();
  PlanarPose creep_;

  std::int64_t time_ns_ = 0;
  std::int64_t started_ns_ = 0;
  std::int64_t homed_at_ns_ = 0;
  bool homing_ = false;
  bool referenced_ = false;
  bool broken_ = false;
  SheetTruthHistory sheet_;
  std::array<SheetSample, kOutbox> outbox_{};
  std::size_t made_ = 0;
  std::size_t taken_ = 0;
  struct TimedFault {
    Fault fault;
    std::int64_t from_ns = 0;
    std::int64_t to_ns = 0;
  };
  std::array<TimedFault, kFaults> faults_{};
  std::size_t fault_count_ = 0;
};

}  // namespace lambdajet::simulated_plant
