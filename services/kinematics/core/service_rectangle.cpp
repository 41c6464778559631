#include "kinematics/core/service_rectangle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "foundation/contract/expects.hpp"

namespace lambdajet::kinematics {
namespace {

constexpr double kOutwardMm = 1e-3;
constexpr double kFar = std::numeric_limits<double>::max();

// An end of the region over one x, with what ends it there.
struct End {
  double y_mm = 0.0;
  ServiceBound bound;
};

struct Arcs {
  ServicePoint centre;
  int joint;
  int tilt_sign;
};

class Region {
 public:
  explicit Region(const ServiceAreaMachine& machine)
      : m_(machine),
        arcs_{{{ArcCentre(machine, 1, +1), 1, +1},
               {ArcCentre(machine, 2, +1), 2, +1},
               {ArcCentre(machine, 1, -1), 1, -1},
               {ArcCentre(machine, 2, -1), 2, -1}}},
        axis_mm_(0.5 * machine.base_joint_spacing_mm),
        top_mm_(machine.frame_top_ratio * machine.base_joint_spacing_mm),
        bottom_mm_(machine.frame_bottom_ratio * machine.base_joint_spacing_mm) {}

  const std::array<Arcs, 4>& arcs() const { return arcs_; }
  double axis_mm() const { return axis_mm_; }
  double half_width_mm() const { return 0.5 * std::max(top_mm_, bottom_mm_); }

  // The highest of all lower bounds.
  End Low(double x) const {
    End low{-kFar, {}};
    for (const Arcs& arc : arcs_) {
      const double dx = x - arc.centre.x_mm;
      const double square = m_.strut_min_mm * m_.strut_min_mm - dx * dx;
      if (square > 0.0) {
        Raise(low, arc.centre.y_mm + std::sqrt(square),
              {ServiceLimit::kStrutShortest, arc.joint, arc.tilt_sign});
      } else {
        Raise(low, arc.centre.y_mm, {ServiceLimit::kBase, 0, 0});
      }
    }
    if (bottom_mm_ > top_mm_) {
      Raise(low, WallAt(x), {ServiceLimit::kFrame, 0, 0});
    }
    return low;
  }

  // The lowest of all upper bounds.
  End High(double x) const {
    End high{m_.height_mm, {ServiceLimit::kTable, 0, 0}};
    for (const Arcs& arc : arcs_) {
      const double dx = x - arc.centre.x_mm;
      const double square = m_.strut_max_mm * m_.strut_max_mm - dx * dx;
      const double y = square >= 0.0 ? arc.centre.y_mm + std::sqrt(square) : -kFar;
      Lower(high, y, {ServiceLimit::kStrutLongest, arc.joint, arc.tilt_sign});
    }
    const double beyond = std::abs(x - axis_mm_) - 0.5 * bottom_mm_;
    if (bottom_mm_ < top_mm_) {
      Lower(high, WallAt(x), {ServiceLimit::kFrame, 0, 0});
    } else if (beyond > 0.0) {
      Lower(high, -kFar, {ServiceLimit::kFrame, 0, 0});
    }
    return high;
  }

 private:
  static void Raise(End& low, double y, ServiceBound bound) { low = y > low.y_mm ? End{y, bound} : low; }
  static void Lower(End& high, double y, ServiceBound bound) { high = y < high.y_mm ? End{y, bound} : high; }

  // Height at which the sloping wall stands over x.
  double WallAt(double x) const {
    return (2.0 * std::abs(x - axis_mm_) - top_mm_) * m_.height_mm / (bottom_mm_ - top_mm_);
  }

