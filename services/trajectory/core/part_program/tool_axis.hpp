// Translates between the tool's axis as CLDATA writes it, (i, j, k), and the rotary words A and B.
//
// Model: a machine with a rotary head means (i, j, k) = Rx(a) Ry(b) z with b within a right angle; a hexapod means roll and
// pitch about the fixed axes, (i, j, k) = Ry(b) Rx(a) z with a within a right angle. C is 0 in both: an axis says nothing about
// the turn about itself. Where only one of A and B is other than 0 the two agree.
// Frames: W. Units: rad. Threads: pure.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace lambdajet::trajectory {

enum class ToolAngles : std::uint8_t { kRotaryHead, kRollPitch };

using ToolAxis = std::array<double, 3>;  // of length 1, from the tip to the spindle

struct HeadAngles {
  double a_rad = 0.0;
  double b_rad = 0.0;
};

inline ToolAxis AxisOf(ToolAngles meaning, const HeadAngles& h) {
  const double sa = std::sin(h.a_rad), ca = std::cos(h.a_rad), sb = std::sin(h.b_rad), cb = std::cos(h.b_rad);
  return meaning == ToolAngles::kRotaryHead ? ToolAxis{sb, -sa * cb, ca * cb}
                                            : ToolAxis{sb * ca, -sa, cb * ca};
}

inline HeadAngles AnglesOf(ToolAngles meaning, const ToolAxis& axis) {
  const auto [i, j, k] = axis;
  return meaning == ToolAngles::kRotaryHead ? HeadAngles{std::atan2(-j, k), std::atan2(i, std::hypot(j, k))}
                                            : HeadAngles{std::atan2(-j, std::hypot(i, k)), std::atan2(i, k)};
}

}  // namespace lambdajet::trajectory
