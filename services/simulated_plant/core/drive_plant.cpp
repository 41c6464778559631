#include "simulated_plant/core/drive_plant.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "foundation/contract/expects.hpp"
#include "foundation/motion/nanoseconds.hpp"
#include "simulated_plant/core/true_mechanism.hpp"

namespace lambdajet::simulated_plant {
namespace {

constexpr double kStep_s = 250e-6;
constexpr double kHoming_s = 1.0;
constexpr double kBrake_mm_per_s2 = 4000.0;
constexpr std::int64_t kLongestPause_ns = 2'000'000'000;
constexpr double kGramPerKilo = 1000.0;  // kg mm/s^2 in mN: N/mm * 1000 / kg is 1/s^2

Oscillator Lever(double stiffness_n_per_mm, const LeversTruth& levers) {
  return {std::sqrt(kGramPerKilo * stiffness_n_per_mm / levers.moving_mass_kg), levers.damping_ratio,
          kStep_s};
}

}  // namespace

DrivePlant::DrivePlant(const PlantTruth& truth, std::uint64_t seed) : truth_(truth), random_(seed) {
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    Servo& servo = servos_[i];
    const ActuatorTruth& actuator = truth_.actuators[i];
    servo.loop = {2.0 * std::numbers::pi * actuator.servo_bandwidth_hz, actuator.servo_damping, kStep_s};
    servo.position_mm = servo.wanted_mm = servo.joint_mm = truth_.home_position_mm[i];
  }
  levers_ = {Lever(truth_.levers.stiffness_x_n_per_mm, truth_.levers),
             Lever(truth_.levers.stiffness_y_n_per_mm, truth_.levers)};
  const std::optional<Eigen::Vector2d> start = TruePoint(truth_, truth_.home_position_mm);
  Expects(start.has_value(), "a validated plant starts where its links meet");
  rigid_mm_ = *start;
}

drive::DriveReadings DrivePlant::ReadState(std::int64_t now_ns) {
  if (time_ns_ == 0) {
    started_ns_ = time_ns_ = now_ns / kStep_ns * kStep_ns;
    for (const Fault& fault : truth_.faults) {
      Inject(fault);
    }
  }
  Advance(now_ns);
  if (homing_ && now_ns >= homed_at_ns_) {
    homing_ = false;
    referenced_ = true;
  }
  drive::DriveReadings readings;
  readings.time_ns = now_ns;
  const double ahead_s = ToSeconds(now_ns - time_ns_);
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    readings.position_mm[i] = Reading(i, ahead_s);
    readings.velocity_mm_per_s[i] = servos_[i].velocity_mm_per_s;
    readings.sensor_fault =
        readings.sensor_fault || Active(FaultKind::kSensorFault, static_cast<int>(i)) != nullptr;
  }
  readings.referenced = referenced_;
  readings.setpoints_late = late_;
  readings.setpoints_missing = missing_;
  return readings;
}

void DrivePlant::WriteSetpoint(const drive::Setpoint& setpoint) {
  if (setpoint.execute_at_ns <= time_ns_) {
    ++late_;
    return;
  }
  while (queue_count_ > 0 &&
         queue_[(queue_first_ + queue_count_ - 1) % kQueue].execute_at_ns >= setpoint.execute_at_ns) {
    --queue_count_;
  }
  if (queue_count_ < kQueue) {
    queue_[(queue_first_ + queue_count_++) % kQueue] = setpoint;
  }
}

void DrivePlant::SetEnabled(bool enabled) {
  enabled_ = enabled;
  queue_count_ = 0;
  dry_ = true;
}

void DrivePlant::BeginHoming() {
  referenced_ = false;
  homing_ = true;
  homed_at_ns_ = time_ns_ + ToNs(kHoming_s);
}

void DrivePlant::Inject(const Fault& fault) {
  if (fault_count_ < kFaults) {
    const std::int64_t from_ns = time_ns_ + ToNs(fault.from_s);
    faults_[fault_count_++] = {fault, from_ns, from_ns + ToNs(fault.for_s)};
  }
}

std::optional<SheetSample> DrivePlant::TakeSheetSample() {
  if (made_ - taken_ > kOutbox) {
    taken_ = made_ - kOutbox;
  }
  return made_ == taken_ ? std::nullopt : std::optional(outbox_[taken_++ % kOutbox]);
}

void DrivePlant::Advance(std::int64_t now_ns) {
  if (now_ns - time_ns_ > kLongestPause_ns) {
    time_ns_ = (now_ns - kLongestPause_ns) / kStep_ns * kStep_ns;
  }
  while (time_ns_ + kStep_ns <= now_ns && !broken_) {
    Substep();
  }
}

void DrivePlant::Substep() {
  time_ns_ += kStep_ns;
  if (enabled_) {
    FollowSetpoint();
  } else {
    Brake(kStep_s);
  }
  MoveServos();
  MoveSheet();
  if (broken_ || time_ns_ % kSample_ns != 0) {
    return;
  }
  Creep();
  const Eigen::Vector2d p_DE = rigid_mm_ + bend_mm_;
  const PlanarPose X_DE{p_DE.x(), p_DE.y(), ValueOf(truth_.clamp.parallelogram, p_DE.x())};
  const SheetSample sample{time_ns_, X_DE * truth_.X_EW * creep_};
  sheet_.Push(sample);
  outbox_[made_++ % kOutbox] = sample;
}

