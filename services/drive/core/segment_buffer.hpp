// Holds the segments of a plan from a little behind the place being played to a few seconds ahead, in fixed room.
//
// Model: a ring of fixed capacity, allocated once. Segments are taken in order only; what is out of order, repeated, not
// finite, or does not join its predecessor is refused with a reason and changes nothing. Played segments stay for
// backing up until their room is needed. Threads: one. Cost: an accept costs one bound of two polynomials.
#pragma once

#include <cstdint>
#include <vector>

#include "foundation/motion/plan.hpp"

namespace lambdajet::drive {

enum class SegmentAnswer { kTaken, kRepeated, kOutOfOrder, kFull, kNotFinite, kNotJoined };

// How fast the segment's actuators move at rate 1, as bounds over the whole segment.
struct SegmentBounds {
  double velocity_mm_per_s = 0.0;
  double acceleration_mm_per_s2 = 0.0;
};

class SegmentBuffer {
 public:
  struct Limits {
    std::uint32_t capacity = 4096;  // segments
    double ahead_s = 4.0;           // program time that may be held ahead
    double behind_s = 2.0;          // program time kept for backing up
    double join_mm = 1e-3;          // largest step of a set-point or of s between neighbours
  };
  explicit SegmentBuffer(const Limits& limits);

  void Clear();
  SegmentAnswer Accept(const Segment& segment, double playing_tau_s);

  bool empty() const { return first_ == next_; }
  std::uint32_t first_index() const { return first_; }  // oldest still here
  std::uint32_t next_index() const { return next_; }    // first not here
  double first_tau_s() const;
  double end_tau_s() const;
  bool Holds(std::uint32_t index) const { return index >= first_ && index < next_; }
  const Segment& at(std::uint32_t index) const { return ring_[index % limits_.capacity].segment; }
  const SegmentBounds& bounds(std::uint32_t index) const { return ring_[index % limits_.capacity].bounds; }

  // Index of the segment that holds tau, sought from a near index; the buffer is not empty.
  std::uint32_t Find(double tau_s, std::uint32_t near) const;

 private:
  struct Slot {
    Segment segment;
    SegmentBounds bounds;
  };
  bool Joins(const Segment& segment) const;
  void MakeRoom(double playing_tau_s);

  Limits limits_;
  std::vector<Slot> ring_;
  std::uint32_t first_ = 0;
  std::uint32_t next_ = 0;
};

}  // namespace lambdajet::drive
