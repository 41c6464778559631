#include "trajectory/core/toolpath/cut_order.hpp"

#include <algorithm>
#include <limits>
#include <map>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
constexpr double kGain_mm = 1e-9;
constexpr int kMostPasses = 60;
constexpr double kWorkLimit = 2e7;
constexpr std::size_t kMostImproved = 3000;  // cuts; above, nearest neighbour has to do

struct Stop {
  Vector2d entry_mm;
  Vector2d exit_mm;
};

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

// 2-opt and Or-opt until neither gains; true if anything did.
template <typename Feasible>
bool Improve(const std::vector<Stop>& stops, std::vector<std::size_t>& sequence, const Vector2d& before,
             const Vector2d* after, Feasible feasible) {
  const std::size_t n = sequence.size();
  const auto reach = static_cast<std::size_t>(
      std::max(2.0, kWorkLimit / (1.0 + static_cast<double>(n) * static_cast<double>(n))));
  if (n > kMostImproved) {
    return false;
  }
  double best = PathLength(stops, sequence, before, after);
  bool gained = false;
  std::vector<std::size_t> trial;
  const auto keep_if_shorter = [&] {
    const double length = PathLength(stops, trial, before, after);
    if (length < best - kGain_mm && feasible(trial)) {
      best = length;
      sequence = trial;
      return true;
    }
    return false;
  };
  for (int pass = 0; pass < kMostPasses; ++pass) {
    bool better = false;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < std::min(n, i + reach); ++j) {
        trial = sequence;
        std::reverse(trial.begin() + static_cast<std::ptrdiff_t>(i),
                     trial.begin() + static_cast<std::ptrdiff_t>(j) + 1);
        better |= keep_if_shorter();
        for (std::size_t length = 1; length <= 3 && j + length <= n; ++length) {
          trial = sequence;  // moves what follows j to i, and what stands at i behind j
          const auto at = [&](std::size_t k) { return trial.begin() + static_cast<std::ptrdiff_t>(k); };
          std::rotate(at(i), at(j), at(j + length));
          better |= keep_if_shorter();
          if (i + length <= j) {
            trial = sequence;
            std::rotate(at(i), at(i + length), at(j + 1));
            better |= keep_if_shorter();
          }
        }
      }
    }
    gained |= better;
    if (!better) {
      break;
    }
  }
  return gained;
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
      around_.push_back(at == place.end() ? kNone : at->second);
      if (around_.back() != kNone) {
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
    std::vector<std::size_t> order;
    std::vector<bool> done(parts_.size(), false);
    Vector2d at = home_;
    while (order.size() < parts_.size()) {
      std::size_t best = kNone;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t p = 0; p < parts_.size(); ++p) {
        if (done[p] || !InnerDone(p, done)) {
          continue;
        }
        const double d = NearestEntry(p, at);
        if (d < least) {
          least = d;
          best = p;
        }
      }
      done[best] = true;
      order.push_back(best);
      at = OrderInside(best, at);
    }
    return order;
  }

  // Alternates between the order of parts and the order in each until neither gains.
  void Refine(std::vector<std::size_t>& order) {
    for (int round = 0; round < 8; ++round) {
      std::vector<Stop> units;
      for (const PartCuts& part : parts_) {
        const std::vector<std::size_t> inside = Inside(part);
        units.push_back({stops_[inside.front()].entry_mm, stops_[inside.back()].exit_mm});
      }
      bool better =
          Improve(units, order, home_, nullptr, [this](const auto& trial) { return InnerFirst(trial); });
      Vector2d at = home_;
      for (const std::size_t p : order) {
        better |= RefineInside(p, at);
        at = stops_[Inside(parts_[p]).back()].exit_mm;
      }
      if (!better) {
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
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

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

  bool InnerDone(std::size_t p, const std::vector<bool>& done) const {
    return std::all_of(inner_[p].begin(), inner_[p].end(), [&](std::size_t q) { return done[q]; });
  }

  bool InnerFirst(const std::vector<std::size_t>& order) const {
    std::vector<std::size_t> place(parts_.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      place[order[k]] = k;
    }
    for (std::size_t q = 0; q < parts_.size(); ++q) {
      if (around_[q] != kNone && place[q] > place[around_[q]]) {
        return false;
      }
    }
    return true;
  }

  double NearestEntry(std::size_t p, const Vector2d& at) const {
    const auto& first = parts_[p].holes.empty() ? parts_[p].outlines : parts_[p].holes;
    double least = std::numeric_limits<double>::infinity();
    for (const std::size_t i : first) {
      least = std::min(least, (stops_[i].entry_mm - at).norm());
    }
    return least;
  }

  // Holes by nearest neighbour; returns where the part is left.
  Vector2d OrderInside(std::size_t p, Vector2d at) {
    auto& holes = parts_[p].holes;
    for (std::size_t k = 0; k < holes.size(); ++k) {
      const auto next = std::min_element(
          holes.begin() + static_cast<std::ptrdiff_t>(k), holes.end(), [&](std::size_t a, std::size_t b) {
            return (stops_[a].entry_mm - at).norm() < (stops_[b].entry_mm - at).norm();
          });
      std::iter_swap(holes.begin() + static_cast<std::ptrdiff_t>(k), next);
      at = stops_[holes[k]].exit_mm;
    }
    return parts_[p].outlines.empty() ? at : stops_[parts_[p].outlines.back()].exit_mm;
  }

  bool RefineInside(std::size_t p, const Vector2d& at) {
    PartCuts& part = parts_[p];
    const Vector2d* after = part.outlines.empty() ? nullptr : &stops_[part.outlines.front()].entry_mm;
    return Improve(stops_, part.holes, at, after, [](const auto&) { return true; });
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
