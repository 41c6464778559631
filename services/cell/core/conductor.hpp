// Leads both modules through a job: plan, load, fill, arm, start at one instant, follow, complete; and back
// to readiness.
//
// Model: one phase at a time, each with a deadline; a command counts as taken only when the module's state
// echoes it (session, sequence number, answer), is sent again up to three times, and a refusal is named. The
// conductor knows neither wires nor clocks: views of the modules and the time come in, actions come out, in
// order. What was cut for certain is main motion's own path length while it was RUNNING; an interrupted job
// resumes from there. A module or a cell that is lost stops nothing by itself: the modules watch each other.
// The conductor reports it. Units: mm, s; common time in ns. Threads: one at a time. Cost: a step is a few
// comparisons. Errors: wishes that cannot be granted are answered with a Refusal; all else is News about the
// job.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "cell/core/job.hpp"
#include "cell/core/job_state.hpp"
#include "cell/core/machine_view.hpp"

namespace lambdajet::cell {

inline constexpr std::uint32_t kDriveTarget = 1;
inline constexpr std::uint32_t kMainMotionTarget = 2;
inline constexpr std::uint32_t kBothTargets = 3;

inline constexpr double kStartAhead_s = 0.3;
inline constexpr double kFilledEnough_s = 1.0;
inline constexpr double kDefaultOverlap_mm = 3.0;

// What the modules must know of a plan before it is streamed to them.
struct PlanFacts {
  std::uint64_t plan_id = 0;
  std::uint32_t segment_count = 0;
  std::uint32_t gate_count = 0;
  std::uint32_t event_count = 0;
  double duration_s = 0.0;
  double gate_time_s = 0.0;
  double elastic_lag_s2 = 0.0;
  double length_mm = 0.0;
  double predicted_95_mm = 0.0;
  ModelVersion model_version;
};

// Where a plan begins, when it is not the whole program.
struct ResumeFrom {
  double s_mm = 0.0;
  double overlap_mm = kDefaultOverlap_mm;
};

struct Refusal {
  std::string reason;
  std::string message;
};

// --- What the conductor wants done
// -------------------------------------------------------------------------------------

struct CommandOut {
  std::uint64_t sequence_number = 0;
  std::uint32_t targets = 0;
  Verb verb = Verb::kNone;
  PlanFacts plan;
  double value = 0.0;
  std::int64_t start_at_ns = 0;
};

// Plan the job's program under the active machine version.
struct PlanWanted {
  std::string job_id;
  std::optional<ResumeFrom> from;
};

// Make trajectory stream the plan; if it does not know the plan any more, plan again first.
struct StreamingWanted {
  std::string job_id;
  std::uint64_t plan_id = 0;
  std::optional<ResumeFrom> from;
};

struct News {
  std::string job_id;
  Happening happening = Happening::kNoted;
  std::string reason;
  std::string message;
  double s_mm = 0.0;
  std::vector<ProgramFault> faults = {};
  std::optional<PlanFacts> plan = std::nullopt;
};

using Action = std::variant<CommandOut, PlanWanted, StreamingWanted, News>;

// --- What it is told
// ---------------------------------------------------------------------------------------------------

struct PlanOutcome {
  std::string job_id;
  std::optional<PlanFacts> plan;     // made
  std::vector<ProgramFault> faults;  // or refused
  std::string reason;                // or trouble
  std::string message;
};

struct StreamingOutcome {
  std::string job_id;
  std::uint64_t plan_id = 0;
  std::string reason;  // empty: streaming
  std::string message;
  std::optional<PlanFacts> plan = std::nullopt;
};

enum class Phase {
  kIdle,
  kReconciling,
  kPreparing,
  kPlanning,
  kLoading,
  kStreaming,
  kFilling,
  kArming,
  kPositioning,
  kStarting,
  kAwaitingMotion,
  kFollowing,
  kUnloading
};

class Conductor {
 public:
  // `session`: of the command writer, as the modules will echo it.
  explicit Conductor(std::uint64_t session) : session_(session) {}

  // A READY job from its beginning, or an INTERRUPTED one from what was cut.
  std::optional<Refusal> Start(const Job& job, double overlap_mm, const MachineView& machine,
                               std::int64_t now_ns);
  std::optional<Refusal> Hold(const MachineView& machine, std::int64_t now_ns);
  std::optional<Refusal> Resume(const MachineView& machine, std::int64_t now_ns);
  std::optional<Refusal> Override(double factor, const MachineView& machine, std::int64_t now_ns);
  // Never refused.
  void Stop(std::int64_t now_ns);
  std::optional<Refusal> Reset(const MachineView& machine, std::int64_t now_ns);

