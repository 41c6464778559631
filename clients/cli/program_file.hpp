// Reads a part program for the verbs on files, and says for which machine's axes it is read.
//
// Threads: one. Errors: those of text_file.hpp; INVALID_ARGUMENT DRAWING_NOT_PROGRAM where the file is a DXF drawing.
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "trajectory/core/part_program/cldata_reader.hpp"

namespace lambdajet::cli {

absl::StatusOr<std::string> ReadProgramFile(const std::string& path);

// --axes: xy, rotary-head or hexapod.
void AddAxesOption(CLI::App& verb, std::string& axes);
std::uint8_t AxesOf(const std::string& axes);
trajectory::ToolAngles ToolAnglesOf(const std::string& axes);

}  // namespace lambdajet::cli
