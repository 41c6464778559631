// Stops the process where one of our own contracts is broken.
//
// For bugs only: never for anything that came from outside (a file, a wire, a person); that is an answer or a Status.
// Threads: any. Cost: one predicted branch.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace lambdajet {

// The built-in functions rather than std::source_location: clang 14 has them and cannot use libstdc++'s class.
inline void Expects(bool condition, const char* what, const char* file = __builtin_FILE(),
                    unsigned line = __builtin_LINE(), const char* function = __builtin_FUNCTION()) {
  if (condition) [[likely]] {
    return;
  }
  std::fprintf(stderr, "%s:%u: %s: contract broken: %s\n", file, line, function, what);
  std::abort();
}

}  // namespace lambdajet
