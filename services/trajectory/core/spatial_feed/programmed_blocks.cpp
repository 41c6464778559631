#include "trajectory/core/spatial_feed/programmed_blocks.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Block = ProgrammedBlocks::Block;

constexpr double kOnPath = 0.01;  // share below which the guess of the place is the place
constexpr int kGoldenSteps = 40;
constexpr double kNoLength_mm = 1e-9;

// LinuxCNC's roll, pitch, yaw, written out.
Quaterniond RotationOf(const Operation& o) {
  return Quaterniond(Eigen::AngleAxisd(o.c_rad, Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(o.b_rad, Vector3d::UnitY()) *
                     Eigen::AngleAxisd(o.a_rad, Vector3d::UnitX()));
}

Vector3d TipAt(const Block& b, double u) {
  if (b.normal < 0) {
    return b.from_mm + u * (b.to_mm - b.from_mm);
  }
  Vector3d out = b.from_mm - b.centre_mm, out_end = b.to_mm - b.centre_mm;
  out[b.normal] = out_end[b.normal] = 0.0;
  const double radius = out.norm();
  const Vector3d first = out / radius, second = Vector3d::Unit(b.normal).cross(first);
  const double r = radius + u * (out_end.norm() - radius), angle = u * b.sweep_rad;
  Vector3d p = b.centre_mm + r * (std::cos(angle) * first + std::sin(angle) * second);
  p[b.normal] = b.from_mm[b.normal] + u * (b.to_mm[b.normal] - b.from_mm[b.normal]);
  return p;
}

// The place that a tool on the block would have; `by_length` decides between the turns of an arc.
double PlaceOf(const Block& b, const Vector3d& p, const Quaterniond& q, double by_length) {
  if (b.tip_length_mm < kNoLength_mm) {
    return b.turn_rad > 0.0 ? b.q_from.angularDistance(q) / b.turn_rad : 0.0;
  }
  if (b.normal < 0) {
    const Vector3d along = b.to_mm - b.from_mm;
    return along.dot(p - b.from_mm) / along.squaredNorm();
  }
  const int i = (b.normal + 1) % 3, k = (b.normal + 2) % 3;
  const Vector3d out = b.from_mm - b.centre_mm, at = p - b.centre_mm;
  const double angle = std::atan2(out[i] * at[k] - out[k] * at[i], out[i] * at[i] + out[k] * at[k]);
  const double guess = by_length * b.sweep_rad;
  return (guess + std::remainder(angle - guess, 2.0 * EIGEN_PI)) / b.sweep_rad;
}

}  // namespace

ProgrammedBlocks::ProgrammedBlocks(const std::vector<Operation>& operations, const HexapodMotion& motion,
                                   double turn_radius_mm)
    : turn_tolerance_rad_(motion.corner_tolerance_rad) {
  double tolerance_mm = motion.corner_tolerance_mm;
  bool moved = false;
  for (const Operation& o : operations) {
    if (o.kind == OperationKind::kPathTolerance) {
      tolerance_mm = o.value > 0.0 ? o.value : motion.corner_tolerance_mm;
    } else if (o.kind == OperationKind::kTraverse && !moved) {
      here_mm_ = {o.x_W_mm, o.y_W_mm, o.z_W_mm};
      q_here_ = RotationOf(o);
      moved = true;
    } else if (o.kind <= OperationKind::kFeedArc) {
      Append(o, tolerance_mm, turn_radius_mm);
      moved = true;
    }
  }
}

void ProgrammedBlocks::Append(const Operation& o, double tolerance_mm, double turn_radius_mm) {
  Block b;
  b.from_mm = here_mm_;
  b.to_mm = here_mm_ = {o.x_W_mm, o.y_W_mm, o.z_W_mm};
  b.q_from = q_here_;
  b.q_to = q_here_ = RotationOf(o);
  b.turn_rad = b.q_from.angularDistance(b.q_to);
  b.tip_length_mm = (b.to_mm - b.from_mm).norm();
  if (o.kind == OperationKind::kFeedArc) {
    b.normal = o.plane == ArcPlane::kXy ? 2 : o.plane == ArcPlane::kZx ? 1 : 0;
    b.centre_mm = {o.center_x_W_mm, o.center_y_W_mm, o.center_z_W_mm};
    b.centre_mm[b.normal] = b.from_mm[b.normal];
    b.sweep_rad = o.sweep_rad;
    const double rise = b.to_mm[b.normal] - b.from_mm[b.normal];
    const Vector3d end = b.to_mm - b.centre_mm - rise * Vector3d::Unit(b.normal);
    b.tip_length_mm = std::hypot(0.5 * ((b.from_mm - b.centre_mm).norm() + end.norm()) * b.sweep_rad, rise);
  }
  b.length_mm = std::hypot(b.tip_length_mm, turn_radius_mm * b.turn_rad);
  b.begin_s_mm = blocks_.empty() ? 0.0 : blocks_.back().begin_s_mm + blocks_.back().length_mm;
  b.tolerance_mm = tolerance_mm;
  b.line = o.line;
  if (b.length_mm > kNoLength_mm) {
    blocks_.push_back(b);
  }
}

BlockDistance ProgrammedBlocks::Distance(const Block& b, double u, const Vector3d& p,
                                         const Quaterniond& q) const {
  BlockDistance d;
  d.tip_mm = (p - TipAt(b, u)).norm();
  d.turn_rad = q.angularDistance(b.turn_rad > 0.0 ? b.q_from.slerp(u, b.q_to) : b.q_from);
  d.share = std::max(d.tip_mm / b.tolerance_mm, d.turn_rad / turn_tolerance_rad_);
  d.line = b.line;
  return d;
}

BlockDistance ProgrammedBlocks::Nearest(const Block& b, const Vector3d& p, const Quaterniond& q,
                                        double s_mm) const {
  const double by_length = std::clamp((s_mm - b.begin_s_mm) / b.length_mm, 0.0, 1.0);
  const double u = std::clamp(PlaceOf(b, p, q, by_length), 0.0, 1.0);
  BlockDistance best = Distance(b, u, p, q);
  if (best.share < kOnPath || (b.turn_rad == 0.0 && b.normal < 0)) {
    return best;
  }
  const double reach = std::min(1.0, (2.0 * best.tip_mm + 0.1) / b.length_mm);
  double from = std::max(0.0, u - reach), to = std::min(1.0, u + reach);
  for (int i = 0; i < kGoldenSteps; ++i) {
    const double c = from + 0.381966 * (to - from), d = from + 0.618034 * (to - from);
    const BlockDistance at_c = Distance(b, c, p, q), at_d = Distance(b, d, p, q);
    (at_c.share < at_d.share ? to : from) = at_c.share < at_d.share ? d : c;
    const BlockDistance& better = at_c.share < at_d.share ? at_c : at_d;
    best = better.share < best.share ? better : best;
  }
  return best;
}

BlockDistance ProgrammedBlocks::From(const Vector3d& p, const Quaterniond& q, double s_mm,
                                     double window_mm) const {
  auto block = std::partition_point(blocks_.begin(), blocks_.end(), [&](const Block& b) {
    return b.begin_s_mm + b.length_mm < s_mm - window_mm;
  });
  BlockDistance best{1e9, 1e9, 1e9, 0};
  for (; block != blocks_.end() && block->begin_s_mm <= s_mm + window_mm && best.share > 1e-6; ++block) {
    const BlockDistance d = Nearest(*block, p, q, s_mm);
    best = d.share < best.share ? d : best;
  }
  return best;
}

}  // namespace lambdajet::trajectory
