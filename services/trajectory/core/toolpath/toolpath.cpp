#include "trajectory/core/toolpath/toolpath.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "trajectory/core/toolpath/cut_order.hpp"
#include "trajectory/core/toolpath/offset.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
constexpr double kTouch_mm = 1e-6;
constexpr std::size_t kMostLeadPlaces = 96;
constexpr double kCorner_rad = 0.1;
// Share of the lead-out that is still cut, so that the sheet is through where the path closes.
constexpr double kJetOnShare = 0.6;

std::string Text(const char* format, double a, double b = 0.0) {
  char text[240];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

// Once around, from a share of one piece.
Pieces RotatedTo(const Pieces& closed, std::size_t first, double share) {
  Pieces path;
  path.push_back(Part(closed[first], share, 1.0));
  for (std::size_t k = 1; k < closed.size(); ++k) {
    path.push_back(closed[(first + k) % closed.size()]);
  }
  path.push_back(Part(closed[first], 0.0, share));
  return path;
}

// The first stretch of a path, of a given length.
Pieces Head(const Pieces& path, double length_mm) {
  Pieces head;
  for (const Piece& piece : path) {
    const double length = Length(piece);
    if (length >= length_mm) {
      if (length_mm > kTouch_mm) {
        head.push_back(Part(piece, 0.0, length_mm / length));
      }
      break;
    }
    head.push_back(piece);
    length_mm -= length;
  }
  return head;
}

class ToolpathMaker {
 public:
  ToolpathMaker(const Drawing& drawing, const ContourSet& contours, const ToolpathOptions& options)
      : drawing_(drawing),
        set_(contours),
        options_(options),
        half_mm_(0.5 * options.kerf_mm),
        all_(AllPieces(contours)),
        index_(all_) {}

  Toolpath Make() {
    CheckSkips();
    for (std::size_t i = 0; i < set_.marks.size(); ++i) {
      Cut cut;
      cut.kind = CutKind::kMark;
      cut.contour = i;
      cut.path = set_.marks[i];
      result_.cuts.push_back(std::move(cut));
    }
    for (std::size_t i = 0; i < set_.contours.size(); ++i) {
      if (!Skipped(set_.contours[i].part)) {
        AddCut(i);
      }
    }
    if (result_.blocked()) {
      result_.cuts.clear();
    } else {
      Order();
      Count();
    }
    return std::move(result_);
  }

 private:
  static Pieces AllPieces(const ContourSet& set) {
    Pieces all;
    for (const Contour& contour : set.contours) {
      all.insert(all.end(), contour.pieces.begin(), contour.pieces.end());
    }
    return all;
  }

  bool Skipped(int part) const {
    return std::find(options_.skip_parts.begin(), options_.skip_parts.end(), part) !=
           options_.skip_parts.end();
  }
  void CheckSkips() {
    for (const int part : options_.skip_parts) {
      if (part < 1 || part > set_.part_count) {
        result_.findings.push_back({"NO_SUCH_PART",
                                    true,
                                    "",
                                    "",
                                    0,
                                    {0.0, 0.0},
                                    0.0,
                                    "part " + std::to_string(part) +
                                        " cannot be skipped; the drawing has parts 1 … " +
                                        std::to_string(set_.part_count)});
      }
    }
  }

  void Tell(std::string_view reason, bool blocks, const Piece& piece, const Vector2d& at, double size_mm,
            std::string message) {
    const DrawingEntity& e = drawing_.entities[piece.source];
    const Vector2d drawn_mm = set_.placed.linear.transpose() * (at - set_.placed.offset);
    result_.findings.push_back(
        {reason, blocks, e.layer, e.type, e.line, drawn_mm, size_mm, std::move(message), e.dxf_handle});
  }

  void AddCut(std::size_t i) {
    const Contour& contour = set_.contours[i];
    const OffsetChain chain = OffsetPieces(contour.pieces, true, contour.hole ? half_mm_ : -half_mm_);
    TellOffset(contour, chain, true);
    if (chain.blocked() || !ClearOfContours(contour, chain)) {
      return;
    }
    TellOffset(contour, chain, false);  // what would remain in corners matters once the contour can be cut
    Cut cut;
    cut.kind = contour.hole ? CutKind::kHole : CutKind::kOutline;
    cut.part = contour.part;
    cut.contour = i;
    if (!ChooseLead(contour, chain.pieces, cut)) {
      Tell(
          "NO_ROOM_FOR_LEAD", true, contour.pieces.front(), contour.pieces.front().from_mm, options_.kerf_mm,
          Text(
              "no lead of at least %.3g mm with its pierce fits beside this contour; cut it with --lead none",
              options_.kerf_mm));
      return;
    }
    if (cut.kind == CutKind::kOutline) {
      AddTabs(contour, chain.pieces, cut);
    }
    result_.cuts.push_back(std::move(cut));
  }

  void TellOffset(const Contour& contour, const OffsetChain& chain, bool blocks) {
    const Piece* told = nullptr;  // a circle is two arcs
    for (const OffsetFault& f : chain.faults) {
      const Piece& piece = contour.pieces[f.piece];
      const bool again = told != nullptr && f.reason == "RADIUS_BELOW_KERF" && told->source == piece.source &&
                         (told->center_mm - piece.center_mm).norm() <= kTouch_mm &&
                         std::abs(Radius(*told) - Radius(piece)) <= kTouch_mm;
      if (f.blocks != blocks || again) {
        continue;
      }
      told = f.reason == "RADIUS_BELOW_KERF" ? &piece : told;
      if (f.reason == "RADIUS_BELOW_KERF") {
        Tell(f.reason, true, piece, f.at_mm, f.size_mm,
             Text("radius %.4g mm is smaller than the jet; right is at least %.4g mm", Radius(piece),
                  f.size_mm));
      } else if (f.reason == "INNER_CORNER_ROUNDED") {
        Tell(f.reason, false, piece, f.at_mm, f.size_mm,
             Text("the jet leaves %.3g mm of material in this inner corner (radius %.4g mm)", f.size_mm,
                  half_mm_));
      } else {
        Tell(f.reason, true, piece, f.at_mm, f.size_mm,
             Text("the jet does not fit here; the contour needs %.4g mm of room", f.size_mm));
      }
    }
  }

  bool ClearOfContours(const Contour& contour, const OffsetChain& chain) {
    if (half_mm_ == 0.0) {
      return true;
    }
    const auto gouges = FindGouges(chain.pieces, all_, index_, half_mm_);
    for (const OffsetFault& f : NearestOfStretches(gouges)) {
      Tell("KERF_GOUGE", true, contour.pieces[chain.pieces[f.piece].source], f.at_mm, f.size_mm,
           Text("here the jet's centre comes within %.4g mm of a contour and cuts into it; it needs %.4g mm",
                f.size_mm, half_mm_));
    }
    return gouges.empty();
  }

  bool Touch(std::size_t a, std::size_t b) const {
    const auto near = [](const Vector2d& p, const Vector2d& q) { return (p - q).norm() <= kTouch_mm; };
    return near(all_[a].from_mm, all_[b].to_mm) || near(all_[a].to_mm, all_[b].from_mm);
  }
  // Where neighbouring pieces of the path come too near to neighbouring pieces of a contour, the nearest place is told for all.
  std::vector<OffsetFault> NearestOfStretches(const std::vector<OffsetFault>& gouges) const {
    std::vector<OffsetFault> nearest, last;
    for (const OffsetFault& f : gouges) {
      std::size_t k = nearest.size();
      while (k > 0 && (f.piece > last[k - 1].piece + 1 || !Touch(f.other, last[k - 1].other))) {
        --k;
      }
      if (k == 0) {
        nearest.push_back(f);
        last.push_back(f);
        continue;
      }
      last[k - 1] = f;
      if (f.size_mm < nearest[k - 1].size_mm - kTouch_mm) {
        nearest[k - 1] = f;
      }
    }
    return nearest;
  }

  // ---- leads ----

  // No nearer to any contour than the distance.
  bool Clear(const Piece& piece, double distance_mm) const {
    bool clear = true;
    index_.ForNear(BoxOf(piece), distance_mm, [&](std::size_t j) {
      clear = Nearest(piece, all_[j]).distance_mm >= distance_mm - kTouch_mm;
      return clear;
    });
    return clear;
  }

  struct LeadPlace {
    std::size_t piece = 0;
    int kind = 0;  // 0: straight, 1: convex seen from the waste, 2: other
    double length_mm = 0.0;
  };
  // Straight pieces first, then convex ones; longest first.
  std::vector<LeadPlace> LeadPlaces(const Contour& contour, const Pieces& path) const {
    std::vector<LeadPlace> places;
    for (std::size_t k = 0; k < path.size(); ++k) {
      const bool rolled = path[k].is_arc() && Radius(path[k]) <= half_mm_ + kTouch_mm;
      const bool convex = (path[k].sweep_rad > 0.0) != contour.hole;
      places.push_back({k, rolled ? 3 : path[k].is_arc() ? (convex ? 1 : 2) : 0, Length(path[k])});
    }
    std::stable_sort(places.begin(), places.end(), [](const LeadPlace& a, const LeadPlace& b) {
      return a.kind < b.kind || (a.kind == b.kind && a.length_mm > b.length_mm + kTouch_mm);
    });
    places.resize(std::min(places.size(), kMostLeadPlaces));
    return places;
  }

  bool ChooseLead(const Contour& contour, const Pieces& path, Cut& cut) {
    const auto places = LeadPlaces(contour, path);
    if (options_.lead == LeadKind::kNone) {
      Assemble(path, places.front().piece, 0.5, {}, cut);
      return true;
    }
    const double side = contour.hole ? 1.0 : -1.0;
    for (double size = options_.lead_mm; size >= std::min(options_.kerf_mm, options_.lead_mm); size *= 0.5) {
      for (const LeadPlace& place : places) {
        for (const double share : {0.5, 0.25, 0.75}) {
          const Piece& on = path[place.piece];
          const Piece lead = LeadIn(PointAt(on, share), TangentAt(on, share), side, size);
          if (Clear(lead, half_mm_) && ClearPierce(lead.from_mm)) {
            Assemble(path, place.piece, share, {lead}, cut);
            AddLeadOut(side, size, cut);
            TellShort(contour, lead, size);
            return true;
          }
        }
      }
    }
    return false;
  }

  bool ClearPierce(const Vector2d& at) const {
    return Clear(LinePiece(at, at), half_mm_ + options_.pierce_clearance_mm);
  }

  void TellShort(const Contour& contour, const Piece& lead, double size) {
    if (size < options_.lead_mm) {
      Tell("LEAD_SHORTENED", false, contour.pieces.front(), lead.from_mm, size,
           Text("the lead is %.3g mm instead of %.3g mm; there is no room for more", size, options_.lead_mm));
    }
  }

  Piece LeadIn(const Vector2d& p, const Vector2d& t, double side, double size) const {
    const Vector2d waste = side * Vector2d(-t.y(), t.x());
    if (options_.lead == LeadKind::kLine) {
      const double a = options_.lead_angle_rad;
      return LinePiece(p + size * (std::sin(a) * waste - std::cos(a) * t), p);
    }
    const Vector2d center = p + size * waste;
    return {center - size * t, p, center, side * 0.5 * std::numbers::pi, 0};
  }

  Piece LeadOut(const Vector2d& p, const Vector2d& t, double side, double size) const {
    const Vector2d waste = side * Vector2d(-t.y(), t.x());
    if (options_.lead == LeadKind::kLine) {
      const double a = options_.lead_angle_rad;
      return LinePiece(p, p + size * (std::sin(a) * waste + std::cos(a) * t));
    }
    const Vector2d center = p + size * waste;
    return {p, center + size * t, center, side * 0.5 * std::numbers::pi, 0};
  }

  void Assemble(const Pieces& closed, std::size_t first, double share, Pieces lead_in, Cut& cut) const {
    cut.lead_in = std::move(lead_in);
    cut.path = RotatedTo(closed, first, share);
    const Pieces overlap = Head(cut.path, std::min(options_.overlap_mm, 0.5 * Length(cut.path)));
    cut.path.insert(cut.path.end(), overlap.begin(), overlap.end());
  }

  // As the lead-in, from where the overlap ends; shorter where there is no room, none at last.
  void AddLeadOut(double side, double size, Cut& cut) const {
    const Piece& last = cut.path.back();
    for (; size >= 0.5 * options_.kerf_mm; size *= 0.5) {
      const Piece out = LeadOut(last.to_mm, TangentAt(last, 1.0), side, size);
      if (Clear(out, half_mm_)) {
        cut.lead_out = {Part(out, 0.0, kJetOnShare), Part(out, kJetOnShare, 1.0)};
        return;
      }
    }
  }

  // ---- tabs ----

  void AddTabs(const Contour& contour, const Pieces& closed, Cut& cut) {
    const double around_mm = Length(closed);
    const int count = options_.tab_spacing_mm > 0.0
                          ? std::max(1, static_cast<int>(around_mm / options_.tab_spacing_mm))
                          : options_.tab_count;
    const double half_tab_mm = 0.5 * (options_.tab_mm + options_.kerf_mm);
    const double keep_mm = half_tab_mm + options_.kerf_mm;  // from corners
    const std::vector<double> corners = Corners(cut.path, around_mm);
    double after_mm = 0.0;
    for (int k = 0; k < count; ++k) {
      const double wanted = around_mm * (k + 0.5) / count;
      const auto at = FreePlace(wanted, 0.5 * around_mm / count, keep_mm, std::max(after_mm, keep_mm),
                                around_mm - keep_mm, corners);
      if (!at) {
        Tell("NO_ROOM_FOR_TAB", false, contour.pieces.front(), contour.pieces.front().from_mm, keep_mm,
             "tab " + std::to_string(k + 1) + " of " + std::to_string(count) +
                 " finds no place away from corners");
        continue;
      }
      cut.tabs.push_back({*at - half_tab_mm, *at + half_tab_mm});
      after_mm = *at + 2.0 * keep_mm;
    }
  }

  // Places along the path where it turns; a rolled corner counts over its whole length.
  std::vector<double> Corners(const Pieces& path, double around_mm) const {
    std::vector<double> corners;
    double s = 0.0;
    for (std::size_t k = 0; k + 1 < path.size() && s < around_mm; ++k) {
      const double begin = s;
      s += Length(path[k]);
      if (path[k].is_arc() && Radius(path[k]) <= 2.0 * half_mm_) {
        corners.push_back(begin);
        corners.push_back(s);
      } else if (std::abs(TurnBetween(TangentAt(path[k], 1.0), TangentAt(path[k + 1], 0.0))) > kCorner_rad) {
        corners.push_back(s);
      }
    }
    return corners;
  }

  static std::optional<double> FreePlace(double wanted, double reach, double keep, double from, double to,
                                         const std::vector<double>& corners) {
    constexpr int kSteps = 64;
    for (int step = 0; step <= 2 * kSteps; ++step) {
      const double at = wanted + (step % 2 == 0 ? 1.0 : -1.0) * reach * ((step + 1) / 2) / kSteps;
      const bool free = at >= from && at <= to &&
                        std::all_of(corners.begin(), corners.end(),
                                    [&](double corner) { return std::abs(at - corner) >= keep; });
      if (free) {
        return at;
      }
    }
    return std::nullopt;
  }

  // ---- order ----

  // Marks first, as long as the sheet is whole.
  void Order() {
    std::vector<CutStop> marks, cuts;
    for (const Cut& cut : result_.cuts) {
      const bool mark = cut.kind == CutKind::kMark;
      CutStop stop{cut.pierce(), cut.end(), static_cast<int>(marks.size()) + 1, 0, false};
      if (!mark) {
        const Contour& contour = set_.contours[cut.contour];
        stop.part = contour.part;
        stop.hole = contour.hole;
        stop.enclosing_part = !contour.hole && contour.parent >= 0
                                  ? set_.contours[static_cast<std::size_t>(contour.parent)].part
                                  : 0;
      }
      (mark ? marks : cuts).push_back(stop);
    }
    const CutOrder mark_order = OrderCuts(marks, options_.home_W_mm, options_.shortest_order);
    const Vector2d from = marks.empty() ? options_.home_W_mm : marks[mark_order.sequence.back()].exit_mm;
    const CutOrder cut_order = OrderCuts(cuts, from, options_.shortest_order);
    std::vector<Cut> ordered;
    for (const std::size_t i : mark_order.sequence) {
      ordered.push_back(std::move(result_.cuts[i]));
    }
    for (const std::size_t i : cut_order.sequence) {
      ordered.push_back(std::move(result_.cuts[marks.size() + i]));
    }
    result_.cuts = std::move(ordered);
    result_.idle_mm = mark_order.idle_mm + cut_order.idle_mm;
    result_.drawing_idle_mm = mark_order.drawing_idle_mm + cut_order.drawing_idle_mm;
  }

  void Count() {
    for (const Cut& cut : result_.cuts) {
      result_.cut_mm += Length(cut.lead_in) + Length(cut.path) + kJetOnShare * Length(cut.lead_out);
      for (const Tab& tab : cut.tabs) {
        result_.cut_mm -= tab.to_mm - tab.from_mm;
      }
      result_.pierce_count += cut.kind == CutKind::kMark ? 0 : 1 + static_cast<int>(cut.tabs.size());
    }
  }

  const Drawing& drawing_;
  const ContourSet& set_;
  const ToolpathOptions& options_;
  double half_mm_;
  Pieces all_;
  PieceIndex index_;
  Toolpath result_;
};

void MovePieces(Pieces& pieces, const Eigen::Matrix2d& turn, const Vector2d& shift) {
  for (Piece& p : pieces) {
    p.from_mm = turn * p.from_mm + shift;
    p.to_mm = turn * p.to_mm + shift;
    p.center_mm = turn * p.center_mm + shift;
  }
}

}  // namespace

