// Hands a table of answers to where it was asked for: a CSV file, standard output, or JSON.
//
// Model: one row an answer. With --json and no file of its own the table is printed as an array of objects, cells that are
// numbers as numbers. Errors: those of WriteCsv. Threads: one.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "clients/cli/csv.hpp"
#include "clients/cli/output.hpp"

namespace lambdajet::cli {

// One more cell, in the fewest digits that read back the same.
void Append(std::vector<std::string>& cells, double number);

// How many rows there were and how many of them have no solution, in words.
std::string Counted(std::size_t rows, std::size_t refused);

// `said` goes to standard error.
absl::Status DeliverTable(const CsvTable& table, const std::string& path, const std::string& said,
                          Output& output);

}  // namespace lambdajet::cli