  // After the cell's own restart: finds out what became of a job that held the machine.
  void Reconcile(const Job& job, std::int64_t now_ns);
  // A job that is given up is no longer listened for.
  void Forget(const std::string& job_id);

  void Step(const MachineView& machine, std::int64_t now_ns);
  void Take(const PlanOutcome& outcome, std::int64_t now_ns);
  void Take(const StreamingOutcome& outcome, std::int64_t now_ns);
  std::vector<Action> TakeActions();

  Phase phase() const { return phase_; }
  bool busy() const { return phase_ != Phase::kIdle; }
  const std::string& job_id() const { return job_id_; }  // the job it leads; empty: none
  double s_mm() const { return s_mm_; }
  const std::optional<Refusal>& reset_trouble() const { return reset_trouble_; }
  // The last HOLD, RESUME or OVERRIDE; empty while it is not answered or has been taken.
  const std::optional<Refusal>& operator_trouble() const { return operator_trouble_; }
  bool operator_command_pending() const { return Waiting(kDriveTarget); }

 private:
  struct Pending {
    CommandOut command;
    bool waiting = false;
    bool refused = false;
    ModuleReason reason = ModuleReason::kNone;
    std::int64_t sent_ns = 0;
    int sent = 0;
  };

  void Enter(Phase phase, std::int64_t now_ns, double deadline_s);
  bool Late(std::int64_t now_ns) const { return now_ns > deadline_ns_; }
  void Tell(Happening happening, std::string reason = "", std::string message = "");

  void Send(std::uint32_t targets, Verb verb, std::int64_t now_ns, double value = 0.0,
            std::int64_t start_at_ns = 0);
  void Transmit(Pending& pending, std::int64_t now_ns);
  void HearEcho(Pending& pending, const ModuleView* module, std::int64_t now_ns);
  bool Waiting(std::uint32_t targets) const;
  std::optional<Refusal> CommandTrouble(std::uint32_t targets) const;

  void StepReconciling(const MachineView& machine, std::int64_t now_ns);
  void StepPreparing(const MachineView& machine, std::int64_t now_ns);
  bool Prepare(const ModuleView& module, bool referenced, std::uint32_t target, std::int64_t now_ns);
  void EndPreparing(std::optional<Refusal> trouble, std::int64_t now_ns);
  void StepStart(const MachineView& machine, std::int64_t now_ns);
  void StepFilling(const MachineView& machine, std::int64_t now_ns);
  void StepPositioning(const MachineView& machine, std::int64_t now_ns);
  void StepAwaitingMotion(const MachineView& machine, std::int64_t now_ns);
  void Follow(const MachineView& machine, std::int64_t now_ns);
  void FollowDriveMode(const DriveView& drive, const MainMotionView& main_motion, std::int64_t now_ns);
  void ResumeAfterLinkLoss(const DriveView& drive, std::int64_t now_ns);
  void KeepStreaming(const DriveView& drive, std::int64_t now_ns);
  std::optional<Refusal> Loss(const MachineView& machine, std::int64_t now_ns) const;
  std::optional<Refusal> ModuleFell(const ModuleView& module, const char* name, std::uint64_t session) const;
  bool HasPlan(const MachineView& machine, std::int64_t now_ns) const;
  void ListenAgain(const MachineView& machine, std::int64_t now_ns);
  void BeginFollowing(const MachineView& machine, std::int64_t now_ns);
  void Complete(std::int64_t now_ns);
  void GiveUpStart(const Refusal& why, std::int64_t now_ns);
  void Interrupt(const Refusal& why);
  void ConfirmCut(const MachineView& machine);

  std::uint64_t session_;
  std::uint64_t sequence_number_ = 0;
  std::array<Pending, 2> pending_;
  std::vector<Action> actions_;

  Phase phase_ = Phase::kIdle;
  std::int64_t entered_ns_ = 0;
  std::int64_t deadline_ns_ = 0;

  std::string job_id_;
  JobState job_state_ = JobState::kReady;  // as told so far
  std::string stand_reason_;
  PlanFacts plan_;
  std::optional<ResumeFrom> from_;
  double s_mm_ = 0.0;
  bool moved_ = false;  // START was sent: a start that fails is an interruption
  std::uint64_t drive_session_ = 0;
  std::uint64_t main_motion_session_ = 0;
  bool resetting_ = false;
  int preparing_commands_ = 0;
  bool streaming_asked_ = false;
  std::int64_t next_streaming_ns_ = 0;
  std::string streaming_reason_;
  std::int64_t drive_complete_ns_ = 0;
  std::int64_t link_held_ns_ = 0;
  int link_resumes_ = 0;
  bool operator_command_ = false;
  std::optional<Refusal> reset_trouble_;
  std::optional<Refusal> operator_trouble_;
};

}  // namespace lambdajet::cell