  const ServiceAreaMachine& m_;
  std::array<Arcs, 4> arcs_;
  double axis_mm_, top_mm_, bottom_mm_;
};

struct Stretch {
  End low, high;
  double area_mm2 = 0.0;
};

Stretch Over(const Region& region, double from, double to) {
  Stretch stretch{region.Low(from), region.High(from), 0.0};
  const auto take_low = [&](double x) {
    const End low = region.Low(x);
    stretch.low = low.y_mm > stretch.low.y_mm ? low : stretch.low;
  };
  take_low(to);
  for (const Arcs& arc : region.arcs()) {
    if (arc.centre.x_mm > from && arc.centre.x_mm < to) {
      take_low(arc.centre.x_mm);
    }
  }
  const End high = region.High(to);
  stretch.high = high.y_mm < stretch.high.y_mm ? high : stretch.high;
  stretch.area_mm2 = std::max(0.0, stretch.high.y_mm - stretch.low.y_mm) * (to - from);
  return stretch;
}

// What a side at x runs into when it moves on by `outward`: of the ends there, the one that is farther inside.
ServiceBound SideBound(const Region& region, double x, double outward, const Stretch& stretch) {
  const End low = region.Low(x + outward), high = region.High(x + outward);
  const bool table = high.bound.limit == ServiceLimit::kTable;
  const double above = table ? kFar : high.y_mm - stretch.high.y_mm;
  return above < stretch.low.y_mm - low.y_mm ? high.bound : low.bound;
}

}  // namespace

std::string_view ServiceLimitName(ServiceLimit limit) {
  constexpr std::array<std::string_view, 6> kNames = {"NONE",  "STRUT_SHORTEST", "STRUT_LONGEST",
                                                      "FRAME", "TABLE",          "BASE"};
  return kNames[static_cast<std::size_t>(limit)];
}

std::string_view ServiceLimitSentence(ServiceLimit limit) {
  switch (limit) {
    case ServiceLimit::kNone:
      return "nothing is served from both sides";
    case ServiceLimit::kStrutShortest:
      return "a strut is as short as it may be";
    case ServiceLimit::kStrutLongest:
      return "a strut is as long as it may be";
    case ServiceLimit::kFrame:
      return "the frame's side stands there";
    case ServiceLimit::kTable:
      return "the table ends there";
    case ServiceLimit::kBase:
      return "the platform's joints would rise above the base";
  }
  return "";
}

ServiceRectangle LargestServiceRectangle(const ServiceAreaMachine& machine) {
  Expects(FaultOf(machine).empty(), "LargestServiceRectangle: a machine without fault");
  const Region region(machine);
  constexpr int kGrid = 32;
  const double left = region.axis_mm() - region.half_width_mm();
  double step = 2.0 * region.half_width_mm() / kGrid;
  double from = 0.0, to = 0.0;
  Stretch best;
  const auto try_stretch = [&](double a, double b) {
    const Stretch stretch = b > a ? Over(region, a, b) : Stretch{};
    const bool better = stretch.area_mm2 > best.area_mm2 * (1.0 + 1e-12);
    if (better) {
      best = stretch;
      from = a;
      to = b;
    }
    return better;
  };
  for (int i = 0; i < kGrid; ++i) {
    for (int j = i + 1; j <= kGrid; ++j) {
      try_stretch(left + i * step, left + j * step);
    }
  }
  // The area has ridges where two limits bind at once, so many directions are tried before the step shrinks.
  constexpr int kReach = 2;
  for (; best.area_mm2 > 0.0 && step > 1e-6; step *= 0.5) {
    for (bool improved = true; improved;) {
      improved = false;
      const double a = from, b = to;
      for (int i = -kReach; i <= kReach; ++i) {
        for (int j = -kReach; j <= kReach; ++j) {
          improved = try_stretch(a + i * step / kReach, b + j * step / kReach) || improved;
        }
      }
    }
  }
  if (!(best.area_mm2 > 0.0)) {
    return {};
  }
  return {{from, best.low.y_mm, to, best.high.y_mm},
          {SideBound(region, from, -kOutwardMm, best), SideBound(region, to, kOutwardMm, best),
           best.low.bound, best.high.bound}};
}

}  // namespace lambdajet::kinematics
