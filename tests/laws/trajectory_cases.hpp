// A machine like the demonstration's, seeded random part programs and circles of short blocks, and judges of plans that share
// nothing with the planner: the speed that no plan can exceed, the sheet on its spring.
//
// Units: mm, s. Threads: values.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "foundation/machine/machine_description.hpp"
#include "kinematics/core/lambda_mechanism.hpp"
#include "trajectory/core/feed/plan_program.hpp"

namespace lambdajet::trajectory {

inline MachineDescription DemoLikeMachine() {
  MachineDescription m;
  m.machine_id = "demo-like";
  m.version = 1;
  m.value(Parameter::kMainLinkLengthMm) = 1200.0;
  m.value(Parameter::kAttachLengthMm) = 600.0;
  m.value(Parameter::kSecondLinkLengthMm) = 700.0;
  m.value(Parameter::kBaseXMm) = 500.3;
  m.value(Parameter::kBaseYMm) = 999.8;
  m.value(Parameter::kBaseThetaRad) = 4e-4;
  m.value(Parameter::kSheetXMm) = -300.2;
  m.value(Parameter::kSheetYMm) = 100.1;
  m.value(Parameter::kSheetThetaRad) = 0.003;
  m.value(Parameter::kElasticLagS2) = 4e-4;
  m.value(Parameter::kDampingTimeS) = 0.0024;
  m.moving_mass_kg = 20.0;
  m.actuators[0] = m.actuators[1] = {-1600.0, 2600.0, 1500.0, 15000.0, 400000.0};
  m.path = {120.0, 300.0, 1050.0, 20000.0, 0.02};
  m.process.kerf_width_mm = 0.8;
  m.process.abrasive_flow_g_per_min = 350.0;
  m.process.abrasive_flow_max_g_per_min = 800.0;
  m.process.jet_lag_time_s = 0.003;
  m.process.pierce_time_s = 0.6;
  m.sheet_width_mm = 800.0;
  m.sheet_height_mm = 600.0;
  m.singular_margin_mm = 20.0;
  return m;
}

// Cuts of lines, arcs and short blocks with idle moves between, anywhere on the sheet.
class RandomProgram {
 public:
  explicit RandomProgram(unsigned seed) : random_(seed) {}

  std::string Make() {
    text_ = "G21 G90 G17\n";
    const int cuts = Pick(1, 3);
    for (int i = 0; i < cuts; ++i) {
      Cut();
    }
    return text_ + "M2\n";
  }

 private:
  int Pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  void Write(const char* format, double a, double b) {
    char line[96];
    std::snprintf(line, sizeof line, format, a, b);
    text_ += line;
  }

  void Cut() {
    x_ = Between(100, 700);
    y_ = Between(100, 500);
    Write("G0 X%.3f Y%.3f\nM3 P0.3\n", x_, y_);
    Write("G1 F%.0f\n", Between(600, 7200), 0);
    const int blocks = Pick(1, 12);
    for (int i = 0; i < blocks; ++i) {
      switch (Pick(0, 3)) {
        case 0:
          Line(Between(5, 60));
          break;
        case 1:
          Line(Between(0.05, 2));
          break;
        case 2:
          Arc();
          break;
        default:
          ShortBlocks();
          break;
      }
    }
    text_ += "M5\n";
  }

  // Turns back to the middle where a move would leave the sheet's margin.
  bool Inside(double x, double y) const { return x > 30 && x < 770 && y > 30 && y < 570; }

  void Line(double length) {
    for (int k = 0; k < 20; ++k) {
      const double angle = heading_ + Between(-2.5, 2.5);
      const double x = x_ + length * std::cos(angle), y = y_ + length * std::sin(angle);
      if (Inside(x, y)) {
        heading_ = angle;
        x_ = x, y_ = y;
        Write("G1 X%.4f Y%.4f\n", x, y);
        return;
      }
    }
  }

