#include "trajectory/rpc/program_streams.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "foundation/contract/trouble.hpp"
#include "trajectory/core/feed/plan_samples.hpp"
#include "trajectory/core/part_program/cldata_writer.hpp"
#include "trajectory/core/part_program/gcode_writer.hpp"
#include "trajectory/rpc/answer_limits.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kOperationsPerBatch = 5000;
constexpr std::string_view kLost = "KEPT_TEXT_UNREADABLE";
constexpr const char* kSampleHeader =
    "tau_s,s_mm,x_W_mm,y_W_mm,vx_W_mm_per_s,vy_W_mm_per_s,ax_W_mm_per_s2,ay_W_mm_per_s2,"
    "actuator_1_mm,actuator_2_mm,actuator_1_mm_per_s,actuator_2_mm_per_s,cutting,source_line\n";

// A program on its way out, read when it is first asked for.
struct Listing {
  ListedProgram listed;
  bool read = false;
  PartProgram program;
  std::size_t next = 0;

  explicit Listing(ListedProgram of) : listed(std::move(of)) {}
  void Read() {
    if (!read) {
      program = ReadListed(std::move(listed));
      read = true;
    }
  }
};

absl::Status FaultStatus(const ProgramFault& fault) {
  if (fault.reason == kLost) {
    return Trouble(absl::StatusCode::kDataLoss, fault.reason, fault.message);
  }
  return Trouble(absl::StatusCode::kFailedPrecondition, std::string(fault.reason),
                 "line " + std::to_string(fault.line) + ": " + fault.message);
}

void AppendSample(const FullSample& s, std::string& csv) {
  const std::array<double, 12> numbers = {
      s.jet.tau_s,         s.jet.s_mm,          s.jet.x_W_mm,           s.jet.y_W_mm,
      s.jet.vx_W_mm_per_s, s.jet.vy_W_mm_per_s, s.jet.ax_W_mm_per_s2,   s.jet.ay_W_mm_per_s2,
      s.actuator_mm[0],    s.actuator_mm[1],    s.actuator_mm_per_s[0], s.actuator_mm_per_s[1]};
  char text[32];
  for (const double number : numbers) {
    std::snprintf(text, sizeof text, "%.9g,", number);
    csv += text;
  }
  std::snprintf(text, sizeof text, "%d,%u\n", s.jet.cutting ? 1 : 0, s.jet.source_line);
  csv += text;
}

}  // namespace

PartProgram ReadListed(ListedProgram listed) {
  if (listed.plan != nullptr) {
    absl::StatusOr<std::string> kept = listed.plan->kept.Read();
    if (!kept.ok()) {
      PartProgram lost;
      lost.faults.push_back({0, 0, kLost, "", std::string(kept.status().message())});
      return lost;
    }
    listed.program.text = *std::move(kept);
  }
  if (listed.hexapod != nullptr) {
    return ReadSpatialProgram(listed.program.text, listed.hexapod->motion, listed.program.notation);
  }
  MadeProgram made = MakeProgram(std::move(listed.program), listed.machine.get());
  if (!made.faults.empty()) {
    PartProgram refused;
    refused.faults = std::move(made.faults);
    return refused;
  }
  ReadOptions options;
  options.notation = made.notation;
  if (listed.machine != nullptr) {
    options.gcode.kerf_width_mm = listed.machine->process.kerf_width_mm;
    options.gcode.abrasive_flow_max_g_per_min = listed.machine->process.abrasive_flow_max_g_per_min;
    options.gcode.default_tolerance_mm = listed.machine->path.corner_tolerance_mm;
  }
  return ReadPartProgram(made.text, options);
}

Source<v1::OperationBatch> OperationBatches(ListedProgram program) {
  return [listing = std::make_shared<Listing>(std::move(program))](
             v1::OperationBatch& batch) -> absl::StatusOr<bool> {
    const bool first = !listing->read;
    listing->Read();
    const PartProgram& read = listing->program;
    if (!read.faults.empty()) {
      for (const ProgramFault& fault : read.faults) {
        ToWire(fault, *batch.add_faults());
      }
      return first;
    }
    for (std::size_t i = 0; i < kOperationsPerBatch && listing->next < read.operations.size(); ++i) {
      batch.add_operations(FormatOperation(read.operations[listing->next++]));
    }
    return first || batch.operations_size() > 0;
  };
}

