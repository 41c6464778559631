// Predictions on files, without any service: predict, map, budget.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "accuracy/core/budget.hpp"
#include "accuracy/core/error_map.hpp"
#include "accuracy/core/prediction.hpp"
#include "clients/cli/csv.hpp"
#include "clients/cli/verbs.hpp"
#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/machine_file.hpp"

namespace lambdajet::cli {
namespace {

using accuracy::ContourPrediction;

struct PredictFiles {
  std::string machine;
  std::string samples = "-";
  std::string points;
  bool compensated = false;
  accuracy::PredictionOptions options;
};

struct MapFiles {
  std::string machine;
  std::string out = "-";
  accuracy::ErrorMapOptions options;
};

absl::StatusOr<std::vector<PlanSample>> ReadSamples(const std::string& path) {
  const auto table = ReadCsv(path);
  if (!table.ok()) {
    return table.status();
  }
  constexpr std::array<const char*, 10> kColumns = {
      "tau_s",         "s_mm",           "x_W_mm",         "y_W_mm",  "vx_W_mm_per_s",
      "vy_W_mm_per_s", "ax_W_mm_per_s2", "ay_W_mm_per_s2", "cutting", "source_line"};
  std::array<std::vector<double>, kColumns.size()> columns;
  for (std::size_t c = 0; c < kColumns.size(); ++c) {
    auto numbers = table->Numbers(kColumns[c]);
    if (!numbers.ok()) {
      return numbers.status();
    }
    columns[c] = std::move(*numbers);
  }
  std::vector<PlanSample> samples(columns[0].size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i] = {columns[0][i],        columns[1][i],
                  columns[2][i],        columns[3][i],
                  columns[4][i],        columns[5][i],
                  columns[6][i],        columns[7][i],
                  columns[8][i] != 0.0, static_cast<std::uint32_t>(columns[9][i])};
  }
  return samples;
}

nlohmann::json JsonOf(const ContourPrediction& prediction) {
  nlohmann::json budget = nlohmann::json::array();
  for (const accuracy::SourceShare& share : prediction.budget) {
    budget.push_back({{"source", accuracy::SourceName(share.source)},
                      {"contribution_95_mm", share.contribution_95_mm},
                      {"share", share.share}});
  }
  return {{"predicted_95_mm", prediction.predicted_95_mm},
          {"predicted_95_linear_mm", prediction.predicted_95_linear_mm},
          {"expected_95_mm", prediction.expected_95_mm},
          {"conformity", prediction.conformity},
          {"budget", budget}};
}

void Print(const ContourPrediction& prediction, Output& output) {
  output.Text(
      fmt::format("the contour's 95th percentile stays below {:.4f} mm with 95 % probability (linear {:.4f}, "
                  "expected {:.4f} mm)",
                  prediction.predicted_95_mm, prediction.predicted_95_linear_mm, prediction.expected_95_mm));
  TextTable budget{{"source", "contribution_95_mm", "share_%"}, {}};
  for (const accuracy::SourceShare& share : prediction.budget) {
    budget.rows.push_back({std::string(accuracy::SourceName(share.source)),
                           Fixed(share.contribution_95_mm, 4), Fixed(100.0 * share.share, 1)});
  }
  output.Table(budget);
  TextTable worst{{"line", "x_W_mm", "y_W_mm", "bound_95_mm", "source"}, {}};
  for (const accuracy::PredictedPoint& p : prediction.worst) {
    worst.rows.push_back({std::to_string(p.source_line), Fixed(p.p_W_mm.x(), 2), Fixed(p.p_W_mm.y(), 2),
                          Fixed(p.bound_95_mm, 4), std::string(accuracy::SourceName(p.dominant))});
  }
  output.Text("");
  output.Table(worst);
}

absl::Status WritePoints(const std::string& path, const ContourPrediction& prediction) {
  CsvTable table({"s_mm", "x_W_mm", "y_W_mm", "bias_mm", "sigma_mm", "bound_95_mm"});
  for (const accuracy::PredictedPoint& p : prediction.points) {
    table.AddRow(
        std::vector<double>{p.s_mm, p.p_W_mm.x(), p.p_W_mm.y(), p.bias_mm, p.sigma_mm, p.bound_95_mm});
  }
  return WriteCsv(path, table);
}

absl::Status PredictFromFiles(const PredictFiles& files, Output& output) {
  const auto machine = ReadMachineFile(files.machine);
  if (!machine.ok()) {
    return machine.status();
  }
  const auto samples = ReadSamples(files.samples);
  if (!samples.ok()) {
    return samples.status();
  }
  accuracy::PredictionOptions options = files.options;
  int drawn = 0;
  options.cancelled = [&] {
    if (drawn++ % std::max(1, options.draws / 100) == 0) {
      output.Progress(static_cast<double>(drawn) / options.draws, "drawing machines");
    }
    return false;
  };
  const ContourPrediction prediction = accuracy::Predict(*machine, *samples, files.compensated, options);
  output.EndProgress();
  if (prediction.reason != accuracy::PredictionReason::kPredicted) {
    output.Fail(ExitCode::kRefused, accuracy::Name(prediction.reason),
                fmt::format("the plan cannot be predicted; line {} is to blame", prediction.blame_line));
    return absl::OkStatus();
  }
  output.json() ? output.Json(JsonOf(prediction)) : Print(prediction, output);
  return files.points.empty() ? absl::OkStatus() : WritePoints(files.points, prediction);
}

absl::Status MapFromFile(const MapFiles& files, Output& output) {
  const auto machine = ReadMachineFile(files.machine);
  if (!machine.ok()) {
    return machine.status();
  }
  CsvTable table({"x_W_mm", "y_W_mm", "mean_mm", "sigma_mm", "bound_95_mm"});
  for (const accuracy::PlaceError& place : accuracy::MapErrors(*machine, files.options)) {
    if (place.valid) {
      table.AddRow(std::vector<double>{place.p_W_mm.x(), place.p_W_mm.y(), place.mean_mm, place.sigma_mm,
                                       place.bound_95_mm});
    }
  }
  for (const accuracy::ParameterShare& share : accuracy::RankParameters(*machine, files.options)) {
    if (share.contribution_mm > 0.0) {
      output.Message(fmt::format("{:>24}  {:.4f} mm", ParameterName(share.parameter), share.contribution_mm));
    }
  }
  return WriteCsv(files.out, table);
}

void AddBudgetVerb(CLI::App& noun, Output& output) {
  auto shares = std::make_shared<accuracy::SetUpShares>();
  auto shifts = std::make_shared<std::vector<double>>();
  auto drive = std::make_shared<double>(0.0);
  auto jet = std::make_shared<double>(0.0);
  CLI::App* budget = noun.add_subcommand("budget", "equations (1) and (2) for given shares");
  budget->add_option("--shift-mm", *shifts, "four shifts of the subsystems")->required()->expected(4);
  budget->add_option("--alpha-rad", shares->alpha_rad, "turn of the drive module");
  budget->add_option("--beta-rad", shares->beta_rad, "turn of the sheet on its rollers");
  budget->add_option("--radius-a-mm", shares->radius_a_mm, "drive module's turning point to the cut");
  budget->add_option("--radius-b-mm", shares->radius_b_mm, "sheet's turning point to the cut");
  budget->add_option("--drive-mm", *drive, "error of the drive mechanism with its elasticity");
  budget->add_option("--jet-mm", *jet, "error of the jet process");
  budget->callback([=, &output] {
    std::copy(shifts->begin(), shifts->end(), shares->shift_mm.begin());
    const double base_mm = accuracy::SetUpError(*shares);
    const double total_mm = accuracy::TotalError(base_mm, *drive, *jet);
    output.Json({{"base_mm", base_mm}, {"total_mm", total_mm}});
    output.Text(fmt::format("base (2) {:.4f} mm, total (1) {:.4f} mm", base_mm, total_mm));
  });
}

}  // namespace

