// Keeps looks, versions and identifications in one SQLite file that survives a kill at any time.
//
// Model: SQLite in WAL mode with synchronous=FULL; every call is one transaction: it happened whole or not at all. A plan
// that is played again gives a new *pass* of the same run: gates rise within a pass. The active version is a row like any
// other.
// Units: of the core; numbers keep all their bits.
// Threads: any; calls take turns.
// Errors: RESOURCE_EXHAUSTED DISK_FULL, UNAVAILABLE STORE_IN_USE, DATA_LOSS STORE_DAMAGED, FAILED_PRECONDITION
// STORE_NOT_WRITABLE or STORE_OF_ANOTHER_BUILD, INTERNAL STORE_FAILED.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "calibration/core/measurement.hpp"
#include "calibration/core/version.hpp"

namespace lambdajet::calibration {

// A look as it came from the bus.
struct RecordedLook {
  std::uint64_t plan = 0;
  std::uint64_t session =
      0;  // of the writer, with the sequence number the same look's name wherever it comes again
  std::uint64_t sequence_number = 0;
  std::uint32_t gate = 0;
  Measurement look;
};

// The latest pass of a run.
struct RunHead {
  std::uint64_t plan = 0;
  std::uint32_t pass = 0;
  std::uint32_t looks = 0;
  std::uint32_t unseen = 0;
  std::int64_t first_exposure_ns = 0;
  std::int64_t row = 0;  // of its last look: newer runs have larger ones
};

enum class OperationState : std::uint8_t { kRunning = 1, kDone = 2, kFailed = 3, kCancelled = 4 };

struct StoredOperation {
  std::string id;
  std::uint64_t plan = 0;
  std::string author;
  OperationState state = OperationState::kRunning;
  std::string reason;
  std::string message;
  std::string report;  // JSON of an IdentificationReport, empty unless done
};

class CalibrationStore {
 public:
  static absl::StatusOr<std::unique_ptr<CalibrationStore>> Open(const std::string& path);
  ~CalibrationStore();
  CalibrationStore(const CalibrationStore&) = delete;
  CalibrationStore& operator=(const CalibrationStore&) = delete;

  // The machine file's canonical text as version 0 was made from it; empty in a new store.
  absl::StatusOr<std::string> AsDesigned();
  // Makes version 0, active; only in a new store.
  absl::Status Begin(const std::string& as_designed_yaml, const Version& version);

  // Looks that are already there are passed over; returns how many were new.
  absl::StatusOr<int> AddLooks(const std::vector<RecordedLook>& looks);
  // Newest first, rows below `before_row` (0: from the newest).
  absl::StatusOr<std::vector<RunHead>> Runs(int most, std::int64_t before_row);
  // Of the latest pass, by arrival; empty for an unknown plan.
  absl::StatusOr<std::vector<RecordedLook>> Looks(std::uint64_t plan);

  // Newest first, numbers below `before` (none: from the newest); `most` 0 gives all.
  absl::StatusOr<std::vector<Version>> Versions(int most, std::optional<std::uint32_t> before);
  absl::StatusOr<std::optional<Version>> FindVersion(std::uint32_t number);
  absl::StatusOr<std::uint32_t> ActiveVersion();
  absl::Status Activate(std::uint32_t number, const std::string& author, std::int64_t now_utc_ns);

  absl::Status AddOperation(const StoredOperation& operation);
  absl::Status EndOperation(const StoredOperation& operation);
  // Ends the operation as done and adds its version, numbered one above the highest, in one transaction.
  absl::StatusOr<std::uint32_t> EndWithVersion(const StoredOperation& operation, Version version);
  absl::StatusOr<std::optional<StoredOperation>> FindOperation(const std::string& id);
  // Operations that a killed process left running become FAILED INTERRUPTED; returns how many.
  absl::StatusOr<int> EndInterrupted();

 private:
  class Inside;
  CalibrationStore();
  std::unique_ptr<Inside> inside_;
};

}  // namespace lambdajet::calibration
