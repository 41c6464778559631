// Seeded part programs that are hard on a planner, and that RandomProgram does not make.
//
// Model: a kind of difficulty by the seed, blocks of it between ordinary lines and arcs; the last kind mixes them all. Every
// program is correct and stays on the sheet. Units: mm, mm/min. Threads: values.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>

namespace lambdajet::trajectory {

class HostileProgram {
 public:
  explicit HostileProgram(unsigned seed) : random_(seed), kind_(seed % kKinds.size()) {}

  static constexpr std::array<const char*, 16> kKinds = {
      "spikes",    "zigzag",       "tiny_blocks", "rounded_line", "rounded_circle", "tiny_arcs",
      "wide_arcs", "circles",      "feeds",       "path_modes",   "inverse_time",   "close_pierces",
      "abrasive",  "tangent_arcs", "splines",     "everything"};

  std::size_t kind() const { return kind_; }
  const char* kind_name() const { return kKinds[kind_]; }

  std::string Make() {
    text_ = "G21 G90 G17\n";
    const bool one_block = Pick(0, 9) == 0;
    const int cuts = one_block ? 1 : Pick(1, 2);
    for (int i = 0; i < cuts; ++i) {
      Cut(one_block);
    }
    return text_ + "M2\n";
  }

 private:
  int Pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double OfSize(double low, double high) { return std::exp(Between(std::log(low), std::log(high))); }
  double Side() { return Pick(0, 1) == 0 ? 1.0 : -1.0; }

  template <class... T>
  void Write(const char* format, T... values) {
    char line[200];
    std::snprintf(line, sizeof line, format, values...);
    text_ += line;
  }

  void Cut(bool one_block) {
    x_ = Between(200, 600), y_ = Between(200, 400), heading_ = Between(-3, 3);
    Write("G0 X%.7f Y%.7f\nM3 P0.1\nG94 G1 F%.0f\n", x_, y_, feed_ = OfSize(300, 9000));
    inverse_ = false;
    const int blocks = one_block ? 1 : Pick(2, 6);
    for (int i = 0; i < blocks; ++i) {
      if (!one_block && Pick(0, 2) == 0) {
        Pick(0, 2) == 0 ? Arc(OfSize(1, 60), Side() * Between(0.2, 5)) : Ahead(OfSize(0.1, 40));
        heading_ += Pick(0, 1) == 0 ? 0.0 : Between(-3, 3);
      }
      Hard(kind_ + 1 == kKinds.size() ? static_cast<std::size_t>(Pick(0, static_cast<int>(kind_) - 1))
                                      : kind_);
    }
    if (inverse_) {
      Write("G94 F%.0f\n", feed_);
    }
    text_ += "M5\n";
  }

  void Hard(std::size_t kind) {
    switch (kind) {
      case 0:
        return Spikes();
      case 1:
        return Zigzag();
      case 2:
        return TinyBlocks();
      case 3:
        return RoundedLine();
      case 4:
        return RoundedCircle();
      case 5:
        return Arcs(OfSize(0.005, 0.5), Pick(1, 8));
      case 6:
        return WideArc();
      case 7:
        return Circles();
      case 8:
        return Feeds();
      case 9:
        return PathModes();
      case 10:
        return InverseTime();
      case 11:
        return ClosePierces();
      case 12:
        return Abrasive();
      case 13:
        return TangentArcs();
      default:
        return Spline();
    }
  }

  static bool Inside(double x, double y) { return x > 30 && x < 770 && y > 30 && y < 570; }

  // To a place, if it is on the sheet; else towards the middle.
  void To(double x, double y) {
    if (!Inside(x, y)) {
      heading_ = std::atan2(300 - y_, 400 - x_);
      return;
    }
    if (inverse_) {
      const double way = std::hypot(x - x_, y - y_);
      Write("G1 X%.7f Y%.7f F%.6g\n", x, y, std::max(1e-3, Between(300, 6000) / std::max(way, 1e-3)));
    } else {
      Write("G1 X%.7f Y%.7f\n", x, y);
    }
    x_ = x, y_ = y;
  }
  void Ahead(double length) { To(x_ + length * std::cos(heading_), y_ + length * std::sin(heading_)); }

