#include "calibration/store/calibration_store.hpp"

#include <sqlite3.h>

#include <cstring>
#include <mutex>
#include <string_view>
#include <utility>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::calibration {
namespace {

constexpr int kSchemaVersion = 1;
constexpr int kBusyPatience_ms = 2000;

constexpr char kSchema[] = R"sql(
CREATE TABLE machine (one INTEGER PRIMARY KEY CHECK (one = 1), as_designed TEXT NOT NULL, active INTEGER NOT NULL);
CREATE TABLE versions (
  number INTEGER PRIMARY KEY,
  parent INTEGER NOT NULL,
  author TEXT NOT NULL,
  created_utc_ns INTEGER NOT NULL,
  valid_until_utc_ns INTEGER NOT NULL,
  run INTEGER NOT NULL,
  hash TEXT NOT NULL,
  parameters BLOB NOT NULL,
  covariance BLOB NOT NULL
);
CREATE TABLE activations (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  version INTEGER NOT NULL REFERENCES versions (number),
  author TEXT NOT NULL,
  utc_ns INTEGER NOT NULL
);
CREATE TABLE looks (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  plan INTEGER NOT NULL,
  pass INTEGER NOT NULL,
  session INTEGER NOT NULL,
  sequence_number INTEGER NOT NULL,
  gate INTEGER NOT NULL,
  mark INTEGER NOT NULL,
  seen INTEGER NOT NULL,
  exposure_ns INTEGER NOT NULL,
  numbers BLOB NOT NULL,
  UNIQUE (session, sequence_number)
);
CREATE INDEX looks_by_plan ON looks (plan, pass, number);
CREATE TABLE operations (
  id TEXT PRIMARY KEY,
  plan INTEGER NOT NULL,
  author TEXT NOT NULL,
  state INTEGER NOT NULL,
  reason TEXT NOT NULL,
  message TEXT NOT NULL,
  report TEXT NOT NULL
);
)sql";

constexpr char kVersionColumns[] =
    "number, parent, author, created_utc_ns, valid_until_utc_ns, run, hash, parameters, covariance";

absl::Status FromSqlite(sqlite3* database, int code, const std::string& path) {
  const std::string words =
      path + ": " + (database != nullptr ? sqlite3_errmsg(database) : sqlite3_errstr(code));
  switch (code & 0xFF) {
    case SQLITE_FULL:
      return Trouble(absl::StatusCode::kResourceExhausted, "DISK_FULL", words + "; make room on the disk");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return Trouble(absl::StatusCode::kUnavailable, "STORE_IN_USE", words + "; another process has it open");
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return Trouble(absl::StatusCode::kDataLoss, "STORE_DAMAGED",
                     words + "; restore it from a copy, or name another");
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return Trouble(absl::StatusCode::kFailedPrecondition, "STORE_NOT_WRITABLE",
                     words + "; a writable folder is right");
    default:
      return Trouble(absl::StatusCode::kInternal, "STORE_FAILED", words);
  }
}

// Bit for bit: SQLite has no unsigned 64-bit integers.
std::int64_t Signed(std::uint64_t value) { return static_cast<std::int64_t>(value); }
std::uint64_t Unsigned(std::int64_t value) { return static_cast<std::uint64_t>(value); }

// A prepared statement, finalised when it goes.
class Statement {
 public:
  Statement(sqlite3* database, const std::string& path, const std::string& sql)
      : database_(database), path_(path) {
    code_ = sqlite3_prepare_v2(database, sql.c_str(), -1, &statement_, nullptr);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& operator<<(const std::string& text) {
    return Bound(sqlite3_bind_text(statement_, ++place_, text.data(), static_cast<int>(text.size()),
                                   SQLITE_TRANSIENT));
  }
  Statement& operator<<(std::int64_t value) { return Bound(sqlite3_bind_int64(statement_, ++place_, value)); }
  Statement& Numbers(const double* numbers, std::size_t count) {
    return Bound(sqlite3_bind_blob(statement_, ++place_, numbers, static_cast<int>(count * sizeof(double)),
                                   SQLITE_TRANSIENT));
  }

  absl::StatusOr<bool> Step() {  // true while there are rows
    const int code = code_ == SQLITE_OK ? sqlite3_step(statement_) : code_;
    if (code == SQLITE_ROW || code == SQLITE_DONE) {
      return code == SQLITE_ROW;
    }
    return FromSqlite(database_, code, path_);
  }
  absl::Status Run() { return Step().status(); }

  std::int64_t Integer(int column) { return sqlite3_column_int64(statement_, column); }
  std::string Text(int column) {
    const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    return bytes == nullptr
               ? std::string()
               : std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column)));
  }
  bool CopyNumbers(int column, double* numbers, std::size_t count) {
    const void* bytes = sqlite3_column_blob(statement_, column);
    if (bytes == nullptr ||
        sqlite3_column_bytes(statement_, column) != static_cast<int>(count * sizeof(double))) {
      return false;
    }
    std::memcpy(numbers, bytes, count * sizeof(double));
    return true;
  }

 private:
  Statement& Bound(int code) {
    code_ = code_ == SQLITE_OK ? code : code_;
    return *this;
  }
  sqlite3* database_;
  const std::string& path_;
  sqlite3_stmt* statement_ = nullptr;
  int code_ = SQLITE_OK;
  int place_ = 0;
};

