#include "main_motion/core/drive_track.hpp"

#include <algorithm>
#include <cmath>

#include "foundation/motion/nanoseconds.hpp"

namespace lambdajet::main_motion {
namespace {

constexpr double kTouch_mm = 1e-6;  // this near counts as there: the path may stand exactly at an event

// Smallest dt >= 0 with rate dt + acceleration/2 dt^2 = way, way > 0; nothing if the motion stops before.
std::optional<double> TimeFor(double way, double rate, double acceleration, double horizon_s) {
  if (rate <= 0.0 && acceleration <= 0.0) {
    return std::nullopt;
  }
  const double discriminant = rate * rate + 2.0 * acceleration * way;
  if (discriminant < 0.0) {
    return std::nullopt;
  }
  const double dt = 2.0 * way / (rate + std::sqrt(discriminant));
  return dt >= 0.0 && dt <= horizon_s ? std::optional(dt) : std::nullopt;
}

struct Hermite {
  double value, first;
};

Hermite Between(const DriveState& a, const DriveState& b, std::int64_t time_ns) {
  const double h = ToSeconds(b.header.time_ns - a.header.time_ns);
  const double u = ToSeconds(time_ns - a.header.time_ns) / h;
  const double da = h * a.s_rate_mm_per_s;
  const double db = h * b.s_rate_mm_per_s;
  const double ds = b.s_mm - a.s_mm;
  const double c2 = 3.0 * ds - 2.0 * da - db;
  const double c3 = da + db - 2.0 * ds;
  return {a.s_mm + u * (da + u * (c2 + u * c3)), (da + u * (2.0 * c2 + 3.0 * u * c3)) / h};
}

}  // namespace

DriveTrack::DriveTrack() : states_(kStates), segments_(kSegments) {}

void DriveTrack::Clear() {
  count_ = 0;
  next_segment_ = 0;
}

void DriveTrack::Heard(const DriveState& state) { states_[count_++ % kStates] = state; }

void DriveTrack::LearnSegments(const SegmentBatch& batch) {
  for (std::uint32_t i = 0; i < std::min(batch.count, kSegmentsPerBatch); ++i) {
    const Segment& segment = batch.segments[i];
    // A gap is bridged by extrapolation; the table goes on behind it.
    if (segment.index >= next_segment_) {
      segments_[segment.index % kSegments] = {segment.index, segment.start_s, segment.duration_s,
                                              segment.s_mm};
      next_segment_ = segment.index + 1;
    }
  }
}

std::optional<double> DriveTrack::PathLengthAt(std::int64_t time_ns) const {
  const DriveState* after = nullptr;
  const DriveState* before = Before(time_ns, &after);
  if (before == nullptr) {
    return std::nullopt;
  }
  if (after != nullptr) {
    return Between(*before, *after, time_ns).value;
  }
  const double dt = ToSeconds(time_ns - before->header.time_ns);
  return before->s_mm + (before->s_rate_mm_per_s + 0.5 * before->s_acceleration_mm_per_s2 * dt) * dt;
}

std::optional<double> DriveTrack::PathRateAt(std::int64_t time_ns) const {
  const DriveState* after = nullptr;
  const DriveState* before = Before(time_ns, &after);
  if (before == nullptr) {
    return std::nullopt;
  }
  if (after != nullptr) {
    return Between(*before, *after, time_ns).first;
  }
  return before->s_rate_mm_per_s +
         before->s_acceleration_mm_per_s2 * ToSeconds(time_ns - before->header.time_ns);
}

std::optional<ActuatorPoint> DriveTrack::ActuatorsAt(std::int64_t time_ns) const {
  const DriveState* after = nullptr;
  const DriveState* before = Before(time_ns, &after);
  if (before == nullptr || after == nullptr) {
    return std::nullopt;
  }
  const double h = ToSeconds(after->header.time_ns - before->header.time_ns);
  const double u = ToSeconds(time_ns - before->header.time_ns) / h;
  ActuatorPoint point;
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    point.position_mm[i] = before->actuator_position_mm[i] +
                           u * (after->actuator_position_mm[i] - before->actuator_position_mm[i]);
    point.velocity_mm_per_s[i] =
        before->actuator_velocity_mm_per_s[i] +
        u * (after->actuator_velocity_mm_per_s[i] - before->actuator_velocity_mm_per_s[i]);
    point.acceleration_mm_per_s2[i] =
        (after->actuator_velocity_mm_per_s[i] - before->actuator_velocity_mm_per_s[i]) / h;
  }
  return point;
}

std::optional<std::int64_t> DriveTrack::ArrivalTime(double s_mm, double horizon_s) const {
  if (empty()) {
    return std::nullopt;
  }
  const DriveState& now = newest();
  const double way = s_mm - now.s_mm;
  if (way <= kTouch_mm) {
    const double overrun_s = now.s_rate_mm_per_s > 1e-3 ? -way / now.s_rate_mm_per_s : 0.0;
    return now.header.time_ns - static_cast<std::int64_t>(1e9 * std::clamp(overrun_s, 0.0, 0.1));
  }
  std::optional<double> dt;
  if (const std::optional<double> tau = TauOf(s_mm, horizon_s)) {
    dt = TimeFor(std::max(0.0, *tau - now.tau_s), now.tau_rate, now.tau_rate_per_s, horizon_s);
  } else {
    dt = TimeFor(way, now.s_rate_mm_per_s, now.s_acceleration_mm_per_s2, horizon_s);
  }
  if (!dt) {
    return std::nullopt;
  }
  return now.header.time_ns + static_cast<std::int64_t>(1e9 * *dt);
}

const DriveState* DriveTrack::Before(std::int64_t time_ns, const DriveState** after) const {
  const std::size_t known = std::min(count_, kStates);
  const DriveState* later = nullptr;
  for (std::size_t back = 1; back <= known; ++back) {
    const DriveState& state = states_[(count_ - back) % kStates];
    if (state.header.time_ns <= time_ns) {
      *after = later;
      return &state;
    }
    later = &state;
  }
  return nullptr;
}

// First tau at which the plan's s reaches s_mm, sought from the segment being played; s is monotonic.
std::optional<double> DriveTrack::TauOf(double s_mm, double horizon_s) const {
  const DriveState& now = newest();
  for (std::uint32_t i = now.segment; i < next_segment_; ++i) {
    const PathSegment& segment = segments_[i % kSegments];
    if (segment.index != i || segment.start_s > now.tau_s + 1.2 * horizon_s) {
      return std::nullopt;
    }
    if (segment.s_mm.value(segment.duration_s) < s_mm - kTouch_mm) {
      continue;
    }
    double low = 0.0;
    double high = segment.duration_s;
    for (int halving = 0; halving < 40; ++halving) {
      const double middle = 0.5 * (low + high);
      (segment.s_mm.value(middle) < s_mm - kTouch_mm ? low : high) = middle;
    }
    return segment.start_s + high;
  }
  return std::nullopt;
}

}  // namespace lambdajet::main_motion
