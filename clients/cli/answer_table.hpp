// Hands a table of answers to where it was asked for: a CSV file, standard output, or JSON.
//
// Model: one row an answer. With --json and no file of its own the table is printed as an array of objects, cells that are
// numbers as numbers. Errors: those of WriteCsv. Threads: one.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "clients/cli/csv.hpp"
#include "clients/cli/output.hpp"

namespace lambdajet::cli {

// `said` goes to standard error.
absl::Status DeliverTable(const CsvTable& table, const std::string& path, const std::string& said,
                          Output& output);

}  // namespace lambdajet::cli