// The ten doubles of a look, in this order in its row.
struct LookNumbers {
  double n[10];
};
LookNumbers Pack(const Measurement& m) {
  return {{m.p_C_mm.x(), m.p_C_mm.y(), m.actuator_position_mm.x(), m.actuator_position_mm.y(),
           m.actuator_velocity_mm_per_s.x(), m.actuator_velocity_mm_per_s.y(),
           m.actuator_acceleration_mm_per_s2.x(), m.actuator_acceleration_mm_per_s2.y(),
           m.pierce_actuator_position_mm.x(), m.pierce_actuator_position_mm.y()}};
}
void Unpack(const LookNumbers& packed, Measurement& m) {
  const double* n = packed.n;
  m.p_C_mm = {n[0], n[1]};
  m.actuator_position_mm = {n[2], n[3]};
  m.actuator_velocity_mm_per_s = {n[4], n[5]};
  m.actuator_acceleration_mm_per_s2 = {n[6], n[7]};
  m.pierce_actuator_position_mm = {n[8], n[9]};
}

absl::Status Damaged(const std::string& path) {
  return Trouble(absl::StatusCode::kDataLoss, "STORE_DAMAGED",
                 path + ": a row of numbers has the wrong length");
}

}  // namespace

class CalibrationStore::Inside {
 public:
  ~Inside() { sqlite3_close_v2(database); }

  Statement Make(const std::string& sql) { return Statement(database, path, sql); }
  absl::Status Execute(const char* sql) {
    const int code = sqlite3_exec(database, sql, nullptr, nullptr, nullptr);
    return code == SQLITE_OK ? absl::OkStatus() : FromSqlite(database, code, path);
  }

  // All of `work` or nothing of it.
  template <typename Work>
  absl::Status Whole(Work&& work) {
    if (const absl::Status begun = Execute("BEGIN IMMEDIATE"); !begun.ok()) {
      return begun;
    }
    absl::Status status = work();
    if (status.ok()) {
      status = Execute("COMMIT");
    }
    if (!status.ok()) {
      (void)Execute(
          "ROLLBACK");  // what failed is in `status`; after some errors SQLite has rolled back itself
    }
    return status;
  }

  absl::Status Prepare() {
    sqlite3_busy_timeout(database, kBusyPatience_ms);
    for (const char* sql : {"PRAGMA journal_mode=WAL", "PRAGMA synchronous=FULL", "PRAGMA foreign_keys=ON"}) {
      if (const absl::Status status = Execute(sql); !status.ok()) {
        return status;
      }
    }
    return Whole([this]() -> absl::Status {
      std::int64_t schema = 0;
      {
        Statement asked = Make("PRAGMA user_version");
        if (const auto row = asked.Step(); !row.ok()) {
          return row.status();
        }
        schema = asked.Integer(0);
      }
      if (schema == kSchemaVersion) {
        return absl::OkStatus();
      }
      if (schema != 0) {
        return Trouble(absl::StatusCode::kFailedPrecondition, "STORE_OF_ANOTHER_BUILD",
                       path + ": schema " + std::to_string(schema) + ", this build writes " +
                           std::to_string(kSchemaVersion));
      }
      if (const absl::Status made = Execute(kSchema); !made.ok()) {
        return made;
      }
      return Execute("PRAGMA user_version = 1");
    });
  }

  absl::Status Insert(const Version& v) {
    Statement insert =
        Make(std::string("INSERT INTO versions (") + kVersionColumns + ") VALUES (?,?,?,?,?,?,?,?,?)");
    insert << std::int64_t{v.number} << std::int64_t{v.parent} << v.author << v.created_utc_ns
           << v.valid_until_utc_ns << Signed(v.run) << v.hash;
    insert.Numbers(v.parameters.data(), kParameterCount);
    insert.Numbers(v.covariance.data(), kParameterCount * kParameterCount);
    return insert.Run();
  }

