// A machine like the demonstration's and seeded random part programs, for the laws of the planner.
//
// Units: mm, s. Threads: values.
#pragma once

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>

#include "foundation/machine/machine_description.hpp"

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

}  // namespace lambdajet::trajectory
