// Describes a job: one part program that the machine runs once, from its submission to its end.
//
// Model: ISA-95 job order in the machine's words. What a client asked never changes (JobOrder); what became
// of it does (JobProgress), one journal record a change. Units: mm, s; times are common time in ns, 0 not
// yet. s_mm counts the program's own path length, also after a resume. Threads: values.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lambdajet::cell {

enum class JobState : std::uint32_t {
  kAdmitting = 1,
  kRefused,
  kReady,
  kStarting,
  kRunning,
  kHeld,
  kInterrupted,
  kCompleted,
  kCancelled,
  kFailed
};
inline constexpr std::uint32_t kJobStateCount = 10;

// UPPER_SNAKE, as on every wire.
std::string_view Name(JobState state);

struct ProgramFault {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  std::string reason;
  std::string message;
  friend bool operator==(const ProgramFault&, const ProgramFault&) = default;
};

struct ModelVersion {
  std::string machine_id;
  std::uint32_t version = 0;
  std::string hash;
  friend bool operator==(const ModelVersion&, const ModelVersion&) = default;
};

// As on the wire: what a program is written in.
enum class ProgramFormat : std::uint32_t { kByContent = 0, kGcode, kCldata, kDxf, kFlatGcode };

// What a client asked.
struct JobOrder {
  std::string job_id;
  std::string request_id;
  std::string name;
  std::string program_sha256;
  std::string content_sha256;  // of everything asked: tells a repeated wish from a reused request id
  bool compensate = false;
  double feed_scale = 1.0;
  bool pins_version = false;  // only with this machine version:
  std::uint32_t machine_version = 0;
  std::int64_t submitted_ns = 0;
  ProgramFormat program_format = ProgramFormat::kByContent;
  std::string toolpath;  // of a drawing: the request's settings, as the wire writes them
};

// What became of it.
struct JobProgress {
  JobState state = JobState::kAdmitting;
  std::string reason;
  std::string message;
  std::vector<ProgramFault> faults;
  ModelVersion model_version;
  std::uint64_t plan_id = 0;
  std::vector<std::uint64_t> plan_ids;
  double s_mm = 0.0;
  double length_mm = 0.0;
  double expected_duration_s = 0.0;
  double predicted_95_mm = 0.0;
  std::int64_t started_ns = 0;
  std::int64_t ended_ns = 0;
  std::uint32_t interruptions = 0;
};

struct Job {
  JobOrder order;
  JobProgress progress;
};

// One thing that happened to a job, as the journal keeps it.
struct JournalRecord {
  std::uint64_t token = 0;  // position in the journal, from 1
  std::int64_t time_ns = 0;
  Job job;  // afterwards
};

// Done with for good, one way or another.
bool HasEnded(JobState state);
// Holds the machine: no other job may start.
bool HoldsMachine(JobState state);

}  // namespace lambdajet::cell
