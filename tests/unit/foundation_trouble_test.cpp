#include <gtest/gtest.h>

#include "foundation/contract/trouble.hpp"

namespace lambdajet {
namespace {

TEST(Trouble, GivesBackWhatWasPutIn) {
  const absl::Status status = Trouble(absl::StatusCode::kNotFound, "UNKNOWN_MACHINE",
                                      "machine m-9 is not known", {{"machine_id", "m-9"}, {"known", "2"}});
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(TroubleReason(status), "UNKNOWN_MACHINE");
  EXPECT_EQ(TroubleDetailsOf(status).at("machine_id"), "m-9");
  EXPECT_EQ(TroubleDetailsOf(status).at("known"), "2");
  EXPECT_TRUE(TroubleViolations(status).empty());
}

TEST(Trouble, KeepsViolationsInOrder) {
  std::vector<FieldViolation> violations;
  for (int i = 0; i < 20; ++i) {
    violations.push_back(
        {"poses[" + std::to_string(i) + "].x_mm", "nan: must be a finite number", "NOT_FINITE"});
  }
  const absl::Status status = InvalidFields("NOT_FINITE", "20 fields are wrong", violations);
  EXPECT_EQ(TroubleViolations(status), violations);
}

TEST(Trouble, FindsNothingInAStatusOfAnother) {
  EXPECT_EQ(TroubleReason(absl::OkStatus()), "");
  EXPECT_EQ(TroubleReason(absl::InternalError("boom")), "");
  EXPECT_TRUE(TroubleDetailsOf(absl::InternalError("boom")).empty());
}

}  // namespace
}  // namespace lambdajet
