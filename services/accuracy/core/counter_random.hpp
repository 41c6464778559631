// Draws random numbers by counting: the n-th number of a stream is a function of (seed, stream, n) and of
// nothing else.
//
// Model: SplitMix64's finaliser over the mixed counter, Box-Muller for the normal. A Monte Carlo draw is one
// stream, so the result does not depend on the order or the number of threads in which draws are made.
// Threads: pure functions. Cost: some 5 ns a uniform, 30 ns a normal; no allocation.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace lambdajet::accuracy {

inline std::uint64_t MixCounter(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

class CounterStream {
 public:
  CounterStream(std::uint64_t seed, std::uint64_t stream)
      : key_(MixCounter(MixCounter(seed) ^ (stream << 1 | 1))) {}

  // In (0, 1), never an end point.
  double Uniform(std::uint64_t n) const {
    return (static_cast<double>(MixCounter(key_ ^ MixCounter(n)) >> 11) + 0.5) * 0x1.0p-53;
  }

  // Mean 0, variance 1.
  double Normal(std::uint64_t n) const {
    const double radius = std::sqrt(-2.0 * std::log(Uniform(2 * n)));
    return radius * std::cos(2.0 * std::numbers::pi * Uniform(2 * n + 1));
  }

 private:
  std::uint64_t key_;
};

}  // namespace lambdajet::accuracy
