// Signs datagrams and tells genuine, fresh ones from all others.
//
// Model: datagram = payload | version (1) | key id (1) | sender (8) | counter (8) | tag (16), the tag being the first 16
// bytes of HMAC-SHA256 over all that stands before it. A sender is a random number drawn at start; its counter rises by
// one a datagram. The receiver keeps a window of 1024 counters a sender: one that was seen, or is older than the window,
// is refused. What it does not protect: the first datagram of a sender this process has not yet heard is taken as it
// comes, so a recording of an earlier session is stopped by the session numbers in the samples, not here.
// Threads: Seal() and Open() each from any; each takes its own lock. Cost: one HMAC, about a microsecond a 256 bytes.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "platform/bus/guard_key.hpp"

namespace lambdajet {

inline constexpr std::size_t kGuardOverheadBytes = 34;

enum class GuardVerdict : std::size_t {
  kAccepted,
  kTooShort,
  kBadVersion,
  kUnknownKey,
  kBadTag,
  kReplayed,
  kCount
};

// The label of lambdajet_bus_guard_datagrams_total{verdict}.
const char* GuardVerdictName(GuardVerdict verdict);

// Counters seen of one sender.
class ReplayWindow {
 public:
  static constexpr std::uint64_t kSize = 1024;
  bool Accept(std::uint64_t counter);  // false if seen before or too old

 private:
  std::uint64_t highest_ = 0;
  bool started_ = false;
  std::array<std::uint64_t, kSize / 64> seen_{};  // bit i: counter with counter % kSize == i
};

class DatagramGuard {
 public:
  explicit DatagramGuard(std::vector<GuardKey> keys);
  ~DatagramGuard();
  DatagramGuard(const DatagramGuard&) = delete;
  DatagramGuard& operator=(const DatagramGuard&) = delete;

  // Writes payload and trailer to `sealed` (its capacity is kept from call to call).
  void Seal(std::span<const std::uint8_t> payload, std::vector<std::uint8_t>& sealed);

  // The payload's size if the datagram is genuine and fresh; the verdict is counted.
  std::optional<std::size_t> Open(std::span<const std::uint8_t> datagram);

  std::uint64_t count(GuardVerdict verdict) const;

 private:
  class Inside;
  GuardVerdict Judge(std::span<const std::uint8_t> datagram);
  std::unique_ptr<Inside> inside_;
  std::array<std::atomic<std::uint64_t>, static_cast<std::size_t>(GuardVerdict::kCount)> counts_{};
};

}  // namespace lambdajet
