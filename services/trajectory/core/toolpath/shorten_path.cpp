#include "trajectory/core/toolpath/shorten_path.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "trajectory/core/toolpath/near_points.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
constexpr double kGain_mm = 1e-9;
constexpr std::size_t kNeighbours = 10;
constexpr std::size_t kBlock = 256;
constexpr std::size_t kMostKicks = 3000;  // up to 1000 stops; above, fewer in proportion
constexpr std::size_t kShort = 3;         // stops of a stretch whose exchange is tried wherever it may go

// Stops are numbered anew: 0 is where the path begins, 1 … n the sequence given, n + 1 where it ends.
class PathSearch {
 public:
  PathSearch(const std::vector<Stop>& stops, const std::vector<std::size_t>& later, const Vector2d& before,
             const Vector2d* after, const std::vector<std::size_t>& sequence)
      : n_(sequence.size()),
        open_(after == nullptr),
        reach_(std::max<std::size_t>(1000, 25'000'000 / (n_ + 1))),
        waiting_(n_ + 2, false),
        skew_(n_ + 2, 0.0) {
    stops_.push_back({before, before});
    for (const std::size_t s : sequence) {
      stops_.push_back(stops[s]);
    }
    stops_.push_back(open_ ? Stop{} : Stop{*after, *after});
    for (std::size_t i = 0; i < n_ + 2; ++i) {
      order_.push_back(i);
      place_.push_back(i);
    }
    NumberLater(stops.size(), later, sequence);
    FindNeighbours();
    Measure(1, n_);
  }

  bool Shorten() {
    for (std::size_t s = 1; s <= n_; ++s) {
      Wake(s);
    }
    double gain = Settle();
    const std::size_t kicks = n_ < 4 ? 0 : std::min({n_ * n_ + 20, kMostKicks, 1000 * kMostKicks / n_});
    for (std::size_t t = 1; t <= kicks; ++t) {
      gain += Kick(t);
    }
    return gain > kGain_mm;
  }

  const std::vector<std::size_t>& order() const { return order_; }

 private:
  struct Exchange {  // [i, m) with [m, j); or [i, j) reversed
    std::size_t i = 0, m = 0, j = 0;
    bool reversed = false;
    double gain_mm = 0.0;
  };

  void NumberLater(std::size_t count, const std::vector<std::size_t>& later,
                   const std::vector<std::size_t>& sequence) {
    if (std::all_of(later.begin(), later.end(), [](std::size_t l) { return l == kNoStop; })) {
      return;
    }
    std::vector<std::size_t> number(count, kNoStop);
    for (std::size_t k = 0; k < n_; ++k) {
      number[sequence[k]] = k + 1;
    }
    later_.assign(n_ + 2, kNoStop);
    for (std::size_t k = 0; k < n_; ++k) {
      const std::size_t l = later[sequence[k]];
      later_[k + 1] = l == kNoStop ? kNoStop : number[l];
    }
  }

  void FindNeighbours() {
    std::vector<Vector2d> entries, exits;
    for (std::size_t s = 0; s <= n_ + 1; ++s) {
      entries.push_back(stops_[s].entry_mm);
      exits.push_back(stops_[s].exit_mm);
    }
    NearPoints near_entries(entries), near_exits(exits);
    near_entries.SetPresent(0, false);
    near_exits.SetPresent(n_ + 1, false);
    if (open_) {
      near_entries.SetPresent(n_ + 1, false);
    }
    const auto without = [](std::vector<std::size_t> list, std::size_t s) {
      list.erase(std::remove(list.begin(), list.end(), s), list.end());
      return list;
    };
    for (std::size_t s = 0; s <= n_ + 1; ++s) {
      next_.push_back(without(near_entries.Nearest(exits[s], kNeighbours + 1), s));
      if (open_) {
        next_.back().push_back(n_ + 1);  // any stop may be the last
      }
      previous_.push_back(without(near_exits.Nearest(entries[s], kNeighbours + 1), s));
    }
  }

