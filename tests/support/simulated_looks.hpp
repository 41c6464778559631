// Makes runs of camera looks from a machine of known truth, with exactly the noise the calibration model assumes.
//
// Model: truth drawn from the machine file's sigmas; looks as services/calibration/core/look_model.hpp predicts them for
// the truth, plus camera noise, marks off their places, jet wander, and the effector off by straightness and backlash. The
// sheet's swing in a tracking run is integrated by classical Runge-Kutta at 0.1 ms, not by the code under test.
// Frames, units: foundation/geometry/frames.md; mm, s.
// Threads: one generator, one thread.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "calibration/core/look_model.hpp"
#include "calibration/core/measurement.hpp"
#include "foundation/machine/machine_description.hpp"

namespace lambdajet::support {

inline void SetSigma(MachineDescription& machine, Parameter p, double value, double sigma) {
  machine.value(p) = value;
  machine.covariance(static_cast<int>(p), static_cast<int>(p)) = sigma * sigma;
}

// A machine of the paper's size, with 20 marks on a sheet of 500 x 400 mm.
inline MachineDescription PaperSizedMachine() {
  using P = Parameter;
  MachineDescription m;
  m.machine_id = "paper-sized";
  SetSigma(m, P::kMainLinkLengthMm, 1200.0, 0.10);
  SetSigma(m, P::kAttachLengthMm, 600.0, 0.10);
  SetSigma(m, P::kSecondLinkLengthMm, 700.0, 0.10);
  SetSigma(m, P::kRail1AngleRad, 0.0, 1e-4);
  SetSigma(m, P::kRail1OffsetMm, 0.0, 0.05);
  SetSigma(m, P::kRail2AngleRad, 0.0, 1e-4);
  SetSigma(m, P::kRail2OffsetMm, 0.0, 0.05);
  SetSigma(m, P::kSlider1ZeroMm, 0.0, 0.2);
  SetSigma(m, P::kSlider2ZeroMm, 0.0, 0.2);
  SetSigma(m, P::kBaseXMm, 30.0, 0.3);
  SetSigma(m, P::kBaseYMm, 700.0, 0.3);
  SetSigma(m, P::kBaseThetaRad, 0.01, 4e-4);
  SetSigma(m, P::kSheetXMm, -250.0, 0.2);
  SetSigma(m, P::kSheetYMm, -200.0, 0.2);
  SetSigma(m, P::kSheetThetaRad, -0.005, 4e-4);
  SetSigma(m, P::kCameraXMm, 80.0, 0.2);
  SetSigma(m, P::kCameraYMm, 5.0, 0.2);
  SetSigma(m, P::kElasticLagS2, 7.6e-4, 1.5e-4);
  SetSigma(m, P::kDampingTimeS, 2.8e-3, 1.2e-3);
  m.moving_mass_kg = 38.0;
  for (ActuatorLimits& a : m.actuators) {
    a = {-3000.0, 3000.0, 1000.0, 2000.0, 20000.0};
  }
  m.path = {150.0, 300.0, 500.0, 20000.0, 0.02};
  m.process.measuring_settle_time_s = 20.0;  // no swing left in the looks at rest
  m.process.pierce_time_s = 0.5;
  m.uncertainties = {0.003, 0.004, 0.005, 0.003, 0.005, 0.005, 0.1};
  m.sheet_width_mm = 500.0;
  m.sheet_height_mm = 400.0;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 5; ++column) {
      m.marks.push_back({1 + column + 5 * row, 30.0 + 110.0 * column, 30.0 + 113.0 * row});
    }
  }
  m.singular_margin_mm = 20.0;
  return m;
}

class LookSimulator {
 public:
  LookSimulator(const MachineDescription& machine, std::uint64_t seed) : machine_(machine), random_(seed) {
    truth_ = machine.parameters;
  }

  // Truth at random, as probable as the machine file says.
  void DrawTruth() {
    for (Eigen::Index i = 0; i < truth_.size(); ++i) {
      truth_[i] = machine_.parameters[i] + std::sqrt(machine_.covariance(i, i)) * Normal();
    }
    auto& lag = truth_[calibration::At(Parameter::kElasticLagS2)];
    auto& damping = truth_[calibration::At(Parameter::kDampingTimeS)];
    lag = std::max(lag, 1e-5);
    damping = std::max(damping, 1e-4);
  }
  const ParameterVector& truth() const { return truth_; }
  void SetTruth(const ParameterVector& truth) { truth_ = truth; }
  double Normal() { return normal_(random_); }

