#include "cell/store/journal.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstring>
#include <type_traits>
#include <utility>

#include "foundation/contract/trouble.hpp"
#include "platform/store/database.hpp"

namespace lambdajet::cell {
namespace {

// A record repeats what changes of its job; `changing` is JobProgress without state and place, as one text.
constexpr char kSchema[] = R"sql(
CREATE TABLE jobs (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  job_id TEXT NOT NULL UNIQUE,
  request_id TEXT NOT NULL UNIQUE,
  name TEXT NOT NULL,
  program BLOB NOT NULL,
  program_sha256 TEXT NOT NULL,
  content_sha256 TEXT NOT NULL,
  compensate INTEGER NOT NULL,
  feed_scale REAL NOT NULL,
  pins_version INTEGER NOT NULL,
  machine_version INTEGER NOT NULL,
  submitted_ns INTEGER NOT NULL,
  state INTEGER NOT NULL,
  changing TEXT NOT NULL,
  s_mm REAL NOT NULL,
  cutting_time_s REAL NOT NULL DEFAULT 0,
  held_time_s REAL NOT NULL DEFAULT 0,
  drive_overruns INTEGER NOT NULL DEFAULT 0,
  main_motion_overruns INTEGER NOT NULL DEFAULT 0
);
CREATE INDEX jobs_by_state ON jobs (state, number);
CREATE TABLE records (
  token INTEGER PRIMARY KEY AUTOINCREMENT,
  job INTEGER NOT NULL REFERENCES jobs (number),
  time_ns INTEGER NOT NULL,
  state INTEGER NOT NULL,
  changing TEXT NOT NULL,
  s_mm REAL NOT NULL
);
CREATE INDEX records_by_job ON records (job, token);
CREATE TABLE run_parts (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  job INTEGER NOT NULL REFERENCES jobs (number),
  events BLOB NOT NULL,
  trace BLOB NOT NULL
);
CREATE INDEX run_parts_by_job ON run_parts (job, number);
)sql";

// What a program is written in, and how a drawing is cut.
constexpr char kFormatSchema[] = R"sql(
ALTER TABLE jobs ADD COLUMN program_format INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN toolpath BLOB NOT NULL DEFAULT x'';
)sql";

constexpr char kJobColumns[] =
    "jobs.number, job_id, request_id, name, program_sha256, content_sha256, compensate, feed_scale, "
    "pins_version, "
    "machine_version, submitted_ns, program_format, toolpath";

// --- One text line for what changes: fields of a job apart by the unit separator, lists by the record separator --------

constexpr char kUnit = '\x1f';
constexpr char kRecord = '\x1e';

std::string Clean(std::string text) {
  std::erase_if(text, [](char c) { return c == kUnit || c == kRecord; });
  return text;
}

