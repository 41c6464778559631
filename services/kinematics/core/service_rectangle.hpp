// Finds the largest rectangle that a machine with a tilted drill serves from both sides, and what binds each of its sides.
//
// Model: ServiceRegion::kIntersection of service_area.hpp. Over a line x the region is one interval: below every strut's
// longest and the table, above every strut's shortest, the base and the frame's sloping wall. Upper bounds are concave in x, so
// over a stretch of x they are lowest at its ends; lower bounds are highest at its ends or under an arc's centre. So the height
// over a stretch is exact, and the stretch is searched: a grid, then a shrinking pattern.
// Frames: as service_area.hpp, y down to the table: `y_min` is the side towards the base. Units: mm.
// Threads: pure. Cost: about 0.2 ms; no allocation.
#pragma once

#include <array>
#include <string_view>

#include "kinematics/core/rectangle.hpp"
#include "kinematics/core/service_area.hpp"

namespace lambdajet::kinematics {

enum class ServiceLimit { kNone, kStrutShortest, kStrutLongest, kFrame, kTable, kBase };
std::string_view ServiceLimitName(ServiceLimit limit);      // UPPER_SNAKE
std::string_view ServiceLimitSentence(ServiceLimit limit);  // for people

struct ServiceBound {
  ServiceLimit limit = ServiceLimit::kNone;
  int joint = 0;      // 1 or 2: the strut on that base joint; 0 where no strut binds
  int tilt_sign = 0;  // +1 or -1: with the drill tilted that way; 0 where no strut binds
};

struct ServiceRectangle {
  Rectangle rectangle;                    // empty where both tilts serve nothing
  std::array<ServiceBound, 4> binding{};  // of its left, right, base's and table's side
};
ServiceRectangle LargestServiceRectangle(const ServiceAreaMachine& machine);

}  // namespace lambdajet::kinematics
