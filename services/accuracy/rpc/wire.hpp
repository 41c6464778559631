// Translates between lambdajet.accuracy.v1 and the core.
//
// Threads: pure. Errors: FromWire says INVALID_ARGUMENT with every field that is wrong.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "accuracy/core/budget.hpp"
#include "accuracy/core/error_map.hpp"
#include "accuracy/core/prediction.hpp"
#include "lambdajet/accuracy/v1/accuracy.pb.h"

namespace lambdajet::accuracy {

inline constexpr std::size_t kMostPlanPoints = 200000;

struct PredictQuestion {
  std::vector<PlanSample> samples;
  bool compensated = false;
  PredictionOptions options;
};

struct BudgetQuestion {
  SetUpShares shares;
  double drive_mm = 0.0;
  double jet_mm = 0.0;
};

absl::StatusOr<PredictQuestion> FromWire(const v1::PredictContourRequest& request);
absl::StatusOr<BudgetQuestion> FromWire(const v1::BudgetRequest& request);
absl::StatusOr<ErrorMapOptions> FromWire(const v1::ErrorMapRequest& request);

void ToWire(const MachineDescription& machine, machine::v1::ModelVersion& wire);
void ToWire(const ContourPrediction& prediction, v1::PredictContourResponse& wire);
void ToWire(const std::vector<PlaceError>& map, const std::vector<ParameterShare>& ranking,
            const ErrorMapOptions& options, v1::ErrorMapResponse& wire);

}  // namespace lambdajet::accuracy