  void Arc() {
    const double radius = std::exp(Between(std::log(0.5), std::log(60.0)));
    const double sweep = Between(0.2, 6.0), turn = Pick(0, 1) == 0 ? 1.0 : -1.0;
    const double cx = x_ - turn * radius * std::sin(heading_), cy = y_ + turn * radius * std::cos(heading_);
    if (!Inside(cx - radius, cy - radius) || !Inside(cx + radius, cy + radius)) {
      return;
    }
    const double end = heading_ + turn * sweep;
    const double x = cx + turn * radius * std::sin(end), y = cy - turn * radius * std::cos(end);
    char line[160];
    std::snprintf(line, sizeof line, "%s X%.5f Y%.5f I%.5f J%.5f\n", turn > 0 ? "G3" : "G2", x, y, cx - x_,
                  cy - y_);
    text_ += line;
    x_ = std::round(x * 1e5) / 1e5, y_ = std::round(y * 1e5) / 1e5;
    heading_ = end;
  }

  void ShortBlocks() {
    const double radius = Between(5, 40), turn = Pick(0, 1) == 0 ? 1.0 : -1.0;
    const double step = std::exp(Between(std::log(0.02), std::log(0.5)));
    for (int i = 0; i < 200; ++i) {
      heading_ += turn * step / radius;
      const double x = x_ + step * std::cos(heading_), y = y_ + step * std::sin(heading_);
      if (!Inside(x, y)) {
        return;
      }
      x_ = x, y_ = y;
      Write("G1 X%.4f Y%.4f\n", x, y);
    }
  }