namespace {

Source<v1::ExportPiece> CanonicalPieces(ListedProgram program) {
  return [listing =
              std::make_shared<Listing>(std::move(program))](v1::ExportPiece& piece) -> absl::StatusOr<bool> {
    listing->Read();
    const PartProgram& read = listing->program;
    if (!read.faults.empty()) {
      return FaultStatus(read.faults.front());
    }
    std::string& text = *piece.mutable_content();
    while (text.size() < kBytesPerPiece && listing->next < read.operations.size()) {
      text += FormatOperation(read.operations[listing->next++]) + "\n";
    }
    return !text.empty();
  };
}

Source<v1::ExportPiece> GcodePieces(ListedProgram program) {
  struct Writing {
    Listing listing;
    GcodeWriter writer{"exported by lambdajet"};
    bool ended = false;
  };
  return [writing = std::make_shared<Writing>(Writing{Listing(std::move(program))})](
             v1::ExportPiece& piece) -> absl::StatusOr<bool> {
    writing->listing.Read();
    const PartProgram& read = writing->listing.program;
    if (!read.faults.empty()) {
      return FaultStatus(read.faults.front());
    }
    GcodeWriter& writer = writing->writer;
    while (writer.size() < kBytesPerPiece && writing->listing.next < read.operations.size()) {
      writer.Append(read.operations[writing->listing.next++]);
    }
    if (writing->listing.next == read.operations.size() && !std::exchange(writing->ended, true)) {
      writer.End();
    }
    piece.set_content(writer.Take());
    return !piece.content().empty();
  };
}

absl::StatusOr<std::string> WrittenCldata(ListedProgram listed) {
  const bool hexapod = listed.hexapod != nullptr;
  const PartProgram read = ReadListed(std::move(listed));
  if (!read.faults.empty()) {
    return FaultStatus(read.faults.front());
  }
  CldataText cldata = WriteCldata(read.operations, "exported by lambdajet", {},
                                  hexapod ? ToolAngles::kRollPitch : ToolAngles::kRotaryHead);
  return cldata.faults.empty() ? absl::StatusOr<std::string>(std::move(cldata.text))
                               : FaultStatus(cldata.faults.front());
}

Source<v1::ExportPiece> CldataPieces(ListedProgram program) {
  struct Writing {
    ListedProgram listed;
    std::optional<std::string> text;
    std::size_t next = 0;
  };
  return [writing = std::make_shared<Writing>(Writing{std::move(program), std::nullopt})](
             v1::ExportPiece& piece) -> absl::StatusOr<bool> {
    if (!writing->text) {
      auto text = WrittenCldata(std::move(writing->listed));
      if (!text.ok()) {
        return text.status();
      }
      writing->text = std::move(*text);
    }
    piece.set_content(writing->text->substr(writing->next, kBytesPerPiece));
    writing->next += piece.content().size();
    return !piece.content().empty();
  };
}

}  // namespace

Source<v1::ExportPiece> ProgramPieces(ListedProgram program, v1::ExportRequest::Format format) {
  return format == v1::ExportRequest::FORMAT_CANONICAL ? CanonicalPieces(std::move(program))
         : format == v1::ExportRequest::FORMAT_GCODE   ? GcodePieces(std::move(program))
                                                       : CldataPieces(std::move(program));
}

Source<v1::ExportPiece> SamplePieces(std::shared_ptr<const PlannedProgram> planned, double step_s) {
  const auto count = static_cast<std::int64_t>(std::floor(planned->plan.duration_s / step_s + 1e-9)) + 1;
  return [planned = std::move(planned), step_s, count,
          next = std::int64_t{0}](v1::ExportPiece& piece) mutable -> absl::StatusOr<bool> {
    std::string& text = *piece.mutable_content();
    if (next == 0) {
      text = kSampleHeader;
    }
    while (text.size() < kBytesPerPiece && next < count) {
      AppendSample(SampleAt(*planned, static_cast<double>(next++) * step_s), text);
    }
    return !text.empty();
  };
}

}  // namespace lambdajet::trajectory
