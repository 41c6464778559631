#include "trajectory/core/toolpath/contours.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <unordered_map>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
constexpr double kSame_mm = 1e-6;  // two drawn points that are one
// Pairs of pieces looked at: enough for any drawing that means something, so that a heap of lines ends soon.
constexpr std::size_t kMostPairs = 5'000'000;
constexpr std::size_t kMostContours = 20'000;
constexpr double kNearMiss_ratio = 50;  // an end this many gaps away is told as a gap, not as an open contour

// Curves of one entity, joined end to end.
struct Chain {
  Pieces pieces;
  std::uint32_t entity = 0;
  bool dropped = false;

  const Vector2d& end(int which) const { return which == 0 ? pieces.front().from_mm : pieces.back().to_mm; }
};

bool Has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string Mm(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g mm", value);
  return text;
}

class ContourFinder {
 public:
  ContourFinder(const Drawing& drawing, const ContourOptions& options)
      : drawing_(drawing), options_(options) {}

  ContourSet Find() {
    set_.findings = drawing_.findings;
    std::erase_if(set_.findings, [this](const Finding& f) {
      return Has(options_.ignore_layers, f.layer) ||
             (!f.entity.empty() && Has(options_.ignore_types, f.entity));
    });
    const bool unreadable = std::any_of(set_.findings.begin(), set_.findings.end(),
                                        [](const Finding& f) { return f.blocks && f.entity.empty(); });
    if (unreadable) {
      return std::move(set_);
    }
    const double unit_mm = options_.unit_mm > 0.0 ? options_.unit_mm : drawing_.unit_mm;
    if (!(unit_mm > 0.0)) {
      Tell({"UNKNOWN_UNITS",
            true,
            "",
            "",
            0,
            {0.0, 0.0},
            0.0,
            "the file does not say its unit ($INSUNITS is missing, 0, or no unit of sheets); name it with "
            "--units "
            "mm or inch"});
      return std::move(set_);
    }
    for (Finding& f : set_.findings) {  // told in the drawing's unit
      f.at_mm *= unit_mm;
    }
    Flatten(unit_mm);
    DropDuplicates();
    Join();
    FlagCrossings();
    if (pairs_ > kMostPairs || set_.contours.size() > kMostContours) {
      Tell({"DRAWING_TOO_DENSE",
            true,
            "",
            "",
            0,
            {0, 0},
            0.0,
            "more lines lie on each other, or more contours are drawn, than can be told apart; split the "
            "drawing"});
      return std::move(set_);
    }
    Nest();
    if (set_.contours.empty() && set_.marks.empty() && !set_.blocked()) {
      Tell({"NOTHING_TO_CUT",
            true,
            "",
            "",
            0,
            {0.0, 0.0},
            0.0,
            "no contour stands on a layer that is cut or marked"});
    }
    return std::move(set_);
  }

 private:
  void Tell(Finding finding) { set_.findings.push_back(std::move(finding)); }
  // About an entity.
  void Tell(std::string_view reason, bool blocks, std::uint32_t entity, const Vector2d& at_mm, double size_mm,
            std::string message) {
    const DrawingEntity& e = drawing_.entities[entity];
    Tell({reason, blocks, e.layer, e.type, e.line, at_mm, size_mm, std::move(message), e.dxf_handle});
  }
  std::string Name(std::uint32_t entity) const {
    const DrawingEntity& e = drawing_.entities[entity];
    return EntityText({"", true, e.layer, e.type, e.line, {0, 0}, 0.0, "", e.dxf_handle}) + " at line " +
           std::to_string(e.line);
  }