  // A still look with the mark near the middle of the picture.
  calibration::Measurement Still(int mark) {
    using calibration::JetPlaceForLook;
    const Eigen::Vector2d p_W = *calibration::MarkPlace(machine_, mark);
    calibration::Measurement look;
    look.mark = mark;
    look.actuator_position_mm = *calibration::ReadingsForJet(machine_, machine_.parameters,
                                                             JetPlaceForLook(machine_.parameters, p_W));
    Expose(look, MarkError(mark, machine_.uncertainties.mark_mm), Eigen::Vector2d::Zero(), true);
    return look;
  }

  // Pierces at a place (where the machine believes it is) and looks at the hole.
  calibration::Measurement Hole(int number, const Eigen::Vector2d& p_W) {
    calibration::Measurement look;
    look.kind = calibration::LookKind::kHole;
    look.mark = calibration::kFirstHole + number;
    look.pierce_actuator_position_mm = *calibration::ReadingsForJet(machine_, machine_.parameters, p_W);
    look.actuator_position_mm = *calibration::ReadingsForJet(
        machine_, machine_.parameters, calibration::JetPlaceForLook(machine_.parameters, p_W));
    Expose(look,
           MarkError(look.mark, machine_.uncertainties.jet_wander_mm) +
               PlaceNoise(look.pierce_actuator_position_mm, true, true),
           Eigen::Vector2d::Zero(), true);
    return look;
  }

  // Pictures every `period_s` of a mark while the jet runs an ellipse about the place from which the mark is
  // seen: three turns with the speed rising and falling smoothly, the sheet swinging freely, then half a
  // second at rest.
  std::vector<calibration::Measurement> Tracking(int mark, double radius_x_mm, double radius_y_mm,
                                                 double turn_s, double period_s = 0.02) {
    const Eigen::Vector2d centre =
        calibration::JetPlaceForLook(machine_.parameters, *calibration::MarkPlace(machine_, mark));
    const double moving_s = 3.0 * turn_s;
    const auto reading = [&](double t) {
      const double u = std::clamp(t / moving_s, 0.0, 1.0);
      const double turn = u * u * u * (10.0 + u * (6.0 * u - 15.0));
      const double angle = 3.0 * 2.0 * std::numbers::pi * turn;
      const Eigen::Vector2d p_W =
          centre + Eigen::Vector2d(radius_x_mm * (1.0 - std::cos(angle)), radius_y_mm * std::sin(angle));
      return *calibration::ReadingsForJet(machine_, machine_.parameters, p_W);
    };
    const auto place = [&](double t) {
      return calibration::PlaceEffector(machine_, truth_, reading(t)).p_DE_mm;
    };
    const Eigen::Vector2d common = PlaceNoise(reading(0.0), true, false);
    const Eigen::Vector2d mark_error = MarkError(mark, machine_.uncertainties.mark_mm);
    std::vector<calibration::Measurement> pictures;
    Eigen::Vector2d u = Eigen::Vector2d::Zero();
    Eigen::Vector2d v = Eigen::Vector2d::Zero();
    const double step = 1e-3;
    const int per_picture = static_cast<int>(std::lround(period_s / step));
    const int steps = static_cast<int>(std::lround((moving_s + 0.5) / step));
    const auto acceleration = [&](double t) -> Eigen::Vector2d {
      const double h = 1e-3;
      return (place(t + h) - 2.0 * place(t) + place(t - h)) / (h * h);
    };
    const double lag = truth_[calibration::At(Parameter::kElasticLagS2)];
    const double damping = truth_[calibration::At(Parameter::kDampingTimeS)];
    const std::int64_t start_ns = now_ns_ + 1000000000;
    Eigen::Vector2d a0 = acceleration(0.0);
    for (int k = 0; k <= steps; ++k) {
      const double t = k * step;
      if (k % per_picture == 0) {
        calibration::Measurement look;
        look.kind = calibration::LookKind::kTracking;
        look.mark = mark;
        look.actuator_position_mm = reading(t);
        look.actuator_velocity_mm_per_s = (reading(t + 1e-4) - reading(t - 1e-4)) / 2e-4;
        now_ns_ = start_ns + static_cast<std::int64_t>(k) * 1000000 - 1000000000;
        Expose(look, common + mark_error, u, false);
        pictures.push_back(look);
      }
      const Eigen::Vector2d a1 = acceleration(t + step);
      for (int inner = 0; inner < 10; ++inner) {
        RungeKutta(lag, damping, a0 + (a1 - a0) * (inner / 10.0), a0 + (a1 - a0) * ((inner + 1) / 10.0),
                   step / 10.0, u, v);
      }
      a0 = a1;
    }
    return pictures;
  }

