// Arcs and helices in the three planes, by centre or by radius.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "trajectory/core/part_program/gcode_reading.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kFull = 2.0 * std::numbers::pi;
constexpr double kNoLength_mm = 1e-9;
constexpr double kMostTurns = 1000.0;
constexpr std::array<char, 3> kCenterLetters = {'I', 'J', 'K'};

// A plane's two axes in the sense of its rotation, and its normal.
struct PlaneAxes {
  std::size_t u, v, normal;
};

PlaneAxes AxesOf(ArcPlane plane) {
  switch (plane) {
    case ArcPlane::kZx:
      return {2, 0, 1};
    case ArcPlane::kYz:
      return {1, 2, 0};
    default:
      return {0, 1, 2};
  }
}

struct Flat {
  double u = 0.0, v = 0.0;  // mm
};

class ArcMotion {
 public:
  ArcMotion(Reading& r, double turn) : r_(r), turn_(turn), axes_(AxesOf(r.state.plane)) {}

  bool Obey() {
    if (!HasFeed(r_)) {
      return false;
    }
    if (r_.block.has(CenterLetter(axes_.normal))) {
      return r_.FaultAt(CenterLetter(axes_.normal), "ARC_WORD_NOT_OF_PLANE",
                        "the centre is given by I and J in G17, I and K in G18, J and K in G19");
    }
    const bool by_center = r_.block.has(CenterLetter(axes_.u)) || r_.block.has(CenterLetter(axes_.v));
    if (by_center == r_.block.has('R')) {
      return r_.FaultAtMotion(by_center ? "ARC_CENTER_AND_RADIUS" : "ARC_CENTER_MISSING",
                              "an arc needs its centre by I, J, K, or R");
    }
    if (r_.block.has('P')) {
      turns_ = r_.block.Take('P');
      if (!(turns_ >= 1.0 && turns_ <= kMostTurns) || turns_ != std::floor(turns_)) {
        return r_.FaultAt('P', "ARC_TURNS_OUT_OF_RANGE", "P of an arc is a whole number of turns, 1 … 1000");
      }
    }
    begin_ = InPlane(r_.state.position);
    const AxisValues end = Target(r_);
    return by_center ? ByCenter(end) : ByRadius(end);
  }

 private:
  static char CenterLetter(std::size_t axis) { return kCenterLetters[axis]; }
  Flat InPlane(const AxisValues& p) const { return {p[axes_.u], p[axes_.v]}; }

  bool ByCenter(const AxisValues& target) {
    const char first = CenterLetter(axes_.u), second = CenterLetter(axes_.v);
    const bool absolute = r_.state.arc_absolute;
    if (absolute && !(r_.block.has(first) && r_.block.has(second))) {
      return r_.FaultAtMotion("ARC_CENTER_MISSING", "with G90.1 an arc needs both words of its centre");
    }
    Flat center = absolute ? InPlane(r_.state.zero) : begin_;
    center.u += r_.block.has(first) ? r_.mm(r_.block.Take(first)) : 0.0;
    center.v += r_.block.has(second) ? r_.mm(r_.block.Take(second)) : 0.0;
    const Flat end = InPlane(target);
    const double radius_begin = std::hypot(begin_.u - center.u, begin_.v - center.v);
    const double radius_end = std::hypot(end.u - center.u, end.v - center.v);
    if (!(radius_begin > kNoLength_mm) || !(radius_end > kNoLength_mm)) {
      return r_.FaultAtMotion("ARC_RADIUS_ZERO", "the centre lies on the path");
    }
    // LinuxCNC's rule: a difference may be small of its own, or small beside the radius, but never large.
    const double allowed =
        std::min(std::max(r_.options.arc_radius_tolerance_mm,
                          r_.options.arc_radius_tolerance_ratio * std::max(radius_begin, radius_end)),
                 r_.options.arc_radius_largest_difference_mm);
    if (std::abs(radius_begin - radius_end) > allowed) {
      return r_.FaultAtMotion("ARC_RADIUS_DIFFERS", "radius at the start " + ShortNumber(radius_begin) +
                                                        " mm, at the end " + ShortNumber(radius_end) +
                                                        " mm; they must agree to " + ShortNumber(allowed) +
                                                        " mm");
    }
    AddArc(target, Between(center, end));
    return true;
  }

  // The centre moved onto the bisector of the chord, so that start and end lie on one circle.
  Flat Between(Flat center, Flat end) const {
    const double du = end.u - begin_.u, dv = end.v - begin_.v;
    const double chord2 = du * du + dv * dv;
    if (chord2 < 1e-12) {
      return center;
    }
    const double along =
        ((center.u - 0.5 * (begin_.u + end.u)) * du + (center.v - 0.5 * (begin_.v + end.v)) * dv) / chord2;
    return {center.u - along * du, center.v - along * dv};
  }

  // R > 0: the shorter of the two arcs, R < 0: the longer.
  bool ByRadius(const AxisValues& target) {
    const double radius = r_.mm(r_.block.Take('R'));
    const Flat end = InPlane(target);
    const double du = end.u - begin_.u, dv = end.v - begin_.v;
    const double half = 0.5 * std::hypot(du, dv);
    if (half < kNoLength_mm) {
      return r_.FaultAt('R', "ARC_RADIUS_FULL_CIRCLE", "R cannot describe a full circle; use I and J");
    }
    double height2 = radius * radius - half * half;
    if (height2 < 0.0) {
      if (half - std::abs(radius) > r_.options.arc_radius_tolerance_mm) {
        return r_.FaultAt(
            'R', "ARC_RADIUS_TOO_SMALL",
            "R is " + ShortNumber(std::abs(radius)) + " mm, half the chord " + ShortNumber(half) + " mm");
      }
      height2 = 0.0;
    }
    const double side = (radius > 0.0 ? turn_ : -turn_) * std::sqrt(height2) / (2.0 * half);
    AddArc(target, {0.5 * (begin_.u + end.u) - side * dv, 0.5 * (begin_.v + end.v) + side * du});
    return true;
  }

  void AddArc(const AxisValues& target, Flat center) {
    const AxisValues begin = r_.state.position;
    const Flat end = InPlane(target);
    const double from = std::atan2(begin_.v - center.v, begin_.u - center.u);
    const double to = std::atan2(end.v - center.v, end.u - center.u);
    double sweep = turn_ * (to - from);
    while (sweep <= 1e-12) {
      sweep += kFull;
    }
    sweep += kFull * (turns_ - 1.0);
    Operation& o = r_.Move(OperationKind::kFeedArc, target);
    std::array<double, 3> c = {begin[0], begin[1], begin[2]};
    c[axes_.u] = center.u;
    c[axes_.v] = center.v;
    o.plane = r_.state.plane;
    o.center_x_W_mm = c[0];
    o.center_y_W_mm = c[1];
    o.center_z_W_mm = c[2];
    o.sweep_rad = turn_ * sweep;
    const double around = sweep * std::hypot(begin_.u - center.u, begin_.v - center.v);
    SetPace(r_, o, std::hypot(around, target[axes_.normal] - begin[axes_.normal]), 0.0);
  }

  Reading& r_;
  double turn_;
  double turns_ = 1.0;
  PlaneAxes axes_;
  Flat begin_;
};

}  // namespace

bool ObeyArc(Reading& r, double turn) { return ArcMotion(r, turn).Obey(); }

}  // namespace lambdajet::trajectory
