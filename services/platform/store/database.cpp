#include "platform/store/database.hpp"

#include <sqlite3.h>

#include <map>
#include <mutex>

#include "foundation/contract/expects.hpp"
#include "foundation/contract/trouble.hpp"

namespace lambdajet {
namespace {

constexpr int kBusyMs = 5000;
constexpr std::size_t kMostPrepared = 256;

absl::Status SqlTrouble(sqlite3* connection, int code, const std::string& path, std::string_view sql) {
  const std::string message = path + ": " +
                              (connection != nullptr ? sqlite3_errmsg(connection) : sqlite3_errstr(code)) +
                              (sql.empty() ? "" : " in: " + std::string(sql.substr(0, 128)));
  const TroubleDetails details{{"path", path}};
  switch (code & 0xff) {
    case SQLITE_FULL:
      return Trouble(absl::StatusCode::kResourceExhausted, "DISK_FULL", message + "; make room on its disk",
                     details);
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return Trouble(absl::StatusCode::kUnavailable, "DATABASE_BUSY", message, details);
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return Trouble(absl::StatusCode::kDataLoss, "DATABASE_DAMAGED",
                     message + "; restore it from a copy, or name another", details);
    case SQLITE_CONSTRAINT:
      return Trouble(absl::StatusCode::kAlreadyExists, "CONSTRAINT", message, details);
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_AUTH:
    case SQLITE_CANTOPEN:
      return Trouble(absl::StatusCode::kPermissionDenied, "NOT_PERMITTED",
                     message + "; name a file in a folder that exists and that this user may write", details);
    default:
      return Trouble(absl::StatusCode::kInternal, "DATABASE_TROUBLE", message, details);
  }
}

struct Bind {
  sqlite3_stmt* statement;
  int place;
  int operator()(std::nullptr_t) const { return sqlite3_bind_null(statement, place); }
  int operator()(std::int64_t value) const { return sqlite3_bind_int64(statement, place, value); }
  int operator()(double value) const { return sqlite3_bind_double(statement, place, value); }
  int operator()(const std::string& text) const {
    return sqlite3_bind_text64(statement, place, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  }
  int operator()(const SqlBlob& blob) const {
    return sqlite3_bind_blob64(statement, place, blob.bytes.data(), blob.bytes.size(), SQLITE_TRANSIENT);
  }
};

// Leaves a kept statement as it was found, whatever happened in between.
class Reset {
 public:
  explicit Reset(sqlite3_stmt* statement) : statement_(statement) {}
  ~Reset() {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
  }
  Reset(const Reset&) = delete;
  Reset& operator=(const Reset&) = delete;

 private:
  sqlite3_stmt* statement_;
};

}  // namespace

bool Row::null(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }
std::int64_t Row::integer(int column) const { return sqlite3_column_int64(statement_, column); }
double Row::number(int column) const { return sqlite3_column_double(statement_, column); }
std::string Row::text(int column) const {
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_, column));
  return bytes == nullptr
             ? std::string()
             : std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column)));
}

class Database::Inside {
 public:
  ~Inside() {
    for (auto& [sql, statement] : prepared_) {
      sqlite3_finalize(statement);
    }
    sqlite3_close(connection);
  }