  // What a measuring run brings: looks at all marks, three holes, two tracking runs.
  std::vector<calibration::Measurement> MeasuringRun(double picture_period_s = 0.02) {
    std::vector<calibration::Measurement> run;
    for (const SheetMark& mark : machine_.marks) {
      run.push_back(Still(mark.id));
    }
    for (int n = 1; n <= 3; ++n) {
      run.push_back(Hole(n, {250.0 + 10.0 * n, 8.0}));
    }
    for (const auto& more :
         {Tracking(8, 4.0, 4.0, 0.7, picture_period_s), Tracking(13, 2.0, 2.0, 0.45, picture_period_s)}) {
      run.insert(run.end(), more.begin(), more.end());
    }
    return run;
  }

 private:
  // In the camera's frame; the same at every look.
  Eigen::Vector2d MarkError(int mark, double sigma) {
    const auto found = mark_error_.find(mark);
    if (found != mark_error_.end()) {
      return found->second;
    }
    return mark_error_[mark] = sigma * Eigen::Vector2d(Normal(), Normal());
  }

  Eigen::Vector2d PlaceNoise(const Eigen::Vector2d& q, bool straightness, bool backlash) {
    const auto place = calibration::PlaceEffector(machine_, truth_, q);
    Eigen::Vector2d off_D = Eigen::Vector2d::Zero();
    if (straightness) {
      off_D += machine_.uncertainties.straightness_mm *
               (Normal() * place.J_x_parameters.col(calibration::At(Parameter::kRail1OffsetMm)) +
                Normal() * place.J_x_parameters.col(calibration::At(Parameter::kRail2OffsetMm)));
    }
    if (backlash) {
      off_D += machine_.uncertainties.backlash_mm / std::sqrt(12.0) *
               (place.J_x_q() * Eigen::Vector2d(Normal(), Normal()));
    }
    return PlanarPose{0, 0, truth_[calibration::At(Parameter::kBaseThetaRad)]}.rotation().transpose() * off_D;
  }

  void Expose(calibration::Measurement& look, const Eigen::Vector2d& off_C, const Eigen::Vector2d& deflection,
              bool still) {
    now_ns_ += 1000000000;
    look.exposure_ns = now_ns_;
    const double camera = machine_.uncertainties.camera_mm;
    look.p_C_mm = calibration::PredictLook(machine_, truth_, look, deflection).p_C_mm + off_C +
                  PlaceNoise(look.actuator_position_mm, still, true) +
                  camera * Eigen::Vector2d(Normal(), Normal());
  }

  static void RungeKutta(double lag, double damping, const Eigen::Vector2d& a0, const Eigen::Vector2d& a1,
                         double h, Eigen::Vector2d& u, Eigen::Vector2d& v) {
    const auto f = [&](const Eigen::Vector2d& x, const Eigen::Vector2d& w, double s) -> Eigen::Vector2d {
      return -(a0 + (a1 - a0) * s) - (damping * w + x) / lag;
    };
    const Eigen::Vector2d k1 = f(u, v, 0.0), k2 = f(u + 0.5 * h * v, v + 0.5 * h * k1, 0.5);
    const Eigen::Vector2d v2 = v + 0.5 * h * k1, v3 = v + 0.5 * h * k2;
    const Eigen::Vector2d k3 = f(u + 0.5 * h * v2, v3, 0.5);
    const Eigen::Vector2d v4 = v + h * k3;
    const Eigen::Vector2d k4 = f(u + h * v3, v4, 1.0);
    u += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
    v += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }

  MachineDescription machine_;
  ParameterVector truth_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::map<int, Eigen::Vector2d> mark_error_;
  std::int64_t now_ns_ = 1000000000;
};

}  // namespace lambdajet::support
