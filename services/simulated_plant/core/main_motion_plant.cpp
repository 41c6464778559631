#include "simulated_plant/core/main_motion_plant.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "foundation/motion/nanoseconds.hpp"

namespace lambdajet::simulated_plant {
namespace {

constexpr double kHoming_s = 0.5;
constexpr double kStandOffRate_mm_per_s = 40.0;
constexpr double kShortestDelay = 0.2;           // of the mean, however the scatter falls
constexpr std::int64_t kBlind_ns = 500'000'000;  // a picture without known truth by then shows nothing
constexpr std::int64_t kLongestPause_ns = 2'000'000'000;
constexpr std::int64_t kPiercing_ns = 400'000'000;  // the stretch of a pierce that makes the hole
constexpr std::int64_t kPiercingStep_ns = 10'000'000;

}  // namespace

MainMotionPlant::MainMotionPlant(const PlantTruth& truth, std::uint64_t seed, const SheetTruthSource& sheet)
    : truth_(truth),
      random_(seed),
      feeder_random_(seed + 1),
      sheet_(sheet),
      p_DJ_mm_(truth.X_DJ().translation_mm()),
      flow_g_per_min_(truth.pump.abrasive_g_per_min) {
  valves_[static_cast<std::size_t>(main_motion::Valve::kJet)].truth = &truth_.jet_valve;
  valves_[static_cast<std::size_t>(main_motion::Valve::kAbrasive)].truth = &truth_.abrasive_valve;
  valves_[static_cast<std::size_t>(main_motion::Valve::kAbrasiveFeeder)].truth = &truth_.abrasive_valve;
  holes_W_mm_.reserve(kHoles);
}

main_motion::MainMotionReadings MainMotionPlant::ReadState(std::int64_t now_ns) {
  if (time_ns_ == 0) {
    time_ns_ = now_ns / kSample_ns * kSample_ns;
    for (const Fault& fault : truth_.faults) {
      Inject(fault);
    }
  }
  main_motion::MainMotionReadings readings;
  readings.time_ns = now_ns;
  Advance(now_ns);
  RunValves(now_ns, readings);
  SettleHoles();
  RunShots(now_ns, readings);
  read_ns_ = now_ns;
  if (homing_ && now_ns >= homed_at_ns_) {
    homing_ = false;
    referenced_ = true;
  }
  const ValveLine& jet = valves_[0];
  const ValveLine& abrasive = valves_[1];
  readings.referenced = referenced_;
  readings.sensor_fault = Active(FaultKind::kSensorFault, 0) != nullptr;
  readings.jet_on = jet.water;
  readings.abrasive_on = abrasive.water;
  readings.pump_pressure_mpa =
      pressure_mpa_ + (pressure_mpa_ / truth_.pump.pressure_mpa) * truth_.pump.ripple_mpa *
                          std::sin(2.0 * std::numbers::pi * truth_.pump.ripple_hz * 1e-9 *
                                   static_cast<double>(now_ns % 1'000'000'000'000));
  readings.abrasive_present = Active(FaultKind::kHopperEmpty, 0) == nullptr;
  readings.abrasive_g_per_min = abrasive.water && readings.abrasive_present ? flow_g_per_min_ : 0.0;
  readings.stand_off_mm = stand_off_mm_;
  return readings;
}

void MainMotionPlant::ScheduleOutput(main_motion::Valve valve, bool on, std::int64_t at_ns) {
  const auto v = static_cast<std::size_t>(valve);
  valves_[v].output = {true, on, at_ns, 0.0};
  if (at_ns <= read_ns_) {
    valves_[v].output.waiting = false;
    Fire(v, on, read_ns_);
  }
}

void MainMotionPlant::ScheduleFlow(double abrasive_g_per_min, std::int64_t at_ns) {
  constexpr auto kFeeder = static_cast<std::size_t>(main_motion::Valve::kAbrasiveFeeder);
  valves_[kFeeder].output = {true, true, at_ns, abrasive_g_per_min};
  if (at_ns <= read_ns_) {
    valves_[kFeeder].output.waiting = false;
    Fire(kFeeder, true, read_ns_);
  }
}

void MainMotionPlant::CancelOutput(main_motion::Valve valve) {
  valves_[static_cast<std::size_t>(valve)].output.waiting = false;
}

void MainMotionPlant::SetPump(bool on) { pump_on_ = on; }
void MainMotionPlant::SetStandOff(double stand_off_mm) { stand_off_wanted_mm_ = stand_off_mm; }

void MainMotionPlant::TakePicture(std::uint32_t request, main_motion::Feature feature,
                                  std::int64_t exposure_ns) {
  if (shot_count_ < kShots) {
    shots_[(shot_first_ + shot_count_++) % kShots] = {request, feature, exposure_ns};
  }
}

void MainMotionPlant::BeginHoming() {
  referenced_ = false;
  homing_ = true;
  homed_at_ns_ = read_ns_ + ToNs(kHoming_s);
}

void MainMotionPlant::Inject(const Fault& fault) {
  if (fault_count_ < kFaults) {
    const std::int64_t from_ns = time_ns_ + ToNs(fault.from_s);
    faults_[fault_count_++] = {fault, from_ns, from_ns + ToNs(fault.for_s)};
  }
}

std::optional<JetSample> MainMotionPlant::TakeJetSample() { return samples_.Take(); }
std::optional<JetSwitch> MainMotionPlant::TakeJetSwitch() { return switches_.Take(); }

void MainMotionPlant::Advance(std::int64_t now_ns) {
  if (now_ns - time_ns_ > kLongestPause_ns) {
    time_ns_ = (now_ns - kLongestPause_ns) / kSample_ns * kSample_ns;
  }
  const double keep = 1e-3 / truth_.jet_wander_time_s;
  const double kick = std::sqrt(2.0 * keep) * truth_.jet_wander_mm;
  while (time_ns_ + kSample_ns <= now_ns) {
    time_ns_ += kSample_ns;
    wander_mm_ += -keep * wander_mm_ + kick * Eigen::Vector2d(normal_(random_), normal_(random_));
    RunPump(1e-3);
    samples_.Put({time_ns_, JetNow()});
  }
}

void MainMotionPlant::RunPump(double dt_s) {
  const bool lost = Active(FaultKind::kPressureLoss, 0) != nullptr;
  const double wanted = pump_on_ && !lost ? truth_.pump.pressure_mpa : 0.0;
  pressure_mpa_ += (wanted - pressure_mpa_) * dt_s / truth_.pump.rise_time_s;
  const double way = stand_off_wanted_mm_ - stand_off_mm_;
  stand_off_mm_ += std::clamp(way, -kStandOffRate_mm_per_s * dt_s, kStandOffRate_mm_per_s * dt_s);
}

// The terminal switches; the water follows. A later command overtakes an earlier one that has not taken effect.
void MainMotionPlant::Fire(std::size_t valve, bool on, std::int64_t at_ns) {
  ValveLine& line = valves_[valve];
  const double delay_s = DelayOf(valve, on);
  if (valve == static_cast<std::size_t>(main_motion::Valve::kAbrasiveFeeder)) {
    line.effect = {true, true, at_ns + ToNs(delay_s), line.output.flow_g_per_min};
    return;
  }
  if (line.effect.waiting && line.effect.on != on && line.water == on) {
    line.effect.waiting = false;
    return;
  }
  if (line.water != on) {
    line.effect = {true, on, at_ns + ToNs(delay_s), 0.0};
  }
}

double MainMotionPlant::DelayOf(std::size_t valve, bool on) {
  const ValveTruth& truth = *valves_[valve].truth;
  const double mean_s = on ? truth.on_delay_s : truth.off_delay_s;
  const double delay_s = std::max(kShortestDelay * mean_s, mean_s + truth.scatter_s * Noise(valve));
  const Fault* fault = Active(FaultKind::kValveDelay, static_cast<int>(valve));
  return fault == nullptr ? delay_s : delay_s + fault->value;
}

double MainMotionPlant::Noise(std::size_t valve) {
  return valve == static_cast<std::size_t>(main_motion::Valve::kAbrasiveFeeder)
             ? feeder_normal_(feeder_random_)
             : normal_(random_);
}

void MainMotionPlant::RunValves(std::int64_t now_ns, main_motion::MainMotionReadings& readings) {
  for (std::size_t v = 0; v < valves_.size(); ++v) {
    ValveLine& line = valves_[v];
    // The effect of an earlier switching comes before a new one fires.
    for (int pass = 0; pass < 2; ++pass) {
      if (line.effect.waiting && line.effect.at_ns <= now_ns &&
          (!line.output.waiting || line.effect.at_ns <= line.output.at_ns || pass == 1)) {
        line.effect.waiting = false;
        line.water = line.effect.on;
        if (v == static_cast<std::size_t>(main_motion::Valve::kAbrasiveFeeder)) {
          flow_g_per_min_ = line.effect.flow_g_per_min;
        }
        const std::int64_t seen_ns = line.effect.at_ns + ToNs(line.truth->sensor_s * Noise(v));
        if (readings.effect_count < main_motion::kEffectsPerCycle) {
          readings.effects[readings.effect_count++] = {static_cast<main_motion::Valve>(v), line.water,
                                                       seen_ns};
        }
        if (v == 0) {
          switches_.Put({line.effect.at_ns, line.water});
          if (line.water && new_hole_count_ < new_holes_.size()) {
            new_holes_[new_hole_count_++] = {line.effect.at_ns, JetNow()};
          }
        }
      }
      if (line.output.waiting && line.output.at_ns <= now_ns) {
        line.output.waiting = false;
        Fire(v, line.output.on, line.output.at_ns);
      }
    }
  }
}

// The hole is where the jet stood over the first stretch of piercing, the sheet still swinging a little.
void MainMotionPlant::SettleHoles() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < new_hole_count_; ++i) {
    const NewHole hole = new_holes_[i];
    if (sheet_.newest_ns() < hole.time_ns + kPiercing_ns) {
      if (time_ns_ - hole.time_ns < kLongestPause_ns) {
        new_holes_[kept++] = hole;
      }
      continue;
    }
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    int count = 0;
    for (std::int64_t t = hole.time_ns; t <= hole.time_ns + kPiercing_ns; t += kPiercingStep_ns) {
      if (const std::optional<PlanarPose> X_DW = sheet_.PoseAt(t)) {
        sum += X_DW->Inverse() * hole.p_DJ_mm;
        ++count;
      }
    }
    if (count > 0 && holes_W_mm_.size() < kHoles) {
      holes_W_mm_.push_back(sum / count);
    }
  }
  new_hole_count_ = kept;
}