  absl::Status OpenFile(const std::string& file) {
    path = file;
    const int code =
        sqlite3_open_v2(path.c_str(), &connection, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
    if (code != SQLITE_OK) {
      return SqlTrouble(connection, code, path, "");
    }
    sqlite3_extended_result_codes(connection, 1);
    sqlite3_busy_timeout(connection, kBusyMs);
    return Script(
        "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; PRAGMA cache_size = "
        "-" +
        std::to_string(kCacheKib) + ";");
  }

  // Several statements in one text, without values.
  absl::Status Script(const std::string& sql) {
    const int code = sqlite3_exec(connection, sql.c_str(), nullptr, nullptr, nullptr);
    return code == SQLITE_OK ? absl::OkStatus() : SqlTrouble(connection, code, path, sql);
  }

  absl::Status Migrate(const std::vector<std::string>& migrations) {
    std::int64_t applied = 0;
    if (absl::Status status =
            Each("PRAGMA user_version", {}, [&](const Row& row) { applied = row.integer(0); });
        !status.ok()) {
      return status;
    }
    if (applied > static_cast<std::int64_t>(migrations.size())) {
      return Trouble(absl::StatusCode::kFailedPrecondition, "DATABASE_TOO_NEW",
                     path + " is of version " + std::to_string(applied) + "; this program knows " +
                         std::to_string(migrations.size()) +
                         ": start the newer program, or restore an older file",
                     {{"path", path}});
    }
    for (auto i = static_cast<std::size_t>(applied); i < migrations.size(); ++i) {
      absl::Status status = Script("BEGIN IMMEDIATE; " + migrations[i] +
                                   "; PRAGMA user_version = " + std::to_string(i + 1) + "; COMMIT;");
      if (!status.ok()) {
        Script("ROLLBACK").IgnoreError();
        return status;
      }
    }
    return absl::OkStatus();
  }

  absl::Status Each(std::string_view sql, const std::vector<SqlValue>& values,
                    const std::function<void(const Row&)>& on_row) {
    sqlite3_stmt* statement = nullptr;
    if (absl::Status status = Prepare(sql, statement); !status.ok()) {
      return status;
    }
    const Reset reset(statement);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const int code =
          std::visit(Bind{statement, static_cast<int>(i) + 1}, static_cast<const SqlValue::Base&>(values[i]));
      if (code != SQLITE_OK) {
        return SqlTrouble(connection, code, path, sql);
      }
    }
    int code = SQLITE_ROW;
    while ((code = sqlite3_step(statement)) == SQLITE_ROW) {
      if (on_row) {
        on_row(Row(statement));
      }
    }
    return code == SQLITE_DONE ? absl::OkStatus() : SqlTrouble(connection, code, path, sql);
  }

  std::recursive_mutex mutex;  // Transact() holds it while its work calls Run() and Query()
  std::string path;
  sqlite3* connection = nullptr;

 private:
  absl::Status Prepare(std::string_view sql, sqlite3_stmt*& statement) {
    if (const auto found = prepared_.find(sql); found != prepared_.end()) {
      Expects(!sqlite3_stmt_busy(found->second),
              "a row's function does not use the statement it is called by");
      statement = found->second;
      return absl::OkStatus();
    }
    const int code = sqlite3_prepare_v3(connection, sql.data(), static_cast<int>(sql.size()),
                                        SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
    if (code != SQLITE_OK) {
      return SqlTrouble(connection, code, path, sql);
    }
    Expects(prepared_.size() < kMostPrepared, "values go to a '?', not into the text of a statement");
    prepared_[std::string(sql)] = statement;
    return absl::OkStatus();
  }

  std::map<std::string, sqlite3_stmt*, std::less<>> prepared_;
};

Database::Database() : inside_(std::make_unique<Inside>()) {}
Database::~Database() = default;

absl::StatusOr<std::unique_ptr<Database>> Database::Open(const std::string& path,
                                                         const std::vector<std::string>& migrations) {
  std::unique_ptr<Database> self(new Database);
  if (absl::Status status = self->inside_->OpenFile(path); !status.ok()) {
    return status;
  }
  if (absl::Status status = self->inside_->Migrate(migrations); !status.ok()) {
    return status;
  }
  return self;
}

absl::StatusOr<std::int64_t> Database::Run(std::string_view sql, const std::vector<SqlValue>& values) {
  const std::lock_guard lock(inside_->mutex);
  if (absl::Status status = inside_->Each(sql, values, nullptr); !status.ok()) {
    return status;
  }
  return sqlite3_changes64(inside_->connection);
}

absl::Status Database::Query(std::string_view sql, const std::vector<SqlValue>& values,
                             const std::function<void(const Row&)>& on_row) {
  const std::lock_guard lock(inside_->mutex);
  return inside_->Each(sql, values, on_row);
}

absl::Status Database::Transact(const std::function<absl::Status()>& work) {
  const std::lock_guard lock(inside_->mutex);
  if (absl::Status status = inside_->Script("BEGIN IMMEDIATE"); !status.ok()) {
    return status;
  }
  absl::Status status = work();
  if (status.ok()) {
    status = inside_->Script("COMMIT");
  }
  if (!status.ok()) {
    inside_->Script("ROLLBACK").IgnoreError();
  }
  return status;
}

}  // namespace lambdajet
