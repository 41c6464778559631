#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "simulated_plant/core/nominal_plant.hpp"
#include "simulated_plant/plant_file/plant_file.hpp"

namespace lambdajet::simulated_plant {
namespace {

std::string SourceFile(const std::string& name) {
  return std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/" + name;
}

MachineDescription DemoMachine() { return *ReadMachineFile(SourceFile("deploy/config/machine.yaml")); }

std::string Replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

std::string FirstTrouble(const std::string& yaml) {
  const auto truth = ParsePlant(yaml, "plant.yaml");
  EXPECT_FALSE(truth.ok());
  EXPECT_EQ(TroubleReason(truth.status()), "BAD_PLANT_FILE");
  return TroubleViolations(truth.status()).empty() ? ""
                                                   : TroubleViolations(truth.status()).front().description;
}

TEST(PlantFile, ReadsBackExactlyWhatItWrote) {
  const MachineDescription machine = DemoMachine();
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlantTruth truth = RandomPlant(machine, seed);
    truth.faults.push_back({FaultKind::kValveDelay, 1, 2.5, 3.5, 0.125});
    const std::string text = PlantText(truth);
    const auto again = ParsePlant(text, "again");
    ASSERT_TRUE(again.ok()) << again.status().ToString();
    EXPECT_EQ(PlantText(*again), text);
    EXPECT_EQ(again->X_DJ().x_mm, truth.X_DJ().x_mm);
    EXPECT_EQ(again->faults.at(0).value, 0.125);
  }
}

TEST(PlantFile, ShipsAPlantOfTheDemonstrationMachine) {
  const auto truth = ReadPlantFile(SourceFile("deploy/plants/shipped.yaml"));
  ASSERT_TRUE(truth.ok()) << truth.status().ToString();
  EXPECT_EQ(truth->machine_id, DemoMachine().machine_id);
  EXPECT_EQ(truth->marks.size(), DemoMachine().marks.size());
}

TEST(PlantFile, RefusesWithKeyValueAndLine) {
  const std::string good = PlantText(NominalPlant(DemoMachine()));
  EXPECT_EQ(FirstTrouble(Replaced(good, "  assembly_mode: 1", "  assembly_mode: 0")),
            "plant.yaml:8: mechanism.assembly_mode is 0; right is -1 or 1");
  EXPECT_EQ(FirstTrouble(Replaced(good, "moving_mass_kg: 20", "moving_mass_kg: -20")).substr(0, 11),
            "plant.yaml:");
  EXPECT_NE(FirstTrouble(Replaced(good, "moving_mass_kg: 20", "moving_mas_kg: 20")).find("moving_mas"),
            std::string::npos);
  EXPECT_NE(FirstTrouble(Replaced(good, "moving_mass_kg: 20", "moving_mass_kg: .nan"))
                .find("right is a finite number in kg"),
            std::string::npos);
  EXPECT_NE(FirstTrouble("][").find("not YAML"), std::string::npos);
  EXPECT_NE(FirstTrouble(Replaced(good, "slider_2_mm: ", "slider_2_mm: 9")).find("links meet"),
            std::string::npos);
}

TEST(RandomPlant, IsTheSameForTheSameSeedAndAlwaysValid) {
  const MachineDescription machine = DemoMachine();
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const PlantTruth truth = RandomPlant(machine, seed);
    EXPECT_TRUE(Validate(truth).empty()) << seed;
    EXPECT_EQ(PlantText(truth), PlantText(RandomPlant(machine, seed)));
    EXPECT_GE(truth.jet_offset_H_mm().norm(), 0.039);  // the paper's range 0.04 to 0.29 mm
    EXPECT_LE(truth.jet_offset_H_mm().norm(), 0.291);
  }
}

}  // namespace
}  // namespace lambdajet::simulated_plant