  void Flatten(double unit_mm) {
    AffineMap scale;
    scale.linear *= unit_mm;
    for (std::uint32_t i = 0; i < drawing_.entities.size(); ++i) {
      const DrawingEntity& entity = drawing_.entities[i];
      const bool mark = Has(options_.mark_layers, entity.layer);
      const bool cut = options_.cut_layers.empty() || Has(options_.cut_layers, entity.layer);
      if (Has(options_.ignore_layers, entity.layer) || (!mark && !cut) ||
          Has(options_.ignore_types, entity.type)) {
        continue;
      }
      Chain chain{{}, i};
      bool followed = true;
      for (const Curve& curve : entity.curves) {
        followed &= AppendPieces(Mapped(scale, curve), options_.curve_tolerance_mm, i, chain.pieces);
      }
      if (!followed) {
        Tell("CURVE_NOT_FOLLOWED", true, i, chain.pieces.empty() ? Vector2d(0, 0) : chain.end(0), 0.0,
             "the curve is flat, endless or without a smooth course; draw it as lines and arcs");
      } else if (!chain.pieces.empty()) {
        Heal(chain.pieces);
        mark ? set_.marks.push_back(std::move(chain.pieces)) : chains_.push_back(std::move(chain));
      }
    }
  }

  // Rounding between the curves of one entity: each begins exactly where the one before ends.
  static void Heal(Pieces& pieces) {
    for (std::size_t i = 1; i < pieces.size(); ++i) {
      if (pieces[i].from_mm != pieces[i - 1].to_mm) {
        pieces[i] = Refit(pieces[i], pieces[i - 1].to_mm, pieces[i].to_mm);
      }
    }
  }

  struct End {
    std::size_t chain;
    int which;  // 0: begin
  };
  // Length of each chain that lies on each other chain.
  using Covered = std::map<std::pair<std::size_t, std::size_t>, Overlap>;
  Covered FindOverlaps() {
    Pieces all;
    std::vector<std::size_t> owner;
    for (std::size_t c = 0; c < chains_.size(); ++c) {
      all.insert(all.end(), chains_[c].pieces.begin(), chains_[c].pieces.end());
      owner.resize(all.size(), c);
    }
    const PieceIndex index(all);
    Covered covered;
    for (std::size_t i = 0; i < all.size(); ++i) {
      index.ForNear(BoxOf(all[i]), kSame_mm, [&](std::size_t j) {
        if (i != j && pairs_ < kMostPairs) {
          const Overlap overlap = OverlapOf(all[i], all[j], kSame_mm);
          if (overlap.length_mm > std::max(kSame_mm, 0.1 * options_.gap_mm)) {
            Overlap& sum = covered[{owner[i], owner[j]}];
            sum.length_mm += overlap.length_mm;
            sum.at_mm = overlap.at_mm;
          }
        }
        return ++pairs_ < kMostPairs;
      });
    }
    return covered;
  }

  void DropDuplicates() {
    const Covered covered = FindOverlaps();
    for (auto at = covered.rbegin(); at != covered.rend(); ++at) {  // the later of two equals goes
      const auto& [pair, overlap] = *at;
      Chain& chain = chains_[pair.first];
      if (pair.first != pair.second && !chain.dropped && !chains_[pair.second].dropped &&
          overlap.length_mm >= Length(chain.pieces) - 2.0 * kSame_mm) {
        chain.dropped = true;
        Tell("DUPLICATE_ENTITY", false, chain.entity, overlap.at_mm, overlap.length_mm,
             "drawn again in " + Name(chains_[pair.second].entity) + "; cut once");
      }
    }
    for (const auto& [pair, overlap] : covered) {
      if (pair.first <= pair.second && !chains_[pair.first].dropped && !chains_[pair.second].dropped) {
        TellOverlap(chains_[pair.first], chains_[pair.second], overlap);
      }
    }
    std::erase_if(chains_, [](const Chain& chain) { return chain.dropped; });
  }