void AddAccuracyVerbs(CLI::App& noun, Output& output) {
  auto predict_files = std::make_shared<PredictFiles>();
  CLI::App* predict =
      noun.add_subcommand("predict", "contour error of a plan's points: bound, budget, worst places");
  predict->add_option("--machine", predict_files->machine, "YAML file of the machine")->required();
  predict->add_option(
      "--samples", predict_files->samples,
      "CSV: tau_s, s_mm, x_W_mm, y_W_mm, vx_W_mm_per_s, vy_W_mm_per_s, ax_W_mm_per_s2, ay_W_mm_per_s2, "
      "cutting, source_line; - is standard input");
  predict->add_option("--points", predict_files->points, "CSV of every point's bias, sigma and bound");
  predict->add_flag("--compensated", predict_files->compensated, "the plan carries elastic feed-forward");
  predict->add_option("--draws", predict_files->options.draws, "Monte Carlo draws, 0 is linear only")
      ->check(CLI::Range(0, accuracy::kMostDraws));
  predict->add_option("--seed", predict_files->options.seed, "of the draws");
  predict->add_option("--tolerance-mm", predict_files->options.tolerance_mm,
                      "for the probability of conformity");
  predict->callback([predict_files, &output] { output.Finish(PredictFromFiles(*predict_files, output)); });

  auto map_files = std::make_shared<MapFiles>();
  CLI::App* map =
      noun.add_subcommand("map", "error map over the sheet as CSV; parameters ranked on standard error");
  map->add_option("--machine", map_files->machine, "YAML file of the machine")->required();
  map->add_option("--out", map_files->out, "CSV; - is standard output");
  map->add_option("--columns", map_files->options.columns, "points along x")->check(CLI::Range(2, 400));
  map->add_option("--rows", map_files->options.rows, "points along y")->check(CLI::Range(2, 400));
  map->add_option("--acceleration-mm-per-s2", map_files->options.acceleration_mm_per_s2,
                  "at which the levers bend");
  map->add_flag("--compensated", map_files->options.compensated,
                "elastic feed-forward takes the deflection away");
  map->callback([map_files, &output] { output.Finish(MapFromFile(*map_files, output)); });

  AddBudgetVerb(noun, output);
}

}  // namespace lambdajet::cli
