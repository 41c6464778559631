#include "trajectory/core/toolpath/kerf.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <unordered_map>

#include "trajectory/core/toolpath/offset.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
constexpr double kSamePoint_mm = 1e-6;

bool IsMotion(const Operation& o) {
  return o.kind == OperationKind::kTraverse || o.kind == OperationKind::kFeedLine ||
         o.kind == OperationKind::kFeedArc;
}
Vector2d EndOf(const Operation& o) { return {o.x_W_mm, o.y_W_mm}; }

std::string Text(const char* format, double a, double b = 0.0, double c = 0.0) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

class KerfCompensation {
 public:
  explicit KerfCompensation(PartProgram program) : program_(std::move(program)) {}

  PartProgram Run() {
    std::vector<Operation>& in = program_.operations;
    out_.reserve(in.size() + in.size() / 4);
    std::size_t i = 0;
    while (i < in.size()) {
      if (IsMotion(in[i]) && in[i].kerf_offset_mm != 0.0) {
        i = Contour(i);
      } else {
        if (IsMotion(in[i])) {
          here_ = EndOf(in[i]);
        }
        out_.push_back(in[i++]);
      }
    }
    if (program_.faults.empty()) {
      in = std::move(out_);
    }
    return std::move(program_);
  }

 private:
  void Fault(std::uint32_t line, std::string_view reason, std::string message) {
    program_.faults.push_back({line, 0, reason, "", std::move(message)});
  }

  // Compensates the motions from `first` to the last with the same offset; returns the place after them.
  std::size_t Contour(std::size_t first) {
    const std::vector<Operation>& in = program_.operations;
    d_mm_ = in[first].kerf_offset_mm;
    const std::size_t faults = program_.faults.size();
    std::size_t end = first;  // after the last compensated motion
    for (std::size_t i = first; i < in.size(); ++i) {
      if (!IsMotion(in[i])) {
        continue;
      }
      if (in[i].kerf_offset_mm == 0.0) {
        if (in[i].kind == OperationKind::kFeedArc) {
          Fault(in[i].line, "KERF_EXIT_NOT_STRAIGHT",
                "the motion after G40 must be a line; an arc would begin beside itself");
        }
        break;
      }
      if (in[i].kerf_offset_mm != d_mm_) {
        Fault(in[i].line, "KERF_CHANGED_ON_CONTOUR", "side and kerf stay until G40; switch off and on again");
        break;
      }
      if (in[i].kind == OperationKind::kFeedArc && in[i].plane != ArcPlane::kXy) {
        Fault(in[i].line, "KERF_OUTSIDE_PLANE", "kerf is compensated in X and Y; arcs must turn in G17");
      }
      end = i + 1;
    }
    if (program_.faults.size() > faults) {
      here_ = EndOf(in[end > first ? end - 1 : first]);
      return std::max(end, first + 1);
    }
    if (Collect(first, end) && EntryLongEnough(first)) {
      const OffsetChain chain = OffsetPieces(pieces_, false, d_mm_);
      TellFaults(chain);
      CheckLoops(chain);
      if (program_.faults.size() == faults) {
        Emit(first, end, chain);
        return end;
      }
    }
    here_ = EndOf(in[end - 1]);
    return end;
  }

  // The programmed path as pieces; motions that do not move in the plane have none.
  bool Collect(std::size_t first, std::size_t end) {
    pieces_.clear();
    owner_.clear();
    Vector2d at = here_;
    for (std::size_t i = first; i < end; ++i) {
      const Operation& o = program_.operations[i];
      if (!IsMotion(o)) {
        continue;
      }
      const Vector2d to = EndOf(o);
      if (o.kind == OperationKind::kFeedArc) {
        const Vector2d center(o.center_x_W_mm, o.center_y_W_mm), out = at - center;
        const std::size_t begin = pieces_.size();
        AppendArc(center, out.norm(), std::atan2(out.y(), out.x()), o.sweep_rad, 0, pieces_);
        pieces_[begin].from_mm = at;
        pieces_.back().to_mm = to;
      } else if ((to - at).norm() > 1e-9) {
        pieces_.push_back(LinePiece(at, to));
      }
      owner_.resize(pieces_.size(), i);
      at = to;
    }
    return !pieces_.empty();
  }

