#include "trajectory/core/feed/level_tops.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

constexpr int kHalvings = 30;

class Tops {
 public:
  Tops(std::vector<ProfileNode>& nodes, double level_s, double acceleration)
      : nodes_(nodes), level_s_(level_s), acceleration_(acceleration) {}

  void Level() {
    for (std::size_t k = 1; k + 1 < nodes_.size();) {
      std::size_t end = k;  // of equal speed
      while (end + 1 < nodes_.size() && nodes_[end + 1].x == nodes_[k].x) {
        ++end;
      }
      if (end + 1 < nodes_.size() && Slope(k - 1) > 0.0 && Slope(end) < 0.0 &&
          Slope(k - 1) - Slope(end) > acceleration_) {
        LevelTop(k, end);
      }
      k = end + 1;
    }
  }

 private:
  // Acceleration in the cell from node k on.
  double Slope(std::size_t k) const {
    return 0.5 * (nodes_[k + 1].x - nodes_[k].x) / (nodes_[k + 1].offset_mm - nodes_[k].offset_mm);
  }

  // Where the profile passes x in the cell between two neighbours, the first of which is the lower.
  double Place(std::size_t low, std::size_t high, double x) const {
    const ProfileNode &a = nodes_[low], &b = nodes_[high];
    return a.offset_mm + (b.offset_mm - a.offset_mm) * (x - a.x) / (b.x - a.x);
  }

  void LevelTop(std::size_t first, std::size_t last) {
    double low = 0.0, high = nodes_[first].x;
    if ((nodes_[last].offset_mm - nodes_[first].offset_mm) / std::sqrt(high) >= level_s_) {
      return;
    }
    for (;;) {  // down to the node below which the level would last long enough
      low = std::max(nodes_[first - 1].x, nodes_[last + 1].x);
      if (low > high) {  // a valley: the profile rises again beyond it
        return Cap(first, last, high);
      }
      if (Lasts(first, last, low) >= level_s_) {
        break;
      }
      first -= nodes_[first - 1].x >= low && first > 1 ? 1 : 0;
      last += nodes_[last + 1].x >= low && last + 2 < nodes_.size() ? 1 : 0;
      if ((nodes_[first - 1].x >= low && first == 1) ||
          (nodes_[last + 1].x >= low && last + 2 == nodes_.size())) {
        return Cap(first, last, low);
      }
      high = low;
    }
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (low + high);
      (Lasts(first, last, middle) >= level_s_ ? low : high) = middle;
    }
    Cap(first, last, low);
  }

  double Lasts(std::size_t first, std::size_t last, double x) const {
    return (Place(last + 1, last, x) - Place(first - 1, first, x)) / std::sqrt(std::max(x, 1e-12));
  }

  void Cap(std::size_t first, std::size_t last, double x) {
    for (std::size_t k = first; k <= last; ++k) {
      if (nodes_[k].x > x) {
        nodes_[k].x = x;
        nodes_[k].binding = FeedLimit::kPathJerk;
      }
    }
  }

  std::vector<ProfileNode>& nodes_;
  double level_s_;
  double acceleration_;
};

}  // namespace

void LevelTops(std::vector<ProfileNode>& nodes, double level_s, double acceleration_mm_per_s2) {
  Tops(nodes, level_s, acceleration_mm_per_s2).Level();
}

}  // namespace lambdajet::trajectory
