#include "clients/cli/answer_table.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

namespace lambdajet::cli {
namespace {

nlohmann::json CellOf(const std::string& cell) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), number);
  const bool whole = error == std::errc() && end == cell.data() + cell.size() && !cell.empty();
  return whole && std::isfinite(number) ? nlohmann::json(number) : nlohmann::json(cell);
}

nlohmann::json JsonOf(const CsvTable& table) {
  nlohmann::json rows = nlohmann::json::array();
  for (const auto& cells : table.rows()) {
    nlohmann::json row;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      row[table.columns()[c]] = CellOf(cells[c]);
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

void Append(std::vector<std::string>& cells, double number) { cells.push_back(Shortest(number)); }

std::string Counted(std::size_t rows, std::size_t refused) {
  return fmt::format("{} rows, {} of them refused", rows, refused);
}

absl::Status DeliverTable(const CsvTable& table, const std::string& path, const std::string& said,
                          Output& output) {
  if (output.json() && path == "-") {
    output.Json(JsonOf(table));
    return absl::OkStatus();
  }
  if (const absl::Status status = WriteCsv(path, table); !status.ok()) {
    return status;
  }
  output.Message(said);
  return absl::OkStatus();
}

}  // namespace lambdajet::cli
