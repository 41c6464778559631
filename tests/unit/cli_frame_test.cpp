#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <random>

#include "clients/cli/csv.hpp"
#include "clients/cli/exit_code.hpp"
#include "clients/cli/text_file.hpp"
#include "foundation/contract/trouble.hpp"

namespace lambdajet::cli {
namespace {

TEST(CsvTable, ReadsBackEveryNumberThatItWroteExactly) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> exponent(-12, 12);
  CsvTable table({"x_W_mm", "y_W_mm"});
  std::vector<double> wanted;
  for (int i = 0; i < 1000; ++i) {
    wanted.push_back(std::pow(10.0, exponent(random)) * (i % 2 == 0 ? 1 : -1));
    table.AddRow(std::vector<double>{wanted.back(), 0.1});
  }
  const auto back = CsvTable::Parse(table.ToText(), "memory");
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(*back->Numbers("x_W_mm"), wanted);
}

TEST(CsvTable, KeepsQuotedCellsAndSkipsCommentsAndBlankLines) {
  const auto table = CsvTable::Parse("# by hand\nname,x_W_mm\n\n\"a, \"\"b\"\"\", 1.5\n", "memory");
  ASSERT_TRUE(table.ok());
  EXPECT_EQ(table->Texts("name")->at(0), "a, \"b\"");
  EXPECT_EQ(table->Numbers("x_W_mm")->at(0), 1.5);
}

TEST(CsvTable, NamesTheLineOfACellThatIsNoNumber) {
  for (const char* cell : {"nan", "inf", "1,5x", "", "1.5 mm", "--1"}) {
    const auto table = CsvTable::Parse(std::string("a;x_W_mm\n1;2\n1;") + cell + "\n", "file.csv");
    ASSERT_TRUE(table.ok()) << cell;
    const auto numbers = table->Numbers("x_W_mm");
    ASSERT_FALSE(numbers.ok()) << cell;
    EXPECT_EQ(TroubleReason(numbers.status()), "CSV_NOT_A_NUMBER");
    EXPECT_NE(numbers.status().message().find("file.csv:3"), std::string::npos) << numbers.status();
  }
}

TEST(CsvTable, RefusesMissingColumnsRaggedRowsAndNothing) {
  const auto table = CsvTable::Parse("x_mm\n1\n", "memory");
  ASSERT_TRUE(table.ok());
  EXPECT_EQ(TroubleReason(table->Numbers("y_mm").status()), "CSV_COLUMN_MISSING");
  EXPECT_EQ(TroubleReason(CsvTable::Parse("x,y\n1\n", "memory").status()), "CSV_WRONG_WIDTH");
  EXPECT_EQ(TroubleReason(CsvTable::Parse("", "memory").status()), "CSV_EMPTY");
}

TEST(TextFile, SaysWhatIsNotThere) {
  EXPECT_EQ(ReadTextFile("/nowhere/at/all").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(TroubleReason(WriteTextFile("/nowhere/at/all", "x")), "FILE_NOT_WRITTEN");
}

TEST(ExitCode, TellsUnreachableRefusedTimeoutAndPreconditionApart) {
  EXPECT_EQ(ExitCodeOf(absl::OkStatus()), ExitCode::kOk);
  EXPECT_EQ(ExitCodeOf(absl::UnavailableError("")), ExitCode::kUnreachable);
  EXPECT_EQ(ExitCodeOf(absl::InvalidArgumentError("")), ExitCode::kRefused);
  EXPECT_EQ(ExitCodeOf(absl::DeadlineExceededError("")), ExitCode::kTimeout);
  EXPECT_EQ(ExitCodeOf(absl::FailedPreconditionError("")), ExitCode::kPrecondition);
  EXPECT_EQ(ExitCodeOf(absl::InternalError("")), ExitCode::kFailure);
  EXPECT_EQ(ExitCodeOf(ReadTextFile("/nowhere/at/all").status()), ExitCode::kUsage);
  EXPECT_EQ(ExitCodeOf(CsvTable::Parse("", "memory").status()), ExitCode::kUsage);
}

}  // namespace
}  // namespace lambdajet::cli
