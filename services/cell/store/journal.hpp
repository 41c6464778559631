// Keeps every job and everything that happened to it in one SQLite file that survives a kill at any moment.
//
// Model: a change is one transaction in synchronous FULL: it is on the disk when the call returns, or it never was. Records
// are numbered from 1 without gaps; the number is the token that watchers resume with. A request id belongs to one job for
// ever. Programs are kept with their job; records of a job's run are appended in chunks.
// Units: as core/job.hpp. Threads: one at a time.
// Errors: those of platform/store/database.hpp (DISK_FULL, DATABASE_DAMAGED, …); NOT_FOUND JOB_UNKNOWN.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "cell/core/job.hpp"
#include "cell/core/report.hpp"

namespace lambdajet {
class Database;
}

namespace lambdajet::cell {

class Journal {
 public:
  static absl::StatusOr<std::unique_ptr<Journal>> Open(const std::string& path);
  ~Journal();

  // A new job with its first record. The request id must be new: ask FindRequest() first.
  absl::StatusOr<JournalRecord> Add(const Job& job, std::string_view program, std::int64_t now_ns);
  // What became of a job: its state from now on, and a record of it.
  absl::StatusOr<JournalRecord> Append(const Job& job, std::int64_t now_ns);
  // Between changes: how far it is, and a further part of its record. No record is made.
  absl::Status Checkpoint(const std::string& job_id, double s_mm, const JobRecord& further);

  absl::StatusOr<Job> Find(const std::string& job_id);
  absl::StatusOr<std::optional<Job>> FindRequest(const std::string& request_id);
  absl::StatusOr<std::string> Program(const std::string& job_id);
  absl::StatusOr<JobRecord> Record(const std::string& job_id);
  // Newest first; jobs older than `before` (0: all), in `state` only if given.
  absl::StatusOr<std::vector<Job>> List(std::int64_t before, std::optional<JobState> state, int most,
                                        std::int64_t& last);
  // Jobs that have not ended.
  absl::StatusOr<std::vector<Job>> Unfinished();
  // Records after a token, oldest first; of one job only if `job_id` is not empty.
  absl::StatusOr<std::vector<JournalRecord>> Since(std::uint64_t token, const std::string& job_id, int most);
  absl::StatusOr<std::uint64_t> LastToken();

 private:
  explicit Journal(std::unique_ptr<Database> database);
  std::unique_ptr<Database> database_;
};

}  // namespace lambdajet::cell
