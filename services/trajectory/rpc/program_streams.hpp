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

// A program to list or to write, and the machine whose kerf it may ask for; null: none is known.
struct ListedProgram {
  SubmittedProgram program;
  std::shared_ptr<const MachineDescription> machine;
  std::shared_ptr<const HexapodModel> hexapod;  // set: the program is one of its
  std::shared_ptr<const PlanRecord> plan;       // set: its program, not the text above
};

Source<v1::OperationBatch> OperationBatches(ListedProgram program);

// As canonical list, G-code or CLDATA. A program with faults ends the stream with FAILED_PRECONDITION and the first one's
// reason; one that CLDATA has no words for with the writer's; one that is kept and cannot be read with DATA_LOSS.
Source<v1::ExportPiece> ProgramPieces(ListedProgram program, v1::ExportRequest::Format format);

Source<v1::ExportPiece> SamplePieces(std::shared_ptr<const PlannedProgram> planned, double step_s);

// All operations of a program; the faults otherwise.
PartProgram ReadListed(ListedProgram program);

}  // namespace lambdajet::trajectory
