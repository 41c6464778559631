#include "cell/core/machine_view.hpp"

#include <cmath>
#include <cstdio>

namespace lambdajet::cell {
namespace {

std::string Milliseconds(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f ms", seconds * 1e3);
  return text;
}

std::string WhatToDo(ModuleMode mode) {
  switch (mode) {
    case ModuleMode::kSafe:
    case ModuleMode::kStopped:
    case ModuleMode::kFault:
      return "find the cause, then reset the machine";
    case ModuleMode::kOff:
    case ModuleMode::kInitialising:
      return "wait until it is READY";
    default:
      return "finish or stop what it plays, then reset the machine";
  }
}

void AddModule(const char* name, const char* lost, const ModuleView* module, std::int64_t now_ns,
               std::vector<Veto>& vetoes) {
  const std::string who(name);
  if (module == nullptr || !Heard(*module, now_ns)) {
    vetoes.push_back({lost, who + " is not heard; start it, or look at the link"});
    return;
  }
  if (module->mode != ModuleMode::kReady) {
    const bool told = module->reason != ModuleReason::kNone;
    const std::string reason = told ? std::string(Name(module->reason)) : "NOT_READY";
    vetoes.push_back(
        {reason, who + " is " + std::string(Name(module->mode)) + "; " + WhatToDo(module->mode)});
  }
  if (std::abs(module->clock_offset_s) > kLargestClockOffset_s) {
    vetoes.push_back({"CLOCK_OFFSET", who + " measures a clock offset of " +
                                          Milliseconds(module->clock_offset_s) + "; up to " +
                                          Milliseconds(kLargestClockOffset_s) + " is right"});
  }
}

}  // namespace

bool Heard(const ModuleView& module, std::int64_t now_ns) {
  return SecondsBetween(module.heard_ns, now_ns) <= kSilence_s || module.quiet_turns < kSilentTurns;
}

bool DriveHeard(const MachineView& machine, std::int64_t now_ns) {
  return machine.drive.has_value() && Heard(*machine.drive, now_ns);
}

bool MainMotionHeard(const MachineView& machine, std::int64_t now_ns) {
  return machine.main_motion.has_value() && Heard(*machine.main_motion, now_ns);
}

std::vector<Veto> StartVetoes(const MachineView& machine, std::int64_t now_ns) {
  std::vector<Veto> vetoes;
  AddModule("drive", "DRIVE_LOST", machine.drive ? &*machine.drive : nullptr, now_ns, vetoes);
  AddModule("main_motion", "MAIN_MOTION_LOST", machine.main_motion ? &*machine.main_motion : nullptr, now_ns,
            vetoes);
  if (DriveHeard(machine, now_ns) && !machine.drive->referenced) {
    vetoes.push_back(
        {"NOT_REFERENCED", "drive does not know where its sliders are; reset the machine to home them"});
  }
  return vetoes;
}

}  // namespace lambdajet::cell
