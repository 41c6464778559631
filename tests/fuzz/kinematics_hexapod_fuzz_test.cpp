// Throws seeded mutations at the hexapod's wire converters and its YAML reader: no crash, nothing on the wire that is not
// finite, and the mutations are near enough to right requests that many are understood and some are answered.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "kinematics/core/hexapod.hpp"
#include "platform/machine_file/hexapod_file.hpp"
#include "tests/fuzz/byte_mutations.hpp"
#include "tests/fuzz/hexapod_questions.hpp"

namespace lambdajet::kinematics {
namespace {

TEST(HexapodFuzz, EverySeedIsAnswered) {
  for (int question = 0; question < fuzz::kHexapodQuestions; ++question) {
    const fuzz::HexapodOutcome outcome = fuzz::AskHexapod(question, fuzz::HexapodSeed(question));
    EXPECT_TRUE(outcome.understood && outcome.answered) << "question " << question;
  }
}

TEST(HexapodFuzz, MutatedRequestsGetAStatusOrAFiniteAnswer) {
  constexpr std::array<int, fuzz::kHexapodQuestions> kCounts = {20000, 10000, 10000, 10000,
                                                                5000,  5000,  1000,  5000};
  for (int question = 0; question < fuzz::kHexapodQuestions; ++question) {
    test::ByteMutations mutate(static_cast<unsigned>(question + 1));
    const std::string seed = fuzz::HexapodSeed(question);
    const int count = kCounts[static_cast<std::size_t>(question)];
    int understood = 0, answered = 0;
    for (int i = 0; i < count; ++i) {
      const fuzz::HexapodOutcome outcome = fuzz::AskHexapod(question, mutate(seed));
      understood += outcome.understood ? 1 : 0;
      answered += outcome.answered ? 1 : 0;
    }
    EXPECT_GT(understood, count / 50)
        << "question " << question;  // most of the rest is not a message any more
    EXPECT_GT(answered, 0) << "question " << question;
  }
}

TEST(HexapodFileFuzz, RefusesOrReadsWhatCanBeWrittenAgain) {
  std::ostringstream text;
  text << std::ifstream(std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/deploy/config/hexapod.yaml")
              .rdbuf();
  test::ByteMutations mutate(8);
  int read = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto machine = ParseHexapod(mutate(text.str()), "fuzz");
    if (machine.ok()) {
      ++read;
      ASSERT_EQ(FaultOf(machine->geometry), "");
      const HexapodInverse home = SolveInverse(Hexapod(machine->geometry), machine->geometry.X_MP_home);
      ASSERT_TRUE(home.lengths_mm.allFinite());
    }
  }
  EXPECT_GT(read, 0);
}

}  // namespace
}  // namespace lambdajet::kinematics
