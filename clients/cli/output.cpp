#include "clients/cli/output.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::cli {
namespace {

constexpr int kBarWidth = 30;
constexpr std::chrono::milliseconds kShort{300};  // work that needs no bar

bool WantsColour(std::FILE* stream) {
  const char* no_colour = std::getenv("NO_COLOR");
  return isatty(fileno(stream)) != 0 && (no_colour == nullptr || no_colour[0] == '\0');
}

// Columns are counted in code points, so that µ and ° do not shift a table.
std::size_t Width(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

bool ReadsAsNumber(std::string_view text) {
  double value = 0.0;
  const auto end = text.data() + text.size();
  return !text.empty() && std::from_chars(text.data(), end, value).ptr == end;
}

std::string Padded(std::string_view text, std::size_t width, bool right) {
  const std::string spaces(width - std::min(width, Width(text)), ' ');
  return right ? spaces + std::string(text) : std::string(text) + spaces;
}

std::string Line(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths,
                 const std::vector<bool>& right) {
  std::string line;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    line += (i == 0 ? "" : "  ") + Padded(i < cells.size() ? cells[i] : "", widths[i], right[i]);
  }
  while (!line.empty() && line.back() == ' ') {
    line.pop_back();
  }
  return line;
}

std::string_view CodeName(ExitCode code) {
  switch (code) {
    case ExitCode::kOk:
      return "OK";
    case ExitCode::kFailure:
      return "FAILED";
    case ExitCode::kUsage:
      return "USAGE";
    case ExitCode::kUnreachable:
      return "UNREACHABLE";
    case ExitCode::kRefused:
      return "REFUSED";
    case ExitCode::kTimeout:
      return "TIMEOUT";
    case ExitCode::kPrecondition:
      return "PRECONDITION";
  }
  return "FAILED";
}

// What is wrong with a word of the command line or with a file that it names, whatever it is wanted for.
bool NamesWrongWordOrFile(std::string_view reason) {
  static constexpr std::array<std::string_view, 16> kReasons = {
      "FILE_NOT_READ", "FILE_TOO_LARGE",    "NO_SUCH_FILE",     "NOT_A_FILE",        "YAML_SYNTAX",
      "YAML_VALUE",    "BAD_MACHINE_FILE",  "BAD_HEXAPOD_FILE", "BAD_DRAWING",       "BAD_ADDRESS",
      "BAD_MODE",      "BAD_SERVICES_FILE", "BAD_ZONE",         "BAD_ANNOUNCE_FILE", "DRAWING_NOT_PROGRAM",
      "PICTURE_SUFFIX"};
  return reason.starts_with("CSV_") || std::ranges::find(kReasons, reason) != kReasons.end();
}

}  // namespace

ExitCode ExitCodeOf(const absl::Status& status) {
  if (NamesWrongWordOrFile(TroubleReason(status))) {
    return ExitCode::kUsage;
  }
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return ExitCode::kOk;
    case absl::StatusCode::kUnavailable:
      return ExitCode::kUnreachable;
    case absl::StatusCode::kDeadlineExceeded:
      return ExitCode::kTimeout;
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kAborted:
      return ExitCode::kPrecondition;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kUnauthenticated:
    case absl::StatusCode::kResourceExhausted:
      return ExitCode::kRefused;
    default:
      return ExitCode::kFailure;
  }
}

std::string Fixed(double value, int digits) { return fmt::format("{:.{}f}", value, digits); }
std::string Shortest(double value) { return fmt::format("{}", value); }

Output::Output(std::FILE* results, std::FILE* messages)
    : results_(results),
      messages_(messages),
      results_colour_(WantsColour(results)),
      messages_colour_(WantsColour(messages)),
      messages_terminal_(isatty(fileno(messages)) != 0) {}

std::string Output::Coloured(std::string_view text, Tone tone, bool colour) const {
  if (!colour || tone == Tone::kPlain) {
    return std::string(text);
  }
  const int code = tone == Tone::kGood ? 32 : tone == Tone::kWarning ? 33 : 31;
  return fmt::format("\x1b[{}m{}\x1b[0m", code, text);
}