  void TellOverlap(const Chain& first, const Chain& second, const Overlap& overlap) {
    const bool itself = first.entity == second.entity;
    const double length_mm = itself ? 0.5 * overlap.length_mm : overlap.length_mm;  // found from both sides
    Tell("DUPLICATE_ENTITY", true, second.entity, overlap.at_mm, length_mm,
         "lies on " + (itself ? "itself" : Name(first.entity)) + " over " + Mm(length_mm) +
             "; draw that stretch once");
    overlapping_[first.entity].insert(second.entity);
    overlapping_[second.entity].insert(first.entity);
  }
  bool Overlapping(std::uint32_t a, std::uint32_t b) const {
    const auto at = overlapping_.find(a);
    return at != overlapping_.end() && at->second.contains(b);
  }
  // The end of an entity on another that it overlaps: told already.
  bool EndsOnOverlap(const End& end) const {
    const auto at = overlapping_.find(chains_[end.chain].entity);
    return at != overlapping_.end() && std::any_of(chains_.begin(), chains_.end(), [&](const Chain& chain) {
             return chain.entity != at->first && at->second.contains(chain.entity) &&
                    std::any_of(chain.pieces.begin(), chain.pieces.end(), [&](const Piece& piece) {
                      return Distance(piece, Place(end)) <= 10.0 * kSame_mm;
                    });
           });
  }

  // ---- joining ----

