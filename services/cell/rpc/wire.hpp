// Translates between the cell's core and lambdajet.cell.v1: nothing else.
//
// Units: the wire's names. Threads: pure. Errors: INVALID_ARGUMENT with every wrong field, its value and what is right.
#pragma once

#include "absl/status/statusor.h"
#include "cell/desk/job_desk.hpp"
#include "lambdajet/cell/v1/cell.pb.h"

namespace lambdajet::cell {

inline constexpr std::size_t kLargestProgram_bytes = 8U << 20U;

absl::StatusOr<Submission> FromWire(const v1::SubmitJobRequest& request);
absl::Status CheckJobId(const std::string& job_id);
std::optional<JobState> FromWire(v1::JobState state);

v1::Job ToWire(const LiveJob& live);
v1::JobEvent ToWire(const JournalRecord& record);
v1::MachineState ToWire(const MachineWord& machine);
v1::GetReportResponse ToWire(const LiveJob& live, const JobRecord& record, std::int64_t now_ns);

// RFC 3339 in UTC with milliseconds; empty for 0.
std::string TimeText(std::int64_t time_ns);

}  // namespace lambdajet::cell