void Output::Text(std::string_view line, Tone tone) {
  if (!options_.json) {
    EndProgress();
    fmt::print(results_, "{}\n", Coloured(line, tone, results_colour_));
    std::fflush(results_);
  }
}

void Output::Table(const TextTable& table) {
  std::vector<std::size_t> widths;
  std::vector<bool> right;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    std::size_t width = Width(table.columns[i]);
    bool numbers = !table.rows.empty();
    for (const auto& row : table.rows) {
      const std::string& cell = i < row.size() ? row[i] : std::string();
      width = std::max(width, Width(cell));
      numbers = numbers && (cell.empty() || cell == "-" || ReadsAsNumber(cell));
    }
    widths.push_back(width);
    right.push_back(numbers);
  }
  Text(Line(table.columns, widths, right));
  for (const auto& row : table.rows) {
    Text(Line(row, widths, right));
  }
}

void Output::Json(const nlohmann::json& value) {
  if (options_.json) {
    fmt::print(results_, "{}\n", value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    std::fflush(results_);
  }
}

void Output::Message(std::string_view line) {
  if (!options_.quiet) {
    EndProgress();
    fmt::print(messages_, "{}\n", line);
  }
}

void Output::Progress(double ratio, std::string_view what) {
  if (options_.quiet || options_.json) {
    return;
  }
  const double clamped = std::clamp(std::isfinite(ratio) ? ratio : 0.0, 0.0, 1.0);
  if (messages_terminal_) {
    const int full = static_cast<int>(clamped * kBarWidth);
    fmt::print(messages_, "\r\x1b[2K[{:#<{}}{:.<{}}] {:3.0f} % {}", "", full, "", kBarWidth - full,
               clamped * 100, what);
    std::fflush(messages_);
    bar_open_ = true;
    return;
  }
  const int tenth = static_cast<int>(clamped * 10);
  if (tenth != last_tenth_ || what != last_what_) {
    fmt::print(messages_, "{:3.0f} % {}\n", clamped * 100, what);
  }
  last_tenth_ = tenth;
  last_what_ = what;
}

void Output::EndProgress() {
  if (bar_open_) {
    fmt::print(messages_, "\n");
    bar_open_ = false;
  }
  last_tenth_ = -1;
}

LongWork::~LongWork() {
  if (shown_percent_ >= 0) {
    output_.EndProgress();
  }
}

void LongWork::At(double ratio) {
  const int percent = static_cast<int>(std::clamp(ratio, 0.0, 1.0) * 100.0);
  if (percent == shown_percent_ ||
      (shown_percent_ < 0 && std::chrono::steady_clock::now() - begin_ < kShort)) {
    return;
  }
  shown_percent_ = percent;
  output_.Progress(ratio, what_);
}

void LongWork::Done() {
  if (shown_percent_ >= 0) {
    At(1.0);
  }
}

void Output::Fail(const absl::Status& status) {
  const ExitCode code = ExitCodeOf(status);
  const std::string reason = TroubleReason(status);
  const std::string shown = reason.empty() ? absl::StatusCodeToString(status.code()) : reason;
  Fail(code, shown, std::string(status.message()));
  if (options_.json) {
    return;
  }
  for (const FieldViolation& violation : TroubleViolations(status)) {
    fmt::print(messages_, "  {}: {} ({})\n", violation.field, violation.description, violation.reason);
  }
}

void Output::Fail(ExitCode code, std::string_view reason, std::string_view message) {
  EndProgress();
  exit_code_ = code;
  if (options_.json) {
    const nlohmann::json error = {
        {"error",
         {{"exit", CodeName(code)}, {"reason", std::string(reason)}, {"message", std::string(message)}}}};
    fmt::print(messages_, "{}\n", error.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    return;
  }
  fmt::print(messages_, "{} {}: {}\n", Coloured("lambdajet:", Tone::kBad, messages_colour_), reason, message);
}

void Output::Finish(const absl::Status& status) {
  if (!status.ok()) {  // a refusal that the verb has told already stays
    Fail(status);
  }
}

}  // namespace lambdajet::cli