  static std::uint64_t Cell(double x, double y) {
    const auto a = static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x)));
    const auto b = static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(y)));
    return a * 0x9E3779B97F4A7C15ull + b;
  }
  const Vector2d& Place(const End& end) const { return chains_[end.chain].end(end.which); }

  void Index(double cell_mm) {
    cell_mm_ = cell_mm;
    cells_.clear();
    for (std::size_t i = 0; i < ends_.size(); ++i) {
      const Vector2d p = Place(ends_[i]) / cell_mm;
      cells_[Cell(p.x(), p.y())].push_back(i);
    }
  }
  // Other ends within reach, nearest first.
  std::vector<std::size_t> Neighbours(std::size_t i, double reach_mm) {
    std::vector<std::size_t> near;
    const Vector2d p = Place(ends_[i]);
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        const auto cell = cells_.find(Cell(p.x() / cell_mm_ + dx, p.y() / cell_mm_ + dy));
        if (cell == cells_.end()) {
          continue;
        }
        for (const std::size_t j : cell->second) {
          if (++pairs_ < kMostPairs && j != i && (Place(ends_[j]) - p).norm() <= reach_mm) {
            near.push_back(j);
          }
        }
      }
    }
    std::sort(near.begin(), near.end(), [&](std::size_t a, std::size_t b) {
      const double da = (Place(ends_[a]) - p).norm(), db = (Place(ends_[b]) - p).norm();
      return da < db || (da == db && a < b);
    });
    return near;
  }

  void Join() {
    for (std::size_t c = 0; c < chains_.size(); ++c) {
      const bool closed = (chains_[c].end(0) - chains_[c].end(1)).norm() <= options_.gap_mm &&
                          Length(chains_[c].pieces) > 4.0 * options_.gap_mm;
      if (closed) {
        Close(chains_[c].pieces, c);
      } else {
        ends_.push_back({c, 0});
        ends_.push_back({c, 1});
      }
    }
    Index(options_.gap_mm);
    partner_.assign(ends_.size(), kNone);
    // Ends that are one point first, so that pieces shorter than the gap do not confuse what is near.
    const bool at_once = Pair(kSame_mm);
    const bool across_gaps = Pair(options_.gap_mm);
    Walk(at_once || across_gaps);
  }

  // Joins free ends that have one other free end within reach; true if some have more.
  bool Pair(double reach_mm) {
    bool branches = false;
    const std::vector<std::size_t> before = partner_;
    for (std::size_t i = 0; i < ends_.size(); ++i) {
      if (before[i] != kNone) {
        continue;
      }
      auto near = Neighbours(i, reach_mm);
      std::erase_if(near, [&](std::size_t j) {
        const bool own = ends_[j].chain == ends_[i].chain;
        return before[j] != kNone || (own && Length(chains_[ends_[i].chain].pieces) <= 4.0 * options_.gap_mm);
      });
      if (near.size() == 1) {
        partner_[i] = near.front();
      } else if (near.size() > 1) {
        branches = true;
        if (i > *std::min_element(near.begin(), near.end()) || !branched_.insert(i).second) {
          continue;  // told where the first of them was met
        }
        Tell("BRANCHING_CONTOUR", true, chains_[ends_[i].chain].entity, Place(ends_[i]), 0.0,
             std::to_string(near.size() + 1) + " ends meet here; a contour goes on in one way only");
      }
    }
    for (std::size_t i = 0; i < ends_.size(); ++i) {  // both must mean each other
      if (partner_[i] != kNone && partner_[partner_[i]] != i) {
        partner_[i] = kNone;
      }
    }
    return branches;
  }

  void Walk(bool branches) {
    Index(kNearMiss_ratio * options_.gap_mm);
    std::vector<bool> used(chains_.size(), false);
    for (std::size_t i = 0; i < ends_.size(); i += 2) {  // open chains first: begin at an end without partner
      TellOpenEnd(i, branches);
      TellOpenEnd(i + 1, branches);
    }
    for (std::size_t i = 0; i < ends_.size(); i += 2) {
      if (!used[ends_[i].chain]) {
        WalkFrom(i, used);
      }
    }
  }

  void TellOpenEnd(std::size_t i, bool branches) {
    if (partner_[i] != kNone && partner_[partner_[i]] == i) {
      return;
    }
    const std::uint32_t entity = chains_[ends_[i].chain].entity;
    const auto near = Neighbours(i, kNearMiss_ratio * options_.gap_mm);
    if (!near.empty() && (Place(ends_[near.front()]) - Place(ends_[i])).norm() > options_.gap_mm) {
      if (i < near.front() || Neighbours(near.front(), kNearMiss_ratio * options_.gap_mm).front() != i) {
        const double gap_mm = (Place(ends_[near.front()]) - Place(ends_[i])).norm();
        Tell("GAP_TOO_WIDE", true, entity, Place(ends_[i]), gap_mm,
             "the next end, of " + Name(chains_[ends_[near.front()].chain].entity) + ", is " + Mm(gap_mm) +
                 " away; at most " + Mm(options_.gap_mm) + " are joined (--gap-mm)");
      }
    } else if ((!branches || near.empty()) && !EndsOnOverlap(ends_[i])) {
      Tell("OPEN_CONTOUR", true, entity, Place(ends_[i]), 0.0,
           "no other end lies near; close the contour, or name its layer with --mark or --ignore");
    }
  }

  // From the begin of a chain on, until it closes; what does not close has been told.
  void WalkFrom(std::size_t begin, std::vector<bool>& used) {
    Pieces pieces;
    std::size_t in = begin;
    const std::size_t first_chain = ends_[begin].chain;
    for (;;) {
      const End& entry = ends_[in];
      used[entry.chain] = true;
      const Pieces& own = chains_[entry.chain].pieces;
      Pieces next = entry.which == 0 ? own : Reversed(own);
      if (!pieces.empty()) {
        Snap(pieces.back(), next.front());
      }
      pieces.insert(pieces.end(), next.begin(), next.end());
      const std::size_t out = in ^ 1u;  // ends stand in pairs
      const std::size_t to = partner_[out];
      if (to == kNone || partner_[to] != out) {
        return;
      }
      if (to == begin) {
        Close(pieces, first_chain);
        return;
      }
      if (used[ends_[to].chain]) {
        return;
      }
      in = to;
    }
  }

  static void Snap(Piece& before, Piece& after) {
    if (before.to_mm != after.from_mm) {
      const Vector2d middle = 0.5 * (before.to_mm + after.from_mm);
      before = Refit(before, before.from_mm, middle);
      after = Refit(after, middle, after.to_mm);
    }
  }

  void Close(Pieces pieces, std::size_t chain) {
    if (pieces.size() > 1) {
      Snap(pieces.back(), pieces.front());
    }
    const double area_mm2 = SignedArea_mm2(pieces);
    if (pieces.size() < 2 || std::abs(area_mm2) < options_.gap_mm * options_.gap_mm) {
      const std::uint32_t entity = chains_[chain].entity;
      if (!Overlapping(entity, entity)) {
        Tell("NO_AREA", true, entity, chains_[chain].end(0), 0.0, "the contour encloses no area");
      }
      return;
    }
    Contour contour;
    contour.pieces = area_mm2 > 0.0 ? std::move(pieces) : Reversed(pieces);
    contour.layer = drawing_.entities[chains_[chain].entity].layer;
    set_.contours.push_back(std::move(contour));
  }

  // ---- crossings ----

  void FlagCrossings() {
    Pieces all;
    std::vector<std::size_t> owner, place;
    for (std::size_t c = 0; c < set_.contours.size(); ++c) {
      for (std::size_t i = 0; i < set_.contours[c].pieces.size(); ++i) {
        all.push_back(set_.contours[c].pieces[i]);
        owner.push_back(c);
        place.push_back(i);
      }
    }
    const PieceIndex index(all);
    std::map<std::pair<std::size_t, std::size_t>, bool> told;
    for (std::size_t i = 0; i < all.size(); ++i) {
      index.ForNear(BoxOf(all[i]), kSame_mm, [&](std::size_t j) {
        if (++pairs_ > kMostPairs || j <= i || told[{owner[i], owner[j]}] ||
            Overlapping(all[i].source, all[j].source)) {
          return pairs_ <= kMostPairs;
        }
        const Meetings meetings = Intersect(all[i], all[j], kSame_mm);
        for (int k = 0; k < meetings.count; ++k) {
          if (owner[i] == owner[j] && IsJoint(all[i], all[j], meetings.meeting[k].at_mm)) {
            continue;
          }
          told[{owner[i], owner[j]}] = true;
          Tell("CROSSING_CONTOURS", true, all[j].source, meetings.meeting[k].at_mm, 0.0,
               all[i].source == all[j].source
                   ? "meets itself"
                   : (owner[i] == owner[j] ? "the contour meets itself, in " : "meets ") +
                         Name(all[i].source));
          break;
        }
        return true;
      });
    }
  }

  static bool IsJoint(const Piece& a, const Piece& b, const Vector2d& at_mm) {
    const auto ends_at = [&](const Vector2d& p, const Vector2d& q) {
      return p == q && (p - at_mm).norm() <= 10.0 * kSame_mm;
    };
    return ends_at(a.to_mm, b.from_mm) || ends_at(b.to_mm, a.from_mm);
  }

  // ---- nesting ----

  void Nest() {
    auto& contours = set_.contours;
    std::vector<Box> boxes;
    std::vector<double> areas;
    for (const Contour& c : contours) {
      boxes.push_back(BoxOf(c.pieces));
      areas.push_back(SignedArea_mm2(c.pieces));
    }
    for (std::size_t i = 0; i < contours.size(); ++i) {
      const Vector2d p = PointAt(contours[i].pieces.front(), 0.5);
      for (std::size_t j = 0; j < contours.size(); ++j) {
        const bool within_box =
            (boxes[j].low_mm.array() <= p.array()).all() && (p.array() <= boxes[j].high_mm.array()).all();
        if (i == j || areas[j] <= areas[i] || !within_box || Winding(contours[j].pieces, p) == 0) {
          continue;
        }
        ++contours[i].depth;
        const int parent = contours[i].parent;
        if (parent < 0 || areas[j] < areas[static_cast<std::size_t>(parent)]) {
          contours[i].parent = static_cast<int>(j);
        }
      }
      contours[i].hole = contours[i].depth % 2 == 1;
    }
    for (Contour& c : contours) {
      c.part = c.hole ? 0 : ++set_.part_count;
    }
    for (Contour& c : contours) {
      c.part = c.hole ? contours[static_cast<std::size_t>(c.parent)].part : c.part;
    }
  }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  const Drawing& drawing_;
  const ContourOptions& options_;
  ContourSet set_;
  std::vector<Chain> chains_;
  std::vector<End> ends_;
  std::vector<std::size_t> partner_;
  std::set<std::size_t> branched_;
  std::map<std::uint32_t, std::set<std::uint32_t>> overlapping_;  // entities, both ways
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells_;
  double cell_mm_ = 1.0;
  std::size_t pairs_ = 0;
};

}  // namespace

bool ContourSet::blocked() const {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.blocks; });
}

ContourSet FindContours(const Drawing& drawing, const ContourOptions& options) {
  return ContourFinder(drawing, options).Find();
}

}  // namespace lambdajet::trajectory
