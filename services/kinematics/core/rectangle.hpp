// Holds a rectangle with sides along the axes. Units: mm. Threads: values.
#pragma once

namespace lambdajet::kinematics {

struct Rectangle {
  double x_min_mm = 0.0;
  double y_min_mm = 0.0;
  double x_max_mm = 0.0;
  double y_max_mm = 0.0;
  double area_mm2() const { return (x_max_mm - x_min_mm) * (y_max_mm - y_min_mm); }
};

}  // namespace lambdajet::kinematics