  double Move(std::size_t from, std::size_t to) const {
    return open_ && to == n_ + 1 ? 0.0 : (stops_[to].entry_mm - stops_[from].exit_mm).norm();
  }
  double MoveAt(std::size_t from, std::size_t to) const { return Move(order_[from], order_[to]); }

  // What each idle move is longer backwards, summed from the beginning of its block of places.
  void Measure(std::size_t from, std::size_t to) {
    const std::size_t end = std::min(n_ + 2, (to / kBlock + 1) * kBlock);
    for (std::size_t k = from / kBlock * kBlock; k < end; ++k) {
      const double more = k < 2 || k > n_ ? 0.0 : MoveAt(k, k - 1) - MoveAt(k - 1, k);
      skew_[k] = k % kBlock == 0 ? more : skew_[k - 1] + more;
    }
  }
  double SkewBetween(std::size_t first, std::size_t last) const {
    double sum = skew_[last] - skew_[first];
    for (std::size_t b = first / kBlock; b < last / kBlock; ++b) {
      sum += skew_[(b + 1) * kBlock - 1];
    }
    return sum;
  }

  bool InOrder(const Exchange& e) const {
    if (later_.empty()) {
      return true;
    }
    const std::size_t from = e.reversed ? e.i : e.m, end = e.reversed ? e.j : e.m;
    for (std::size_t k = e.i; k < (e.reversed ? e.j : end); ++k) {
      const std::size_t l = later_[order_[k]];
      if (l != kNoStop && place_[l] >= from && place_[l] < e.j) {
        return false;
      }
    }
    return true;
  }

  double SwapGain(std::size_t i, std::size_t m, std::size_t j) const {
    return MoveAt(i - 1, i) + MoveAt(m - 1, m) + MoveAt(j - 1, j) - MoveAt(i - 1, m) - MoveAt(j - 1, i) -
           MoveAt(m - 1, j);
  }
  void Keep(const Exchange& e, Exchange& best) const {
    if (e.gain_mm > best.gain_mm + kGain_mm && InOrder(e)) {
      best = e;
    }
  }
  void TrySwap(std::size_t i, std::size_t m, std::size_t j, Exchange& best) const {
    if (i >= 1 && i < m && m < j && j <= n_ + 1 && j - i <= reach_) {
      Keep({i, m, j, false, SwapGain(i, m, j)}, best);
    }
  }
  void TryReverse(std::size_t i, std::size_t j, Exchange& best) const {
    if (i >= 1 && i + 1 < j && j <= n_ + 1 && j - i <= reach_) {
      const double gain =
          MoveAt(i - 1, i) + MoveAt(j - 1, j) - MoveAt(i - 1, j - 1) - MoveAt(i, j) - SkewBetween(i, j - 1);
      Keep({i, i, j, true, gain}, best);
    }
  }

  // All exchanges after which `b` follows `a`.
  void TryJoining(std::size_t a, std::size_t b, Exchange& best) const {
    const std::size_t pa = place_[a], pb = place_[b];
    if (pa + 1 == pb) {
      return;
    }
    const bool ahead = pa < pb;
    for (std::size_t length = 1; length <= kShort; ++length) {
      if (ahead) {
        TrySwap(pa + 1, pb, pb + length, best);
        if (pa >= length) {
          TrySwap(pa + 1 - length, pa + 1, pb, best);
        }
      } else {
        TrySwap(pb, pb + length, pa + 1, best);
        TrySwap(pb, pa + 1 - length, pa + 1, best);
      }
    }
    if (ahead) {
      TryReverse(pa + 1, pb + 1, best);
      TryReverse(pa, pb, best);
    }
    TryThirdJoin(pa, pb, best);
  }

  // Long stretches: the second new move is short as well.
  void TryThirdJoin(std::size_t pa, std::size_t pb, Exchange& best) const {
    if (pa < pb) {
      for (const std::size_t s : previous_[order_[pa + 1]]) {
        TrySwap(pa + 1, pb, place_[s] + 1, best);
      }
    } else if (pb > 0) {
      for (const std::size_t s : next_[order_[pb - 1]]) {
        TrySwap(pb, place_[s], pa + 1, best);
      }
    }
  }