  bool EntryLongEnough(std::size_t first) {
    const double length_mm = Length(pieces_.front());
    if (pieces_.front().is_arc() || length_mm > std::abs(d_mm_)) {
      return true;
    }
    Fault(program_.operations[first].line, "KERF_ENTRY_TOO_SHORT",
          Text("the motion that begins compensation is %.4g mm long; it must be longer than half the kerf, "
               "%.4g mm",
               length_mm, std::abs(d_mm_)));
    return false;
  }

  void TellFaults(const OffsetChain& chain) {
    for (const OffsetFault& fault : chain.faults) {
      if (!fault.blocks) {
        continue;
      }
      const std::uint32_t line = program_.operations[owner_[fault.piece]].line;
      if (fault.reason == "RADIUS_BELOW_KERF") {
        Fault(
            line, fault.reason,
            Text("the inner arc at X%.4f Y%.4f is smaller than the jet; its radius must be at least %.4g mm",
                 fault.at_mm.x(), fault.at_mm.y(), fault.size_mm));
      } else {
        Fault(line, fault.reason,
              Text("the jet cannot follow the contour at X%.4f Y%.4f without cutting into it; it needs %.4g "
                   "mm of room",
                   fault.at_mm.x(), fault.at_mm.y(), fault.size_mm));
      }
    }
  }

  // A contour that closes must not be cut into by any place of its own compensated path.
  void CheckLoops(const OffsetChain& chain) {
    if (chain.blocked()) {
      return;
    }
    std::unordered_map<std::uint64_t, std::size_t> last_end;
    for (std::size_t i = 1; i < pieces_.size(); ++i) {
      last_end[Key(pieces_[i].to_mm)] = i;
    }
    for (std::size_t i = 1; i < pieces_.size(); ++i) {
      const auto at = last_end.find(Key(pieces_[i].from_mm));
      if (at == last_end.end() || at->second <= i ||
          (pieces_[at->second].to_mm - pieces_[i].from_mm).norm() > kSamePoint_mm) {
        continue;
      }
      CheckLoop(chain, i, at->second);
      i = at->second;
    }
  }

  static std::uint64_t Key(const Vector2d& p) {
    const auto x = static_cast<std::uint64_t>(std::llround(p.x() * 1e5));
    const auto y = static_cast<std::uint64_t>(std::llround(p.y() * 1e5));
    return x * 0x9E3779B97F4A7C15ull + y;
  }

  void CheckLoop(const OffsetChain& chain, std::size_t from, std::size_t to) {
    Pieces path;
    for (const Piece& piece : chain.pieces) {
      if (piece.source >= from && piece.source < to + 1) {
        path.push_back(piece);
      }
    }
    if (!path.empty() && !pieces_[to].is_arc() && path.back().is_arc() && path.back().source == to) {
      path.pop_back();  // the roll into what follows the contour
    }
    const Pieces contour(pieces_.begin() + static_cast<std::ptrdiff_t>(from),
                         pieces_.begin() + static_cast<std::ptrdiff_t>(to) + 1);
    for (const OffsetFault& fault : FindGouges(path, contour, PieceIndex(contour), std::abs(d_mm_))) {
      Fault(
          program_.operations[owner_[path[fault.piece].source]].line, "KERF_GOUGE",
          Text("at X%.4f Y%.4f the jet comes within %.4g mm of another part of the contour and cuts into it",
               fault.at_mm.x(), fault.at_mm.y(), fault.size_mm));
    }
  }

  // ---- writing ----

