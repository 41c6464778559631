#include "trajectory/core/feed/run_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trajectory/core/feed/reach.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;

constexpr double kLongestCell_mm = 1.0;
constexpr double kShortestCell_mm = 0.1;
constexpr double kCellOfRadius = 0.1;
constexpr double kKinkNode_rad = 0.02;     // a kink above this has a node of its own
constexpr double kTurningWindow_mm = 0.5;  // either side
constexpr double kSmoothKink_rad = 0.35;   // kinks below this count as curvature of a polygon
constexpr double kShareOfTolerance = 0.9;  // that a corner may use up
constexpr double kShortestNear_mm = 0.02;
constexpr double kSamePlace_mm = 1e-3;
constexpr int kFewestCells = 4;
constexpr double kWorthANode = 1.1;                               // of speed
constexpr std::array<double, 3> kNearEnds_mm = {0.03, 0.1, 0.3};  // where speed changes fast over little way

struct SmallKink {
  double offset_mm;
  double turning;  // prefix sum of signed small turnings up to and with this kink
};

// How the place between two pieces is crossed.
struct Kink {
  double angle = 0.0;
  double speed_mm_per_s = 1e9;
  FeedLimit reason = FeedLimit::kFeed;
  double hold_mm = 0.0;  // the speed is kept this far either side
};

class NodeBuilder {
 public:
  NodeBuilder(const PlanningModel& model, const PathElement& run, std::vector<ProgramFault>& faults)
      : model_(model), run_(run), faults_(faults) {}

  std::vector<ProfileNode> Build() {
    const double total = run_.length_mm();
    longest_ = std::min(kLongestCell_mm, total / kFewestCells);
    shortest_ = std::min(kShortestCell_mm, 0.5 * longest_);
    AddNode(0, 0.0, model_.machine.path.feed_mm_per_s, FeedLimit::kFeed);
    Kink before, after;
    for (std::size_t i = 0; i < run_.pieces.size() && faults_.empty(); ++i) {
      after = i + 1 < run_.pieces.size() ? KinkAfter(i) : Kink{};
      Inside(i, before, after);
      Join(i, after, total);
      before = after;
    }
    AddPolygonCurvature();
    return std::move(nodes_);
  }

 private:
  // Nodes strictly inside a piece.
  void Inside(std::size_t i, const Kink& before, const Kink& after) {
    const PathPiece& piece = run_.pieces[i];
    double cell = longest_;
    if (piece.radius_mm != 0.0) {
      cell = std::clamp(kCellOfRadius * std::abs(piece.radius_mm), shortest_, longest_);
    }
    if (piece.length_mm < 2.0 * shortest_) {
      if (Rises(i, before, after)) {
        AddInside(i, 0.5 * piece.length_mm);
      }
      return;
    }
    int count = static_cast<int>(std::ceil(piece.length_mm / cell));
    count += count % 2 == 1 && Rises(i, before, after) ? 1 : 0;
    const double step = piece.length_mm / count;
    const double most = count > 1 ? step : 0.5 * piece.length_mm;  // that ends' own nodes reach
    const bool fine = step > 2.0 * kNearEnds_mm.back();
    NearEnd(i, before.hold_mm, fine, most, [](double near) { return near; });
    for (int k = 1; k < count; ++k) {
      AddInside(i, step * k);
    }
    NearEnd(i, after.hold_mm, fine, most, [&](double near) { return piece.length_mm - near; });
    std::sort(nodes_.begin() + static_cast<std::ptrdiff_t>(piece_begin_), nodes_.end(),
              [](const ProfileNode& a, const ProfileNode& b) { return a.offset_mm < b.offset_mm; });
  }

  // Whether the middle of a piece can be passed faster than its ends: it needs a node then, else the piece is driven from one
  // end's speed to the other's.
  bool Rises(std::size_t i, const Kink& before, const Kink& after) const {
    const PathPiece& piece = run_.pieces[i];
    const double from = i == 0 ? 0.0 : before.speed_mm_per_s;
    const double to = i + 1 == run_.pieces.size() ? 0.0 : after.speed_mm_per_s;
    const double held_mm = (i == 0 ? 0.0 : before.hold_mm) + after.hold_mm;
    const double way_mm = piece.length_mm - held_mm;
    const double ends = std::min(from, to), faster = kWorthANode * std::max(from, to);
    return faster < piece.feed_mm_per_s && way_mm > kSamePlace_mm &&
           ends * ends + model_.path_acceleration_mm_per_s2 * way_mm > faster * faster;
  }

