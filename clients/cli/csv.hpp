// Reads and writes tables as CSV with a header line whose names end in their units, as `x_W_mm`.
//
// Model: RFC 4180 with comma or semicolon and dot as the decimal sign; a cell in double quotes may hold
// commas; lines that start with # are comments. A path "-" is standard input or output. Numbers are written
// with as many digits as read back exactly. Errors: INVALID_ARGUMENT with reason CSV_… , the file, line and
// column, and what would be right; NOT_FOUND. Threads: values.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lambdajet::cli {

class CsvTable {
 public:
  CsvTable() = default;
  explicit CsvTable(std::vector<std::string> columns) : columns_(std::move(columns)) {}

  const std::vector<std::string>& columns() const { return columns_; }
  const std::vector<std::vector<std::string>>& rows() const { return rows_; }
  const std::string& source() const { return source_; }

  bool Has(std::string_view column) const { return Find(column) >= 0; }
  // The column as finite numbers; refused with the line where it is not one, or where the column is missing.
  absl::StatusOr<std::vector<double>> Numbers(std::string_view column) const;
  absl::StatusOr<std::vector<std::string>> Texts(std::string_view column) const;

  void AddRow(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  void AddRow(const std::vector<double>& numbers);

  static absl::StatusOr<CsvTable> Parse(std::string_view text, std::string source);
  std::string ToText() const;

 private:
  int Find(std::string_view column) const;
  absl::Status Missing(std::string_view column) const;

  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<int> lines_;  // of the file, for messages
  std::string source_;
};

absl::StatusOr<CsvTable> ReadCsv(const std::string& path);
absl::Status WriteCsv(const std::string& path, const CsvTable& table);

}  // namespace lambdajet::cli
