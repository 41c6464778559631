// How much one answer of the trajectory service carries, the same for two sliders and for six struts.
#pragma once

#include <cstddef>

namespace lambdajet::trajectory {

inline constexpr std::size_t kMostSlowStretches = 200;     // in the summary of a plan
inline constexpr std::size_t kBytesPerPiece = 256u << 10;  // of a text that is sent as a stream

}  // namespace lambdajet::trajectory