bool Toolpath::blocked() const {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.blocks; });
}

Toolpath MakeToolpath(const Drawing& drawing, const ContourSet& contours, const ToolpathOptions& options) {
  return ToolpathMaker(drawing, contours, options).Make();
}

void PlaceContours(ContourSet& contours, double turn_rad, const Vector2d& corner_W_mm) {
  Eigen::Matrix2d turn;
  turn << std::cos(turn_rad), -std::sin(turn_rad), std::sin(turn_rad), std::cos(turn_rad);
  Box box;
  const auto each = [&](auto&& work) {
    for (Contour& contour : contours.contours) {
      work(contour.pieces);
    }
    for (Pieces& mark : contours.marks) {
      work(mark);
    }
  };
  each([&](Pieces& pieces) {
    MovePieces(pieces, turn, Vector2d::Zero());
    box.Add(BoxOf(pieces));
  });
  const Vector2d shift_mm = corner_W_mm - box.low_mm;
  each([&](Pieces& pieces) { MovePieces(pieces, Eigen::Matrix2d::Identity(), shift_mm); });
  contours.placed =
      AffineMap{Eigen::Matrix2d::Identity(), shift_mm} * AffineMap{turn, Vector2d::Zero()} * contours.placed;
}

}  // namespace lambdajet::trajectory