  // Where a kink's speed is no longer kept, and where speed changes fast.
  template <class Place>
  void NearEnd(std::size_t i, double hold_mm, bool fine, double most_mm, Place place) {
    const bool own = hold_mm > kSamePlace_mm && hold_mm < most_mm - kSamePlace_mm;
    if (own) {
      AddInside(i, place(hold_mm));
    }
    for (const double near : kNearEnds_mm) {
      if (fine && !(own && std::abs(near - hold_mm) < kShortestNear_mm)) {
        AddInside(i, place(near));
      }
    }
  }

  void AddInside(std::size_t i, double offset_mm) {
    if (faults_.empty()) {
      AddNode(i, offset_mm, run_.pieces[i].feed_mm_per_s, FeedLimit::kFeed);
      if (nodes_.back().offset_mm <= held_to_mm_) {
        LowerCap(nodes_.back(), held_speed_, held_reason_);
      }
    }
  }

  Kink KinkAfter(std::size_t i) {
    const PathPiece& piece = run_.pieces[i];
    const PathPiece& next = run_.pieces[i + 1];
    const Vector2d u = PointOn(piece, piece.length_mm).tangent;
    const Vector2d v = PointOn(next, 0.0).tangent;
    Kink kink;
    kink.angle = std::atan2(u.x() * v.y() - u.y() * v.x(), u.dot(v));
    kink.speed_mm_per_s = std::min(piece.feed_mm_per_s, next.feed_mm_per_s);
    LimitKink(std::min(piece.tolerance_mm, next.tolerance_mm), kink);
    return kink;
  }

  // The place between piece i and the next, or the end.
  void Join(std::size_t i, const Kink& kink, double total) {
    const PathPiece& piece = run_.pieces[i];
    const double here = piece.begin_mm + piece.length_mm;
    if (i + 1 == run_.pieces.size()) {
      AddNode(i, piece.length_mm, piece.feed_mm_per_s, FeedLimit::kFeed);
      nodes_.back().offset_mm = total;
      return;
    }
    if (std::abs(kink.angle) < kSmoothKink_rad && std::abs(kink.angle) > 1e-9) {
      turning_ += kink.angle;
      kinks_.push_back({here, turning_});
    }
    const bool turns = std::abs(kink.angle) > kKinkNode_rad;
    // A slow block beside fast ones: sharing a node, either would be run at the slow one's feed.
    const bool own = turns || piece.feed_mm_per_s != run_.pieces[i + 1].feed_mm_per_s;
    if (own || here - nodes_.back().offset_mm >= shortest_) {
      if (own && here - nodes_.back().offset_mm < kSamePlace_mm && nodes_.size() > 1) {
        LowerCap(nodes_.back(), kink.speed_mm_per_s, kink.reason);
      } else {
        AddNode(i + 1, 0.0, kink.speed_mm_per_s, kink.reason);
        // The incoming piece's curvature holds up to here.
        nodes_.back().curvature =
            std::max(nodes_.back().curvature, std::abs(piece.curvature()) * model_.overshoot);
      }
    } else {
      LowerCap(nodes_.back(), kink.speed_mm_per_s, kink.reason);
    }
    if (turns) {
      Hold(here, kink);
    }
    piece_begin_ = nodes_.size();
  }

  // Nodes already there, and those to come, within the hold.
  void Hold(double here, const Kink& kink) {
    for (std::size_t k = nodes_.size(); k-- > 0 && nodes_[k].offset_mm >= here - kink.hold_mm - 1e-9;) {
      LowerCap(nodes_[k], kink.speed_mm_per_s, kink.reason);
    }
    held_to_mm_ = here + kink.hold_mm + 1e-9;
    held_speed_ = kink.speed_mm_per_s;
    held_reason_ = kink.reason;
  }

  static void LowerCap(ProfileNode& node, double speed, FeedLimit reason) {
    if (speed < node.speed_cap_mm_per_s) {
      node.speed_cap_mm_per_s = speed;
      node.cap_reason = reason;
    }
  }

  void LimitKink(double tolerance_mm, Kink& kink) const {
    const double angle = std::abs(kink.angle);
    const double change = 2.0 * std::sin(0.5 * angle);  // of velocity, per speed
    if (change < 1e-9) {
      return;
    }
    const auto lower = [&](double limit, FeedLimit why) {
      if (limit < kink.speed_mm_per_s) {
        kink.speed_mm_per_s = limit;
        kink.reason = why;
      }
    };
    const double deviation_mm = kShareOfTolerance * tolerance_mm;
    if (angle > kKinkNode_rad) {
      const CornerRule::Crossing crossing = model_.corner.Cross(angle, deviation_mm, kink.speed_mm_per_s);
      lower(crossing.speed_mm_per_s, FeedLimit::kCorner);
      kink.hold_mm = crossing.hold_mm;
    } else {
      lower(deviation_mm / (model_.kink_deviation_s * change), FeedLimit::kCorner);
    }
    const double lag = model_.options.compensate ? model_.machine.process.jet_lag_time_s : 0.0;
    if (lag > 0.0) {
      lower(4.0 * model_.options.tolerance_mm / (lag * change), FeedLimit::kPredictedError);
    }
  }

