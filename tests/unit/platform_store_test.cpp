#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include "foundation/contract/trouble.hpp"
#include "platform/store/database.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/temporary_folder.hpp"

namespace lambdajet::test {
namespace {

const std::vector<std::string> kMigrations = {
    "CREATE TABLE job (id TEXT PRIMARY KEY, state INTEGER, note BLOB)"};

class Store : public ::testing::Test {
 protected:
  std::unique_ptr<Database> Open(const std::vector<std::string>& migrations = kMigrations) {
    auto database = Database::Open(path_, migrations);
    EXPECT_TRUE(database.ok()) << database.status().ToString();
    return database.ok() ? std::move(*database) : nullptr;
  }
  static std::int64_t Count(Database& database) {
    std::int64_t count = -1;
    EXPECT_TRUE(
        database.Query("SELECT count(*) FROM job", {}, [&](const Row& row) { count = row.integer(0); }).ok());
    return count;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.File("jobs.sqlite");
};

TEST_F(Store, GivesBackWhatWasPutIn) {
  auto database = Open();
  const std::string bytes("a\0b", 3);
  ASSERT_EQ(*database->Run("INSERT INTO job VALUES (?, ?, ?)", {"job-1", 7, SqlBlob{bytes}}), 1);
  ASSERT_EQ(*database->Run("INSERT INTO job VALUES (?, ?, ?)", {std::string("job-2"), 2.5, nullptr}), 1);
  std::vector<std::string> seen;
  ASSERT_TRUE(database
                  ->Query("SELECT id, state, note FROM job ORDER BY id", {},
                          [&](const Row& row) {
                            seen.push_back(row.text(0));
                            if (seen.size() == 1) {
                              EXPECT_EQ(row.integer(1), 7);
                              EXPECT_EQ(row.text(2), bytes);
                            } else {
                              EXPECT_EQ(row.number(1), 2.5);
                              EXPECT_TRUE(row.null(2));
                            }
                          })
                  .ok());
  EXPECT_EQ(seen, (std::vector<std::string>{"job-1", "job-2"}));
}

// As a journal grows from shift to shift: by a little in every transaction, read back now and then.
TEST_F(Store, HoldsNoMoreInMemoryHoweverLongTheFileGrows) {
  auto database = Open();
  const std::string note(64 << 10, 'n');
  std::int64_t early = 0;
  for (int i = 0; i < 64; ++i) {
    ASSERT_TRUE(
        database->Run("INSERT INTO job VALUES (?, ?, ?)", {"job-" + std::to_string(i), i, SqlBlob{note}})
            .ok());
    EXPECT_EQ(Count(*database), i + 1);
    early = i == 3 ? sqlite3_memory_used() : early;
  }
  EXPECT_GT(std::filesystem::file_size(path_) + std::filesystem::file_size(path_ + "-wal"), 4u << 20);
  EXPECT_LE(sqlite3_memory_used(), early + (Database::kCacheKib << 10)) << "from " << early << " bytes";
}

TEST_F(Store, RollsBackAWorkThatFails) {
  auto database = Open();
  const absl::Status status = database->Transact([&] {
    EXPECT_TRUE(database->Run("INSERT INTO job VALUES ('a', 1, NULL)").ok());
    return absl::AbortedError("on second thoughts");
  });
  EXPECT_EQ(status.code(), absl::StatusCode::kAborted);
  EXPECT_EQ(Count(*database), 0);
  EXPECT_TRUE(
      database->Transact([&] { return database->Run("INSERT INTO job VALUES ('a', 1, NULL)").status(); })
          .ok());
  EXPECT_EQ(Count(*database), 1);
}

TEST_F(Store, NamesASecondOfAUniqueKey) {
  auto database = Open();
  ASSERT_TRUE(database->Run("INSERT INTO job VALUES ('a', 1, NULL)").ok());
  EXPECT_EQ(TroubleReason(database->Run("INSERT INTO job VALUES ('a', 2, NULL)").status()), "CONSTRAINT");
}

TEST_F(Store, AppliesOnlyWhatIsNewAndRefusesTheFuture) {
  Open();
  std::vector<std::string> two = kMigrations;
  two.push_back("ALTER TABLE job ADD COLUMN operator TEXT");
  ASSERT_TRUE(Open(two)->Run("INSERT INTO job VALUES ('a', 1, NULL, 'ann')").ok());
  EXPECT_EQ(TroubleReason(Database::Open(path_, kMigrations).status()), "DATABASE_TOO_NEW");
}

TEST_F(Store, LeavesTheFileAsItWasWhenAMigrationFails) {
  Open();
  std::vector<std::string> bad = kMigrations;
  bad.push_back("CREATE TABLE extra (id INTEGER); CREATE TABLE job (id INTEGER)");
  EXPECT_FALSE(Database::Open(path_, bad).ok());
  auto database = Open();
  EXPECT_FALSE(database->Query("SELECT * FROM extra", {}, nullptr).ok());
}

TEST_F(Store, KeepsEveryCommittedRowWhenKilled) {
  Open();
  int tell[2];
  ASSERT_EQ(pipe(tell), 0);
  const pid_t child = fork();
  if (child == 0) {
    auto database = Database::Open(path_, kMigrations);
    for (int i = 0;; ++i) {
      if ((*database)->Run("INSERT INTO job VALUES (?, ?, NULL)", {std::to_string(i), i}).ok()) {
        const char committed = 1;
        if (write(tell[1], &committed, 1) != 1) {
          _exit(1);
        }
      }
    }
  }
  close(tell[1]);
  int committed = 0;
  char byte = 0;
  while (committed < 50 && read(tell[0], &byte, 1) == 1) {
    ++committed;
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  while (read(tell[0], &byte, 1) == 1) {
    ++committed;
  }
  close(tell[0]);
  auto database = Open();
  EXPECT_GE(Count(*database), committed);
  EXPECT_LE(Count(*database), committed + 1);
}

TEST_F(Store, SaysThatTheDiskIsFull) {
  auto database = Open();
  ASSERT_TRUE(database->Query("PRAGMA max_page_count = 20", {}, nullptr).ok());
  absl::Status status;
  for (int i = 0; status.ok() && i < 1000; ++i) {
    status = database->Run("INSERT INTO job VALUES (?, 0, ?)", {std::to_string(i), std::string(4096, 'x')})
                 .status();
  }
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(TroubleReason(status), "DISK_FULL");
}

TEST_F(Store, SaysThatAFileIsDamagedOrOutOfReach) {
  folder_.Write("jobs.sqlite", std::string(8192, 'x'));
  EXPECT_EQ(TroubleReason(Database::Open(path_, kMigrations).status()), "DATABASE_DAMAGED");
  EXPECT_EQ(TroubleReason(Database::Open("/no/such/folder/x.sqlite", kMigrations).status()), "NOT_PERMITTED");
}

TEST_F(Store, ServesManyThreads) {
  auto database = Open();
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 25; ++i) {
        EXPECT_TRUE(database
                        ->Transact([&] {
                          return database
                              ->Run("INSERT INTO job VALUES (?, ?, NULL)", {std::to_string(t * 100 + i), t})
                              .status();
                        })
                        .ok());
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_EQ(Count(*database), 100);
}

}  // namespace
}  // namespace lambdajet::test
