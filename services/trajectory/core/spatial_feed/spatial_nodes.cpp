#include "trajectory/core/spatial_feed/spatial_nodes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kPathMargin = 0.99;  // planned against the limit, before smoothing
constexpr double kActuatorMargin = 0.985;
constexpr double kLongestCell_mm = 1.0;
constexpr double kShortestCell_mm = 0.1;
constexpr double kCellOfRadius = 0.1;
constexpr double kKinkNode = 0.02;         // a change of direction above this has a node of its own
constexpr double kSmoothKink = 0.35;       // below this it counts as bend of a polygon
constexpr double kTurningWindow_mm = 0.5;  // either side
constexpr double kSamePlace_mm = 1e-3;
constexpr int kFewestCells = 4;
constexpr double kWorthANode = 1.1;  // of speed
constexpr std::size_t kMostFaults = 20;
constexpr std::array<double, 3> kNearEnds_mm = {0.03, 0.1, 0.3};  // where speed changes fast over little way

struct SmallKink {
  double offset_mm;
  Vector6d turning;  // prefix sum of small changes of direction up to and with this kink
};

// How the place between two pieces is crossed.
struct Kink {
  Vector6d change = Vector6d::Zero();  // of direction
  double size = 0.0;
  double bend = 0.0;  // of the piece that comes in
  double speed_mm_per_s = 0.0;
  FeedLimit reason = FeedLimit::kFeed;
};

class NodeBuilder {
 public:
  NodeBuilder(const SpatialModel& model, const SpatialRun& run, std::vector<ProgramFault>& faults)
      : model_(model), run_(run), faults_(faults) {}

  std::vector<SpatialNode> Build() {
    longest_ = std::min(kLongestCell_mm, run_.length_mm() / kFewestCells);
    shortest_ = std::min(kShortestCell_mm, 0.5 * longest_);
    AddNode(0, 0.0, run_.pieces.front().feed_mm_per_s, FeedLimit::kFeed);
    Kink before, after;
    for (std::size_t i = 0; i < run_.pieces.size(); ++i) {
      after = i + 1 < run_.pieces.size() ? KinkAfter(i) : Kink{};
      Inside(i, before, after);
      Join(i, after);
      before = after;
    }
    for (std::size_t n = 0; n < nodes_.size() && faults_.size() < kMostFaults; ++n) {
      SetMotion(n);
    }
    return std::move(nodes_);
  }

 private:
  // Nodes strictly inside a piece.
  void Inside(std::size_t i, const Kink& before, const Kink& after) {
    const SpatialPiece& piece = run_.pieces[i];
    const bool rises = Rises(piece, before.speed_mm_per_s, after.speed_mm_per_s);
    if (piece.length_mm < 2.0 * shortest_) {
      if (rises) {
        AddNode(i, 0.5 * piece.length_mm, piece.feed_mm_per_s, FeedLimit::kFeed);
      }
      return;
    }
    const double bend = PointOn(piece, 0.0).bend.norm();
    const double cell = bend > 0.0 ? std::clamp(kCellOfRadius / bend, shortest_, longest_) : longest_;
    int count = static_cast<int>(std::ceil(piece.length_mm / cell));
    count += rises && count % 2 == 1 ? 1 : 0;
    const double step = piece.length_mm / count;
    const bool fine = step > 2.0 * kNearEnds_mm.back();
    for (std::size_t k = 0; fine && k < kNearEnds_mm.size(); ++k) {
      AddNode(i, kNearEnds_mm[k], piece.feed_mm_per_s, FeedLimit::kFeed);
    }
    for (int k = 1; k < count; ++k) {
      AddNode(i, step * k, piece.feed_mm_per_s, FeedLimit::kFeed);
    }
    for (std::size_t k = kNearEnds_mm.size(); fine && k-- > 0;) {
      AddNode(i, piece.length_mm - kNearEnds_mm[k], piece.feed_mm_per_s, FeedLimit::kFeed);
    }
  }

  // Whether the middle of a piece can be passed faster than its ends: it needs a node then, else the piece is driven from one
  // end's speed to the other's.
  bool Rises(const SpatialPiece& piece, double from_mm_per_s, double to_mm_per_s) const {
    const double ends = std::min(from_mm_per_s, to_mm_per_s);
    const double faster = kWorthANode * std::max(from_mm_per_s, to_mm_per_s);
    return faster < piece.feed_mm_per_s && piece.length_mm > kSamePlace_mm &&
           ends * ends + model_.path_acceleration_mm_per_s2 * piece.length_mm > faster * faster;
  }

