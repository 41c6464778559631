// Takes the commands that are meant for a module, each once, and writes the receipt that the module's state carries.
//
// Model: commands for others, old and repeated ones, and those of a second writer are passed over. One that was made too long
// ago is refused with STALE_COMMAND; a stop is obeyed however old it is. Units: common time in ns. Threads: one.
#pragma once

#include <cstdint>

#include "foundation/motion/link_samples.hpp"
#include "foundation/motion/sequence_guard.hpp"

namespace lambdajet {

class CommandReceiver {
 public:
  CommandReceiver(std::uint32_t target, std::int64_t longest_age_ns)
      : target_(target), longest_age_ns_(longest_age_ns) {}

  // `obey` answers a command with the reason of its refusal; kNone: done.
  template <typename Obey>
  void Take(const ModuleCommand& command, std::int64_t now_ns, CommandReceipt& receipt, const Obey& obey) {
    if ((command.target & target_) == 0) {
      return;
    }
    const SampleVerdict verdict = guard_.Judge(command.header);
    if (verdict == SampleVerdict::kOld || verdict == SampleVerdict::kTwoWriters) {
      return;
    }
    const bool stale = now_ns - command.header.time_ns > longest_age_ns_ && command.verb != Verb::kStop;
    const ModuleReason refusal = stale ? ModuleReason::kStaleCommand : obey(command);
    const bool done = refusal == ModuleReason::kNone;
    receipt = {command.header.session, command.header.sequence_number,
               done ? CommandAnswer::kDone : CommandAnswer::kRefused, refusal};
  }

  std::uint32_t dropped() const { return guard_.dropped(); }

 private:
  std::uint32_t target_;
  std::int64_t longest_age_ns_;
  SequenceGuard guard_;
};

}  // namespace lambdajet
