// Prints what reading and planning cost beside baselines of the same run, and how near to the limits the plans come:
// lines a second, blocks a second, nanoseconds a grid point, duration against the time-optimal bound, feed held on circles
// of short blocks, elastic error removed. `benchmark_trajectory [PART|BLOCKS]…`: only these; the peak of memory is the whole
// process's, so that of a size is measured by a run with nothing else.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "tests/laws/trajectory_cases.hpp"
#include "tests/laws/trajectory_spatial_reference.hpp"
#include "tests/support/figure.hpp"
#include "trajectory/core/feed/early_plan.hpp"
#include "trajectory/core/feed/plan_program.hpp"
#include "trajectory/core/feed/plan_samples.hpp"
#include "trajectory/core/feed/run_profile.hpp"
#include "trajectory/core/idle_motion/jerk_limited_move.hpp"
#include "trajectory/core/part_program/gcode_reader.hpp"

namespace lambdajet::trajectory {
namespace {

using tests::PrintFigure;

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

// Turned heads and hexapods: five coordinates a line.
std::string FiveAxisBlocks(int blocks) {
  std::string text = "G21 G90\nG0 X0 Y0 Z0 A0 C0\nG1 F6000\n";
  text.reserve(static_cast<std::size_t>(blocks) * 52);
  for (int i = 1; i <= blocks; ++i) {
    const double a = 0.001 * i;
    char line[96];
    std::snprintf(line, sizeof line, "X%.4f Y%.4f Z%.4f A%.4f C%.4f\n", 40 * std::cos(a), 30 * std::sin(a),
                  5 * std::sin(3 * a), 20 * std::sin(a), 15 * std::cos(2 * a));
    text += line;
  }
  return text + "M2\n";
}

// Seconds of this process's own time on the processor: another program beside does not count.
template <class Work>
double ProcessorSeconds(Work work, int repeats = 5) {
  double best = 1e300;
  for (int i = 0; i < repeats; ++i) {
    const std::clock_t start = std::clock();
    work();
    best = std::min(best, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  return best;
}

void Reading(const char* what, const char* figure, const std::string& text, const GcodeOptions& options,
             double lines) {
  std::size_t operations = 0;
  const double ours = ProcessorSeconds([&] { operations = ReadGcode(text, options).operations.size(); });
  double sum = 0.0;
  const double baseline = ProcessorSeconds([&] { sum = BaselineRead(text); });
  std::printf(
      "read %.0f lines of %s: %.2f million lines/s; strtod alone %.2f (ratio %.2f)  [%zu operations, %.0f]\n",
      lines, what, 1e-6 * lines / ours, 1e-6 * lines / baseline, baseline / ours, operations, sum);
  PrintFigure(figure, lines / ours);
}

void Reading() {
  constexpr int kLines = 1'000'000;
  GcodeOptions options;
  Reading("G1", "read.g1_lines_per_s", CircleOfShortBlocks(kLines, 20, 0.02, 6000), options, kLines);
  options.axes = kSixAxes;
  Reading("five axes", "read.five_axis_lines_per_s", FiveAxisBlocks(kLines), options, kLines);
  Reading("expressions in a loop", "read.loop_lines_per_s",
          "#1=0\nG1 F600\no1 while [#1 LT 200000]\nX[100*COS[#1/100]] Y[100*SIN[#1/100]]\n#1=[#1+1]\no1 "
          "endwhile\nM2\n",
          options, 4 * 200'000);
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
  PrintFigure("move.pair_ns", 1e9 * pair / kMoves);
}

double PeakMemoryMib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

// Processor time beside the wall's: on a shared host the wall tells more about the neighbours.
struct Stopwatch {
  std::chrono::steady_clock::time_point wall = std::chrono::steady_clock::now();
  std::clock_t processor = std::clock();

  double wall_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
  }
  double processor_s() const { return static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC; }
};

void Planning(int blocks) {
  const std::string text = CircleOfShortBlocks(blocks, 20, 0.02, 6000);
  const Stopwatch whole;
  std::size_t segments = 0, faults = 0;
  {
    const PlannedProgram planned = PlanPartProgram(text, DemoLikeMachine(), {});
    segments = planned.plan.segments.size();
    faults = planned.faults.size();
  }
  const double wall = whole.wall_s(), processor = whole.processor_s(), peak = PeakMemoryMib();
  const Stopwatch streamed;
  double first_wall = 0.0, first_processor = 0.0;
  faults += PlanWithEarlySegments(text, DemoLikeMachine(), {}, [&](std::span<const Segment>) {
              if (first_wall == 0.0) {
                first_wall = streamed.wall_s();
                first_processor = streamed.processor_s();
              }
              return true;
            }).faults.size();
  std::printf(
      "plan %d blocks of 0.02 mm in one run, reading included: %.2f s (processor %.2f s), %.0f blocks/s "
      "(%.0f a processor "
      "second), peak memory %.0f MiB, %zu segments, faults %zu; handed out early: first segments after %.1f "
      "ms (processor "
      "%.1f ms), all after %.2f s\n",
      blocks, wall, processor, blocks / wall, blocks / processor, peak, segments, faults, 1e3 * first_wall,
      1e3 * first_processor, streamed.wall_s());
  PrintFigure("plan.blocks_per_s", blocks / wall);
  PrintFigure("plan.blocks_per_processor_s", blocks / processor);
  PrintFigure("plan.first_segment_ms", 1e3 * first_wall);
  PrintFigure("plan.peak_memory_mib", peak);
  PrintFigure("plan.faults", static_cast<double>(faults));
}

void FeedHeld(const char* name, const char* figure, const std::string& text,
              const std::vector<Eigen::Vector2d>& centres_mm) {
  const MachineDescription m = DemoLikeMachine();
  PlanOptions options;
  options.knot_s = 0.001;
  const double held = MeanSpeed(PlanPartProgram(text, m, options));
  const double bound = FastestMeanSpeed(m, 100.0, 20.0, centres_mm);
  std::printf(
      "%s R20 in 0.02 mm blocks, 100 mm/s programmed: %.1f mm/s, %.1f %% of %.1f mm/s, which feed, curvature "
      "and actuator "
      "speeds allow\n",
      name, held, 100 * held / bound, bound);
  PrintFigure(figure, held / bound);
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
  PrintFigure(N == 2 ? "timing.two_ns" : "timing.six_ns", 1e9 * ours_s / points);
  PrintFigure(N == 2 ? "timing.two_duration_off" : "timing.six_duration_off", worst);
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
  PrintFigure("bound.square_ratio", p.plan.duration_s / bound);
}

void FeedForward() {
  const ElasticFigures figures = MeasureFeedForward();
  std::printf(
      "elastic error on the spring-mass plant, rms: untreated %.4f mm; removed %.2f %% with exact "
      "parameters, %.2f %% with "
      "stiffness 10 %% wrong\n",
      figures.untreated_mm, 100 * figures.removed_exact, 100 * figures.removed_wrong);
  PrintFigure("elastic.removed_exact", figures.removed_exact);
  PrintFigure("elastic.removed_wrong_stiffness", figures.removed_wrong);
}

struct Part {
  std::string_view name;
  void (*run)();
};

void Timing() {
  PathTiming();
  PathTimingOf<2>();
  PathTimingOf<6>();
}

void Feed() {
  FeedHeld("circle", "feed.circle_share", CircleOfShortBlocks(20000, 20, 0.02, 6000), {{400, 300}});
  FeedHeld("figure-eight", "feed.eight_share", FigureEight(20000, 20, 0.02, 6000), {{420, 300}, {380, 300}});
}

// Ten million lines, as a file of some 230 MB holds them.
void LongFile() {
  constexpr int kLines = 10'000'000;
  const std::string text = CircleOfShortBlocks(kLines, 20, 0.02, 6000);
  const double before_mib = PeakMemoryMib();
  const Stopwatch reading;
  const PartProgram program = ReadGcode(text, {});
  std::printf(
      "read %d lines, %.0f MB: %.2f s, %zu operations, %zu faults, %.0f MiB besides the text's %.0f\n",
      kLines, 1e-6 * static_cast<double>(text.size()), reading.wall_s(), program.operations.size(),
      program.faults.size(), PeakMemoryMib() - before_mib, before_mib);
  PrintFigure("long.lines_read", program.faults.empty() ? kLines : 0);
  PrintFigure("long.seconds", reading.wall_s());
  PrintFigure("long.memory_mib", PeakMemoryMib());
}

void AllPlanning() {
  for (const int blocks :
       {100'000, 300'000, 1'000'000}) {  // growing, for the peak of memory is the process's
    Planning(blocks);
  }
}

constexpr Part kParts[] = {{"move", Moves},       {"read", [] { Reading(); }}, {"timing", Timing},
                           {"feed", Feed},        {"bound", AgainstBound},     {"elastic", FeedForward},
                           {"plan", AllPlanning}, {"long", LongFile}};

bool Run(std::string_view word) {
  if (const int blocks = std::atoi(word.data()); blocks > 0) {
    Planning(blocks);
    return true;
  }
  for (const Part& part : kParts) {
    if (part.name == word) {
      part.run();
      return true;
    }
  }
  return false;
}

}  // namespace
}  // namespace lambdajet::trajectory

int main(int count, char** words) {
  using namespace lambdajet::trajectory;
  for (const Part& part : kParts) {
    if (count == 1) {
      part.run();
    }
  }
  for (int i = 1; i < count; ++i) {
    if (!Run(words[i])) {
      std::fprintf(stderr,
                   "%s: not a number of blocks, nor move, read, timing, feed, bound, elastic, plan, long\n",
                   words[i]);
      return 2;
    }
  }
}
