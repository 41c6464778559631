// Stands in for the main-motion module's iron: pump, valves on time-stamped outputs, head, jet and camera.
//
// Model: an output fires at its own stamp, or on arrival if that has passed; water follows after the valve's true delay
// and scatter, and a sensor sees it with its own scatter. A new flow of abrasive takes the way of abrasive that comes on. The jet's axis is off its head by the stack's tilts and wanders
// a little. Where water comes on, a hole is pierced and remembered in true W. The camera, fixed to the head, reads a mark
// or hole at p_C = R_DH' (X_DW p_W - p_DH) - p_HC with noise, if one lies in its field of view.
// Frames: D, H, C, W. Units: mm, s, MPa; common time ns. Threads: one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "main_motion/core/main_motion_hardware.hpp"
#include "simulated_plant/core/plant_truth.hpp"
#include "simulated_plant/core/sheet_truth.hpp"

namespace lambdajet::simulated_plant {

struct JetSample {
  std::int64_t time_ns = 0;
  Eigen::Vector2d p_DJ_mm = Eigen::Vector2d::Zero();
};

struct JetSwitch {
  std::int64_t time_ns = 0;
  bool on = false;
};

class MainMotionPlant final : public main_motion::MainMotionHardware {
 public:
  MainMotionPlant(const PlantTruth& truth, std::uint64_t seed, const SheetTruthSource& sheet);

  main_motion::MainMotionReadings ReadState(std::int64_t now_ns) override;
  void ScheduleOutput(main_motion::Valve valve, bool on, std::int64_t at_ns) override;
  void ScheduleFlow(double abrasive_g_per_min, std::int64_t at_ns) override;
  void CancelOutput(main_motion::Valve valve) override;
  void SetPump(bool on) override;
  void SetStandOff(double stand_off_mm) override;
  void TakePicture(std::uint32_t request, main_motion::Feature feature, std::int64_t exposure_ns) override;
  void BeginHoming() override;

  void Inject(const Fault& fault);
  double lag_time_s() const { return truth_.jet_lag_time_s; }
  bool jet_on() const { return valves_[0].water; }
  std::optional<JetSample> TakeJetSample();
  std::optional<JetSwitch> TakeJetSwitch();

 private:
  struct Pending {
    bool waiting = false;
    bool on = false;
    std::int64_t at_ns = 0;
    double flow_g_per_min = 0.0;  // of the feeder
  };
  struct Shot {
    std::uint32_t request = 0;
    main_motion::Feature feature = main_motion::Feature::kMark;
    std::int64_t exposure_ns = 0;
  };
  struct ValveLine {
    const ValveTruth* truth = nullptr;
    Pending output;
    Pending effect;
    bool water = false;
  };
  template <typename T, std::size_t N>
  struct Outbox {
    std::array<T, N> items{};
    std::size_t made = 0;
    std::size_t taken = 0;
    void Put(const T& item) { items[made++ % N] = item; }
    std::optional<T> Take() {
      taken = made - taken > N ? made - N : taken;
      return made == taken ? std::nullopt : std::optional<T>(items[taken++ % N]);
    }
  };

  void Advance(std::int64_t now_ns);
  void Fire(std::size_t valve, bool on, std::int64_t at_ns);
  double DelayOf(std::size_t valve, bool on);
  double Noise(std::size_t valve);
  void RunValves(std::int64_t now_ns, main_motion::MainMotionReadings& readings);
  void RunPump(double dt_s);
  void RunShots(std::int64_t now_ns, main_motion::MainMotionReadings& readings);
  main_motion::Picture Look(const Shot& shot, const PlanarPose& X_DW);
  void SettleHoles();
  Eigen::Vector2d JetNow() const { return p_DJ_mm_ + wander_mm_; }
  const Fault* Active(FaultKind kind, int index) const;

  static constexpr std::int64_t kSample_ns = 1'000'000;
  static constexpr std::size_t kShots = 64;
  static constexpr std::size_t kHoles = 8192;
  static constexpr std::size_t kFaults = 32;

  PlantTruth truth_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  // The feeder's own, so that a run without it is the run it always was.
  std::mt19937_64 feeder_random_;
  std::normal_distribution<double> feeder_normal_;
  const SheetTruthSource& sheet_;
  Eigen::Vector2d p_DJ_mm_;
  Eigen::Vector2d wander_mm_ = Eigen::Vector2d::Zero();

  std::array<ValveLine, main_motion::kValveCount> valves_;
  bool pump_on_ = false;
  double pressure_mpa_ = 0.0;
  double flow_g_per_min_ = 0.0;
  double stand_off_mm_ = 20.0;
  double stand_off_wanted_mm_ = 20.0;

  std::array<Shot, kShots> shots_{};
  std::size_t shot_first_ = 0;
  std::size_t shot_count_ = 0;
  std::vector<Eigen::Vector2d> holes_W_mm_;
  struct NewHole {
    std::int64_t time_ns = 0;
    Eigen::Vector2d p_DJ_mm = Eigen::Vector2d::Zero();
  };
  std::array<NewHole, 16> new_holes_{};
  std::size_t new_hole_count_ = 0;

  std::int64_t time_ns_ = 0;
  std::int64_t read_ns_ = 0;
  std::int64_t homed_at_ns_ = 0;
  bool homing_ = false;
  bool referenced_ = false;
  Outbox<JetSample, 4096> samples_;
  Outbox<JetSwitch, 256> switches_;
  struct TimedFault {
    Fault fault;
    std::int64_t from_ns = 0;
    std::int64_t to_ns = 0;
  };
  std::array<TimedFault, kFaults> faults_{};
  std::size_t fault_count_ = 0;
};

}  // namespace lambdajet::simulated_plant