  Kink KinkAfter(std::size_t i) const {
    const SpatialPiece &piece = run_.pieces[i], &next = run_.pieces[i + 1];
    const SpatialPoint u = PointOn(piece, piece.length_mm), v = PointOn(next, 0.0);
    Kink kink;
    kink.change << v.tangent - u.tangent, v.turn - u.turn;
    kink.size = Size(kink.change);
    kink.bend = u.bend.norm();
    kink.speed_mm_per_s = std::min(piece.feed_mm_per_s, next.feed_mm_per_s);
    LimitKink(u, v, std::min(piece.tolerance_mm, next.tolerance_mm), kink);
    return kink;
  }

  // The place between piece i and the next, or the end.
  void Join(std::size_t i, const Kink& kink) {
    const SpatialPiece& piece = run_.pieces[i];
    const double here = piece.begin_mm + piece.length_mm;
    if (i + 1 == run_.pieces.size()) {
      AddNode(i, piece.length_mm, piece.feed_mm_per_s, FeedLimit::kFeed);
      return;
    }
    if (kink.size < kSmoothKink && kink.size > 1e-9) {
      turning_ += kink.change;
      kinks_.push_back({here, turning_});
    }
    // A slow block beside fast ones: sharing a node, either would be run at the slow one's feed.
    const bool own = kink.size > kKinkNode || piece.feed_mm_per_s != run_.pieces[i + 1].feed_mm_per_s;
    const bool near = here - nodes_.back().offset_mm < (own ? kSamePlace_mm : shortest_);
    if (near && nodes_.size() > 1) {
      LowerCap(nodes_.back(), kink.speed_mm_per_s, kink.reason);
      return;
    }
    AddNode(i + 1, 0.0, kink.speed_mm_per_s, kink.reason);
    // The incoming piece's curvature holds up to here.
    nodes_.back().curvature = std::max(nodes_.back().curvature, kink.bend * model_.overshoot);
    nodes_.back().speed_cap_mm_per_s = std::min(nodes_.back().speed_cap_mm_per_s, piece.feed_mm_per_s);
  }

  // A change of direction as path length counts it.
  double Size(const Vector6d& change) const {
    return std::hypot(change.head<3>().norm(), model_.turn_radius_mm * change.tail<3>().norm());
  }

  static void LowerCap(SpatialNode& node, double speed, FeedLimit reason) {
    if (speed < node.speed_cap_mm_per_s) {
      node.speed_cap_mm_per_s = speed;
      node.cap_reason = reason;
    }
  }

  void LimitKink(const SpatialPoint& u, const SpatialPoint& v, double tolerance_mm, Kink& kink) const {
    const Vector6d& change = kink.change;
    const double size = kink.size;
    const auto lower = [&](double limit) {
      if (limit < kink.speed_mm_per_s) {
        kink.speed_mm_per_s = limit;
        kink.reason = FeedLimit::kCorner;
      }
    };
    const double deviation_s = model_.kink_deviation_s;
    lower(0.9 * tolerance_mm / (deviation_s * std::max(1e-12, change.head<3>().norm())));
    lower(0.9 * model_.motion.corner_tolerance_rad /
          (deviation_s * std::max(1e-12, change.tail<3>().norm())));
    if (size <= kKinkNode) {
      return;
    }
    // The kernel's peak is 0.4/sigma. Braking before and speeding up after the kink point the same way as its own change of
    // velocity, by half of it each.
    const double sigma = std::sqrt(model_.filter.variance_s2());
    const double room = 1.0 - std::min(1.0, 0.5 * size);
    lower(0.7 * room * model_.path_acceleration_mm_per_s2 * sigma / (0.4 * size));
    const StrutVector before = model_.struts.At({u.p_mm, u.q, {u.tangent, u.turn}, {}}).first;
    const StrutVector after = model_.struts.At({v.p_mm, v.q, {v.tangent, v.turn}, {}}).first;
    lower(0.7 * model_.motion.strut_acceleration_mm_per_s2 * sigma /
          (0.4 * std::max(1e-12, (after - before).cwiseAbs().maxCoeff())));
  }

