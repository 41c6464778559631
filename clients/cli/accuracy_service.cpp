// Predictions over AccuracyService: predict, map, budget.
#include <fmt/format.h>

#include "clients/cli/csv.hpp"
#include "clients/cli/service_verbs.hpp"
#include "clients/cli/trajectory_service.hpp"
#include "lambdajet/accuracy/v1/accuracy.grpc.pb.h"

namespace lambdajet::cli {
namespace {

namespace accuracy_v1 = accuracy::v1;
using accuracy_v1::AccuracyService;

constexpr std::size_t kPredictionStride = 8;  // of a plan's point: time, s, place, speed, acceleration

struct PredictOptions {
  std::uint64_t plan_id = 0;
  bool compensated = false;
  std::optional<std::uint32_t> draws;
  std::optional<std::uint64_t> seed;
};

void PrintPrediction(const accuracy_v1::PredictContourResponse& prediction, Output& output) {
  if (prediction.reason() != "PREDICTED") {
    output.Text("no bound: " + prediction.reason(), Tone::kWarning);
    return;
  }
  output.Text(
      fmt::format("the contour's 95th percentile stays below {:.4f} mm with 95 % probability (linear {:.4f}, "
                  "expected {:.4f} mm), machine version {}",
                  prediction.predicted_95_mm(), prediction.predicted_95_linear_mm(),
                  prediction.expected_95_mm(), prediction.model_version().version()));
  TextTable budget{{"source", "contribution_95_mm", "share_%"}, {}};
  for (const accuracy_v1::SourceShare& source : prediction.budget()) {
    budget.rows.push_back(
        {source.source(), Fixed(source.contribution_95_mm(), 4), Fixed(source.share() * 100, 1)});
  }
  output.Table(budget);
  TextTable worst{{"line", "x_W_mm", "y_W_mm", "bound_95_mm", "source"}, {}};
  for (const accuracy_v1::WorstPlace& place : prediction.worst()) {
    worst.rows.push_back({std::to_string(place.source_line()), Fixed(place.x_w_mm(), 2),
                          Fixed(place.y_w_mm(), 2), Fixed(place.bound_95_mm(), 4), place.source()});
  }
  output.Text("");
  output.Table(worst);
}

absl::Status Predict(const PredictOptions& options, const Connections& connections, Output& output) {
  PlanPoints points;
  absl::Status status = ReadPlanPoints(connections, options.plan_id, std::nullopt, points);
  if (!status.ok()) {
    return status;
  }
  accuracy_v1::PredictContourRequest request;
  for (std::size_t i = 0; i < points.cutting.size(); ++i) {
    for (std::size_t j = 0; j < kPredictionStride; ++j) {
      request.add_values(points.values[i * kPlanPointStride + j]);
    }
  }
  request.mutable_cutting()->Add(points.cutting.begin(), points.cutting.end());
  request.mutable_source_line()->Add(points.source_line.begin(), points.source_line.end());
  request.set_compensated(options.compensated);
  if (options.draws) {
    request.set_draws(*options.draws);
  }
  if (options.seed) {
    request.set_seed(*options.seed);
  }
  accuracy_v1::PredictContourResponse response;
  status =
      connections.Ask<AccuracyService>("accuracy", &AccuracyService::Stub::PredictContour, request, response);
  if (status.ok()) {
    output.json() ? PrintJson(response, output) : PrintPrediction(response, output);
  }
  return status;
}

absl::Status Map(std::optional<std::uint32_t> columns, std::optional<std::uint32_t> rows,
                 const std::string& out, const Connections& connections, Output& output) {
  accuracy_v1::ErrorMapRequest request;
  if (columns) {
    request.set_columns(*columns);
  }
  if (rows) {
    request.set_rows(*rows);
  }
  accuracy_v1::ErrorMapResponse response;
  const absl::Status status =
      connections.Ask<AccuracyService>("accuracy", &AccuracyService::Stub::ErrorMap, request, response);
  if (!status.ok()) {
    return status;
  }
  if (output.json()) {
    PrintJson(response, output);
    return status;
  }
  CsvTable table({"x_W_mm", "y_W_mm", "sigma_mm", "bound_95_mm"});
  for (int i = 0; i + 4 <= response.values_size(); i += 4) {
    table.AddRow(std::vector<double>(response.values().begin() + i, response.values().begin() + i + 4));
  }
  return WriteCsv(out, table);
}

}  // namespace

void AddAccuracyServiceVerbs(CLI::App& noun, Output& output, const Connections& connections) {
  auto options = std::make_shared<PredictOptions>();
  CLI::App* predict = AddServiceVerb(
      noun, "predict", "contour error of a plan that trajectory has: bound, budget, worst places");
  predict->add_option("PLAN", options->plan_id, "the plan's id")->required();
  predict->add_flag("--compensated", options->compensated, "the plan carries elastic feed-forward");
  predict->add_option("--draws", options->draws, "Monte Carlo draws, 0 is linear only; default 1000");
  predict->add_option("--seed", options->seed, "of the draws; default 1");
  predict->callback([=, &output, &connections] { output.Finish(Predict(*options, connections, output)); });

  auto columns = std::make_shared<std::optional<std::uint32_t>>();
  auto rows = std::make_shared<std::optional<std::uint32_t>>();
  auto out = std::make_shared<std::string>("-");
  CLI::App* map = AddServiceVerb(noun, "map", "error map over the sheet as CSV");
  map->add_option("--columns", *columns, "points along x, 2 to 400; default 41");
  map->add_option("--rows", *rows, "points along y, 2 to 400; default 31");
  map->add_option("--out", *out, "CSV; - is standard output");
  map->callback(
      [=, &output, &connections] { output.Finish(Map(*columns, *rows, *out, connections, output)); });

  auto request = std::make_shared<accuracy_v1::BudgetRequest>();
  auto shifts = std::make_shared<std::vector<double>>();
  auto numbers = std::make_shared<std::vector<double>>(6, 0.0);
  CLI::App* budget = AddServiceVerb(noun, "budget", "equations (1) and (2) for given shares");
  budget->add_option("--shift-mm", *shifts, "four shifts of the subsystems")->required()->expected(4);
  const char* names[] = {"--alpha-rad",   "--beta-rad", "--radius-a-mm",
                         "--radius-b-mm", "--drive-mm", "--jet-mm"};
  for (std::size_t i = 0; i < numbers->size(); ++i) {
    budget->add_option(names[i], (*numbers)[i], "as the proto says; default 0");
  }
  budget->callback([=, &output, &connections] {
    request->mutable_shift_mm()->Add(shifts->begin(), shifts->end());
    request->set_alpha_rad((*numbers)[0]);
    request->set_beta_rad((*numbers)[1]);
    request->set_radius_a_mm((*numbers)[2]);
    request->set_radius_b_mm((*numbers)[3]);
    request->set_drive_mm((*numbers)[4]);
    request->set_jet_mm((*numbers)[5]);
    accuracy_v1::BudgetResponse response;
    const absl::Status status =
        connections.Ask<AccuracyService>("accuracy", &AccuracyService::Stub::Budget, *request, response);
    if (status.ok()) {
      PrintJson(response, output);
      output.Text(
          fmt::format("base (2) {:.4f} mm, total (1) {:.4f} mm", response.base_mm(), response.total_mm()));
    }
    output.Finish(status);
  });
}

}  // namespace lambdajet::cli
