#include "tests/load/load_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::load {
namespace {

constexpr double kShares[] = {0.5, 0.9, 0.99, 0.999, 0.9999, 1.0};
constexpr double kWidth = 860.0;
constexpr double kHeight = 380.0;
constexpr double kLeft = 70.0;
constexpr double kRight = 40.0;
constexpr double kBottom = 50.0;
constexpr double kNines = 5.0;  // the axis ends at 99.999 %
constexpr double kLeastDecade_s = 1e-5;
constexpr double kDecades = 6.0;  // 10 µs to 10 s

double X(double share) {
  const double nines = share >= 1.0 ? kNines : std::min(-std::log10(1.0 - share), kNines);
  return kLeft + nines / kNines * (kWidth - kLeft - kRight);
}

double Y(double seconds) {
  const double decades =
      std::clamp(std::log10(std::max(seconds, kLeastDecade_s) / kLeastDecade_s), 0.0, kDecades);
  return (kHeight - kBottom) - decades / kDecades * (kHeight - kBottom - 20.0);
}

std::string Axis() {
  std::string svg;
  for (int decade = 0; decade <= static_cast<int>(kDecades); ++decade) {
    const double value_ms = kLeastDecade_s * std::pow(10.0, decade) * 1e3;
    const double y = Y(value_ms * 1e-3);
    svg += fmt::format(
        "<line x1='{}' x2='{}' y1='{:.1f}' y2='{:.1f}' stroke='#ddd'/><text x='{}' y='{:.1f}' "
        "text-anchor='end'>{:.6g} ms</text>\n",
        kLeft, kWidth - kRight, y, y, kLeft - 8.0, y + 4.0, value_ms);
  }
  for (int nines = 0; nines <= static_cast<int>(kNines); ++nines) {
    const double share = 1.0 - std::pow(10.0, -nines);
    svg += fmt::format(
        "<line x1='{0:.1f}' x2='{0:.1f}' y1='20' y2='{1}' stroke='#ddd'/><text x='{0:.1f}' y='{2}' "
        "text-anchor='middle'>{3:.7g} %</text>\n",
        X(share), kHeight - kBottom, kHeight - kBottom + 18.0, share * 100.0);
  }
  svg += fmt::format("<text x='{}' y='{}' text-anchor='end'>share of the questions</text>\n", kWidth - kRight,
                     kHeight - 10.0);
  return svg;
}

// Ends at the slowest one: of a thousand questions nothing is known beyond 99.9 %.
std::string Curve(const LatencyHistogram& histogram, const char* colour, const char* dash) {
  std::string points;
  const double last = std::log10(std::max<double>(1.0, static_cast<double>(histogram.count())));
  for (double nines = 0.0; nines <= std::min(kNines, last); nines += 0.05) {
    const double share = 1.0 - std::pow(10.0, -nines);
    points += fmt::format("{:.1f},{:.1f} ", X(share), Y(histogram.Percentile_s(std::max(share, 1e-9))));
  }
  return fmt::format(
      "<polyline fill='none' stroke='{}' stroke-width='2' stroke-dasharray='{}' points='{}'/>\n", colour,
      dash, points);
}

std::string Section(const Measured& run) {
  std::string html =
      fmt::format("<h2>{}</h2><p>{} questions answered, {} errors, {:.0f} a second for {:.0f} s</p>\n",
                  run.what, run.latency.count(), run.error_count(), run.rate_per_s, run.duration_s);
  html +=
      fmt::format("<svg viewBox='0 0 {0} {1}' width='{0}' height='{1}'>{2}{3}{4}</svg>\n", kWidth, kHeight,
                  Axis(), Curve(run.latency, "#0b61a4", "none"), Curve(run.timer, "#999", "4 4"));
  html +=
      "<p>Blue: from the instant the question was due to its answer. Grey, dashed: how late this machine "
      "woke the generator.</p><table><tr><th>share</th><th>latency ms</th><th>timer ms</th></tr>";
  for (const double share : kShares) {
    html += fmt::format("<tr><td>{:.7g} %</td><td>{:.3f}</td><td>{:.3f}</td></tr>", share * 100.0,
                        run.latency.Percentile_s(share) * 1e3, run.timer.Percentile_s(share) * 1e3);
  }
  html += "</table>\n";
  for (const auto& [what, value] : run.further) {
    html += fmt::format("<p>{}: {:.6g}</p>\n", what, value);
  }
  for (const auto& [reason, count] : run.errors) {
    html += fmt::format("<p class='bad'>{}: {}</p>\n", reason, count);
  }
  return html;
}

}  // namespace

std::string ToText(const Measured& run) {
  std::string text = fmt::format("{}: {} answered, {} errors at {:.0f}/s\n", run.what, run.latency.count(),
                                 run.error_count(), run.rate_per_s);
  for (const double share : kShares) {
    text += fmt::format("  {:>8.7g} %  {:10.3f} ms  (timer {:.3f} ms)\n", share * 100.0,
                        run.latency.Percentile_s(share) * 1e3, run.timer.Percentile_s(share) * 1e3);
  }
  for (const auto& [what, value] : run.further) {
    text += fmt::format("  {} {:.6g}\n", what, value);
  }
  for (const auto& [reason, count] : run.errors) {
    text += fmt::format("  error {} {}\n", reason, count);
  }
  return text;
}

std::string ToJson(const std::vector<Measured>& runs) {
  nlohmann::json json = nlohmann::json::array();
  for (const Measured& run : runs) {
    json.push_back({{"what", run.what},
                    {"rate_per_s", run.rate_per_s},
                    {"answered", run.latency.count()},
                    {"errors", run.errors},
                    {"p50_s", run.latency.Percentile_s(0.5)},
                    {"p99_s", run.latency.Percentile_s(0.99)},
                    {"p999_s", run.latency.Percentile_s(0.999)},
                    {"max_s", run.latency.most_s()},
                    {"timer_p50_s", run.timer.Percentile_s(0.5)},
                    {"timer_p99_s", run.timer.Percentile_s(0.99)},
                    {"further", run.further}});
  }
  return json.dump(2);
}

absl::Status WriteHtml(const std::string& path, const std::vector<Measured>& runs) {
  std::ofstream file(path);
  file << "<!doctype html><html lang='en'><meta charset='utf-8'><title>Lambdajet under "
          "load</title><style>body{font:15px sans-serif;max-width:900px;"
          "margin:2em auto;padding:0 1em;color:#1b2733}svg{max-width:100%;height:auto}svg "
          "text{font-size:12px}table{border-collapse:collapse}td,th{padding:4px "
          "14px;text-align:right;border-bottom:1px solid "
          "#d7dee5}.bad{color:#b3261e;font-weight:bold}</style><h1>Lambdajet under load</h1>\n";
  for (const Measured& run : runs) {
    file << Section(run);
  }
  file << "</html>\n";
  file.close();
  if (!file) {
    return Trouble(absl::StatusCode::kInternal, "REPORT_NOT_WRITTEN", path + ": could not be written");
  }
  return absl::OkStatus();
}

}  // namespace lambdajet::load
