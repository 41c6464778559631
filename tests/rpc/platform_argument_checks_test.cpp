#include <gmock/gmock.h>
#include <grpcpp/support/status.h>
#include <gtest/gtest.h>

#include <limits>

#include "platform/rpc/argument_checks.hpp"
#include "platform/rpc/roles.hpp"
#include "platform/rpc/status_mapping.hpp"

namespace lambdajet {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string ReasonOf(const ArgumentChecks& checks) { return TroubleReason(checks.status()); }

TEST(ArgumentChecks, PassWhatIsRight) {
  ArgumentChecks checks;
  checks.Finite("a", -0.0);
  checks.Positive("b_mm", 1e-308, "mm");
  checks.InRange("c", 5.0, 5.0, 5.0);
  checks.CountInRange("d", 3, 0, 3);
  checks.NonEmpty("e", "x");
  checks.Id("f", "machine-1");
  checks.Id("f", std::string(63, 'a'));
  checks.Text("g", "Łódź ☃ 𝄞", 64);
  checks.AllFinite("h", std::vector<double>{1, 2, 3});
  checks.Require(true, "i", "X", "");
  EXPECT_TRUE(checks.ok());
  EXPECT_TRUE(checks.status().ok());
}

TEST(ArgumentChecks, NameFieldValueUnitAndWhatIsRight) {
  ArgumentChecks checks;
  checks.InRange("feed_mm_per_s", 612.5, 0.1, 500.0, "mm/s");
  EXPECT_EQ(ReasonOf(checks), "OUT_OF_RANGE");
  EXPECT_EQ(checks.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(checks.status().message()),
              HasSubstr("feed_mm_per_s is 612.5 mm/s; right is 0.1 to 500 mm/s"));
}

TEST(ArgumentChecks, RefuseEveryKindOfWrong) {
  const auto reason = [](auto&& check) {
    ArgumentChecks checks;
    check(checks);
    return ReasonOf(checks);
  };
  for (const double wrong : {kNan, -kNan, kInfinity, -kInfinity}) {
    EXPECT_EQ(reason([&](ArgumentChecks& c) { c.Finite("x", wrong); }), "NOT_FINITE");
    EXPECT_EQ(reason([&](ArgumentChecks& c) { c.Positive("x", wrong); }), "NOT_FINITE");
    EXPECT_EQ(reason([&](ArgumentChecks& c) { c.InRange("x", wrong, -1, 1); }), "NOT_FINITE");
    EXPECT_EQ(reason([&](ArgumentChecks& c) {
                c.AllFinite("x", std::vector<double>{1, wrong});
              }),
              "NOT_FINITE");
  }
  EXPECT_EQ(reason([](ArgumentChecks& c) { c.Positive("x", 0.0); }), "MUST_BE_POSITIVE");
  EXPECT_EQ(reason([](ArgumentChecks& c) { c.CountInRange("x", 0, 1, 2); }), "TOO_FEW");
  EXPECT_EQ(reason([](ArgumentChecks& c) { c.CountInRange("x", 3, 1, 2); }), "TOO_MANY");
  EXPECT_EQ(reason([](ArgumentChecks& c) { c.NonEmpty("x", ""); }), "EMPTY");
  EXPECT_EQ(reason([](ArgumentChecks& c) { c.Text("x", "abc", 2); }), "TOO_LARGE");
  for (const std::string& id :
       {std::string("A"), std::string("a b"), std::string("../a"), std::string(64, 'a'), std::string("a\n"),
        std::string("a\0b", 3), std::string("é")}) {
    EXPECT_EQ(reason([&](ArgumentChecks& c) { c.Id("x", id); }), "BAD_ID") << id;
  }
}

TEST(ArgumentChecks, RefuseWhatIsNotUtf8) {
  for (const std::string& bad :
       {std::string("\xff"), std::string("\xc0\x80"), std::string("\xc1\xbf"), std::string("\xe0\x80\xaf"),
        std::string("\xed\xa0\x80"), std::string("\xf0\x80\x80\xaf"), std::string("\xf4\x90\x80\x80"),
        std::string("\xf5\x80\x80\x80"), std::string("\xe2\x98"), std::string("\x80"),
        std::string("a\0b", 3)}) {
    ArgumentChecks checks;
    checks.Text("x", bad, 100);
    EXPECT_EQ(ReasonOf(checks), "NOT_UTF8");
  }
}

TEST(ArgumentChecks, CollectAtMostTwentyAndRepeatLittle) {
  ArgumentChecks checks;
  checks.AllFinite("x_mm", std::vector<double>(1000, kNan));
  EXPECT_EQ(TroubleViolations(checks.status()).size(), 20u);
  EXPECT_EQ(TroubleViolations(checks.status())[19].field, "x_mm[19]");
  ArgumentChecks other;
  other.Id("id", std::string(100'000, 'Z'));
  EXPECT_LT(other.status().message().size(), 400u);
}

TEST(StatusMapping, BringsTroubleOverTheWireAndBack) {
  std::vector<FieldViolation> violations;
  for (int i = 0; i < 20; ++i) {
    violations.push_back({"f" + std::to_string(i), "is wrong", "OUT_OF_RANGE"});
  }
  absl::Status sent =
      Trouble(absl::StatusCode::kOutOfRange, "UNREACHABLE", "too far", {{"margin_mm", "-3.5"}});
  AttachViolations(sent, violations);
  const absl::Status read = FromWire(ToWire(sent));
  EXPECT_EQ(read.code(), sent.code());
  EXPECT_EQ(read.message(), sent.message());
  EXPECT_EQ(TroubleReason(read), "UNREACHABLE");
  EXPECT_EQ(TroubleDetailsOf(read), TroubleDetailsOf(sent));
  EXPECT_EQ(TroubleViolations(read), violations);
}

TEST(StatusMapping, GivesEveryFailureAReason) {
  for (int code = 1; code <= 16; ++code) {
    const absl::Status plain(static_cast<absl::StatusCode>(code), "x");
    EXPECT_EQ(ToWire(plain).error_code(), code);
    EXPECT_FALSE(TroubleReason(FromWire(ToWire(plain))).empty());
    EXPECT_FALSE(TroubleReason(FromWire(grpc::Status(static_cast<grpc::StatusCode>(code), "x"))).empty());
  }
  EXPECT_TRUE(ToWire(absl::OkStatus()).ok());
  EXPECT_TRUE(FromWire(grpc::Status::OK).ok());
}

TEST(StatusMapping, BearsDetailsThatAreRubbish) {
  const absl::Status read = FromWire(grpc::Status(grpc::StatusCode::INTERNAL, "x", "\xff\xff rubbish"));
  EXPECT_EQ(read.code(), absl::StatusCode::kInternal);
}

TEST(Roles, AreThoseOfTheCertificateAndNotOfTextThatLooksLikeThem) {
  const auto name = CertificateName::FromSubject("CN=clerk\\,OU=operators,OU=office+OU=second floor,O=x");
  EXPECT_EQ(name.common_name, "clerk,OU=operators");
  EXPECT_THAT(name.organizational_units, testing::ElementsAre("office", "second floor"));
  EXPECT_TRUE(CertificateName::FromSubject("").common_name.empty());
}

TEST(Roles, AllowWhatAnyRoleOfTheClientAllows) {
  const auto table =
      RoleTable::Parse({"viewer: CN=a OU=office -> CellService/Get* JobService/List*",
                        "operator: CN=a OU=operators -> CellService/HoldJob", "admin: CN=root -> *"});
  ASSERT_TRUE(table.ok()) << table.status();
  const auto judge = [&](const char* subject, const char* method) {
    return table->Judge(CertificateName::FromSubject(subject), std::string("/lambdajet.cell.v1.") + method);
  };
  EXPECT_TRUE(judge("CN=a", "CellService/GetJob").allowed);
  EXPECT_TRUE(judge("CN=a", "CellService/HoldJob").allowed);
  EXPECT_TRUE(judge("CN=b,OU=office", "JobService/ListJobs").allowed);
  EXPECT_TRUE(judge("CN=root", "CellService/StopJob").allowed);
  EXPECT_FALSE(judge("CN=b,OU=office", "CellService/HoldJob").allowed);
  EXPECT_FALSE(judge("CN=a", "CellService/HoldJobs").allowed);
  EXPECT_FALSE(judge("", "CellService/GetJob").allowed);
  EXPECT_FALSE(judge("OU=a", "CellService/GetJob").allowed) << "a unit is no name";
  EXPECT_TRUE(table->Judge({}, "/grpc.health.v1.Health/Check").allowed);
  EXPECT_THAT(judge("CN=b,OU=office", "CellService/HoldJob").may_call,
              testing::ElementsAre("operator", "admin"));
}

TEST(Roles, RefusesLinesThatNameNobodyOrNothing) {
  for (const char* line :
       {"", "operator", "operator: CN=a", ": CN=a -> */x", "operator: -> CellService/*",
        "operator: a -> CellService/*", "operator: CN= -> CellService/*", "operator: CN=a ->",
        "operator: CN=a -> HoldJob", "operator -> CN=a: CellService/*"}) {
    EXPECT_EQ(TroubleReason(RoleTable::Parse({line}).status()), "BAD_ROLE") << line;
  }
}

}  // namespace
}  // namespace lambdajet
