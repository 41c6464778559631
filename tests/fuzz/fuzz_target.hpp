// The one function that libFuzzer and the replay both call: takes any bytes, aborts on a broken promise.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);

namespace lambdajet::fuzz {

// What must hold for every input; the input that breaks it is kept by libFuzzer or named by the replay.
inline void Promise(bool holds, const char* what) {
  if (!holds) {
    std::fprintf(stderr, "broken promise: %s\n", what);
    std::abort();
  }
}

}  // namespace lambdajet::fuzz