  void Emit(std::size_t first, std::size_t end, const OffsetChain& chain) {
    std::size_t next = 0;  // of chain.pieces
    for (std::size_t i = first; i < end; ++i) {
      const Operation& o = program_.operations[i];
      if (!IsMotion(o)) {
        out_.push_back(o);
        if (o.kind != OperationKind::kWorkOffsetChange) {
          out_.back().x_W_mm = here_.x();
          out_.back().y_W_mm = here_.y();
        }
        continue;
      }
      if (next < chain.pieces.size() && owner_[chain.pieces[next].source] == i) {
        next = EmitMotion(o, i, chain.pieces, next);
      } else {  // no motion in the plane
        Add(o, LinePiece(here_, here_));
      }
    }
  }

  // All pieces that come from one motion, parts of one arc as one again.
  std::size_t EmitMotion(const Operation& o, std::size_t i, const Pieces& pieces, std::size_t next) {
    bool entry = next == 0;
    while (next < pieces.size() && owner_[pieces[next].source] == i) {
      Piece piece = pieces[next++];
      const bool own_arc = o.kind == OperationKind::kFeedArc;
      while (own_arc && next < pieces.size() && owner_[pieces[next].source] == i && piece.is_arc() &&
             pieces[next].is_arc() && (pieces[next].center_mm - piece.center_mm).norm() < 1e-9) {
        piece.to_mm = pieces[next].to_mm;
        piece.sweep_rad += pieces[next++].sweep_rad;
      }
      if (entry) {
        piece = Entry(o, piece);
        entry = false;
      }
      Add(o, piece);
    }
    return next;
  }

  // From where the jet stands to the end of the first parallel: a line, or an arc that ends tangent to it.
  Piece Entry(const Operation& o, const Piece& parallel) {
    if (!parallel.is_arc()) {
      return LinePiece(here_, parallel.to_mm);
    }
    Vector2d tangent = parallel.to_mm - parallel.center_mm;
    tangent = Vector2d(-tangent.y(), tangent.x()).normalized() * (parallel.sweep_rad > 0.0 ? 1.0 : -1.0);
    const Vector2d chord = here_ - parallel.to_mm;
    const double turn = TurnBetween(-tangent, chord);
    const double sweep = -2.0 * turn;
    if (!(sweep * parallel.sweep_rad > 0.0) || std::abs(turn) * chord.norm() < 1e-9) {
      Fault(o.line, "KERF_ENTRY_ARC_UNREACHABLE",
            "no arc of this sense leads from the present point tangent to the contour; begin with a line");
      return parallel;
    }
    const double radius = chord.norm() / (2.0 * std::sin(turn));
    const Vector2d center = parallel.to_mm + radius * Vector2d(tangent.y(), -tangent.x());
    return {here_, parallel.to_mm, center, sweep, parallel.source};
  }

  void Add(const Operation& o, const Piece& piece) {
    Operation moved = o;
    moved.kerf_offset_mm = 0.0;
    moved.x_W_mm = piece.to_mm.x();
    moved.y_W_mm = piece.to_mm.y();
    if (o.kind != OperationKind::kTraverse) {
      moved.kind = piece.is_arc() ? OperationKind::kFeedArc : OperationKind::kFeedLine;
      moved.center_x_W_mm = piece.center_mm.x();
      moved.center_y_W_mm = piece.center_mm.y();
      moved.sweep_rad = piece.sweep_rad;
    }
    out_.push_back(moved);
    here_ = piece.to_mm;
  }

  PartProgram program_;
  std::vector<Operation> out_;
  Vector2d here_ = Vector2d::Zero();
  double d_mm_ = 0.0;
  Pieces pieces_;
  std::vector<std::size_t> owner_;  // of each piece, the place of its operation
};

}  // namespace

PartProgram CompensateKerf(PartProgram program) {
  const bool compensated = std::any_of(program.operations.begin(), program.operations.end(),
                                       [](const Operation& o) { return o.kerf_offset_mm != 0.0; });
  if (!program.faults.empty() || !compensated) {  // a long program is not copied for nothing
    return program;
  }
  return KerfCompensation(std::move(program)).Run();
}

}  // namespace lambdajet::trajectory