  // Tangent to the heading; positive to the left.
  void Arc(double radius, double sweep) {
    const double turn = sweep > 0 ? 1.0 : -1.0;
    const double cx = x_ - turn * radius * std::sin(heading_), cy = y_ + turn * radius * std::cos(heading_);
    const double end = heading_ + sweep;
    const double x = cx + turn * radius * std::sin(end), y = cy - turn * radius * std::cos(end);
    const double half = heading_ + 0.5 * sweep;
    if (!Inside(x, y) || !Inside(cx + turn * radius * std::sin(half), cy - turn * radius * std::cos(half)) ||
        (std::abs(sweep) > 1.5 && (!Inside(cx - radius, cy - radius) || !Inside(cx + radius, cy + radius)))) {
      return To(0, 0);
    }
    Write("%s X%.9f Y%.9f I%.9f J%.9f", turn > 0 ? "G3" : "G2", x, y, cx - x_, cy - y_);
    inverse_ ? Write(" F%.6g\n", Between(300, 6000) / (radius * std::abs(sweep))) : Write("\n");
    x_ = x, y_ = y, heading_ = end;
  }

  // There and back on the same line, and half back.
  void Spikes() {
    const int count = Pick(1, 6);
    for (int i = 0; i < count; ++i) {
      const double length = OfSize(1e-3, 30), angle = heading_ + (Pick(0, 1) == 0 ? 0.0 : Between(-3, 3));
      const double x = x_, y = y_, back = Pick(0, 2) == 0 ? Between(0.2, 0.9) : 1.0;
      const double dx = length * std::cos(angle), dy = length * std::sin(angle);
      if (Inside(x + dx, y + dy)) {
        To(x + dx, y + dy);
        To(x + (1 - back) * dx, y + (1 - back) * dy);
      }
      if (Pick(0, 2) == 0) {
        Ahead(OfSize(1e-3, 3));
      }
    }
  }

  void Zigzag() {
    const double height = OfSize(0.003, 0.1), pitch = OfSize(0.003, 0.1), heading = heading_;
    const int count = Pick(20, 150);
    for (int i = 0; i < count; ++i) {
      const double side = i % 2 == 0 ? height : -height;
      To(x_ + pitch * std::cos(heading) - side * std::sin(heading),
         y_ + pitch * std::sin(heading) + side * std::cos(heading));
    }
    heading_ = heading;
  }

  void TinyBlocks() {
    Ahead(OfSize(1, 30));
    const int count = Pick(1, 60);
    const double size = OfSize(1e-6, 1e-3), wild = Pick(0, 1) == 0 ? 0.0 : 3.0, heading = heading_;
    for (int i = 0; i < count; ++i) {
      heading_ = heading + Between(-wild, wild);
      Ahead(size);
    }
    heading_ = heading;
    Ahead(OfSize(1, 30));
  }

  static double Rounded(double value) { return std::round(value * 1e3) * 1e-3; }

  void RoundedLine() {
    const double step = OfSize(0.01, 1), x = x_, y = y_, noise = Pick(0, 1) == 0 ? 0.0 : 1e-3;
    const int count = Pick(30, 200);
    for (int i = 1; i <= count; ++i) {
      To(Rounded(x + step * i * std::cos(heading_) + Between(-noise, noise)),
         Rounded(y + step * i * std::sin(heading_) + Between(-noise, noise)));
    }
  }

  void RoundedCircle() {
    const double radius = OfSize(0.5, 60), step = OfSize(0.01, 0.5), noise = Pick(0, 1) == 0 ? 0.0 : 1e-3;
    const double side = Side(), cx = x_ - side * radius * std::sin(heading_),
                 cy = y_ + side * radius * std::cos(heading_);
    const int count = Pick(30, 250);
    for (int i = 1; i <= count; ++i) {
      const double a = heading_ + side * step * i / radius;
      To(Rounded(cx + side * radius * std::sin(a) + Between(-noise, noise)),
         Rounded(cy - side * radius * std::cos(a) + Between(-noise, noise)));
    }
    heading_ += side * step * count / radius;
  }

  void Arcs(double radius, int count) {
    const bool snake = Pick(0, 1) == 0;
    for (int i = 0; i < count; ++i) {
      Arc(radius, (snake && i % 2 == 1 ? -1.0 : 1.0) * Between(0.3, 6.2));
      if (Pick(0, 2) == 0) {
        Ahead(OfSize(0.005, 5));
      }
    }
  }

  void WideArc() {
    const double radius = OfSize(1e3, 1e5);
    heading_ = std::atan2(300 - y_, 400 - x_);
    Arc(radius, Side() * OfSize(0.1, 150) / radius);
    Arc(OfSize(1e3, 1e5), Side() * OfSize(0.1, 20) / 1e5);
  }

  void Circles() {
    const int count = Pick(2, 4);
    for (int i = 0; i < count; ++i) {
      const double radius = OfSize(0.1, 20), side = Side();
      const double i_mm = -side * radius * std::sin(heading_), j_mm = side * radius * std::cos(heading_);
      if (inverse_ || !Inside(x_ + i_mm - radius, y_ + j_mm - radius) ||
          !Inside(x_ + i_mm + radius, y_ + j_mm + radius)) {
        return To(0, 0);
      }
      Write("%s X%.7f Y%.7f I%.9f J%.9f P%d\n", side > 0 ? "G3" : "G2", x_, y_, i_mm, j_mm, Pick(1, 3));
    }
  }

