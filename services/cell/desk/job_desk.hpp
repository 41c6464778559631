// Is where clients, journal, conductor and planner meet: takes wishes, leads the machine, writes down what happens.
//
// Model: one lock around the journal, the conductor and what was heard of the machine. Clients' calls and the loop's
// cycle take turns; nothing waits inside the lock but the disk. A change exists when the journal has it; then watchers
// are woken. Calls that wait for the machine (Start, Hold, Override, Reset) wait outside the lock, up to their patience, and
// then answer what is known. Planning is asked for as tasks in two queues, so that admitting a long program never delays
// the streaming of the one being cut.
// Units: mm, s. Threads: any, except Cycle(): the loop. Errors: Trouble with the reasons in services/cell/README.md.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "cell/core/conductor.hpp"
#include "cell/core/recorder.hpp"
#include "cell/store/journal.hpp"
#include "platform/process/common_clock.hpp"

namespace lambdajet::cell {

// What a client submits, checked by the door; content_sha256 is over all of it but the request id and the name.
struct Submission {
  std::string request_id;
  std::string name;
  std::string program;
  std::string program_sha256;
  std::string content_sha256;
  bool compensate = false;
  double feed_scale = 1.0;
  std::optional<std::uint32_t> machine_version;
  ProgramFormat program_format = ProgramFormat::kByContent;
  std::string toolpath;  // as in JobOrder
};

// A job with what is known of it at this moment.
struct LiveJob {
  Job job;
  double feed_mm_per_s = 0.0;
};

struct NodeWord {
  std::string name;
  std::string mode;
  std::string reason;
  double age_s = 0.0;
};

struct MachineWord {
  std::vector<NodeWord> nodes;
  std::vector<std::string> vetoes;
  ModelVersion model_version;
  std::string job_id;
};

// Work for the planner.
struct AdmissionTask {
  JobOrder order;
  std::string program;
};
struct MachineTask {
  JobOrder order;
  std::string program;
  std::uint64_t plan_id = 0;  // stream this one; 0: plan
  std::optional<ResumeFrom> from;
};

// What the planner found out about a program.
struct Admission {
  enum class Verdict { kAdmitted, kRefused, kFailed, kTryAgain };
  Verdict verdict = Verdict::kTryAgain;
  std::optional<PlanFacts> plan;
  std::vector<ProgramFault> faults;
  std::string reason;
  std::string message;
};

// Numbers this run of the process on the bus.
std::uint64_t NewSession();

class JobDesk {
 public:
  // Opens the journal and takes up what it holds.
  static absl::StatusOr<std::unique_ptr<JobDesk>> Open(const std::string& path, const Clock& clock,
                                                       std::uint64_t session);

  // `session` numbers the commands' writer. The journal is taken over; the clock outlives the desk.
  JobDesk(std::unique_ptr<Journal> journal, const Clock& clock, std::uint64_t session);

  // Takes up what the journal holds: unfinished admissions, a job that held the machine.
  absl::Status TakeUp();
  // Wakes everyone who waits, for the end of the process.
  void Close();

  // --- clients ---
  absl::StatusOr<LiveJob> Submit(const Submission& submission, double patience_s);
  absl::StatusOr<LiveJob> Start(const std::string& job_id, double patience_s);
  absl::StatusOr<LiveJob> Hold(const std::string& job_id, double patience_s);
  absl::StatusOr<LiveJob> Resume(const std::string& job_id, double overlap_mm, double patience_s);
  absl::StatusOr<std::optional<LiveJob>> Stop(const std::string& job_id);
  absl::StatusOr<LiveJob> Cancel(const std::string& job_id);
  absl::StatusOr<double> Override(double factor, double patience_s);
  absl::StatusOr<MachineWord> Reset(double patience_s);
  absl::StatusOr<LiveJob> Find(const std::string& job_id);
  absl::StatusOr<std::vector<LiveJob>> List(std::int64_t before, std::optional<JobState> state, int most,
                                            std::int64_t& last);
  absl::StatusOr<std::vector<JournalRecord>> Since(std::uint64_t token, const std::string& job_id, int most);
  std::uint64_t last_token();
  absl::StatusOr<JobRecord> Record(const std::string& job_id);
  MachineWord Machine();

  // --- the machine ---
  void Hear(const DriveView& drive);
  void Hear(const MainMotionView& main_motion);
  void Hear(std::uint64_t plan_id, const EventDeviation& event);
  void HearModel(const ModelVersion& version);
  void HearService(const std::string& name, bool serving, const std::string& reason);
  struct Outgoing {
    std::vector<CommandOut> commands;
    std::vector<JournalRecord> records;
  };
  Outgoing Cycle();

  // --- the planner; each waits until there is work, nothing at Close() ---
  std::optional<AdmissionTask> NextAdmission();
  std::optional<MachineTask> NextMachineTask();
  void Admitted(const std::string& job_id, const Admission& admission);
  void Answer(const PlanOutcome& outcome);
  void Answer(const StreamingOutcome& outcome);

 private:
  using Lock = std::unique_lock<std::mutex>;

  absl::StatusOr<Job> Current(const std::string& job_id);
  LiveJob Live(const Job& job) const;
  absl::Status Change(Job job, Happening happening, const News& news);
  absl::Status Change(const News& news);
  void Carry(std::vector<Action> actions);
  absl::Status WriteDown(const Job& job);
  std::vector<Veto> Vetoes() const;
  MachineWord MachineNow() const;
  absl::Status CheckMayStart(const Job& job);
  template <typename Condition>
  bool WaitFor(Lock& lock, double patience_s, Condition&& condition);
  void WaitUntilUnloaded(Lock& lock, double patience_s);
  void WaitUntilListened(Lock& lock, double patience_s);
  absl::StatusOr<LiveJob> WaitUntilStarted(Lock& lock, const std::string& job_id, double patience_s);
  void CheckpointIfDue(std::int64_t now_ns);
  void WriteDownAgainIfDue(std::int64_t now_ns);

  std::unique_ptr<Journal> journal_;
  const Clock& clock_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool closed_ = false;

  Conductor conductor_;
  MachineView machine_;
  int turns_ = 0;  // of the loop
  Recorder recorder_;
  std::optional<Job> active_;  // the job the conductor leads or last led
  std::optional<ModelVersion> model_version_;
  std::vector<NodeWord> services_;
  std::vector<CommandOut> commands_;
  std::vector<JournalRecord> records_;
  std::deque<std::string> admissions_;
  std::deque<MachineTask> machine_tasks_;
  std::uint64_t last_token_ = 0;
  std::int64_t next_checkpoint_ns_ = 0;
  std::int64_t next_writing_ns_ = 0;
  std::string journal_trouble_;
};

}  // namespace lambdajet::cell
