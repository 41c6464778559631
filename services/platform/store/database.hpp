// Keeps a house's records in one SQLite file that survives kill -9 and power loss.
//
// Model: WAL with synchronous FULL: what Run() or Transact() has returned OK for is on disk. Migrations are a list of SQL
// texts; the file's user_version says how many have been applied, and Open() applies the rest, each in a transaction. A
// file from a newer program is refused. Statements are prepared once and kept.
// Threads: any; a call, or a whole Transact(), has the connection to itself.
// Cost: one fsync a transaction that writes; pages of the file are held in memory up to Database::kCacheKib and a transaction's
// own, however long the file grows.
// Errors: RESOURCE_EXHAUSTED DISK_FULL, UNAVAILABLE DATABASE_BUSY (another process held it for 5 s), DATA_LOSS
// DATABASE_DAMAGED, ALREADY_EXISTS CONSTRAINT (a unique key is there already), PERMISSION_DENIED NOT_PERMITTED,
// FAILED_PRECONDITION DATABASE_TOO_NEW, INTERNAL DATABASE_TROUBLE.
// Example:
//   auto db = Database::Open("jobs.sqlite", {"CREATE TABLE job (id TEXT PRIMARY KEY, state INTEGER NOT NULL)"});
//   (*db)->Run("INSERT INTO job VALUES (?, ?)", {"job-1", 3});
//   (*db)->Query("SELECT id, state FROM job WHERE state = ?", {3},
//                [&](const Row& row) { jobs.push_back({row.text(0), row.integer(1)}); });
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

struct sqlite3_stmt;

namespace lambdajet {

struct SqlBlob {
  std::string bytes;
};

// A value for a '?'.
struct SqlValue : std::variant<std::nullptr_t, std::int64_t, double, std::string, SqlBlob> {
  using Base = std::variant<std::nullptr_t, std::int64_t, double, std::string, SqlBlob>;
  SqlValue(std::nullptr_t) : Base(nullptr) {}  // NOLINT: implicit by intent
  template <std::integral Integer>
  SqlValue(Integer value) : Base(static_cast<std::int64_t>(value)) {}  // NOLINT
  SqlValue(double value) : Base(value) {}                              // NOLINT
  SqlValue(const char* text) : Base(std::string(text)) {}              // NOLINT
  SqlValue(std::string_view text) : Base(std::string(text)) {}         // NOLINT
  SqlValue(std::string text) : Base(std::move(text)) {}                // NOLINT
  SqlValue(SqlBlob blob) : Base(std::move(blob)) {}                    // NOLINT
};

// One row of an answer; valid in the call it is given to.
class Row {
 public:
  explicit Row(sqlite3_stmt* statement) : statement_(statement) {}
  bool null(int column) const;
  std::int64_t integer(int column) const;
  double number(int column) const;
  std::string text(int column) const;  // also the bytes of a blob

 private:
  sqlite3_stmt* statement_;
};

class Database {
 public:
  static constexpr int kCacheKib = 256;

  static absl::StatusOr<std::unique_ptr<Database>> Open(const std::string& path,
                                                        const std::vector<std::string>& migrations);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  // One statement that gives no rows; how many it has changed.
  absl::StatusOr<std::int64_t> Run(std::string_view sql, const std::vector<SqlValue>& values = {});

  absl::Status Query(std::string_view sql, const std::vector<SqlValue>& values,
                     const std::function<void(const Row&)>& on_row);

  // Runs `work` in a transaction: committed if it returns OK, rolled back if not. Not nested.
  absl::Status Transact(const std::function<absl::Status()>& work);

 private:
  class Inside;
  Database();
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet
