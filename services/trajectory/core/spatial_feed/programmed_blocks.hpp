// Says how far a tool is from what a program wrote, block by block; the player's own ruler, apart from the planner's geometry.
//
// Model: each motion as the words say it: the tip on a line, an arc or a helix (a spiral where its ends differ in radius), the
// tool turning from the block's first to its last orientation the short way in step with it.
// Frames: W. Units: mm, rad. Threads: const calls pure. Cost: 0.2 us a block where the tool is on it, 10 us near corners.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "foundation/machine/hexapod_motion.hpp"
#include "trajectory/core/part_program/operation.hpp"

namespace lambdajet::trajectory {

struct BlockDistance {
  double tip_mm = 0.0;
  double turn_rad = 0.0;
  double share = 0.0;  // the larger of both in shares of their tolerances
  std::uint32_t line = 0;
};

class ProgrammedBlocks {
 public:
  // `turn_radius_mm`: what a turn counts in path length.
  ProgrammedBlocks(const std::vector<Operation>& operations, const HexapodMotion& motion,
                   double turn_radius_mm);

  // From the nearest of the blocks within `window_mm` of path length s.
  BlockDistance From(const Eigen::Vector3d& p_W_mm, const Eigen::Quaterniond& q_W, double s_mm,
                     double window_mm) const;

  struct Block {
    Eigen::Vector3d from_mm, to_mm;
    Eigen::Vector3d centre_mm;  // arc
    int normal = -1;            // arc: index of the coordinate along its axis
    double sweep_rad = 0.0;
    Eigen::Quaterniond q_from, q_to;
    double tip_length_mm = 0.0;
    double turn_rad = 0.0;
    double begin_s_mm = 0.0;
    double length_mm = 0.0;
    double tolerance_mm = 0.0;
    std::uint32_t line = 0;
  };
  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  void Append(const Operation& o, double tolerance_mm, double turn_radius_mm);
  BlockDistance Distance(const Block& block, double u, const Eigen::Vector3d& p,
                         const Eigen::Quaterniond& q) const;
  BlockDistance Nearest(const Block& block, const Eigen::Vector3d& p, const Eigen::Quaterniond& q,
                        double s_mm) const;

  double turn_tolerance_rad_;
  Eigen::Vector3d here_mm_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_here_ = Eigen::Quaterniond::Identity();
  std::vector<Block> blocks_;
};

}  // namespace lambdajet::trajectory