class FieldWriter {
 public:
  template <typename Value>
  FieldWriter& operator<<(const Value& value) {
    if constexpr (std::is_convertible_v<Value, std::string>) {
      text_ += Clean(value);
    } else {
      text_ += fmt::format("{}", value);
    }
    text_ += kUnit;
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

class FieldReader {
 public:
  explicit FieldReader(std::string_view text) : text_(text) {}
  std::string Text() {
    const auto end = text_.find(kUnit);
    const std::string field(text_.substr(0, end));
    text_.remove_prefix(end == std::string_view::npos ? text_.size() : end + 1);
    return field;
  }
  template <typename Number>
  Number Get() {
    const std::string field = Text();
    Number number{};
    std::from_chars(field.data(), field.data() + field.size(), number);
    return number;
  }

 private:
  std::string_view text_;
};

std::string ToText(const JobProgress& progress) {
  FieldWriter out;
  out << progress.reason << progress.message << progress.model_version.machine_id
      << progress.model_version.version << progress.model_version.hash << progress.plan_id
      << progress.length_mm << progress.expected_duration_s << progress.predicted_95_mm << progress.started_ns
      << progress.ended_ns << progress.interruptions << progress.plan_ids.size();
  for (const std::uint64_t plan : progress.plan_ids) {
    out << plan;
  }
  out << progress.faults.size();
  for (const ProgramFault& fault : progress.faults) {
    out << fault.line << fault.column << fault.reason << fault.message;
  }
  return out.text();
}

JobProgress FromText(std::string_view text, int state, double s_mm) {
  FieldReader in(text);
  JobProgress progress;
  progress.state = static_cast<JobState>(state);
  progress.s_mm = s_mm;
  progress.reason = in.Text();
  progress.message = in.Text();
  progress.model_version.machine_id = in.Text();
  progress.model_version.version = in.Get<std::uint32_t>();
  progress.model_version.hash = in.Text();
  progress.plan_id = in.Get<std::uint64_t>();
  progress.length_mm = in.Get<double>();
  progress.expected_duration_s = in.Get<double>();
  progress.predicted_95_mm = in.Get<double>();
  progress.started_ns = in.Get<std::int64_t>();
  progress.ended_ns = in.Get<std::int64_t>();
  progress.interruptions = in.Get<std::uint32_t>();
  progress.plan_ids.resize(in.Get<std::size_t>());
  for (std::uint64_t& plan : progress.plan_ids) {
    plan = in.Get<std::uint64_t>();
  }
  progress.faults.resize(in.Get<std::size_t>());
  for (ProgramFault& fault : progress.faults) {
    fault.line = in.Get<std::uint32_t>();
    fault.column = in.Get<std::uint32_t>();
    fault.reason = in.Text();
    fault.message = in.Text();
  }
  return progress;
}

template <typename Item>
SqlBlob Bytes(const std::vector<Item>& items) {
  static_assert(std::is_trivially_copyable_v<Item>);
  return {std::string(reinterpret_cast<const char*>(items.data()), items.size() * sizeof(Item))};
}

template <typename Item>
void AppendItems(std::string_view bytes, std::vector<Item>& items) {
  const std::size_t before = items.size();
  items.resize(before + bytes.size() / sizeof(Item));
  std::memcpy(items.data() + before, bytes.data(), (items.size() - before) * sizeof(Item));
}

constexpr int kJobColumnCount = 13;

// Columns from 0 on: kJobColumns, state, changing, s_mm.
Job ReadJob(const Row& row) {
  Job job;
  job.order.job_id = row.text(1);
  job.order.request_id = row.text(2);
  job.order.name = row.text(3);
  job.order.program_sha256 = row.text(4);
  job.order.content_sha256 = row.text(5);
  job.order.compensate = row.integer(6) != 0;
  job.order.feed_scale = row.number(7);
  job.order.pins_version = row.integer(8) != 0;
  job.order.machine_version = static_cast<std::uint32_t>(row.integer(9));
  job.order.submitted_ns = row.integer(10);
  job.order.program_format = static_cast<ProgramFormat>(row.integer(11));
  job.order.toolpath = row.text(12);
  job.progress = FromText(row.text(kJobColumnCount + 1), static_cast<int>(row.integer(kJobColumnCount)),
                          row.number(kJobColumnCount + 2));
  return job;
}

std::int64_t Number(JobState state) { return static_cast<std::int64_t>(state); }

absl::Status JobUnknown(const std::string& job_id) {
  return Trouble(absl::StatusCode::kNotFound, "JOB_UNKNOWN",
                 fmt::format("there is no job '{}'; ListJobs tells which there are", job_id));
}

absl::StatusOr<std::vector<Job>> ReadJobs(Database& database, const std::string& condition,
                                          const std::vector<SqlValue>& values, std::int64_t& last) {
  std::vector<Job> jobs;
  const absl::Status status =
      database.Query(fmt::format("SELECT {}, state, changing, s_mm FROM jobs {}", kJobColumns, condition),
                     values, [&](const Row& row) {
                       last = row.integer(0);
                       jobs.push_back(ReadJob(row));
                     });
  if (!status.ok()) {
    return status;
  }
  return jobs;
}

absl::StatusOr<std::int64_t> ReadNumber(Database& database, const char* sql) {
  std::int64_t number = 0;
  const absl::Status status = database.Query(sql, {}, [&](const Row& row) { number = row.integer(0); });
  if (!status.ok()) {
    return status;
  }
  return number;
}

absl::Status InsertRecord(Database& database, const Job& job, std::int64_t now_ns, std::uint64_t& token) {
  const auto inserted = database.Run(
      "INSERT INTO records (job, time_ns, state, changing, s_mm) SELECT number, ?, ?, ?, ? FROM jobs WHERE "
      "job_id = ?",
      {now_ns, Number(job.progress.state), ToText(job.progress), job.progress.s_mm, job.order.job_id});
  const auto number =
      inserted.ok() ? ReadNumber(database, "SELECT MAX(token) FROM records") : inserted.status();
  token = static_cast<std::uint64_t>(number.value_or(0));
  return number.status();
}

}  // namespace

Journal::Journal(std::unique_ptr<Database> database) : database_(std::move(database)) {}
Journal::~Journal() = default;

absl::StatusOr<std::unique_ptr<Journal>> Journal::Open(const std::string& path) {
  auto database = Database::Open(path, {kSchema, kFormatSchema});
  if (!database.ok()) {
    return database.status();
  }
  return std::unique_ptr<Journal>(new Journal(std::move(*database)));
}

absl::StatusOr<JournalRecord> Journal::Add(const Job& job, std::string_view program, std::int64_t now_ns) {
  JournalRecord record{0, now_ns, job};
  const JobOrder& order = job.order;
  const absl::Status status = database_->Transact([&]() -> absl::Status {
    const auto number = ReadNumber(*database_, "SELECT COALESCE(MAX(number), 0) + 1 FROM jobs");
    if (!number.ok()) {
      return number.status();
    }
    record.job.order.job_id = fmt::format("job-{:06}", *number);
    const auto inserted = database_->Run(
        "INSERT INTO jobs (job_id, request_id, name, program, program_sha256, content_sha256, compensate, "
        "feed_scale, "
        "pins_version, machine_version, submitted_ns, state, changing, s_mm, program_format, toolpath) "
        "VALUES "
        "(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)",
        {record.job.order.job_id, order.request_id, order.name, SqlBlob{std::string(program)},
         order.program_sha256, order.content_sha256, order.compensate, order.feed_scale, order.pins_version,
         order.machine_version, order.submitted_ns, Number(job.progress.state), ToText(job.progress),
         job.progress.s_mm, static_cast<std::int64_t>(order.program_format), SqlBlob{order.toolpath}});
    return inserted.ok() ? InsertRecord(*database_, record.job, now_ns, record.token) : inserted.status();
  });
  if (!status.ok()) {
    return status;
  }
  return record;
}

absl::StatusOr<JournalRecord> Journal::Append(const Job& job, std::int64_t now_ns) {
  JournalRecord record{0, now_ns, job};
  const absl::Status status = database_->Transact([&]() -> absl::Status {
    const auto updated = database_->Run(
        "UPDATE jobs SET state = ?, changing = ?, s_mm = ? WHERE job_id = ?",
        {Number(job.progress.state), ToText(job.progress), job.progress.s_mm, job.order.job_id});
    return updated.ok() ? InsertRecord(*database_, job, now_ns, record.token) : updated.status();
  });
  if (!status.ok()) {
    return status;
  }
  return record;
}

absl::Status Journal::Checkpoint(const std::string& job_id, double s_mm, const JobRecord& further) {
  return database_->Transact([&]() -> absl::Status {
    const auto updated = database_->Run(
        "UPDATE jobs SET s_mm = ?, cutting_time_s = cutting_time_s + ?, held_time_s = held_time_s + ?, "
        "drive_overruns = drive_overruns + ?, main_motion_overruns = main_motion_overruns + ? WHERE job_id = "
        "?",
        {s_mm, further.cutting_time_s, further.held_time_s, further.drive_overruns,
         further.main_motion_overruns, job_id});
    if (!updated.ok()) {
      return updated.status();
    }
    return database_
        ->Run("INSERT INTO run_parts (job, events, trace) SELECT number, ?, ? FROM jobs WHERE job_id = ?",
              {Bytes(further.events), Bytes(further.trace), job_id})
        .status();
  });
}

absl::StatusOr<Job> Journal::Find(const std::string& job_id) {
  std::int64_t last = 0;
  const auto jobs = ReadJobs(*database_, "WHERE job_id = ?", {job_id}, last);
  if (!jobs.ok()) {
    return jobs.status();
  }
  if (jobs->empty()) {
    return JobUnknown(job_id);
  }
  return jobs->front();
}

absl::StatusOr<std::optional<Job>> Journal::FindRequest(const std::string& request_id) {
  std::int64_t last = 0;
  const auto jobs = ReadJobs(*database_, "WHERE request_id = ?", {request_id}, last);
  if (!jobs.ok()) {
    return jobs.status();
  }
  return jobs->empty() ? std::nullopt : std::optional(jobs->front());
}

absl::StatusOr<std::string> Journal::Program(const std::string& job_id) {
  std::optional<std::string> program;
  const absl::Status status = database_->Query("SELECT program FROM jobs WHERE job_id = ?", {job_id},
                                               [&](const Row& row) { program = row.text(0); });
  if (!status.ok()) {
    return status;
  }
  return program ? absl::StatusOr<std::string>(*program) : JobUnknown(job_id);
}

absl::StatusOr<JobRecord> Journal::Record(const std::string& job_id) {
  JobRecord record;
  absl::Status status = database_->Query(
      "SELECT cutting_time_s, held_time_s, drive_overruns, main_motion_overruns FROM jobs WHERE job_id = ?",
      {job_id}, [&](const Row& row) {
        record.cutting_time_s = row.number(0);
        record.held_time_s = row.number(1);
        record.drive_overruns = static_cast<std::uint32_t>(row.integer(2));
        record.main_motion_overruns = static_cast<std::uint32_t>(row.integer(3));
      });
  if (status.ok()) {
    status = database_->Query(
        "SELECT events, trace FROM run_parts WHERE job = (SELECT number FROM jobs WHERE job_id = ?) ORDER BY "
        "number",
        {job_id}, [&](const Row& row) {
          AppendItems(row.text(0), record.events);
          AppendItems(row.text(1), record.trace);
        });
  }
  if (!status.ok()) {
    return status;
  }
  return record;
}

absl::StatusOr<std::vector<Job>> Journal::List(std::int64_t before, std::optional<JobState> state, int most,
                                               std::int64_t& last) {
  const std::int64_t wanted = state ? Number(*state) : 0;
  return ReadJobs(*database_,
                  "WHERE (? = 0 OR number < ?) AND (? = 0 OR state = ?) ORDER BY number DESC LIMIT ?",
                  {before, before, wanted, wanted, most}, last);
}

absl::StatusOr<std::vector<Job>> Journal::Unfinished() {
  std::int64_t last = 0;
  return ReadJobs(*database_, "WHERE state NOT IN (?, ?, ?, ?) ORDER BY number",
                  {Number(JobState::kRefused), Number(JobState::kCompleted), Number(JobState::kCancelled),
                   Number(JobState::kFailed)},
                  last);
}

absl::StatusOr<std::vector<JournalRecord>> Journal::Since(std::uint64_t token, const std::string& job_id,
                                                          int most) {
  std::vector<JournalRecord> records;
  const absl::Status status = database_->Query(
      fmt::format("SELECT {}, records.state, records.changing, records.s_mm, token, time_ns FROM records "
                  "JOIN jobs ON jobs.number = records.job WHERE token > ? AND (? = '' OR job_id = ?) ORDER "
                  "BY token LIMIT ?",
                  kJobColumns),
      {token, job_id, job_id, most}, [&](const Row& row) {
        records.push_back({static_cast<std::uint64_t>(row.integer(kJobColumnCount + 3)),
                           row.integer(kJobColumnCount + 4), ReadJob(row)});
      });
  if (!status.ok()) {
    return status;
  }
  return records;
}

absl::StatusOr<std::uint64_t> Journal::LastToken() {
  const auto token = ReadNumber(*database_, "SELECT COALESCE(MAX(token), 0) FROM records");
  if (!token.ok()) {
    return token.status();
  }
  return static_cast<std::uint64_t>(*token);
}

}  // namespace lambdajet::cell
