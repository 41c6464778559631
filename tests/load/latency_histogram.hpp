// Counts latencies in buckets whose width grows with the value, so that every percentile is right to 1.6 % from 1 µs to hours.
//
// Model: as HdrHistogram: 64 linear buckets in each power of two of nanoseconds.
// Units: ns in, s out. Threads: one; Add() another's counts. Cost: an addition.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace lambdajet::load {

class LatencyHistogram {
 public:
  void Record(std::int64_t latency_ns) {
    const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(latency_ns, 0));
    ++counts_[std::min(Bucket(value), kBuckets - 1)];
    ++count_;
    most_ns_ = std::max(most_ns_, value);
  }

  void Add(const LatencyHistogram& other) {
    for (std::size_t i = 0; i < kBuckets; ++i) {
      counts_[i] += other.counts_[i];
    }
    count_ += other.count_;
    most_ns_ = std::max(most_ns_, other.most_ns_);
  }

  std::uint64_t count() const { return count_; }
  double most_s() const { return static_cast<double>(most_ns_) * 1e-9; }

  // Nearest rank; share in (0, 1]. The upper end of the bucket, so never too good.
  double Percentile_s(double share) const {
    const auto rank = static_cast<std::uint64_t>(
        std::max(1.0, std::min(share, 1.0) * static_cast<double>(count_) + 0.999999));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < kBuckets; ++i) {
      seen += counts_[i];
      if (seen >= std::min(rank, count_) && seen > 0) {
        return static_cast<double>(std::min(Upper(i), most_ns_)) * 1e-9;
      }
    }
    return 0.0;
  }

 private:
  static constexpr std::uint64_t kLinear = 64;
  static constexpr int kLinearBits = 6;
  static constexpr std::size_t kBuckets = 45 * kLinear;

  static std::size_t Bucket(std::uint64_t value) {
    if (value < kLinear) {
      return static_cast<std::size_t>(value);
    }
    const int shift = std::bit_width(value) - kLinearBits - 1;
    return static_cast<std::size_t>(static_cast<std::uint64_t>(shift) * kLinear + (value >> shift));
  }
  static std::uint64_t Upper(std::size_t bucket) {
    if (bucket < 2 * kLinear) {
      return bucket;
    }
    const std::uint64_t shift = bucket / kLinear - 1;
    return ((bucket % kLinear + kLinear + 1) << shift) - 1;
  }

  std::array<std::uint64_t, kBuckets> counts_{};
  std::uint64_t count_ = 0;
  std::uint64_t most_ns_ = 0;
};

}  // namespace lambdajet::load
