// Stands in for both machine modules, as far as the cell can see them: they obey the words of module_words.hpp and echo
// commands. For tests of the cell's own rooms; the real modules are in the system tests.
#pragma once

#include <cstdint>

#include "cell/core/conductor.hpp"

namespace lambdajet::cell {

inline constexpr std::uint64_t kModelSession = 4711;  // of the command writer that the model echoes

class MachineModel {
 public:
  MachineModel() {
    view.drive.emplace();
    view.main_motion.emplace();
    view.drive->session = 1;
    view.main_motion->session = 2;
    view.drive->mode = view.main_motion->mode = ModuleMode::kSafe;
  }

  void Obey(const CommandOut& command, std::int64_t now_ns) {
    if ((command.targets & kDriveTarget) != 0 && !drive_deaf) {
      Obey(*view.drive, command, now_ns);
      if (command.verb == Verb::kHome) {
        view.drive->referenced = true;
      }
      if (command.verb == Verb::kOverride) {
        view.drive->feed_override = command.value;
      }
    }
    if ((command.targets & kMainMotionTarget) != 0) {
      Obey(*view.main_motion, command, now_ns);
    }
  }

  void Advance(std::int64_t now_ns) {
    for (ModuleView* module :
         {static_cast<ModuleView*>(&*view.drive), static_cast<ModuleView*>(&*view.main_motion)}) {
      if (module->mode == ModuleMode::kStopping) {
        module->mode = ModuleMode::kStopped;
      }
      if (module->mode == ModuleMode::kArmed && start_at_ns != 0 && now_ns >= start_at_ns) {
        module->mode = ModuleMode::kRunning;
      }
    }
    if (view.drive->mode == ModuleMode::kRunning) {
      view.drive->s_mm += 1.0;
      view.main_motion->s_mm = view.drive->s_mm;
      if (view.drive->s_mm >= length_mm) {
        view.drive->mode = view.main_motion->mode = ModuleMode::kComplete;
      }
    }
    Speak(*view.drive, drive_silent, now_ns);
    Speak(*view.main_motion, main_motion_silent, now_ns);
  }

  // As if trajectory had filled both buffers.
  void Fill() {
    view.drive->next_segment = 100;
    view.drive->buffered_s = 2.0;
    view.main_motion->next_event = 10;
    view.main_motion->next_gate = 3;
  }

  MachineView view;
  double length_mm = 50.0;
  std::int64_t start_at_ns = 0;
  bool fills = true;  // whether a stand-in for trajectory fills the buffers
  bool drive_deaf = false;
  bool drive_silent = false;
  bool main_motion_silent = false;
  int turns_unheard = 0;  // of a new cell's loop, before it hears anything
  ModuleReason refuse_arm = ModuleReason::kNone;

 private:
  static void Speak(ModuleView& module, bool silent, std::int64_t now_ns) {
    module.heard_ns = silent ? module.heard_ns : now_ns;
    module.quiet_turns = silent ? module.quiet_turns + 1 : 0;
  }
  void Obey(ModuleView& module, const CommandOut& command, std::int64_t) {
    module.echo = {kModelSession, command.sequence_number, 1, ModuleReason::kNone};
    switch (command.verb) {
      case Verb::kHome:
      case Verb::kReset:
        module.mode =
            command.verb == Verb::kReset && !view.drive->referenced ? ModuleMode::kSafe : ModuleMode::kReady;
        module.reason = ModuleReason::kNone;
        break;
      case Verb::kLoad:
        module.plan = command.plan.plan_id;
        module.mode = ModuleMode::kReady;
        view.drive->s_mm = 0.0;
        view.main_motion->s_mm = 0.0;
        start_at_ns = 0;
        break;
      case Verb::kUnload:
        module.plan = 0;
        module.mode = ModuleMode::kReady;
        break;
      case Verb::kArm:
        if (refuse_arm != ModuleReason::kNone) {
          module.echo.answer = 2;
          module.echo.reason = refuse_arm;
        } else {
          module.mode = ModuleMode::kArmed;
        }
        break;
      case Verb::kStart:
        start_at_ns = command.start_at_ns;
        break;
      case Verb::kHold:
        module.mode = ModuleMode::kHeld;
        module.reason = ModuleReason::kCommanded;
        break;
      case Verb::kResume:
        module.mode = ModuleMode::kRunning;
        module.reason = ModuleReason::kNone;
        break;
      case Verb::kStop:
        module.mode = ModuleMode::kStopping;
        module.reason = ModuleReason::kCommanded;
        break;
      default:
        break;
    }
  }
};

}  // namespace lambdajet::cell
