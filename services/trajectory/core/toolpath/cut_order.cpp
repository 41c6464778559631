#include "trajectory/core/toolpath/cut_order.hpp"

#include <algorithm>
#include <map>

#include "trajectory/core/toolpath/near_points.hpp"
#include "trajectory/core/toolpath/shorten_path.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
constexpr int kMostRounds = 8;
// Length of the idle moves from `before` through the stops to `after`, if there is one.
double PathLength(const std::vector<Stop>& stops, const std::vector<std::size_t>& sequence,
                  const Vector2d& before, const Vector2d* after) {
  double length = 0.0;
  Vector2d at = before;
  for (const std::size_t i : sequence) {
    length += (stops[i].entry_mm - at).norm();
    at = stops[i].exit_mm;
  }
  return after == nullptr ? length : length + (*after - at).norm();
}

struct PartCuts {
  int number = 0;
  int enclosing = 0;
  std::vector<std::size_t> holes;
  std::vector<std::size_t> outlines;  // none or one; several for lines without area
};

class Orderer {
 public:
  Orderer(const std::vector<CutStop>& cuts, const Vector2d& home) : home_(home) {
    std::map<int, std::size_t> place;
    for (std::size_t i = 0; i < cuts.size(); ++i) {
      const auto [at, added] = place.try_emplace(cuts[i].part, parts_.size());
      if (added) {
        parts_.push_back({cuts[i].part, 0, {}, {}});
      }
      PartCuts& part = parts_[at->second];
      (cuts[i].hole ? part.holes : part.outlines).push_back(i);
      if (!cuts[i].hole) {
        part.enclosing = cuts[i].enclosing_part;
      }
      stops_.push_back({cuts[i].entry_mm, cuts[i].exit_mm});
    }
    inner_.resize(parts_.size());
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      const auto at = place.find(parts_[p].enclosing);
      around_.push_back(at == place.end() ? kNoStop : at->second);
      if (around_.back() != kNoStop) {
        inner_[around_.back()].push_back(p);
      }
    }
  }

  std::vector<std::size_t> DrawingOrder() const {
    std::vector<std::size_t> order;
    std::vector<bool> done(parts_.size(), false);
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      AddWithInner(p, done, order);
    }
    return order;
  }

  std::vector<std::size_t> NearestOrder() {
    std::vector<Vector2d> entries;
    std::vector<std::size_t> part_of, open(parts_.size());
    std::vector<std::vector<std::size_t>> first(parts_.size());
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      open[p] = inner_[p].size();
      for (const std::size_t i : parts_[p].holes.empty() ? parts_[p].outlines : parts_[p].holes) {
        first[p].push_back(entries.size());
        entries.push_back(stops_[i].entry_mm);
        part_of.push_back(p);
      }
    }
    NearPoints near(entries);
    const auto show = [&](std::size_t p, bool present) {
      for (const std::size_t k : first[p]) {
        near.SetPresent(k, present);
      }
    };
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      show(p, open[p] == 0);
    }
    std::vector<std::size_t> order;
    Vector2d at = home_;
    while (order.size() < parts_.size()) {
      const std::size_t best = part_of[near.Nearest(at, 1).front()];
      show(best, false);
      order.push_back(best);
      at = OrderInside(best, at);
      if (around_[best] != kNoStop && --open[around_[best]] == 0) {
        show(around_[best], true);
      }
    }
    return order;
  }

  // Alternates between the order of parts and the order in each until neither gains.
  void Refine(std::vector<std::size_t>& order) {
    for (int round = 0; round < kMostRounds; ++round) {
      std::vector<Stop> units;
      for (const PartCuts& part : parts_) {
        const std::vector<std::size_t> inside = Inside(part);
        units.push_back({stops_[inside.front()].entry_mm, stops_[inside.back()].exit_mm});
      }
      ShortenPath(units, around_, home_, nullptr, order);
      bool better = false;
      Vector2d at = home_;
      for (const std::size_t p : order) {
        better |= RefineInside(p, at);
        at = stops_[Inside(parts_[p]).back()].exit_mm;
      }
      if (!better || parts_.size() == 1) {
        return;
      }
    }
  }

  std::vector<std::size_t> Flat(const std::vector<std::size_t>& order) const {
    std::vector<std::size_t> flat;
    for (const std::size_t p : order) {
      const auto inside = Inside(parts_[p]);
      flat.insert(flat.end(), inside.begin(), inside.end());
    }
    return flat;
  }
  double Length(const std::vector<std::size_t>& flat) const {
    return PathLength(stops_, flat, home_, nullptr);
  }

 private:
  static std::vector<std::size_t> Inside(const PartCuts& part) {
    std::vector<std::size_t> cuts = part.holes;
    cuts.insert(cuts.end(), part.outlines.begin(), part.outlines.end());
    return cuts;
  }

  void AddWithInner(std::size_t p, std::vector<bool>& done, std::vector<std::size_t>& order) const {
    if (done[p]) {
      return;
    }
    done[p] = true;
    for (const std::size_t q : inner_[p]) {
      AddWithInner(q, done, order);
    }
    order.push_back(p);
  }

  // Holes by nearest neighbour; returns where the part is left.
  Vector2d OrderInside(std::size_t p, Vector2d at) {
    auto& holes = parts_[p].holes;
    std::vector<Vector2d> entries;
    for (const std::size_t i : holes) {
      entries.push_back(stops_[i].entry_mm);
    }
    NearPoints near(entries);
    std::vector<std::size_t> ordered;
    while (ordered.size() < holes.size()) {
      const std::size_t next = near.Nearest(at, 1).front();
      near.SetPresent(next, false);
      ordered.push_back(holes[next]);
      at = stops_[holes[next]].exit_mm;
    }
    holes = std::move(ordered);
    return parts_[p].outlines.empty() ? at : stops_[parts_[p].outlines.back()].exit_mm;
  }

  bool RefineInside(std::size_t p, const Vector2d& at) {
    PartCuts& part = parts_[p];
    const Vector2d* after = part.outlines.empty() ? nullptr : &stops_[part.outlines.front()].entry_mm;
    return ShortenPath(stops_, {}, at, after, part.holes);
  }

  Vector2d home_;
  std::vector<PartCuts> parts_;
  std::vector<Stop> stops_;
  std::vector<std::size_t> around_;              // part whose hole each lies in
  std::vector<std::vector<std::size_t>> inner_;  // and the other way
};

}  // namespace

CutOrder OrderCuts(const std::vector<CutStop>& cuts, const Vector2d& home_mm, bool shortest) {
  CutOrder result;
  Orderer drawn(cuts, home_mm);
  std::vector<std::size_t> order = drawn.DrawingOrder();
  result.sequence = drawn.Flat(order);
  result.drawing_idle_mm = result.idle_mm = drawn.Length(result.sequence);
  if (!shortest) {
    return result;
  }
  drawn.Refine(order);
  Orderer nearest(cuts, home_mm);
  std::vector<std::size_t> other = nearest.NearestOrder();
  nearest.Refine(other);
  const auto a = drawn.Flat(order), b = nearest.Flat(other);
  const double length_a = drawn.Length(a), length_b = nearest.Length(b);
  const auto& better = length_a <= length_b ? a : b;
  if (std::min(length_a, length_b) < result.idle_mm) {
    result.sequence = better;
    result.idle_mm = std::min(length_a, length_b);
  }
  return result;
}

}  // namespace lambdajet::trajectory
