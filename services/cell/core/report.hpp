// Gathers what a job did and says it in numbers: deviations of process events, ages of messages, times,
// slider trace.
//
// Model: order statistics by the nearest rank on the magnitude; |deviation| counts only for events that
// happened in motion (path speed of at least kMotion_mm_per_s). Units: mm, s. Shapes: as proto
// GetReportResponse. Threads: values. Cost: percentiles sort a copy.
#pragma once

#include <cstdint>
#include <vector>

namespace lambdajet::cell {

inline constexpr double kMotion_mm_per_s = 0.5;

struct EventDeviation {
  double s_wanted_mm = 0.0;
  double s_rate_mm_per_s = 0.0;
  double deviation_mm = 0.0;
  double message_age_s = 0.0;
};

struct TracePoint {
  double time_s = 0.0;
  double actuator_1_mm = 0.0;
  double actuator_2_mm = 0.0;
  double actuator_1_mm_per_s = 0.0;
  double actuator_2_mm_per_s = 0.0;
  double s_mm = 0.0;
};

struct JobRecord {
  double cutting_time_s = 0.0;
  double held_time_s = 0.0;
  std::uint32_t drive_overruns = 0;
  std::uint32_t main_motion_overruns = 0;
  std::vector<EventDeviation> events;
  std::vector<TracePoint> trace;
};

struct DeviationSummary {
  double p50_mm = 0.0;
  double p99_mm = 0.0;
  double message_age_p50_s = 0.0;
  double message_age_p99_s = 0.0;
};

// Nearest-rank percentile, share in (0, 1]; 0 for no values.
double Percentile(std::vector<double> values, double share);

DeviationSummary Summarise(const std::vector<EventDeviation>& events);

}  // namespace lambdajet::cell
