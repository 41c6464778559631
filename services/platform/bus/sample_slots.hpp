// Hands samples from a thread of the bus to a loop: the latest one, or all of them in a bounded queue.
//
// Model: LatestSample keeps the newest; SampleQueue keeps the oldest `capacity` and counts what it had to refuse. Both
// allocate at construction only (a sample's own strings apart).
// Threads: Put() from the reader's thread; the others from one consumer. A consumer that must not wait uses the Try
// forms: they give up at once when the other side is in the middle of a copy, and succeed in the next cycle.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "platform/bus/endpoint.hpp"

namespace lambdajet {

template <typename Sample>
class LatestSample {
 public:
  void Put(const Sample& sample, const Arrival& arrival) {
    const std::lock_guard lock(mutex_);
    sample_ = sample;
    arrival_ = arrival;
    ++number_;
  }

  // Copies the newest sample if there is one that this consumer has not had yet.
  bool TryTakeNew(Sample& sample, Arrival* arrival = nullptr) {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock.owns_lock() || number_ == taken_) {
      return false;
    }
    taken_ = number_;
    sample = sample_;
    if (arrival != nullptr) {
      *arrival = arrival_;
    }
    return true;
  }

  // The newest sample, new or not; nothing if none has come yet. May wait for a copy to end.
  std::optional<std::pair<Sample, Arrival>> Latest() const {
    const std::lock_guard lock(mutex_);
    return number_ == 0 ? std::nullopt : std::optional(std::pair(sample_, arrival_));
  }

  std::uint64_t received() const {
    const std::lock_guard lock(mutex_);
    return number_;
  }

 private:
  mutable std::mutex mutex_;
  Sample sample_{};
  Arrival arrival_;
  std::uint64_t number_ = 0;
  std::uint64_t taken_ = 0;
};

template <typename Sample>
class SampleQueue {
 public:
  explicit SampleQueue(std::size_t capacity) : ring_(capacity) {}

  // False if the queue is full; the sample is dropped and counted.
  bool Put(const Sample& sample, const Arrival& arrival) {
    const std::lock_guard lock(mutex_);
    if (size_ == ring_.size()) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    Entry& entry = ring_[(first_ + size_) % ring_.size()];
    entry.sample = sample;
    entry.arrival = arrival;
    ++size_;
    changed_.notify_one();
    return true;
  }

  bool TryTake(Sample& sample, Arrival* arrival = nullptr) {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    return lock.owns_lock() && Take(sample, arrival);
  }

  // Waits up to `time` for a sample; for consumers that are no cyclic loop.
  bool TakeWithin(std::chrono::milliseconds time, Sample& sample, Arrival* arrival = nullptr) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, time, [this] { return size_ > 0; });
    return Take(sample, arrival);
  }

  std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return size_;
  }
  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  struct Entry {
    Sample sample{};
    Arrival arrival;
  };

  bool Take(Sample& sample, Arrival* arrival) {
    if (size_ == 0) {
      return false;
    }
    std::swap(sample, ring_[first_].sample);
    if (arrival != nullptr) {
      *arrival = ring_[first_].arrival;
    }
    first_ = (first_ + 1) % ring_.size();
    --size_;
    return true;
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Entry> ring_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
  std::atomic<std::uint64_t> dropped_ = 0;
};

}  // namespace lambdajet