  std::mt19937 random_;
  std::string text_;
  double x_ = 0.0, y_ = 0.0, heading_ = 0.0;
};

inline void AddLine(std::string& text, double x, double y) {
  char line[64];
  std::snprintf(line, sizeof line, "G1 X%.4f Y%.4f\n", x, y);
  text += line;
}

// Round and round.
inline std::string CircleOfShortBlocks(int blocks, double radius, double step, double feed_mm_per_min) {
  std::string text =
      "G21 G90\nG0 X" + std::to_string(400 + radius) + " Y300\nG1 F" + std::to_string(feed_mm_per_min) + "\n";
  text.reserve(static_cast<std::size_t>(blocks) * 26);
  for (int i = 1; i <= blocks; ++i) {
    const double a = i * step / radius;
    AddLine(text, 400 + radius * std::cos(a), 300 + radius * std::sin(a));
  }
  return text + "M2\n";
}

inline std::string FigureEight(int blocks, double radius, double step, double feed_mm_per_min) {
  std::string text = "G21 G90\nG0 X400 Y300\nG1 F" + std::to_string(feed_mm_per_min) + "\n";
  const double lap = 2 * std::numbers::pi * radius;
  for (int i = 1; i <= blocks; ++i) {
    const double s = std::fmod(i * step, 2 * lap);
    const double side = s < lap ? 1.0 : -1.0, a = std::fmod(s, lap) / radius;
    AddLine(text, 400 + side * radius * (1 - std::cos(a)), 300 + radius * std::sin(a));
  }
  return text + "M2\n";
}

// Mean speed no plan can exceed on circles of a radius about a centre: everywhere the least of the programmed feed, of what
// curvature leaves of the path's acceleration, and of the actuators' speed over their travel per millimetre of path, taken
// from positions a micrometre apart. Jerk, actuator acceleration and the way from rest only make a plan slower.
inline double FastestMeanSpeed(const MachineDescription& m, double feed_mm_per_s, double radius_mm,
                               const std::vector<Eigen::Vector2d>& centres_mm) {
  const auto mechanism = kinematics::LambdaMechanism::FromDescription(m);
  const auto actuators = [&](const Eigen::Vector2d& p_W) {
    return kinematics::SolveInverse(mechanism, m.X_DJ().translation_mm() - m.X_EW() * p_W)
        .actuator_position_mm;
  };
  double time_a_mm = 0.0;
  constexpr int kPlaces = 2000;
  constexpr double kStep_mm = 1e-3;
  for (const Eigen::Vector2d& centre : centres_mm) {
    for (int i = 0; i < kPlaces; ++i) {
      const double a = 2 * std::numbers::pi * i / kPlaces;
      const auto at = [&](double angle) {
        return Eigen::Vector2d(centre + radius_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
      };
      const Eigen::Vector2d travel = (actuators(at(a + kStep_mm / radius_mm)) - actuators(at(a))) / kStep_mm;
      double v = std::min(feed_mm_per_s, std::sqrt(m.path.acceleration_mm_per_s2 * radius_mm));
      for (int j = 0; j < 2; ++j) {
        v = std::min(v, m.actuators[static_cast<std::size_t>(j)].velocity_mm_per_s / std::abs(travel[j]));
      }
      time_a_mm += 1.0 / v;
    }
  }
  return static_cast<double>(kPlaces * centres_mm.size()) / time_a_mm;
}

// Mean speed of a plan without its first and last twentieth.
inline double MeanSpeed(const PlannedProgram& p) {
  double length = 0.0, time = 0.0;
  for (std::size_t i = 1; i < p.samples.size(); ++i) {
    const double s = p.samples[i].s_mm;
    if (s > 0.05 * p.plan.length_mm && s < 0.95 * p.plan.length_mm) {
      length += s - p.samples[i - 1].s_mm;
      time += p.samples[i].tau_s - p.samples[i - 1].tau_s;
    }
  }
  return length / time;
}

// How far the sheet on its spring stays from the programmed motion, root mean square: u'' = -w2 (u - x) - w2 T (u' - x')
// behind the effector's played motion x, by Runge and Kutta's fourth-order rule on (u, u' + w2 T (u - x)), which needs no x'.
inline double ElasticError(const MachineDescription& truth, const PlannedProgram& p,
                           const MachineDescription& planned_for) {
  using Eigen::Vector2d;
  const double w2 = 1.0 / truth.value(Parameter::kElasticLagS2);
  const double damping = w2 * truth.value(Parameter::kDampingTimeS);
  const auto mechanism = kinematics::LambdaMechanism::FromDescription(planned_for);
  const auto effector = [&](const Segment& s, double t, double lead) {
    return kinematics::SolveForward(mechanism, {s.q_mm[0].value(t) + lead * s.lead_mm[0].value(t),
                                                s.q_mm[1].value(t) + lead * s.lead_mm[1].value(t)})
        .p_DE_mm;
  };
  struct State {
    Vector2d u, p;
  };
  const auto rate = [&](const State& s, const Vector2d& x) {
    return State{s.p - damping * (s.u - x), -w2 * (s.u - x)};
  };
  const auto moved = [](const State& s, const State& k, double h) {
    return State{s.u + h * k.u, s.p + h * k.p};
  };
  State sheet{effector(p.plan.segments.front(), 0.0, 1.0), Vector2d::Zero()};
  double sum = 0.0;
  std::size_t count = 0;
  constexpr int kSteps = 20;  // a segment
  for (const Segment& s : p.plan.segments) {
    const double h = s.duration_s / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const Vector2d x0 = effector(s, i * h, 1.0), x1 = effector(s, (i + 0.5) * h, 1.0),
                     x2 = effector(s, (i + 1) * h, 1.0);
      const State a = rate(sheet, x0), b = rate(moved(sheet, a, h / 2), x1),
                  c = rate(moved(sheet, b, h / 2), x1), d = rate(moved(sheet, c, h), x2);
      sheet.u += h / 6 * (a.u + 2 * b.u + 2 * c.u + d.u);
      sheet.p += h / 6 * (a.p + 2 * b.p + 2 * c.p + d.p);
      sum += (sheet.u - effector(s, (i + 1) * h, 0.0)).squaredNorm();
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

struct ElasticFigures {
  double untreated_mm = 0.0;
  double removed_exact = 0.0;  // shares
  double removed_wrong = 0.0;  // planned for a stiffness a tenth too low
};

// Lines, arcs, corners.
inline ElasticFigures MeasureFeedForward() {
  const std::string text =
      "G21 G90\nG0 X300 Y200\nM3\nG1 F4800\nG1 X400\nG3 X420 Y220 I0 J20\nG1 Y300\nG2 X440 Y320 I20\nG1 X500 "
      "Y260\nM5\nM2\n";
  const MachineDescription m = DemoLikeMachine();
  PlanOptions options;
  options.compensate = true;
  MachineDescription wrong = m;
  wrong.value(Parameter::kElasticLagS2) *= 1.1;
  ElasticFigures figures;
  figures.untreated_mm = ElasticError(m, PlanPartProgram(text, m, {}), m);
  figures.removed_exact = 1 - ElasticError(m, PlanPartProgram(text, m, options), m) / figures.untreated_mm;
  figures.removed_wrong =
      1 - ElasticError(m, PlanPartProgram(text, wrong, options), m) / figures.untreated_mm;
  return figures;
}

}  // namespace lambdajet::trajectory
