// Prints how accurate the whole product is on machines whose truth it does not know: twenty random plants, each cut as set up,
// identified, and compensated, with the predicted bound beside what the judge found.
//
// Usage: twenty_plants [MACHINE_YAML] [PLANTS] [FIRST_SEED] [PART], PART as deploy/parts/bracket (its .ngc and
// .drawing.yaml, the default), or plate: a plate with three holes at the fastest feed
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "platform/machine_file/machine_file.hpp"
#include "tests/support/cut_trial.hpp"

namespace lambdajet::tests {
namespace {

constexpr const char* kStages[] = {"as set up", "identified", "compensated"};

void PrintPlant(const PlantTrial& trial) {
  for (std::size_t s = 0; s < trial.cuts.size(); ++s) {
    const CutResult& c = trial.cuts[s];
    if (c.cut) {
      std::printf(
          "%4llu  %-11s  %7.4f  %7.4f  %7.4f  %9.4f  %9.4f  %9.4f  %-5s  %6.1f  %4u  %-10s  %s %.1f %.1f%s\n",
          static_cast<unsigned long long>(trial.seed), kStages[s], c.p50_mm, c.p95_mm, c.max_mm,
          c.predicted_95_mm, c.predicted_95_linear_mm, c.expected_95_mm, c.bound_holds() ? "yes" : "NO",
          c.cutting_time_s, c.not_cut, c.largest_source.c_str(), c.worst_feature.c_str(), c.worst_x_W_mm,
          c.worst_y_W_mm, c.holds > 0 ? " HELD" : "");
    }
  }
  if (!trial.trouble.empty()) {
    std::printf("%4llu  TROUBLE: %s\n", static_cast<unsigned long long>(trial.seed), trial.trouble.c_str());
  }
  std::fflush(stdout);
}

void PrintSummary(const std::vector<PlantTrial>& trials) {
  std::printf("\n%-11s  worst p95  median p95  worst max  bound holds  median bound/p95\n", "stage");
  for (std::size_t s = 0; s < 3; ++s) {
    std::vector<double> p95;
    std::vector<double> ratio;
    double largest = 0.0;
    int holds = 0;
    for (const PlantTrial& trial : trials) {
      const CutResult& c = trial.cuts[s];
      if (c.cut) {
        p95.push_back(c.p95_mm);
        ratio.push_back(c.predicted_95_mm / c.p95_mm);
        largest = std::max(largest, c.max_mm);
        holds += c.bound_holds() ? 1 : 0;
      }
    }
    std::ranges::sort(p95);
    std::ranges::sort(ratio);
    if (!p95.empty()) {
      std::printf("%-11s  %9.4f  %10.4f  %9.4f  %5d of %2zu  %16.2f\n", kStages[s], p95.back(),
                  p95[p95.size() / 2], largest, holds, p95.size(), ratio[ratio.size() / 2]);
    }
  }
}

int Run(int argc, char** argv) {
  const char* source = std::getenv("LAMBDAJET_SOURCE_DIR");
  const std::string file =
      argc > 1 ? argv[1] : std::string(source ? source : ".") + "/deploy/config/machine.yaml";
  const int plants = argc > 2 ? std::atoi(argv[2]) : 20;
  const std::uint64_t first = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
  const auto machine = ReadMachineFile(file);
  if (!machine.ok()) {
    std::fprintf(stderr, "%s\n", machine.status().ToString().c_str());
    return 1;
  }
  const std::string stem = argc > 4 ? argv[4] : std::string(source ? source : ".") + "/deploy/parts/bracket";
  const auto chosen = stem == "plate"
                          ? PlateWithHoles(machine->process.kerf_width_mm, machine->path.feed_mm_per_s)
                          : ReadTrialPart(stem);
  if (!chosen.ok()) {
    std::fprintf(stderr, "%s\n", chosen.status().ToString().c_str());
    return 1;
  }
  const TrialPart& part = *chosen;
  std::printf(
      "seed  stage            p50      p95      max  bound_95   (linear)   (median)  holds  cut_s  not cut  "
      "largest source\n");
  std::vector<PlantTrial> trials;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < plants; ++i) {
    trials.push_back(RunTrial(*machine, part, first + static_cast<std::uint64_t>(i)));
    PrintPlant(trials.back());
  }
  PrintSummary(trials);
  std::printf("%.1f s\n", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  return std::ranges::all_of(trials, [](const PlantTrial& t) { return t.trouble.empty(); }) ? 0 : 2;
}

}  // namespace
}  // namespace lambdajet::tests

int main(int argc, char** argv) { return lambdajet::tests::Run(argc, argv); }
