// Any bytes as a request about a hexapod: a status with a reason, or an answer without NaN or infinity.
//
// The first byte chooses the question (hexapod_questions.hpp); the rest is the request.
#include <string>

#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/hexapod_questions.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size > 0) {
    lambdajet::fuzz::AskHexapod(bytes[0] % lambdajet::fuzz::kHexapodQuestions,
                                std::string(reinterpret_cast<const char*>(bytes + 1), size - 1));
  }
  return 0;
}