// Cubic Hermite between the last set-point whose time has come and the next.
void DrivePlant::FollowSetpoint() {
  while (queue_count_ > 0 && queue_[queue_first_].execute_at_ns <= time_ns_) {
    played_ = queue_[queue_first_];
    queue_first_ = (queue_first_ + 1) % kQueue;
    --queue_count_;
    dry_ = false;
    if (played_.execute_at_ns == time_ns_) {
      for (std::size_t i = 0; i < kActuatorCount; ++i) {
        servos_[i].wanted_mm = played_.position_mm[i];
        servos_[i].wanted_rate_mm_per_s = played_.velocity_mm_per_s[i];
      }
      return;
    }
  }
  if (queue_count_ == 0 || dry_) {
    if (!dry_) {
      ++missing_;
      dry_ = true;
    }
    Brake(kStep_s);
    return;
  }
  const drive::Setpoint& next = queue_[queue_first_];
  const double h = ToSeconds(next.execute_at_ns - played_.execute_at_ns);
  const double u = ToSeconds(time_ns_ - played_.execute_at_ns) / h;
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    const double da = h * played_.velocity_mm_per_s[i];
    const double db = h * next.velocity_mm_per_s[i];
    const double dx = next.position_mm[i] - played_.position_mm[i];
    const double c2 = 3.0 * dx - 2.0 * da - db;
    const double c3 = da + db - 2.0 * dx;
    servos_[i].wanted_mm = played_.position_mm[i] + u * (da + u * (c2 + u * c3));
    servos_[i].wanted_rate_mm_per_s = (da + u * (2.0 * c2 + 3.0 * u * c3)) / h;
  }
}

void DrivePlant::Brake(double step_s) {
  for (Servo& servo : servos_) {
    const double v = servo.wanted_rate_mm_per_s;
    const double slower = std::copysign(std::max(0.0, std::abs(v) - kBrake_mm_per_s2 * step_s), v);
    servo.wanted_mm += 0.5 * (v + slower) * step_s;
    servo.wanted_rate_mm_per_s = slower;
  }
}

void DrivePlant::MoveServos() {
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    Servo& servo = servos_[i];
    if (Active(FaultKind::kStall, static_cast<int>(i)) != nullptr) {
      servo.velocity_mm_per_s = 0.0;
      continue;
    }
    // The error x - x_s obeys the closed loop, driven by the set-point's acceleration over this step.
    const double rate = servo.wanted_rate_mm_per_s;
    const double before_mm = servo.wanted_mm - 0.5 * (servo.last_rate_mm_per_s + rate) * kStep_s;
    double error_mm = servo.position_mm - before_mm;
    double error_rate = servo.velocity_mm_per_s - servo.last_rate_mm_per_s;
    servo.loop.Step(-(rate - servo.last_rate_mm_per_s) / kStep_s, error_mm, error_rate);
    servo.position_mm = servo.wanted_mm + error_mm;
    servo.velocity_mm_per_s = rate + error_rate;
    servo.last_rate_mm_per_s = rate;
    const double half = 0.5 * truth_.actuators[i].backlash_mm;
    servo.joint_mm = std::clamp(servo.joint_mm, servo.position_mm - half, servo.position_mm + half);
  }
}

// The set-point moves on a chord within a substep: the same free oscillation about it, with the jump of its speed.
void DrivePlant::MoveSheet() {
  const std::optional<Eigen::Vector2d> rigid = TruePoint(truth_, {servos_[0].joint_mm, servos_[1].joint_mm});
  if (!rigid) {
    broken_ = true;
    return;
  }
  const Eigen::Vector2d rate = (*rigid - rigid_mm_) / kStep_s;
  bend_rate_mm_per_s_ += rigid_rate_mm_per_s_ - rate;
  for (int axis = 0; axis < 2; ++axis) {
    levers_[static_cast<std::size_t>(axis)].Step(0.0, bend_mm_[axis], bend_rate_mm_per_s_[axis]);
  }
  rigid_mm_ = *rigid;
  rigid_rate_mm_per_s_ = rate;
}

// Ornstein-Uhlenbeck: bounded wandering of the sheet in its clamp.
void DrivePlant::Creep() {
  const double keep = 1e-3 / truth_.clamp.creep_time_s;
  const double kick = std::sqrt(2.0 * keep);
  creep_.x_mm += -keep * creep_.x_mm + kick * truth_.clamp.creep_mm * normal_(random_);
  creep_.y_mm += -keep * creep_.y_mm + kick * truth_.clamp.creep_mm * normal_(random_);
  creep_.theta_rad += -keep * creep_.theta_rad + kick * truth_.clamp.creep_turn_rad * normal_(random_);
}

double DrivePlant::Reading(std::size_t i, double ahead_s) {
  Servo& servo = servos_[i];
  const ActuatorTruth& actuator = truth_.actuators[i];
  const double place = servo.position_mm + servo.velocity_mm_per_s * ahead_s;
  const double seen = place + ValueOf(actuator.encoder_wave, place);
  double reading = actuator.encoder_step_mm > 0.0
                       ? std::round(seen / actuator.encoder_step_mm) * actuator.encoder_step_mm
                       : seen;
  if (Active(FaultKind::kSensorFreeze, static_cast<int>(i)) != nullptr) {
    servo.frozen_mm = servo.frozen ? servo.frozen_mm : reading;
    servo.frozen = true;
    reading = servo.frozen_mm;
  } else {
    servo.frozen = false;
  }
  return reading;
}

const Fault* DrivePlant::Active(FaultKind kind, int index) const {
  for (std::size_t i = 0; i < fault_count_; ++i) {
    const TimedFault& timed = faults_[i];
    if (timed.fault.kind == kind && timed.fault.index == index && time_ns_ >= timed.from_ns &&
        time_ns_ < timed.to_ns) {
      return &timed.fault;
    }
  }
  return nullptr;
}

}  // namespace lambdajet::simulated_plant
