#include "clients/cli/csv.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "clients/cli/text_file.hpp"
#include "foundation/contract/trouble.hpp"

namespace lambdajet::cli {
namespace {

constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;

std::string Trimmed(std::string text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) {
    return "";
  }
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string> Cells(std::string_view line, char separator) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back() += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == separator && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  for (std::string& cell : cells) {
    cell = Trimmed(std::move(cell));
  }
  return cells;
}

std::string Quoted(const std::string& cell) {
  if (cell.find_first_of(",\"\n") == std::string::npos) {
    return cell;
  }
  std::string out = "\"";
  for (const char c : cell) {
    out += c == '"' ? "\"\"" : std::string(1, c);
  }
  return out + "\"";
}

std::string Joined(const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    line += (i == 0 ? "" : ",") + Quoted(cells[i]);
  }
  return line + "\n";
}

}  // namespace

int CsvTable::Find(std::string_view column) const {
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (columns_[i] == column) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

absl::Status CsvTable::Missing(std::string_view column) const {
  return Trouble(kInvalid, "CSV_COLUMN_MISSING",
                 fmt::format("{}: there is no column '{}'; the header has: {}", source_, column,
                             fmt::join(columns_, ", ")));
}

absl::StatusOr<std::vector<std::string>> CsvTable::Texts(std::string_view column) const {
  const int index = Find(column);
  if (index < 0) {
    return Missing(column);
  }
  std::vector<std::string> texts;
  texts.reserve(rows_.size());
  for (const auto& row : rows_) {
    texts.push_back(row[static_cast<std::size_t>(index)]);
  }
  return texts;
}

absl::StatusOr<std::vector<double>> CsvTable::Numbers(std::string_view column) const {
  const int index = Find(column);
  if (index < 0) {
    return Missing(column);
  }
  std::vector<double> numbers;
  numbers.reserve(rows_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const std::string& cell = rows_[i][static_cast<std::size_t>(index)];
    double value = 0.0;
    const char* end = cell.data() + cell.size();
    const auto parsed = std::from_chars(cell.data(), end, value);
    if (parsed.ec != std::errc{} || parsed.ptr != end || !std::isfinite(value)) {
      const int line = i < lines_.size() ? lines_[i] : static_cast<int>(i) + 2;
      return Trouble(kInvalid, "CSV_NOT_A_NUMBER",
                     fmt::format("{}:{}: column '{}' is '{}'; a finite number with a decimal point is right",
                                 source_, line, column, cell));
    }
    numbers.push_back(value);
  }
  return numbers;
}

void CsvTable::AddRow(const std::vector<double>& numbers) {
  std::vector<std::string> cells;
  cells.reserve(numbers.size());
  for (const double number : numbers) {
    cells.push_back(fmt::format("{}", number));
  }
  rows_.push_back(std::move(cells));
}

absl::StatusOr<CsvTable> CsvTable::Parse(std::string_view text, std::string source) {
  CsvTable table;
  table.source_ = std::move(source);
  char separator = ',';
  int number = 0;
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string line = Trimmed(std::string(text.substr(0, end)));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++number;
    if (line.empty() || line[0] == '#') {
      continue;
    }
    if (table.columns_.empty()) {
      separator = line.find(';') != std::string::npos && line.find(',') == std::string::npos ? ';' : ',';
      table.columns_ = Cells(line, separator);
      continue;
    }
    auto cells = Cells(line, separator);
    if (cells.size() != table.columns_.size()) {
      return Trouble(kInvalid, "CSV_WRONG_WIDTH",
                     fmt::format("{}:{}: {} cells; the header has {} columns", table.source_, number,
                                 cells.size(), table.columns_.size()));
    }
    table.rows_.push_back(std::move(cells));
    table.lines_.push_back(number);
  }
  if (table.columns_.empty()) {
    return Trouble(kInvalid, "CSV_EMPTY",
                   fmt::format("{}: empty; a header line with column names is right", table.source_));
  }
  return table;
}

std::string CsvTable::ToText() const {
  std::string text = Joined(columns_);
  for (const auto& row : rows_) {
    text += Joined(row);
  }
  return text;
}

absl::StatusOr<CsvTable> ReadCsv(const std::string& path) {
  absl::StatusOr<std::string> text = ReadTextFile(path);
  if (!text.ok()) {
    return text.status();
  }
  return CsvTable::Parse(*text, path == "-" ? "standard input" : path);
}

absl::Status WriteCsv(const std::string& path, const CsvTable& table) {
  return WriteTextFile(path, table.ToText());
}

}  // namespace lambdajet::cli
