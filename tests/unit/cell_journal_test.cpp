#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "cell/store/journal.hpp"
#include "foundation/contract/trouble.hpp"

namespace lambdajet::cell {
namespace {

class JournalTest : public testing::Test {
 protected:
  JournalTest() {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    folder = std::filesystem::temp_directory_path() /
             ("lambdajet-journal-" + std::string(test->name()) + "-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    path = folder / "journal.sqlite";
  }
  ~JournalTest() override { std::filesystem::remove_all(folder); }

  std::unique_ptr<Journal> MustOpen() {
    auto journal = Journal::Open(path);
    EXPECT_TRUE(journal.ok()) << journal.status();
    return journal.ok() ? std::move(*journal) : nullptr;
  }

  static Job Wish(int number) {
    Job job;
    job.order.request_id = "wish-" + std::to_string(number);
    job.order.name = "plate ä";
    job.order.content_sha256 = "c" + std::to_string(number);
    job.order.feed_scale = 0.1 + 0.2;
    job.order.pins_version = true;
    job.order.machine_version = 3;
    job.order.submitted_ns = 1'700'000'000'123'456'789;
    return job;
  }

  std::filesystem::path folder;
  std::string path;
};

TEST_F(JournalTest, GivesBackEverythingThatWasWritten) {
  auto journal = MustOpen();
  Job job = Wish(1);
  job.progress.message = "it's \"odd\"\nwith two lines";
  job.progress.faults = {{3, 7, "UNKNOWN_WORD", "G99 µ"}, {4, 0, "", ""}};
  job.progress.plan_ids = {18446744073709551615ULL, 1};
  job.progress.length_mm = 1.0 / 3.0;
  job.progress.model_version = {"demo-1", 7, "abcdef"};
  job.progress.predicted_95_mm = 1e-300;
  const auto record = journal->Add(job, std::string("G1\0X", 4), 5);
  ASSERT_TRUE(record.ok()) << record.status();
  journal = MustOpen();
  const auto back = journal->Find(record->job.order.job_id);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->order.request_id, job.order.request_id);
  EXPECT_EQ(back->order.name, job.order.name);
  EXPECT_EQ(back->order.feed_scale, job.order.feed_scale);
  EXPECT_EQ(back->order.submitted_ns, job.order.submitted_ns);
  EXPECT_EQ(back->progress.message, job.progress.message);
  EXPECT_EQ(back->progress.faults, job.progress.faults);
  EXPECT_EQ(back->progress.plan_ids, job.progress.plan_ids);
  EXPECT_EQ(back->progress.length_mm, job.progress.length_mm);
  EXPECT_EQ(back->progress.predicted_95_mm, job.progress.predicted_95_mm);
  EXPECT_EQ(back->progress.model_version, job.progress.model_version);
  EXPECT_EQ(*journal->Program(record->job.order.job_id), std::string("G1\0X", 4));
}

TEST_F(JournalTest, ARequestIdBelongsToOneJobForEver) {
  auto journal = MustOpen();
  const auto first = journal->Add(Wish(1), "x", 1);
  ASSERT_TRUE(first.ok());
  EXPECT_FALSE(journal->Add(Wish(1), "y", 2).ok());
  EXPECT_EQ((*journal->FindRequest("wish-1"))->order.job_id, first->job.order.job_id);
  EXPECT_FALSE(journal->FindRequest("wish-2")->has_value());
}

TEST_F(JournalTest, NumbersRecordsWithoutGapsAndReadsOnFromAToken) {
  auto journal = MustOpen();
  Job job = journal->Add(Wish(1), "x", 1)->job;
  const Job other = journal->Add(Wish(2), "x", 1)->job;
  for (int i = 0; i < 20; ++i) {
    job.progress.s_mm = i;
    ASSERT_EQ(journal->Append(i % 2 == 0 ? job : other, i)->token, static_cast<std::uint64_t>(i + 3));
  }
  EXPECT_EQ(*journal->LastToken(), 22U);
  const auto rest = journal->Since(10, "", 100);
  ASSERT_EQ(rest->size(), 12U);
  EXPECT_EQ(rest->front().token, 11U);
  const auto own = journal->Since(0, job.order.job_id, 100);
  for (const JournalRecord& record : *own) {
    EXPECT_EQ(record.job.order.job_id, job.order.job_id);
  }
  EXPECT_EQ(own->size(), 11U);
}

TEST_F(JournalTest, ListsNewestFirstInPagesThatMissNothing) {
  auto journal = MustOpen();
  for (int i = 0; i < 25; ++i) {
    Job job = journal->Add(Wish(i), "x", 1)->job;
    if (i % 5 == 0) {
      job.progress.state = JobState::kCancelled;
      ASSERT_TRUE(journal->Append(job, 2).ok());
    }
  }
  std::vector<std::string> seen;
  std::int64_t before = 0;
  for (auto page = journal->List(before, std::nullopt, 7, before); !page->empty();
       page = journal->List(before, std::nullopt, 7, before)) {
    for (const Job& job : *page) {
      seen.push_back(job.order.job_id);
    }
  }
  EXPECT_EQ(seen.size(), 25U);
  EXPECT_TRUE(std::is_sorted(seen.rbegin(), seen.rend()));
  EXPECT_EQ(journal->List(0, JobState::kCancelled, 100, before)->size(), 5U);
  EXPECT_EQ(journal->Unfinished()->size(), 20U);
}

TEST_F(JournalTest, AddsUpTheRecordOfARun) {
  auto journal = MustOpen();
  const std::string job_id = journal->Add(Wish(1), "x", 1)->job.order.job_id;
  JobRecord part;
  part.cutting_time_s = 1.5;
  part.drive_overruns = 2;
  part.events = {{1, 2, 3, 4}};
  part.trace = {{0, 1, 2, 3, 4, 5}, {6, 7, 8, 9, 10, 11}};
  ASSERT_TRUE(journal->Checkpoint(job_id, 10.0, part).ok());
  ASSERT_TRUE(journal->Checkpoint(job_id, 20.0, part).ok());
  const auto record = journal->Record(job_id);
  EXPECT_EQ(record->cutting_time_s, 3.0);
  EXPECT_EQ(record->drive_overruns, 4U);
  ASSERT_EQ(record->events.size(), 2U);
  EXPECT_EQ(record->events[1].deviation_mm, 3.0);
  ASSERT_EQ(record->trace.size(), 4U);
  EXPECT_EQ(record->trace[3].s_mm, 11.0);
  EXPECT_EQ(journal->Find(job_id)->progress.s_mm, 20.0);
}

TEST_F(JournalTest, SaysWhatIsWrongWithAFileThatIsNoJournal) {
  std::ofstream(path) << std::string(10000, 'x');
  EXPECT_EQ(TroubleReason(Journal::Open(path).status()), "DATABASE_DAMAGED");
  const absl::Status nowhere = Journal::Open("/nowhere/at/all.sqlite").status();
  EXPECT_FALSE(nowhere.ok());
  EXPECT_NE(nowhere.message().find("/nowhere/at/all.sqlite"), std::string::npos) << nowhere;
}

TEST_F(JournalTest, NamesTheJobThatIsNotThere) {
  EXPECT_EQ(TroubleReason(MustOpen()->Find("job-9").status()), "JOB_UNKNOWN");
}

// A child writes and tells through a pipe what the journal has confirmed; it is killed at no moment in particular. All
// that was confirmed must be there, and nothing half.
TEST_F(JournalTest, SurvivesAKillAtAnyMoment) {
  const char* rounds_wanted = std::getenv("LAMBDAJET_KILLS");
  const int rounds = rounds_wanted == nullptr ? 15 : std::atoi(rounds_wanted);
  std::uint64_t confirmed = 0;
  int next_wish = 0;
  for (int round = 0; round < rounds; ++round) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
      auto journal = Journal::Open(path);
      for (int wish = next_wish; journal.ok(); ++wish) {
        auto record = (*journal)->Add(Wish(wish), "G1 X1", wish);
        for (int step = 0; record.ok() && step < 3; ++step) {
          const std::uint64_t token = record->token;
          if (write(ends[1], &token, sizeof token) < 0) {
            _exit(2);
          }
          record->job.progress.s_mm = static_cast<double>(record->token + 1);
          record = (*journal)->Append(record->job, wish);
        }
        if (!record.ok()) {
          _exit(3);
        }
      }
      _exit(1);
    }
    close(ends[1]);
    // Waits for the first word, so that the kill falls among writes; then a little more each round.
    std::uint64_t token = 0;
    const int words = 1 + (round * 7) % 23;
    for (int i = 0; i < words && read(ends[0], &token, sizeof token) == static_cast<ssize_t>(sizeof token);
         ++i) {
      confirmed = token;
    }
    kill(child, SIGKILL);
    while (read(ends[0], &token, sizeof token) == static_cast<ssize_t>(sizeof token)) {
      confirmed = token;
    }
    close(ends[0]);
    int how = 0;
    waitpid(child, &how, 0);
    ASSERT_TRUE(WIFSIGNALED(how)) << "the child ended by itself with " << WEXITSTATUS(how);

    const auto journal = MustOpen();
    ASSERT_GE(*journal->LastToken(), confirmed);
    const auto records = journal->Since(0, "", 100000);
    ASSERT_TRUE(records.ok()) << records.status();
    for (std::size_t i = 0; i < records->size(); ++i) {
      ASSERT_EQ((*records)[i].token, i + 1);
    }
    // Each job's state is that of its last record.
    const auto unfinished = journal->Unfinished();
    for (const Job& job : *unfinished) {
      const auto own = journal->Since(0, job.order.job_id, 100);
      ASSERT_FALSE(own->empty());
      ASSERT_EQ(own->back().job.progress.s_mm, job.progress.s_mm);
      ASSERT_EQ(*journal->Program(job.order.job_id), "G1 X1");
    }
    next_wish = static_cast<int>(unfinished->size());
  }
  EXPECT_GT(confirmed, static_cast<std::uint64_t>(rounds));
}

}  // namespace
}  // namespace lambdajet::cell