  absl::StatusOr<Version> ReadVersion(Statement& row) {
    Version v;
    v.number = static_cast<std::uint32_t>(row.Integer(0));
    v.parent = static_cast<std::uint32_t>(row.Integer(1));
    v.author = row.Text(2);
    v.created_utc_ns = row.Integer(3);
    v.valid_until_utc_ns = row.Integer(4);
    v.run = Unsigned(row.Integer(5));
    v.hash = row.Text(6);
    if (!row.CopyNumbers(7, v.parameters.data(), kParameterCount) ||
        !row.CopyNumbers(8, v.covariance.data(), kParameterCount * kParameterCount)) {
      return Damaged(path);
    }
    return v;
  }

  absl::Status Finish(const StoredOperation& operation) {
    Statement update =
        Make("UPDATE operations SET state = ?, reason = ?, message = ?, report = ? WHERE id = ?");
    update << static_cast<std::int64_t>(operation.state) << operation.reason << operation.message
           << operation.report << operation.id;
    return update.Run();
  }

  // A look at a gate not above the last one's belongs to a new pass of the plan.
  absl::StatusOr<std::int64_t> PassOf(const RecordedLook& look) {
    Statement last = Make("SELECT MAX(pass) FROM looks WHERE plan = ?");
    last << Signed(look.plan);
    if (const auto row = last.Step(); !row.ok()) {
      return row.status();
    }
    const std::int64_t pass = last.Integer(0);
    if (look.gate == 0) {
      return pass;
    }
    Statement gate = Make("SELECT MAX(gate) FROM looks WHERE plan = ? AND pass = ?");
    gate << Signed(look.plan) << pass;
    if (const auto row = gate.Step(); !row.ok()) {
      return row.status();
    }
    return std::int64_t{look.gate} <= gate.Integer(0) ? pass + 1 : pass;
  }

  absl::StatusOr<bool> Known(const RecordedLook& look) {
    Statement there = Make("SELECT 1 FROM looks WHERE session = ? AND sequence_number = ?");
    there << Signed(look.session) << Signed(look.sequence_number);
    return there.Step();
  }

  absl::StatusOr<int> Insert(const RecordedLook& look) {
    const auto known = Known(look);
    if (!known.ok() || *known) {
      return known.ok() ? absl::StatusOr<int>(0) : known.status();
    }
    const auto pass = PassOf(look);
    if (!pass.ok()) {
      return pass.status();
    }
    Statement insert = Make(
        "INSERT INTO looks (plan, pass, session, sequence_number, gate, mark, seen, exposure_ns, numbers) "
        "VALUES (?,?,?,?,?,?,?,?,?)");
    insert << Signed(look.plan) << *pass << Signed(look.session) << Signed(look.sequence_number)
           << std::int64_t{look.gate} << std::int64_t{look.look.mark} << std::int64_t{look.look.seen}
           << look.look.exposure_ns;
    const LookNumbers packed = Pack(look.look);
    insert.Numbers(packed.n, std::size(packed.n));
    const absl::Status status = insert.Run();
    return status.ok() ? absl::StatusOr<int>(1) : status;
  }

  std::string path;
  sqlite3* database = nullptr;
  std::mutex mutex;
};

CalibrationStore::CalibrationStore() : inside_(std::make_unique<Inside>()) {}
CalibrationStore::~CalibrationStore() = default;

absl::StatusOr<std::unique_ptr<CalibrationStore>> CalibrationStore::Open(const std::string& path) {
  std::unique_ptr<CalibrationStore> store(new CalibrationStore());
  Inside& inside = *store->inside_;
  inside.path = path;
  const int code =
      sqlite3_open_v2(path.c_str(), &inside.database,
                      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX, nullptr);
  if (code != SQLITE_OK) {
    return FromSqlite(inside.database, code, path);
  }
  if (const absl::Status prepared = inside.Prepare(); !prepared.ok()) {
    return prepared;
  }
  return store;
}

absl::StatusOr<std::string> CalibrationStore::AsDesigned() {
  const std::lock_guard lock(inside_->mutex);
  Statement select = inside_->Make("SELECT as_designed FROM machine");
  const auto row = select.Step();
  if (!row.ok()) {
    return row.status();
  }
  return *row ? select.Text(0) : std::string();
}

