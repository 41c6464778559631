#include "foundation/motion/module_words.hpp"

#include <array>
#include <cstddef>

namespace lambdajet {
namespace {

constexpr std::array<std::string_view, 13> kModes = {
    "OFF",  "INITIALISING", "SAFE",     "READY",    "ARMED",   "RUNNING", "HOLDING",
    "HELD", "RESUMING",     "COMPLETE", "STOPPING", "STOPPED", "FAULT"};
constexpr std::array<std::string_view, 13> kVerbs = {"NONE",   "LOAD",    "ARM",      "START", "HOLD",
                                                     "RESUME", "RETRACE", "OVERRIDE", "STOP",  "RESET",
                                                     "HOME",   "UNLOAD",  "JOG"};
constexpr std::array<std::string_view, 21> kReasons = {"NONE",
                                                       "COMMANDED",
                                                       "PEER_LOST",
                                                       "PEER_STOPPED",
                                                       "STARVED",
                                                       "RESTARTED",
                                                       "NOT_REFERENCED",
                                                       "WRONG_MODE",
                                                       "WRONG_PLAN",
                                                       "FOLLOWING_ERROR",
                                                       "ACTUATOR_LIMIT",
                                                       "OVERRUNS",
                                                       "CLOCK_OFFSET",
                                                       "TWO_WRITERS",
                                                       "PRESSURE_LOST",
                                                       "SENSOR_FAULT",
                                                       "NO_MACHINE_DESCRIPTION",
                                                       "GATE_TIMEOUT",
                                                       "STALE_COMMAND",
                                                       "INPUT_TIMEOUT",
                                                       "JET_NOT_CLOSED"};

template <std::size_t N>
std::string_view At(const std::array<std::string_view, N>& names, std::uint32_t index) {
  return index < N ? names[index] : std::string_view("UNKNOWN");
}

}  // namespace

bool IsDown(ModuleMode mode) {
  using enum ModuleMode;
  return mode == kOff || mode == kInitialising || mode == kSafe || mode == kStopping || mode == kStopped ||
         mode == kFault;
}

std::string_view Name(ModuleMode mode) { return At(kModes, static_cast<std::uint32_t>(mode)); }
std::string_view Name(Verb verb) { return At(kVerbs, static_cast<std::uint32_t>(verb)); }
std::string_view Name(ModuleReason reason) { return At(kReasons, static_cast<std::uint32_t>(reason)); }

}  // namespace lambdajet
