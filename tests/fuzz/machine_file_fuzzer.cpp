// Any bytes as a machine file: refused with named violations, or a sound machine that writes and reads back the same.
#include <string>

#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"

using lambdajet::fuzz::Promise;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(bytes), size);
  const auto machine = lambdajet::ParseMachine(text, "fuzz");
  if (!machine.ok()) {
    Promise(!lambdajet::TroubleReason(machine.status()).empty(), "a refusal has a reason");
    return 0;
  }
  Promise(lambdajet::Validate(*machine).empty(), "what has been read is sound");
  const auto again = lambdajet::ParseMachine(lambdajet::MachineText(*machine), "canonical");
  Promise(again.ok(), "canonical text reads back");
  Promise(again->parameters == machine->parameters && again->hash == machine->hash,
          "and is the same machine");
  return 0;
}