  void Wake(std::size_t stop) {
    if (stop >= 1 && stop <= n_ && !waiting_[stop]) {
      waiting_[stop] = true;
      queue_.push_back(stop);
    }
  }

  void Apply(const Exchange& e) {
    const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
    if (e.reversed) {
      std::reverse(at(e.i), at(e.j));
    } else {
      std::rotate(at(e.i), at(e.m), at(e.j));
    }
    for (std::size_t k = e.i; k < e.j; ++k) {
      place_[order_[k]] = k;
    }
    Measure(e.i, std::min(e.j, n_));
  }
  void ApplyAndWake(const Exchange& e) {
    Apply(e);
    applied_.push_back(e);
    const std::size_t seam = e.i + (e.j - e.m);
    for (const std::size_t k : {e.i - 1, e.i, seam - 1, seam, e.j - 1, e.j}) {
      Wake(order_[std::min(k, n_ + 1)]);
    }
  }

  // Until no stop that waits gains; returns what was gained.
  double Settle() {
    double gain = 0.0;
    while (!queue_.empty()) {
      const std::size_t stop = queue_.front();
      queue_.pop_front();
      waiting_[stop] = false;
      Exchange best;
      for (const std::size_t s : next_[stop]) {
        TryJoining(stop, s, best);
      }
      for (const std::size_t s : previous_[stop]) {
        TryJoining(s, stop, best);
      }
      if (best.gain_mm > 0.0) {
        ApplyAndWake(best);
        gain += best.gain_mm;
        Wake(stop);
      }
    }
    return gain;
  }

  // Exchanges two short stretches at a place that the golden section picks; what does not gain in the end is taken back.
  double Kick(std::size_t t) {
    const auto pick = [t](double step, std::size_t count) {
      const double share = std::fmod(static_cast<double>(t) * step, 1.0);
      return std::min(count - 1, static_cast<std::size_t>(share * static_cast<double>(count)));
    };
    const std::size_t longest = std::min<std::size_t>(30, n_ / 2);
    const std::size_t first = 1 + pick(0.7548776662466927, longest);
    const std::size_t second = 1 + pick(0.5698402909980532, longest);
    const std::size_t i = 1 + pick(0.6180339887498949, n_ + 1 - first - second);
    Exchange kick{i, i + first, i + first + second, false, 0.0};
    kick.gain_mm = SwapGain(kick.i, kick.m, kick.j);
    if (!InOrder(kick)) {
      return 0.0;
    }
    applied_.clear();
    ApplyAndWake(kick);
    const double gain = kick.gain_mm + Settle();
    if (gain > kGain_mm) {
      return gain;
    }
    for (auto e = applied_.rbegin(); e != applied_.rend(); ++e) {
      Apply({e->i, e->reversed ? e->i : e->i + (e->j - e->m), e->j, e->reversed, 0.0});
    }
    return 0.0;
  }

  std::size_t n_;
  bool open_;
  std::size_t reach_;
  std::vector<Stop> stops_;
  std::vector<std::size_t> later_;
  std::vector<std::size_t> order_, place_;
  std::vector<std::vector<std::size_t>> next_,
      previous_;  // near entries of each exit, near exits of each entry
  std::vector<bool> waiting_;
  std::vector<double> skew_;
  std::deque<std::size_t> queue_;
  std::vector<Exchange> applied_;
};

}  // namespace

bool ShortenPath(const std::vector<Stop>& stops, const std::vector<std::size_t>& later,
                 const Vector2d& before, const Vector2d* after, std::vector<std::size_t>& sequence) {
  if (sequence.size() < 2) {
    return false;
  }
  PathSearch search(stops, later, before, after, sequence);
  const bool shorter = search.Shorten();
  std::vector<std::size_t> result;
  for (std::size_t k = 1; k <= sequence.size(); ++k) {
    result.push_back(sequence[search.order()[k] - 1]);
  }
  sequence = std::move(result);
  return shorter;
}

}  // namespace lambdajet::trajectory
