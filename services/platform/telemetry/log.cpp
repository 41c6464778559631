#include "platform/telemetry/log.hpp"

#include <spdlog/async_logger.h>
#include <spdlog/details/thread_pool.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <map>
#include <mutex>
#include <optional>

namespace lambdajet {
namespace {

constexpr std::size_t kQueueLines = 8192;
constexpr std::size_t kMostEvents = 1024;  // of which the rate is watched one by one

std::int64_t MonotonicNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::string UtcNow() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  tm utc{};
  gmtime_r(&now.tv_sec, &utc);
  char text[40];
  const std::size_t size = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
  std::snprintf(text + size, sizeof text - size, ".%06ldZ", now.tv_nsec / 1000);
  return text;
}

void AppendString(std::string& line, std::string_view text) {
  line += '"';
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      line += '\\';
      line += c;
    } else if (byte < 0x20) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04x", byte);
      line += escape;
    } else {
      line += c;
    }
  }
  line += '"';
}

struct AppendValue {
  std::string& line;
  void operator()(const std::string& text) const { AppendString(line, text); }
  void operator()(bool flag) const { line += flag ? "true" : "false"; }
  void operator()(std::int64_t number) const { line += std::to_string(number); }
  void operator()(double number) const {
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", number);
    if (std::isfinite(number)) {
      line += text;
    } else {
      AppendString(line, text);  // JSON has no NaN
    }
  }
};

void AppendField(std::string& line, std::string_view key, const decltype(LogField::value)& value) {
  line += line.empty() ? '{' : ',';
  AppendString(line, key);
  line += ':';
  std::visit(AppendValue{line}, value);
}

// Counts an event's lines in the running second.
class RateLimit {
 public:
  explicit RateLimit(int lines_per_second) : most_(lines_per_second) {}

  // The number of lines held back since the last one that passed, or nothing if this line is held back too.
  std::optional<std::int64_t> Pass(std::string_view event, std::int64_t now_ns) {
    const std::lock_guard lock(mutex_);
    if (events_.size() >= kMostEvents && events_.find(event) == events_.end()) {
      events_.clear();
    }
    Window& window = events_.try_emplace(std::string(event)).first->second;
    if (now_ns - window.start_ns >= 1'000'000'000) {
      window.start_ns = now_ns;
      window.lines = 0;
    }
    if (window.lines >= most_) {
      ++window.held_back;
      return std::nullopt;
    }
    ++window.lines;
    return std::exchange(window.held_back, 0);
  }

 private:
  struct Window {
    std::int64_t start_ns = 0;
    int lines = 0;
    std::int64_t held_back = 0;
  };
  const int most_;
  std::mutex mutex_;
  std::map<std::string, Window, std::less<>> events_;
};

}  // namespace

class Log::Sink {
 public:
  explicit Sink(const LogOptions& options)
      : options_(options),
        limit_(options.lines_per_second),
        pool_(std::make_shared<spdlog::details::thread_pool>(kQueueLines, 1)),
        logger_(std::make_shared<spdlog::async_logger>(
            options.house, std::make_shared<spdlog::sinks::stderr_sink_mt>(), pool_,
            spdlog::async_overflow_policy::overrun_oldest)) {
    logger_->set_pattern("%v");
    logger_->flush_on(spdlog::level::info);
  }

  void Write(LogLevel level, const char* word, std::string_view event, std::string_view message,
             std::initializer_list<LogField> fields) {
    if (level < options_.level) {
      return;
    }
    const std::int64_t now_ns = MonotonicNs();
    const auto held_back = limit_.Pass(event, now_ns);
    if (!held_back) {
      return;
    }
    std::string line;
    AppendField(line, "ts", UtcNow());
    AppendField(line, "mono_ns", now_ns);
    AppendField(line, "level", std::string(word));
    AppendField(line, "house", options_.house);
    AppendField(line, "event", std::string(event));
    AppendField(line, "message", std::string(message));
    for (const LogField& field : fields) {
      AppendField(line, field.key, field.value);
    }
    if (*held_back > 0) {
      AppendField(line, "suppressed", *held_back);
    }
    line += '}';
    logger_->log(spdlog::level::info, spdlog::string_view_t(line.data(), line.size()));
  }

 private:
  const LogOptions options_;
  RateLimit limit_;
  std::shared_ptr<spdlog::details::thread_pool> pool_;
  std::shared_ptr<spdlog::async_logger> logger_;
};

Log::Log(const LogOptions& options) : sink_(std::make_unique<Sink>(options)) {}
Log::~Log() = default;

void Log::Debug(std::string_view event, std::string_view message, std::initializer_list<LogField> fields) {
  sink_->Write(LogLevel::kDebug, "debug", event, message, fields);
}
void Log::Info(std::string_view event, std::string_view message, std::initializer_list<LogField> fields) {
  sink_->Write(LogLevel::kInfo, "info", event, message, fields);
}
void Log::Warning(std::string_view event, std::string_view message, std::initializer_list<LogField> fields) {
  sink_->Write(LogLevel::kWarning, "warning", event, message, fields);
}
void Log::Error(std::string_view event, std::string_view message, std::initializer_list<LogField> fields) {
  sink_->Write(LogLevel::kError, "error", event, message, fields);
}

}  // namespace lambdajet
