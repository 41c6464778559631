// The loads that a cell must bear: a MES that polls while people watch, a CAM system that solves poses in batches, and CAM
// programmers who have programs admitted, planned, listed and sampled.
//
// Model: open loop as open_loop.hpp. MES: of ten questions six read a job, two list jobs, two read the machine, beside
// `watchers` open WatchJobs streams. CAM: each question is one SolveInverseBatch of `batch_poses` poses over the sheet.
// Plans: of ten questions four admit a program, two list its operations, two read all points of the newest plan, and two plan it at
// a feed that no plan was made for yet and watch to the end; the answer to a stream is its last word.
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
absl::StatusOr<Measured> RunPlanning(const Channels& trajectory, const Pace& pace);
absl::StatusOr<Measured> RunCamBatches(const Channels& kinematics, const Pace& pace, int batch_poses);

}  // namespace lambdajet::load