absl::Status CalibrationStore::Begin(const std::string& as_designed_yaml, const Version& version) {
  const std::lock_guard lock(inside_->mutex);
  return inside_->Whole([&]() -> absl::Status {
    if (const absl::Status made = inside_->Insert(version); !made.ok()) {
      return made;
    }
    Statement insert = inside_->Make("INSERT INTO machine (one, as_designed, active) VALUES (1, ?, ?)");
    insert << as_designed_yaml << std::int64_t{version.number};
    return insert.Run();
  });
}

absl::StatusOr<int> CalibrationStore::AddLooks(const std::vector<RecordedLook>& looks) {
  const std::lock_guard lock(inside_->mutex);
  int added = 0;
  const absl::Status status = inside_->Whole([&]() -> absl::Status {
    for (const RecordedLook& look : looks) {
      const auto one = inside_->Insert(look);
      if (!one.ok()) {
        return one.status();
      }
      added += *one;
    }
    return absl::OkStatus();
  });
  return status.ok() ? absl::StatusOr<int>(added) : status;
}

absl::StatusOr<std::vector<RunHead>> CalibrationStore::Runs(int most, std::int64_t before_row) {
  const std::lock_guard lock(inside_->mutex);
  Statement select = inside_->Make(
      "SELECT plan, pass, COUNT(*), SUM(1 - seen), MIN(exposure_ns), MAX(number) AS row FROM looks "
      "WHERE pass = (SELECT MAX(pass) FROM looks AS newer WHERE newer.plan = looks.plan) "
      "GROUP BY plan HAVING row < ? ORDER BY row DESC LIMIT ?");
  select << (before_row > 0 ? before_row : INT64_MAX) << std::int64_t{most};
  std::vector<RunHead> runs;
  for (;;) {
    const auto row = select.Step();
    if (!row.ok()) {
      return row.status();
    }
    if (!*row) {
      return runs;
    }
    runs.push_back({Unsigned(select.Integer(0)), static_cast<std::uint32_t>(select.Integer(1)),
                    static_cast<std::uint32_t>(select.Integer(2)),
                    static_cast<std::uint32_t>(select.Integer(3)), select.Integer(4), select.Integer(5)});
  }
}

absl::StatusOr<std::vector<RecordedLook>> CalibrationStore::Looks(std::uint64_t plan) {
  const std::lock_guard lock(inside_->mutex);
  Statement select = inside_->Make(
      "SELECT session, sequence_number, gate, mark, seen, exposure_ns, numbers FROM looks "
      "WHERE plan = ?1 AND pass = (SELECT MAX(pass) FROM looks WHERE plan = ?1) ORDER BY number");
  select << Signed(plan);
  std::vector<RecordedLook> looks;
  for (;;) {
    const auto row = select.Step();
    if (!row.ok()) {
      return row.status();
    }
    if (!*row) {
      return looks;
    }
    RecordedLook look{plan,
                      Unsigned(select.Integer(0)),
                      Unsigned(select.Integer(1)),
                      static_cast<std::uint32_t>(select.Integer(2)),
                      {}};
    look.look.mark = static_cast<int>(select.Integer(3));
    look.look.seen = select.Integer(4) != 0;
    look.look.exposure_ns = select.Integer(5);
    look.look.kind = KindOf(look.gate, look.look.mark);
    LookNumbers packed{};
    if (!select.CopyNumbers(6, packed.n, std::size(packed.n))) {
      return Damaged(inside_->path);
    }
    Unpack(packed, look.look);
    looks.push_back(look);
  }
}

absl::StatusOr<std::vector<Version>> CalibrationStore::Versions(int most,
                                                                std::optional<std::uint32_t> before) {
  const std::lock_guard lock(inside_->mutex);
  Statement select = inside_->Make(std::string("SELECT ") + kVersionColumns +
                                   " FROM versions WHERE number < ? ORDER BY number DESC LIMIT ?");
  select << (before ? std::int64_t{*before} : INT64_MAX) << std::int64_t{most > 0 ? most : -1};
  std::vector<Version> versions;
  for (;;) {
    const auto row = select.Step();
    if (!row.ok()) {
      return row.status();
    }
    if (!*row) {
      return versions;
    }
    auto version = inside_->ReadVersion(select);
    if (!version.ok()) {
      return version.status();
    }
    versions.push_back(std::move(*version));
  }
}

absl::StatusOr<std::optional<Version>> CalibrationStore::FindVersion(std::uint32_t number) {
  const std::lock_guard lock(inside_->mutex);
  Statement select =
      inside_->Make(std::string("SELECT ") + kVersionColumns + " FROM versions WHERE number = ?");
  select << std::int64_t{number};
  const auto row = select.Step();
  if (!row.ok()) {
    return row.status();
  }
  if (!*row) {
    return std::optional<Version>();
  }
  auto version = inside_->ReadVersion(select);
  return version.ok() ? absl::StatusOr<std::optional<Version>>(std::move(*version)) : version.status();
}

