// Knows where the sheet truly was: the physics between the two modules.
//
// Model: a ring of true poses X_DW at 1 ms, filled by the drive's plant; in one process directly, between processes by the
// plant's own topic. Between samples the pose is linear (1e-4 mm at 1 m/s2). Only simulated plants and inspection read it.
// Frames: X_DW, foundation/geometry/frames.md. Units: mm, rad; common time ns. Threads: one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "foundation/geometry/planar_pose.hpp"

namespace lambdajet::simulated_plant {

struct SheetSample {
  std::int64_t time_ns = 0;
  PlanarPose X_DW;
};

class SheetTruthSource {
 public:
  virtual ~SheetTruthSource() = default;
  // Nothing if the time is not known, or not known yet.
  virtual std::optional<PlanarPose> PoseAt(std::int64_t time_ns) const = 0;
  virtual std::int64_t newest_ns() const = 0;
};

class SheetTruthHistory final : public SheetTruthSource {
 public:
  explicit SheetTruthHistory(std::size_t samples = 8192) : ring_(samples) {}

  void Push(const SheetSample& sample) {
    if (count_ == 0 || sample.time_ns > newest_ns()) {
      ring_[count_++ % ring_.size()] = sample;
    }
  }
  std::int64_t newest_ns() const override {
    return count_ == 0 ? 0 : ring_[(count_ - 1) % ring_.size()].time_ns;
  }
  std::optional<PlanarPose> PoseAt(std::int64_t time_ns) const override;

 private:
  std::vector<SheetSample> ring_;
  std::size_t count_ = 0;
};

}  // namespace lambdajet::simulated_plant
