#include "trajectory/core/toolpath/offset.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
constexpr double kMeets_mm = 1e-9;  // ends this near are one
constexpr double kGouge_mm = 1e-7;  // nearer than this much under the distance
constexpr double kSmooth_rad =
    1e-3;  // an inner corner flatter than this is drawing noise; its parallels are fitted together

class Offsetter {
 public:
  Offsetter(const Pieces& pieces, bool closed, double offset_mm)
      : source_(pieces), closed_(closed), d_(offset_mm) {}

  OffsetChain Run() {
    for (std::size_t i = 0; i < source_.size(); ++i) {
      AddParallel(i);
    }
    if (result_.faults.empty() && !parallels_.empty()) {
      const std::size_t joints = parallels_.size() - (closed_ ? 0 : 1);
      for (std::size_t i = 0; i < joints; ++i) {
        Join(parallels_[i], parallels_[(i + 1) % parallels_.size()]);
      }
      for (const Parallel& p : parallels_) {
        Emit(p);
      }
      CloseUp();
    } else if (parallels_.empty() && result_.faults.empty() && !source_.empty()) {
      Fault("KERF_GOUGE", 0, source_.front().from_mm, 2.0 * std::abs(d_));
    }
    return std::move(result_);
  }

 private:
  struct Parallel {
    std::size_t index = 0;
    Piece piece;
    double from_share = 0.0;  // trimmed to
    double to_share = 1.0;
    Pieces corner;  // after it
  };

  void Fault(std::string_view reason, std::size_t piece, const Vector2d& at_mm, double size_mm,
             bool blocks = true) {
    result_.faults.push_back({reason, blocks, piece, at_mm, size_mm});
  }

  void AddParallel(std::size_t i) {
    const Piece& s = source_[i];
    Piece moved = s;
    moved.source = static_cast<std::uint32_t>(i);
    if (!s.is_arc()) {
      const Vector2d t = TangentAt(s, 0.0);
      const Vector2d n(-t.y(), t.x());
      moved.from_mm += d_ * n;
      moved.to_mm += d_ * n;
    } else {
      const double r = Radius(s), moved_r = r - std::copysign(d_, d_ * s.sweep_rad);
      if (std::abs(moved_r) <= kMeets_mm) {
        return;  // becomes a corner
      }
      if (moved_r < 0.0) {
        Fault("RADIUS_BELOW_KERF", i, PointAt(s, 0.5), std::abs(d_));
        return;
      }
      moved.from_mm = s.center_mm + (s.from_mm - s.center_mm) * (moved_r / r);
      moved.to_mm = s.center_mm + (s.to_mm - s.center_mm) * (moved_r / r);
    }
    parallels_.push_back({i, moved, 0.0, 1.0, {}});
  }

  void Join(Parallel& a, Parallel& b) {
    const Vector2d p = a.piece.to_mm, q = b.piece.from_mm;
    if ((p - q).norm() <= kMeets_mm) {
      b.piece.from_mm = p;  // a shift below the tolerance
      return;
    }
    const double turn = TurnBetween(TangentAt(source_[a.index], 1.0), TangentAt(source_[b.index], 0.0));
    const bool back = std::abs(turn) > std::numbers::pi - 1e-9;
    if (turn * d_ < 0.0 || back) {
      const Vector2d corner = source_[a.index].to_mm;
      const double sweep = back ? -std::copysign(std::numbers::pi, d_) : turn;
      a.corner.push_back({p, q, corner, sweep, static_cast<std::uint32_t>(a.index)});
      return;
    }
    Trim(a, b, std::abs(turn));
  }

  // An inner corner: both parallels end where they cross, at the crossing that costs least length.
  void Trim(Parallel& a, Parallel& b, double turn_rad) {
    const Meetings meetings = Intersect(a.piece, b.piece, kMeets_mm);
    double least = 1e300;
    const Meeting* best = nullptr;
    for (int i = 0; i < meetings.count; ++i) {
      const Meeting& m = meetings.meeting[i];
      const double cost = (1.0 - m.a_share) * Length(a.piece) + m.b_share * Length(b.piece);
      if (cost < least) {
        least = cost;
        best = &m;
      }
    }
    const Vector2d corner = source_[a.index].to_mm;
    if (best != nullptr) {
      a.to_share = best->a_share;
      b.from_share = best->b_share;
      if (turn_rad > kSmooth_rad) {
        Fault("INNER_CORNER_ROUNDED", a.index, corner, (best->at_mm - corner).norm() - std::abs(d_), false);
      }
    } else if (turn_rad <= kSmooth_rad) {
      const Vector2d middle = 0.5 * (a.piece.to_mm + b.piece.from_mm);
      a.piece = Refit(a.piece, a.piece.from_mm, middle);
      b.piece = Refit(b.piece, middle, b.piece.to_mm);
    } else {
      Fault("KERF_GOUGE", b.index, corner, 2.0 * std::abs(d_));
    }
  }

  void Emit(const Parallel& p) {
    if (p.to_share <= p.from_share) {
      Fault("KERF_GOUGE", p.index, PointAt(source_[p.index], 0.5), 2.0 * std::abs(d_));
      return;
    }
    Piece piece = p.from_share > 0.0 || p.to_share < 1.0 ? Part(p.piece, p.from_share, p.to_share) : p.piece;
    if (!result_.pieces.empty()) {
      piece.from_mm = result_.pieces.back().to_mm;
    }
    result_.pieces.push_back(piece);
    result_.pieces.insert(result_.pieces.end(), p.corner.begin(), p.corner.end());
  }

  void CloseUp() {
    if (closed_ && !result_.pieces.empty()) {
      result_.pieces.front().from_mm = result_.pieces.back().to_mm;
    }
  }

  const Pieces& source_;
  bool closed_;
  double d_;
  std::vector<Parallel> parallels_;
  OffsetChain result_;
};

}  // namespace

bool OffsetChain::blocked() const {
  return std::any_of(faults.begin(), faults.end(), [](const OffsetFault& f) { return f.blocks; });
}

OffsetChain OffsetPieces(const Pieces& pieces, bool closed, double offset_mm) {
  if (offset_mm == 0.0) {
    OffsetChain same{pieces, {}};
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      same.pieces[i].source = static_cast<std::uint32_t>(i);
    }
    return same;
  }
  return Offsetter(pieces, closed, offset_mm).Run();
}

std::vector<OffsetFault> FindGouges(const Pieces& path, const Pieces& contours, const PieceIndex& index,
                                    double distance_mm) {
  std::vector<OffsetFault> faults;
  std::vector<bool> told(contours.size(), false);
  for (std::size_t i = 0; i < path.size(); ++i) {
    index.ForNear(BoxOf(path[i]), distance_mm, [&](std::size_t j) {
      if (!told[j]) {
        const Closeness near = Nearest(path[i], contours[j]);
        if (near.distance_mm < distance_mm - kGouge_mm) {
          told[j] = true;
          faults.push_back({"KERF_GOUGE", true, i, near.at_mm, near.distance_mm, j});
        }
      }
      return true;
    });
  }
  return faults;
}

}  // namespace lambdajet::trajectory
