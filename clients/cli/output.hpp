// Writes what a verb has to say: text and tables for people, or JSON for programs, and remembers how it
// ended.
//
// Model: results go to standard output, messages and progress to standard error, so that a pipe carries
// results only. With --json a verb prints one JSON value (a stream prints one per line) and no text; trouble
// is a JSON object on standard error. Progress is a bar on a terminal and plain lines elsewhere. Colour only
// on a terminal and without NO_COLOR. Units: as the columns say. Threads: one.
#pragma once

#include <chrono>
#include <cstdio>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "clients/cli/exit_code.hpp"

namespace lambdajet::cli {

// A table for people. Cells that read as numbers are set right.
struct TextTable {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
};

struct OutputOptions {
  bool json = false;
  bool quiet = false;  // no messages, no progress; trouble is still told
};

enum class Tone { kPlain, kGood, kWarning, kBad };

// With so many digits after the point.
std::string Fixed(double value, int digits);
// Shortest text that reads back as the same number.
std::string Shortest(double value);

class Output {
 public:
  Output(std::FILE* results, std::FILE* messages);

  OutputOptions& options() { return options_; }
  bool json() const { return options_.json; }
  ExitCode exit_code() const { return exit_code_; }

  // People's results; nothing with --json. A line feed is added.
  void Text(std::string_view line, Tone tone = Tone::kPlain);
  void Table(const TextTable& table);
  // The program's result; nothing without --json.
  void Json(const nlohmann::json& value);

  // On standard error, unless --quiet.
  void Message(std::string_view line);
  // Progress of long work; ratio 0 … 1. On a terminal the bar is drawn over; elsewhere a line each new tenth.
  void Progress(double ratio, std::string_view what);
  void EndProgress();

  // Tells the trouble on standard error with its reason and fields, and sets the exit code that fits.
  void Fail(const absl::Status& status);
  void Fail(ExitCode code, std::string_view reason, std::string_view message);
  // OK ends well; trouble is told.
  void Finish(const absl::Status& status);
  void Exit(ExitCode code) { exit_code_ = code; }

 private:
  std::string Coloured(std::string_view text, Tone tone, bool colour) const;

  std::FILE* results_;
  std::FILE* messages_;
  bool results_colour_;
  bool messages_colour_;
  bool messages_terminal_;
  bool bar_open_ = false;
  int last_tenth_ = -1;
  std::string last_what_;
  OutputOptions options_;
  ExitCode exit_code_ = ExitCode::kOk;
};

// Shows how far work in many steps has come: nothing of work that is over within 0.3 s, then each new percent. The bar
// ends where the work did, unless it was Done() before that.
class LongWork {
 public:
  LongWork(Output& output, std::string what) : output_(output), what_(std::move(what)) {}
  ~LongWork();
  LongWork(const LongWork&) = delete;
  LongWork& operator=(const LongWork&) = delete;

  void At(double ratio);
  void Done();

 private:
  Output& output_;
  std::string what_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  int shown_percent_ = -1;
};

}  // namespace lambdajet::cli
