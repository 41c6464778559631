// Gives long answers in pieces: operation lists, and files made of them or of a plan's points.
//
// Model: each function returns a source for a pull stream (platform/rpc/streams.hpp); a program is read at the first piece.
// Threads: as the stream calls. Cost: a piece at a time in memory, besides the program's operations.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "trajectory/rpc/wire.hpp"

namespace lambdajet::trajectory {

template <typename Message>
using Source = std::function<absl::StatusOr<bool>(Message&)>;

Source<v1::OperationBatch> OperationBatches(std::string program);

// A program with faults ends the stream with FAILED_PRECONDITION and the first one's reason.
Source<v1::ExportPiece> CanonicalPieces(std::string program);

Source<v1::ExportPiece> SamplePieces(std::shared_ptr<const PlannedProgram> planned, double step_s);

}  // namespace lambdajet::trajectory
