#include "drive/core/segment_buffer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "foundation/contract/expects.hpp"

namespace lambdajet::drive {
namespace {

constexpr double kTauJoint_s = 1e-6;

bool Finite(const Polynomial& p) {
  return std::all_of(p.c.begin(), p.c.end(), [](double c) { return std::isfinite(c); });
}

bool Finite(const Segment& segment) {
  bool finite =
      std::isfinite(segment.start_s) && std::isfinite(segment.duration_s) && segment.duration_s > 0.0;
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    finite = finite && Finite(segment.q_mm[i]) && Finite(segment.lead_mm[i]);
  }
  return finite && Finite(segment.s_mm);
}

// Largest |value| on [0, duration] is at most the largest Bernstein coefficient.
template <std::size_t N>
double BernsteinBound(std::array<double, N> c, double duration_s) {
  double power = 1.0;
  for (double& coefficient : c) {
    coefficient *= power;
    power *= duration_s;
  }
  double bound = 0.0;
  for (std::size_t j = 0; j < N; ++j) {
    double b = 0.0;
    double ratio = 1.0;  // C(j, i) / C(n, i)
    for (std::size_t i = 0; i <= j; ++i) {
      b += ratio * c[i];
      ratio *= static_cast<double>(j - i) / static_cast<double>(N - 1 - i == 0 ? 1 : N - 1 - i);
    }
    bound = std::max(bound, std::abs(b));
  }
  return bound;
}

SegmentBounds BoundsOf(const Segment& segment) {
  SegmentBounds bounds;
  for (const Polynomial& p : segment.q_mm) {
    const auto& c = p.c;
    bounds.velocity_mm_per_s =
        std::max(bounds.velocity_mm_per_s,
                 BernsteinBound<5>({c[1], 2 * c[2], 3 * c[3], 4 * c[4], 5 * c[5]}, segment.duration_s));
    bounds.acceleration_mm_per_s2 =
        std::max(bounds.acceleration_mm_per_s2,
                 BernsteinBound<4>({2 * c[2], 6 * c[3], 12 * c[4], 20 * c[5]}, segment.duration_s));
  }
  return bounds;
}

}  // namespace

SegmentBuffer::SegmentBuffer(const Limits& limits) : limits_(limits), ring_(limits.capacity) {
  Expects(limits.capacity > 1, "a segment buffer holds at least two segments");
}

void SegmentBuffer::Clear() { first_ = next_ = 0; }

SegmentAnswer SegmentBuffer::Accept(const Segment& segment, double playing_tau_s) {
  if (segment.index != next_) {
    return segment.index < next_ ? SegmentAnswer::kRepeated : SegmentAnswer::kOutOfOrder;
  }
  if (!Finite(segment)) {
    return SegmentAnswer::kNotFinite;
  }
  if (!Joins(segment)) {
    return SegmentAnswer::kNotJoined;
  }
  MakeRoom(playing_tau_s);
  if (next_ - first_ == limits_.capacity || end_tau_s() - playing_tau_s >= limits_.ahead_s) {
    return SegmentAnswer::kFull;
  }
  ring_[next_ % limits_.capacity] = {segment, BoundsOf(segment)};
  ++next_;
  return SegmentAnswer::kTaken;
}

double SegmentBuffer::first_tau_s() const { return empty() ? 0.0 : at(first_).start_s; }

double SegmentBuffer::end_tau_s() const {
  return empty() ? 0.0 : at(next_ - 1).start_s + at(next_ - 1).duration_s;
}

std::uint32_t SegmentBuffer::Find(double tau_s, std::uint32_t near) const {
  Expects(!empty(), "a segment is sought in a buffer that holds one");
  std::uint32_t i = std::clamp(near, first_, next_ - 1);
  while (i > first_ && tau_s < at(i).start_s) {
    --i;
  }
  while (i + 1 < next_ && tau_s >= at(i + 1).start_s) {
    ++i;
  }
  return i;
}

bool SegmentBuffer::Joins(const Segment& segment) const {
  if (empty()) {
    return std::abs(segment.start_s) <= kTauJoint_s;
  }
  const Segment& last = at(next_ - 1);
  bool joined = std::abs(segment.start_s - last.start_s - last.duration_s) <= kTauJoint_s &&
                std::abs(segment.s_mm.c[0] - last.s_mm.value(last.duration_s)) <= limits_.join_mm;
  for (std::size_t i = 0; i < kActuatorCount; ++i) {
    joined =
        joined && std::abs(segment.q_mm[i].c[0] - last.q_mm[i].value(last.duration_s)) <= limits_.join_mm;
  }
  return joined;
}

// Gives up the oldest played segments, but none younger than behind_s unless the ring itself is full of them.
void SegmentBuffer::MakeRoom(double playing_tau_s) {
  while (next_ - first_ > 1) {
    const Segment& oldest = at(first_);
    const double played_s = playing_tau_s - (oldest.start_s + oldest.duration_s);
    const bool full = next_ - first_ == limits_.capacity;
    if (played_s > limits_.behind_s || (full && played_s > 0.0)) {
      ++first_;
    } else {
      return;
    }
  }
}

}  // namespace lambdajet::drive