  void AddNode(std::size_t i, double offset_mm, double speed, FeedLimit reason) {
    const PathPiece& piece = run_.pieces[i];
    ProfileNode node;
    node.offset_mm = piece.begin_mm + offset_mm;
    node.speed_cap_mm_per_s = std::min(speed, piece.feed_mm_per_s);
    node.cap_reason = reason;
    node.curvature = std::abs(piece.curvature()) * model_.overshoot;
    node.acceleration_mm_per_s2 = model_.path_acceleration_mm_per_s2;
    LimitLag(piece, node);
    SetActuators(piece, offset_mm, node);
    nodes_.push_back(node);
  }

  // The cut front trails by v T; on an arc that pulls it inwards by (v T)^2 / (2 R).
  void LimitLag(const PathPiece& piece, ProfileNode& node) const {
    const double lag = model_.options.compensate ? model_.machine.process.jet_lag_time_s : 0.0;
    if (lag > 0.0 && piece.radius_mm != 0.0) {
      LowerCap(node, std::sqrt(2.0 * std::abs(piece.radius_mm) * model_.options.tolerance_mm) / lag,
               FeedLimit::kPredictedError);
    }
  }

  void SetActuators(const PathPiece& piece, double offset_mm, ProfileNode& node) {
    const PathPoint point = PointOn(piece, offset_mm);
    const Vector2d normal{-point.tangent.y(), point.tangent.x()};
    const kinematics::MotionAnswer answer =
        model_.sheet.Actuators({point.p_mm, point.tangent, piece.curvature() * normal});
    if (answer.reason != kinematics::Reason::kSolved || !answer.differentiable) {
      faults_.push_back(ReachFault(model_.sheet, point.p_mm, piece.line));
      return;
    }
    for (int j = 0; j < 2; ++j) {
      node.A[static_cast<std::size_t>(j)] = answer.motion.velocity_mm_per_s[j];
      node.B[static_cast<std::size_t>(j)] = answer.motion.acceleration_mm_per_s2[j];
    }
  }

  // Polygons of short blocks: net turning within the window, as curvature.
  void AddPolygonCurvature() {
    if (kinks_.empty()) {
      return;
    }
    std::size_t from = 0, to = 0;
    for (ProfileNode& node : nodes_) {
      while (to < kinks_.size() && kinks_[to].offset_mm <= node.offset_mm + kTurningWindow_mm) {
        ++to;
      }
      while (from < to && kinks_[from].offset_mm < node.offset_mm - kTurningWindow_mm) {
        ++from;
      }
      if (to > from) {
        const double before = from > 0 ? kinks_[from - 1].turning : 0.0;
        const double turning = kinks_[to - 1].turning - before;
        const double curvature = std::abs(turning) / (2.0 * kTurningWindow_mm);
        node.curvature += curvature * model_.overshoot;
        const double lag = model_.options.compensate ? model_.machine.process.jet_lag_time_s : 0.0;
        if (lag > 0.0 && curvature > 0.0) {
          LowerCap(node, std::sqrt(2.0 * model_.options.tolerance_mm / curvature) / lag,
                   FeedLimit::kPredictedError);
        }
      }
    }
  }

  const PlanningModel& model_;
  const PathElement& run_;
  std::vector<ProgramFault>& faults_;
  std::vector<ProfileNode> nodes_;
  std::vector<SmallKink> kinks_;
  double turning_ = 0.0;
  std::size_t piece_begin_ = 1;  // first node inside the piece at hand
  double held_to_mm_ = -1.0;
  double held_speed_ = 0.0;
  FeedLimit held_reason_ = FeedLimit::kCorner;
  double longest_ = kLongestCell_mm;
  double shortest_ = kShortestCell_mm;
};

}  // namespace

std::vector<ProfileNode> MakeRunNodes(const PlanningModel& model, const PathElement& run,
                                      std::vector<ProgramFault>& faults) {
  return NodeBuilder(model, run, faults).Build();
}

}  // namespace lambdajet::trajectory
