// Prints what reading and planning cost beside baselines of the same run, and how near to the limits the plans come:
// lines a second, blocks a second, nanoseconds a grid point, duration against the time-optimal bound, feed held on circles
// of short blocks, elastic error removed.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>

#include "tests/laws/trajectory_cases.hpp"
#include "tests/laws/trajectory_spatial_reference.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/feed/plan_samples.hpp"
#include "trajectory/core/feed/run_profile.hpp"
#include "trajectory/core/idle_motion/jerk_limited_move.hpp"
#include "trajectory/core/part_program/gcode_reader.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kPi = std::numbers::pi;

template <class Work>
double Seconds(Work work, int repeats = 3) {
  double best = 1e300;
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

void Line(std::string& text, double x, double y) {
  char line[64];
  std::snprintf(line, sizeof line, "G1 X%.4f Y%.4f\n", x, y);
  text += line;
}

// Round and round on a slowly changing radius.
std::string CircleOfShortBlocks(int blocks, double radius, double step, double feed_mm_per_min) {
  std::string text =
      "G21 G90\nG0 X" + std::to_string(400 + radius) + " Y300\nG1 F" + std::to_string(feed_mm_per_min) + "\n";
  text.reserve(static_cast<std::size_t>(blocks) * 26);
  for (int i = 1; i <= blocks; ++i) {
    const double a = i * step / radius;
    Line(text, 400 + radius * std::cos(a), 300 + radius * std::sin(a));
  }
  return text + "M2\n";
}

std::string FigureEight(int blocks, double radius, double step, double feed_mm_per_min) {
  std::string text = "G21 G90\nG0 X400 Y300\nG1 F" + std::to_string(feed_mm_per_min) + "\n";
  const double lap = 2 * kPi * radius;
  for (int i = 1; i <= blocks; ++i) {
    const double s = std::fmod(i * step, 2 * lap);
    const double side = s < lap ? 1.0 : -1.0, a = std::fmod(s, lap) / radius;
    Line(text, 400 + side * radius * (1 - std::cos(a)), 300 + radius * std::sin(a));
  }
  return text + "M2\n";
}

// What any reader must do at least: find the line ends and turn the digits into numbers with the C library.
double BaselineRead(const std::string& text) {
  double sum = 0.0;
  const char* at = text.c_str();
  while (*at != '\0') {
    if ((*at >= '0' && *at <= '9') || *at == '-') {
      char* end = nullptr;
      sum += std::strtod(at, &end);
      at = end;
    } else {
      ++at;
    }
  }
  return sum;
}

void Reading() {
  constexpr int kLines = 1'000'000;
  const std::string text = CircleOfShortBlocks(kLines, 20, 0.02, 6000);
  std::size_t operations = 0;
  const double ours = Seconds([&] { operations = ReadGcode(text).operations.size(); });
  double sum = 0.0;
  const double baseline = Seconds([&] { sum = BaselineRead(text); });
  std::printf(
      "read %d lines of G1: %.2f million lines/s; strtod alone %.2f (ratio %.2f)  [%zu operations, %.0f]\n",
      kLines, 1e-6 * kLines / ours, 1e-6 * kLines / baseline, baseline / ours, operations, sum);
}

// The quickest move of one actuator pair, beside the two cube roots and two square roots that a move without any case
// distinction would cost.
void Moves() {
  constexpr int kMoves = 1'000'000;
  double sum = 0.0, floor = 0.0;
  const double pair = Seconds([&] {
    for (int i = 1; i <= kMoves; ++i) {
      sum += SolvePairMove({0.001 * i, 0.3}, {{{120, 1500, 40000}, {120, 1500, 40000}}}).duration_s;
    }
  });
  const double general = Seconds([&] {
    for (int i = 1; i <= kMoves; ++i) {
      sum += SolveMove({0.001 * i, 30, -20}, {120, 1500, 40000}).duration_s;
    }
  });
  const double roots = Seconds([&] {
    for (int i = 1; i <= kMoves; ++i) {
      floor += std::cbrt(0.001 * i) + std::cbrt(0.002 * i) + std::sqrt(0.001 * i) + std::sqrt(0.3 * i);
    }
  });
  std::printf(
      "quickest move: one actuator pair, rest to rest %.1f ns, velocity to velocity %.1f ns; four roots %.1f "
      "ns "
      "(ratios %.2f, %.2f)  [%.3g %.3g]\n",
      1e9 * pair / kMoves, 1e9 * general / kMoves, 1e9 * roots / kMoves, pair / roots, general / roots, sum,
      floor);
}

double PeakMemoryMib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void Planning(int blocks) {
  const std::string text = CircleOfShortBlocks(blocks, 20, 0.02, 6000);
  PlannedProgram planned;
  const double seconds = Seconds([&] { planned = PlanPartProgram(text, DemoLikeMachine(), {}); }, 1);
  std::printf(
      "plan %d blocks of 0.02 mm: %.2f s, %.0f blocks/s, peak memory %.0f MiB, %zu segments, faults %zu\n",
      blocks, seconds, blocks / seconds, PeakMemoryMib(), planned.plan.segments.size(),
      planned.faults.size());
}

double CuttingSpeed(const PlannedProgram& p) {
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

void FeedHeld(const char* name, const std::string& text, double radius) {
  const MachineDescription m = DemoLikeMachine();
  const PlannedProgram p = PlanPartProgram(text, m, {});
  const double allowed = std::min(100.0, std::sqrt(m.path.acceleration_mm_per_s2 * radius));
  std::printf(
      "%s in 0.02 mm blocks, 100 mm/s programmed: %.1f mm/s, %.1f %% of the %.1f mm/s its limits allow\n",
      name, CuttingSpeed(p), 100 * CuttingSpeed(p) / allowed, allowed);
}

void PathTiming() {
  MachineDescription m = DemoLikeMachine();
  const PlanOptions options;
  const PlanningModel model(m, options);
  PathDefaults defaults;
  defaults.tolerance_mm = 0.02;
  const ProgramPath path = MakeProgramPath(ReadGcode(FigureEight(40000, 40, 0.2, 7200)).operations, defaults);
  std::vector<ProgramFault> faults;
  const std::vector<ProfileNode> nodes = MakeRunNodes(model, path.elements.at(0), faults);
  std::vector<ProfileNode> solved;
  const double seconds = Seconds(
      [&] {
        solved = nodes;
        SolveSpeedProfile(solved, model.bounds, 0.0, 0.0);
      },
      10);
  std::printf(
      "path timing, velocity and acceleration limits of path and 2 actuators: %.0f ns a grid point (%zu "
      "points)\n",
      1e9 * seconds / static_cast<double>(nodes.size()), nodes.size());
}

// N actuators on random smooth paths, against the plain reference: time a grid point on the same grid, duration against the
// reference on a grid ten times finer.
template <std::size_t N>
void PathTimingOf() {
  constexpr std::size_t kCells = 20'000;
  std::mt19937_64 random(11);
  double ours_s = 0.0, plain_s = 0.0, worst = 0.0;
  constexpr int kPaths = 5;
  for (int i = 0; i < kPaths; ++i) {
    const TimedPath<N> path = TimedPath<N>::Random(random, 1000.0);
    const std::vector<ProfileNodeOf<N>> nodes = path.Nodes(kCells);
    std::vector<ProfileNodeOf<N>> solved = nodes;
    ours_s += Seconds([&] { SolveSpeedProfile(solved, path.bounds, 0.0, 0.0); }, 10);
    double duration = 0.0;
    plain_s += Seconds([&] { duration = ReferenceDuration(nodes, path.bounds); }, 1);
    const double fine = ReferenceDuration(path.Nodes(10 * kCells), path.bounds);
    worst = std::max(worst, std::abs(ProfileDuration(solved) / fine - 1.0));
  }
  const double points = static_cast<double>(kPaths * (kCells + 1));
  std::printf(
      "path timing of %zu actuators, random paths: %.0f ns a grid point; plain reference %.0f ns (ratio "
      "%.0f); durations "
      "differ by at most %.1e\n",
      N, 1e9 * ours_s / points, 1e9 * plain_s / points, plain_s / ours_s, worst);
}

// A long square with jerk made inactive: against the bound that starts, corners and stops at standstill cost.
void AgainstBound() {
  MachineDescription m = DemoLikeMachine();
  m.path.jerk_mm_per_s3 = 1e9;
  m.actuators[0].jerk_mm_per_s3 = m.actuators[1].jerk_mm_per_s3 = 1e12;
  PlanOptions options;
  options.knot_s = 0.0005;
  const double v = 100.0, a = m.path.acceleration_mm_per_s2;
  const std::string text = "G21 G90\nG0 X300 Y200\nG1 F6000\nG1 X500\nG1 Y400\nG1 X300\nG1 Y200\nM2\n";
  const PlannedProgram p = PlanPartProgram(text, m, options);
  // Corners at the speed a right angle allows within 0.02 mm at this acceleration: a circle of 0.0483 mm.
  const double corner = std::sqrt(a * 0.02 / (std::sqrt(2.0) - 1.0));
  const double bound = 800.0 / v + 2 * v / (2 * a) + 3 * (v - corner) * (v - corner) / (v * a);
  std::printf("square of 800 mm at 100 mm/s, jerk inactive: %.4f s, time-optimal bound %.4f s, ratio %.4f\n",
              p.plan.duration_s, bound, p.plan.duration_s / bound);
}

// The sheet on its spring behind the played effector: m u'' = -k (u - x) - c (u' - x'), integrated finely.
double ElasticError(const MachineDescription& truth, const PlannedProgram& p,
                    const MachineDescription& planned_for) {
  const double w2 = 1.0 / truth.value(Parameter::kElasticLagS2);
  const double T = truth.value(Parameter::kDampingTimeS);
  const auto mechanism = kinematics::LambdaMechanism::FromDescription(planned_for);
  Eigen::Vector2d r, v = Eigen::Vector2d::Zero(), last;
  bool begun = false;
  double sum = 0.0;
  std::size_t count = 0;
  constexpr double kStep_s = 1e-4;
  for (const Segment& s : p.plan.segments) {
    for (double t = 0.0; t < s.duration_s - 1e-9; t += kStep_s) {
      const auto at = [&](bool lead) {
        Eigen::Vector2d q;
        for (int a = 0; a < 2; ++a) {
          const auto i = static_cast<std::size_t>(a);
          q[a] = s.q_mm[i].value(t) + (lead ? s.lead_mm[i].value(t) : 0.0);
        }
        return kinematics::SolveForward(mechanism, q).p_DE_mm;
      };
      const Eigen::Vector2d x = at(true);
      if (!begun) {
        r = last = x;
        begun = true;
      }
      const Eigen::Vector2d x_rate = (x - last) / kStep_s;
      last = x;
      v += kStep_s * (-w2 * (r - x) - w2 * T * (v - x_rate));
      r += kStep_s * v;
      sum += (r - at(false)).squaredNorm();
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

void FeedForward() {
  const std::string text =
      "G21 G90\nG0 X300 Y200\nM3\nG1 F4800\nG1 X400\nG3 X420 Y220 I0 J20\nG1 Y300\nG2 X440 Y320 I20\nG1 X500 "
      "Y260\nM5\nM2\n";
  const MachineDescription m = DemoLikeMachine();
  const PlannedProgram plain = PlanPartProgram(text, m, {});
  PlanOptions options;
  options.compensate = true;
  const double untreated = ElasticError(m, plain, m);
  const PlannedProgram exact = PlanPartProgram(text, m, options);
  MachineDescription wrong = m;
  wrong.value(Parameter::kElasticLagS2) *= 1.1;
  const PlannedProgram off = PlanPartProgram(text, wrong, options);
  std::printf(
      "elastic error on the spring-mass plant, rms: untreated %.4f mm; removed %.2f %% with exact "
      "parameters, %.2f %% with "
      "stiffness 10 %% wrong\n",
      untreated, 100 * (1 - ElasticError(m, exact, m) / untreated),
      100 * (1 - ElasticError(m, off, m) / untreated));
}

}  // namespace
}  // namespace lambdajet::trajectory

int main(int count, char** words) {
  using namespace lambdajet::trajectory;
  Moves();
  Reading();
  PathTiming();
  PathTimingOf<2>();
  PathTimingOf<6>();
  FeedHeld("circle R20", CircleOfShortBlocks(20000, 20, 0.02, 6000), 20);
  FeedHeld("figure-eight R20", FigureEight(20000, 20, 0.02, 6000), 20);
  AgainstBound();
  FeedForward();
  Planning(count > 1 ? std::atoi(words[1]) : 100'000);
  Planning(count > 1 ? std::atoi(words[1]) : 1'000'000);
}