void MainMotionPlant::RunShots(std::int64_t now_ns, main_motion::MainMotionReadings& readings) {
  const std::int64_t latency_ns = ToNs(truth_.camera.latency_s);
  while (shot_count_ > 0 && readings.picture_count < main_motion::kPicturesPerCycle) {
    const Shot& shot = shots_[shot_first_];
    if (now_ns < shot.exposure_ns + latency_ns) {
      return;
    }
    const std::optional<PlanarPose> X_DW = sheet_.PoseAt(shot.exposure_ns);
    if (!X_DW && now_ns < shot.exposure_ns + kBlind_ns) {
      return;
    }
    main_motion::Picture picture;
    picture.request = shot.request;
    picture.exposure_ns = shot.exposure_ns;
    readings.pictures[readings.picture_count++] = X_DW ? Look(shot, *X_DW) : picture;
    shot_first_ = (shot_first_ + 1) % kShots;
    --shot_count_;
  }
}

main_motion::Picture MainMotionPlant::Look(const Shot& shot, const PlanarPose& X_DW) {
  main_motion::Picture picture;
  picture.request = shot.request;
  picture.exposure_ns = shot.exposure_ns;
  const PlanarPose X_HD = truth_.X_DH.Inverse();
  const Eigen::Vector2d p_HC(truth_.camera.p_HC_x_mm, truth_.camera.p_HC_y_mm);
  double nearest_mm = truth_.camera.field_of_view_mm;
  const auto consider = [&](const Eigen::Vector2d& p_W) {
    const Eigen::Vector2d p_C = X_HD * (X_DW * p_W) - p_HC;
    const double off_mm = p_C.cwiseAbs().maxCoeff();
    if (off_mm <= nearest_mm) {
      nearest_mm = off_mm;
      picture.seen = true;
      picture.x_C_mm = p_C.x();
      picture.y_C_mm = p_C.y();
    }
  };
  if (shot.feature == main_motion::Feature::kHole) {
    for (const Eigen::Vector2d& hole : holes_W_mm_) {
      consider(hole);
    }
  } else {
    for (const SheetMark& mark : truth_.marks) {
      consider({mark.x_W_mm, mark.y_W_mm});
    }
  }
  if (picture.seen) {
    picture.x_C_mm += truth_.camera.noise_mm * normal_(random_);
    picture.y_C_mm += truth_.camera.noise_mm * normal_(random_);
  }
  return picture;
}

const Fault* MainMotionPlant::Active(FaultKind kind, int index) const {
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