absl::StatusOr<std::uint32_t> CalibrationStore::ActiveVersion() {
  const std::lock_guard lock(inside_->mutex);
  Statement select = inside_->Make("SELECT active FROM machine");
  const auto row = select.Step();
  if (!row.ok() || !*row) {
    return row.ok() ? Damaged(inside_->path) : row.status();
  }
  return static_cast<std::uint32_t>(select.Integer(0));
}

absl::Status CalibrationStore::Activate(std::uint32_t number, const std::string& author,
                                        std::int64_t now_utc_ns) {
  const std::lock_guard lock(inside_->mutex);
  return inside_->Whole([&]() -> absl::Status {
    Statement ended = inside_->Make(
        "UPDATE versions SET valid_until_utc_ns = ? WHERE number = (SELECT active FROM machine)");
    ended << now_utc_ns;
    Statement begun = inside_->Make("UPDATE versions SET valid_until_utc_ns = 0 WHERE number = ?");
    begun << std::int64_t{number};
    Statement active = inside_->Make("UPDATE machine SET active = ?");
    active << std::int64_t{number};
    Statement record = inside_->Make("INSERT INTO activations (version, author, utc_ns) VALUES (?, ?, ?)");
    record << std::int64_t{number} << author << now_utc_ns;
    for (Statement* statement : {&ended, &begun, &active, &record}) {
      if (const absl::Status status = statement->Run(); !status.ok()) {
        return status;
      }
    }
    return absl::OkStatus();
  });
}

absl::Status CalibrationStore::AddOperation(const StoredOperation& operation) {
  const std::lock_guard lock(inside_->mutex);
  Statement insert = inside_->Make(
      "INSERT INTO operations (id, plan, author, state, reason, message, report) VALUES (?,?,?,?,?,?,?)");
  insert << operation.id << Signed(operation.plan) << operation.author
         << static_cast<std::int64_t>(operation.state) << operation.reason << operation.message
         << operation.report;
  return insert.Run();
}

absl::Status CalibrationStore::EndOperation(const StoredOperation& operation) {
  const std::lock_guard lock(inside_->mutex);
  return inside_->Finish(operation);
}

absl::StatusOr<std::uint32_t> CalibrationStore::EndWithVersion(const StoredOperation& operation,
                                                               Version version) {
  const std::lock_guard lock(inside_->mutex);
  const absl::Status status = inside_->Whole([&]() -> absl::Status {
    Statement highest = inside_->Make("SELECT COALESCE(MAX(number), 0) FROM versions");
    if (const auto row = highest.Step(); !row.ok()) {
      return row.status();
    }
    if (std::int64_t{version.number} != highest.Integer(0) + 1) {
      return Trouble(absl::StatusCode::kInternal, "STORE_FAILED",
                     "version " + std::to_string(version.number) + " does not follow " +
                         std::to_string(highest.Integer(0)));
    }
    if (const absl::Status made = inside_->Insert(version); !made.ok()) {
      return made;
    }
    return inside_->Finish(operation);
  });
  return status.ok() ? absl::StatusOr<std::uint32_t>(version.number) : status;
}

absl::StatusOr<std::optional<StoredOperation>> CalibrationStore::FindOperation(const std::string& id) {
  const std::lock_guard lock(inside_->mutex);
  Statement select =
      inside_->Make("SELECT id, plan, author, state, reason, message, report FROM operations WHERE id = ?");
  select << id;
  const auto row = select.Step();
  if (!row.ok()) {
    return row.status();
  }
  if (!*row) {
    return std::optional<StoredOperation>();
  }
  return std::optional(StoredOperation{select.Text(0), Unsigned(select.Integer(1)), select.Text(2),
                                       static_cast<OperationState>(select.Integer(3)), select.Text(4),
                                       select.Text(5), select.Text(6)});
}

absl::StatusOr<int> CalibrationStore::EndInterrupted() {
  const std::lock_guard lock(inside_->mutex);
  Statement update = inside_->Make(
      "UPDATE operations SET state = 3, reason = 'INTERRUPTED', "
      "message = 'the service was stopped while it ran; start the identification again' WHERE state = 1");
  if (const absl::Status status = update.Run(); !status.ok()) {
    return status;
  }
  return sqlite3_changes(inside_->database);
}

}  // namespace lambdajet::calibration
