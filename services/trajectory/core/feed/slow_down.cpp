#include "trajectory/core/feed/slow_down.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

constexpr double kAllowed = 1.0 + 5e-7;     // of a limit, on the final polynomials
constexpr double kStrongestSlowDown = 0.6;  // in one pass
constexpr double kCure = 0.997;             // slower than would just do, so that few passes are needed
constexpr double kLeastEase = 0.6;

}  // namespace

void Excess::Take(double cure, FeedLimit why) {
  if (cure < factor) {
    factor = cure;
    reason = why;
  }
}

void Excess::Judge(double share, double power, FeedLimit why) {
  if (share > kAllowed) {
    Take(std::max(kStrongestSlowDown, kCure * std::pow(share, -power)), why);
  }
}

void RunPace::Reset(std::size_t nodes) {
  slow.assign(nodes, 1.0);
  ease.assign(nodes, 1.0);
  reason.assign(nodes, FeedLimit::kContourTolerance);
}

std::ptrdiff_t RunPace::Slow(std::span<const SlowPlace> places, double half_s, double begin_time_s,
                             std::span<const double> node_time_s) {
  std::size_t first = 0;
  std::ptrdiff_t last = -1;
  for (std::size_t k = 0; k < slow.size(); ++k) {
    const double t = begin_time_s + node_time_s[k];
    const double before = k > 0 ? begin_time_s + node_time_s[k - 1] : t;
    const double after = k + 1 < slow.size() ? begin_time_s + node_time_s[k + 1] : t;
    while (first < places.size() && places[first].end_time_s + half_s < before) {
      ++first;
    }
    Excess worst;
    for (std::size_t i = first; i < places.size() && places[i].begin_time_s - half_s <= after; ++i) {
      worst.Take(places[i].excess.factor, places[i].excess.reason);
    }
    if (worst.any()) {
      slow[k] *= worst.factor;
      // Too much acceleration is cured by less speed at the kink and a little less braking before it.
      const double least = worst.reason == FeedLimit::kPathAcceleration ? std::min(kLeastEase, ease[k]) : 0.0;
      ease[k] = std::max(least, ease[k] * worst.factor);
      reason[k] = worst.reason;
      last = static_cast<std::ptrdiff_t>(k);
    }
  }
  return last;
}

}  // namespace lambdajet::trajectory
