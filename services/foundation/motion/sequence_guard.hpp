// Recognises old, repeated and out-of-order samples of one writer, a writer that started anew, and a second writer.
//
// Model: within a session the sequence number must rise. A sample of an unknown session is a restart of the writer, and
// its session is adopted. A sample of the session that was left, made later than the adoption, shows that two writers
// are alive at once: a fault, not a race. Threads: one. Cost: a few comparisons, no allocation.
#pragma once

#include <cstdint>

#include "foundation/motion/link_samples.hpp"

namespace lambdajet {

enum class SampleVerdict { kFresh, kRestarted, kOld, kTwoWriters };

class SequenceGuard {
 public:
  SampleVerdict Judge(const SampleHeader& header) {
    if (header.session == session_ && session_ != 0) {
      return JudgeKnown(header);
    }
    if (header.session == left_session_ && left_session_ != 0) {
      ++dropped_;
      return header.time_ns > adopted_time_ns_ ? SampleVerdict::kTwoWriters : SampleVerdict::kOld;
    }
    left_session_ = session_;
    session_ = header.session;
    sequence_number_ = header.sequence_number;
    adopted_time_ns_ = header.time_ns;
    return left_session_ == 0 ? SampleVerdict::kFresh : SampleVerdict::kRestarted;
  }

  std::uint64_t session() const { return session_; }
  std::uint64_t sequence_number() const { return sequence_number_; }
  std::uint32_t dropped() const { return dropped_; }

 private:
  SampleVerdict JudgeKnown(const SampleHeader& header) {
    if (header.sequence_number <= sequence_number_) {
      ++dropped_;
      return SampleVerdict::kOld;
    }
    sequence_number_ = header.sequence_number;
    return SampleVerdict::kFresh;
  }

  std::uint64_t session_ = 0;
  std::uint64_t left_session_ = 0;
  std::uint64_t sequence_number_ = 0;
  std::int64_t adopted_time_ns_ = 0;
  std::uint32_t dropped_ = 0;
};

}  // namespace lambdajet
