// The two loads that a cell must bear: a MES that polls while people watch, and a CAM system that solves poses in batches.
//
// Model: open loop as open_loop.hpp. MES: of ten questions six read a job, two list jobs, two read the machine, beside
// `watchers` open WatchJobs streams. CAM: each question is one SolveInverseBatch of `batch_poses` poses over the sheet.
// Threads: one call at a time.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "tests/load/open_loop.hpp"

namespace grpc {
class Channel;
}

namespace lambdajet::load {

using Channels = std::vector<std::shared_ptr<grpc::Channel>>;

absl::StatusOr<Measured> RunMesPolling(const Channels& cell, const Pace& pace, int watchers);
absl::StatusOr<Measured> RunCamBatches(const Channels& kinematics, const Pace& pace, int batch_poses);

}  // namespace lambdajet::load