  void AddNode(std::size_t i, double offset_mm, double speed, FeedLimit reason) {
    const SpatialPiece& piece = run_.pieces[i];
    SpatialNode node;
    node.offset_mm = piece.begin_mm + offset_mm;
    node.speed_cap_mm_per_s = std::min(speed, piece.feed_mm_per_s);
    node.cap_reason = reason;
    node.curvature = PointOn(piece, offset_mm).bend.norm() * model_.overshoot;
    node.acceleration_mm_per_s2 = model_.path_acceleration_mm_per_s2;
    nodes_.push_back(node);
    places_.push_back({i, offset_mm});
  }

  // The struts' slopes and bends at a node, and its reach.
  void SetMotion(std::size_t n) {
    SpatialNode& node = nodes_[n];
    const SpatialPiece& piece = run_.pieces[places_[n].piece];
    const SpatialPoint point = PointOn(piece, places_[n].offset_mm);
    ProgramFault fault;
    if ((faults_.empty() || faults_.back().line != piece.line) &&
        !model_.struts.Reaches(point.p_mm, point.q, piece.line, fault)) {
      faults_.push_back(fault);
    }
    const Vector6d bend = PolygonBend(node.offset_mm);
    node.curvature += Size(bend) * model_.overshoot;
    const StrutState state = model_.struts.At(
        {point.p_mm, point.q, {point.tangent, point.turn}, {point.bend + bend.head<3>(), bend.tail<3>()}});
    Eigen::Map<StrutVector>(node.A.data()) = state.first;
    Eigen::Map<StrutVector>(node.B.data()) = state.second;
  }

  // Net change of direction of small kinks within the window, a mm.
  Vector6d PolygonBend(double offset_mm) {
    while (to_ < kinks_.size() && kinks_[to_].offset_mm <= offset_mm + kTurningWindow_mm) {
      ++to_;
    }
    while (from_ < to_ && kinks_[from_].offset_mm < offset_mm - kTurningWindow_mm) {
      ++from_;
    }
    if (to_ == from_) {
      return Vector6d::Zero();
    }
    const Vector6d before = from_ > 0 ? kinks_[from_ - 1].turning : Vector6d(Vector6d::Zero());
    return (kinks_[to_ - 1].turning - before) / (2.0 * kTurningWindow_mm);
  }

  struct Place {
    std::size_t piece;
    double offset_mm;
  };

  const SpatialModel& model_;
  const SpatialRun& run_;
  std::vector<ProgramFault>& faults_;
  std::vector<SpatialNode> nodes_;
  std::vector<Place> places_;
  std::vector<SmallKink> kinks_;
  Vector6d turning_ = Vector6d::Zero();
  std::size_t from_ = 0, to_ = 0;
  double longest_ = kLongestCell_mm;
  double shortest_ = kShortestCell_mm;
};

// The first average lasts as long as path and struts need from nothing to their limit; the struts move about as fast as
// the path.
SmoothingFilter FilterFor(const HexapodMotion& m, const SpatialOptions& options) {
  constexpr double kStrutGain = 2.0;  // strut acceleration to path acceleration, away from singular places
  const double strut = std::min(m.strut_acceleration_mm_per_s2, kStrutGain * m.path_acceleration_mm_per_s2);
  const double ramp_s =
      std::max(m.path_acceleration_mm_per_s2 / m.path_jerk_mm_per_s3, strut / m.strut_jerk_mm_per_s3);
  return SmoothingFilter::ForLimits(options.knot_s, m.path_acceleration_mm_per_s2,
                                    m.path_acceleration_mm_per_s2 / ramp_s, 0.0);
}

}  // namespace

SpatialModel::SpatialModel(const HexapodGeometry& geometry, const HexapodMotion& m, const SpatialOptions& o)
    : motion(m),
      options(o),
      struts(geometry, m.X_MT_zero),
      turn_radius_mm(struts.hexapod().lever_mm()),
      filter(FilterFor(m, o)),
      overshoot(filter.overshoot()),
      kink_deviation_s(filter.kink_deviation_s()),
      path_acceleration_mm_per_s2(kPathMargin * m.path_acceleration_mm_per_s2) {
  bounds.velocity_mm_per_s.fill(kActuatorMargin * m.strut_velocity_mm_per_s);
  bounds.acceleration_mm_per_s2.fill(kActuatorMargin * m.strut_acceleration_mm_per_s2);
}

std::vector<SpatialNode> MakeSpatialNodes(const SpatialModel& model, const SpatialRun& run,
                                          std::vector<ProgramFault>& faults) {
  return NodeBuilder(model, run, faults).Build();
}

}  // namespace lambdajet::trajectory
