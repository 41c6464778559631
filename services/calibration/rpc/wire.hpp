// Translates between lambdajet.calibration.v1 and the desk.
//
// Threads: pure.
// Errors: FromWire says INVALID_ARGUMENT with every field that is wrong.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "calibration/core/measuring_plan.hpp"
#include "calibration/core/verification.hpp"
#include "calibration/desk/calibration_desk.hpp"
#include "lambdajet/calibration/v1/calibration.pb.h"

namespace lambdajet::calibration {

inline constexpr int kDefaultPageSize = 20;
inline constexpr int kLargestPageSize = 100;

struct Page {
  int size = kDefaultPageSize;
  std::optional<std::int64_t> before;  // what the token says
};

absl::StatusOr<MeasuringPlanOptions> FromWire(const v1::PlanMeasuringRunRequest& request);
absl::StatusOr<int> FromWire(const v1::PlanVerificationRequest& request);
absl::StatusOr<Page> PageFromWire(std::int32_t page_size, const std::string& page_token);
absl::Status CheckPlan(std::uint64_t plan_id);
absl::Status CheckAuthor(const std::string& author);
absl::Status CheckOperationId(const std::string& id);

void ToWire(const MachineDescription& machine, machine::v1::ModelVersion& wire);
void ToWire(const RunHead& run, v1::Run& wire);
void ToWire(const RecordedLook& look, v1::Look& wire);
void ToWire(const Verification& found, const MachineDescription& machine, v1::VerifyBaseResponse& wire);
void ToWire(const OperationView& operation, type::v1::Operation& wire);
void ToWire(const IdentificationReport& report, const Version& parent, const Version& made,
            v1::IdentificationResult& wire);
void ToWire(const Version& version, const MachineDescription& machine, bool active, v1::Version& wire);
void ToWire(const ParameterChange& change, v1::ParameterChange& wire);

}  // namespace lambdajet::calibration