  void Feeds() {
    const int count = Pick(3, 12);
    for (int i = 0; i < count; ++i) {
      const bool slow = i % 2 == 0;
      Write("F%.4g\n", slow ? OfSize(1, 60) : 6000.0);
      Ahead(slow ? OfSize(1e-3, 0.1) : OfSize(1e-3, 30));
      heading_ += Pick(0, 2) == 0 ? Between(-2, 2) : 0.0;
    }
    Write("F%.0f\n", feed_);
  }

  void PathModes() {
    const int count = Pick(3, 10);
    for (int i = 0; i < count; ++i) {
      switch (Pick(0, 3)) {
        case 0:
          text_ += "G61\n";
          break;
        case 1:
          text_ += "G61.1\n";
          break;
        case 2:
          text_ += "G64\n";
          break;
        default:
          Write("G64 P%.6f\n", OfSize(1e-4, 1.0));
          break;
      }
      heading_ += Pick(0, 1) == 0 ? Between(-2, 2) : Between(-6e-3, 6e-3);
      Pick(0, 2) == 0 ? Arc(OfSize(0.5, 30), Side() * Between(0.2, 4)) : Ahead(OfSize(0.01, 30));
    }
    text_ += "G64\n";
  }

  void InverseTime() {
    text_ += "G93\n";
    inverse_ = true;
    const int count = Pick(2, 10);
    for (int i = 0; i < count; ++i) {
      heading_ += Between(-1, 1);
      Pick(0, 2) == 0 ? Arc(OfSize(0.5, 30), Side() * Between(0.2, 4)) : Ahead(OfSize(0.01, 30));
    }
    inverse_ = false;
    Write("G94 F%.0f\n", feed_);
  }

  void ClosePierces() {
    const int count = Pick(1, 5);
    for (int i = 0; i < count; ++i) {
      Ahead(OfSize(1e-3, 3));
      text_ += Pick(0, 3) == 0 ? "G4 P0.05\nM5\n" : "M5\n";
      const double way = Pick(0, 3) == 0 ? 0.0 : OfSize(1e-6, 1), angle = Between(-3, 3);
      x_ += way * std::cos(angle), y_ += way * std::sin(angle);
      Write("G0 X%.7f Y%.7f\nM3 P0.02\n", x_, y_);
      Write("G1 X%.7f Y%.7f\n", x_, y_);  // of no length
    }
    Ahead(OfSize(1e-3, 3));
  }

  void Abrasive() {
    const int count = Pick(3, 20);
    for (int i = 0; i < count; ++i) {
      Write("M67 E0 Q%d\n", Pick(100, 800));
      if (Pick(0, 4) == 0) {
        text_ += "M68 E0 Q300\n";
      }
      heading_ += Between(-0.3, 0.3);
      Ahead(OfSize(1e-3, 10));
    }
  }

  // Tangent, nearly tangent, and back over the same arc.
  void TangentArcs() {
    const int count = Pick(2, 6);
    for (int i = 0; i < count; ++i) {
      const double radius = OfSize(0.3, 60), sweep = Side() * Between(0.05, 2.5);
      Arc(radius, sweep);
      if (Pick(0, 3) == 0) {
        heading_ += std::numbers::pi;
        Arc(radius, -sweep);
      }
      heading_ += Pick(0, 1) == 0 ? 0.0 : Side() * OfSize(1e-6, 1e-3);
    }
  }

  void Spline() {
    const double length = OfSize(0.5, 60), end = heading_ + Between(-1.5, 1.5);
    const double x = x_ + length * std::cos(heading_), y = y_ + length * std::sin(heading_);
    const double pull = length * Between(0.1, 0.9);
    if (inverse_ || !Inside(x, y)) {
      return To(0, 0);
    }
    Write("G5 X%.6f Y%.6f I%.6f J%.6f P%.6f Q%.6f\n", x, y, pull * std::cos(heading_),
          pull * std::sin(heading_), -pull * std::cos(end), -pull * std::sin(end));
    x_ = std::round(x * 1e6) / 1e6, y_ = std::round(y * 1e6) / 1e6, heading_ = end;
  }

  std::mt19937 random_;
  std::size_t kind_;
  std::string text_;
  double x_ = 0.0, y_ = 0.0, heading_ = 0.0, feed_ = 0.0;
  bool inverse_ = false;
};

}  // namespace lambdajet::trajectory
