// Prints a measured number under a name that does not change, for tests/long/trajectory_numbers to find beside the prose.
#pragma once

#include <cstdio>

namespace lambdajet::tests {

inline void PrintFigure(const char* name, double value) {
  std::printf("figure %s %.12g\n", name, value);
  std::fflush(stdout);
}

}  // namespace lambdajet::tests
