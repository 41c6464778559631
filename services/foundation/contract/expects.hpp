// Stops the process where one of our own contracts is broken.
//
// For bugs only: never for anything that came from outside (a file, a wire, a person); that is an answer or a Status.
// Threads: any. Cost: one predicted branch.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <source_location>

namespace lambdajet {

inline void Expects(bool condition, const char* what,
                    std::source_location where = std::source_location::current()) {
  if (condition) [[likely]] {
    return;
  }
  std::fprintf(stderr, "%s:%u: %s: contract broken: %s\n", where.file_name(), where.line(), where.function_name(),
               what);
  std::abort();
}

}  // namespace lambdajet
