// Keeps what a cyclic loop has found until somebody takes it, the oldest first: bounded, in place.
//
// Model: what does not fit is not put. Threads: one. Cost: no allocation.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

namespace lambdajet {

template <typename T, std::size_t kSize>
class Ring {
 public:
  bool Put(const T& item) {
    if (made_ - taken_ == kSize) {
      return false;
    }
    items_[made_++ % kSize] = item;
    return true;
  }
  std::optional<T> Take() { return empty() ? std::nullopt : std::optional<T>(items_[taken_++ % kSize]); }

  bool empty() const { return made_ == taken_; }
  T& oldest() { return items_[taken_ % kSize]; }  // of one that is not empty
  void Clear() { taken_ = made_; }

 private:
  std::array<T, kSize> items_{};
  std::size_t made_ = 0;
  std::size_t taken_ = 0;
};

}  // namespace lambdajet
