// Converts between the seconds of models and settings and the whole nanoseconds of common time.
// Threads: pure.
#pragma once

#include <cmath>
#include <cstdint>

namespace lambdajet {

inline std::int64_t ToNs(double s) { return static_cast<std::int64_t>(std::llround(1e9 * s)); }
inline double ToSeconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

}  // namespace lambdajet
