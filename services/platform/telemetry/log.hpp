// Writes the structured log: one JSON object a line, on stderr.
//
// Model: fields ts (UTC, for people), mono_ns (for arithmetic), level, house, event (snake_case, stable),
// message (for people), then the caller's own. Lines go through a bounded queue to one writer thread; a full
// queue drops the oldest line, so a stuck stderr never stops a loop. An event that comes more than
// `lines_per_second` times in a second is cut off for the rest of that second, and the next line that passes
// says how many were held back (`suppressed`). Threads: any; not from inside a cyclic loop (a line
// allocates). Errors and warnings are flushed at once.
#pragma once

#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

namespace lambdajet {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

// A key (snake_case, unit last) and its value.
struct LogField {
  LogField(std::string_view k, std::string_view v) : key(k), value(std::string(v)) {}
  LogField(std::string_view k, const char* v) : key(k), value(std::string(v)) {}
  LogField(std::string_view k, const std::string& v) : key(k), value(v) {}
  LogField(std::string_view k, double v) : key(k), value(v) {}
  LogField(std::string_view k, bool v) : key(k), value(v) {}
  template <std::integral Integer>
  LogField(std::string_view k, Integer v) : key(k), value(static_cast<std::int64_t>(v)) {}

  std::string_view key;
  std::variant<std::string, double, bool, std::int64_t> value;
};

struct LogOptions {
  std::string house;
  LogLevel level = LogLevel::kInfo;
  int lines_per_second = 20;  // of one event
};

class Log {
 public:
  explicit Log(const LogOptions& options);
  ~Log();  // writes out what is queued
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  void Debug(std::string_view event, std::string_view message, std::initializer_list<LogField> fields = {});
  void Info(std::string_view event, std::string_view message, std::initializer_list<LogField> fields = {});
  void Warning(std::string_view event, std::string_view message, std::initializer_list<LogField> fields = {});
  void Error(std::string_view event, std::string_view message, std::initializer_list<LogField> fields = {});

 private:
  class Sink;
  std::unique_ptr<Sink> sink_;
};

}  // namespace lambdajet
