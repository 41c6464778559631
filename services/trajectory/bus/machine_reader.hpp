// Keeps the machine descriptions that calibration has published: the active one, and the few before it.
//
// Model: calibration/machine_description carries the machine file's text; parameters and covariance beside it take the
// place of the text's own. One that cannot be read or fails Validate() is refused, logged, and the one before stays.
// Threads: samples come on the bus's thread; the questions from any. Errors: those of platform/bus.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "absl/status/statusor.h"
#include "foundation/machine/machine_description.hpp"

namespace lambdajet {
class Log;
class Participant;
}  // namespace lambdajet

namespace lambdajet::trajectory {

class MachineReader {
 public:
  static constexpr std::size_t kKept = 8;

  // `on_first` is called once, when the first description has come.
  static absl::StatusOr<std::unique_ptr<MachineReader>> Open(Participant& bus, Log& log,
                                                             std::function<void()> on_first);
  ~MachineReader();

  std::shared_ptr<const MachineDescription> active() const;                        // null: none yet
  std::shared_ptr<const MachineDescription> Version(std::uint32_t version) const;  // null: not held
  std::shared_ptr<const MachineDescription> Find(std::optional<std::uint32_t> version) const {
    return version ? Version(*version) : active();
  }

 private:
  struct Link;
  MachineReader();
  void Take(std::shared_ptr<const MachineDescription> machine);

  mutable std::mutex mutex_;
  std::deque<std::shared_ptr<const MachineDescription>> held_;  // the active one last
  std::unique_ptr<Link> link_;
};

}  // namespace lambdajet::trajectory
