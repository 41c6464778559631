// The nodes' real loops over real Fast DDS: what they allocate once they run, everything counted that the loop's thread asks of
// the heap, the library's own requests too.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>

#include "drive/bus/drive_node.hpp"
#include "main_motion/bus/main_motion_node.hpp"
#include "platform/bus/participant.hpp"
#include "platform/machine_file/machine_file.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/telemetry/log.hpp"
#include "platform/telemetry/metrics.hpp"
#include "simulated_plant/bus/simulated_modules.hpp"
#include "tests/support/bus_cell.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/hand_made_plan.hpp"
#include "tests/support/private_domain.hpp"

namespace {
thread_local std::atomic<std::uint64_t>* counter = nullptr;  // of this thread, where it is watched
void Count() {
  if (counter != nullptr) {
    counter->fetch_add(1, std::memory_order_relaxed);
  }
}
}  // namespace

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  Count();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  Count();
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  Count();
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  Count();
  return __libc_memalign(alignment, size);
}
}

namespace lambdajet::tests {
namespace {

std::unique_ptr<Participant> Join(const std::string& house, int domain) {
  BusOptions options;
  options.house = house;
  options.partition = "demo-1";
  options.domain = domain;
  options.profile_file = test::SourceDir() + "/deploy/dds/profiles.xml";
  auto participant = Participant::Open(options, nullptr, nullptr);
  EXPECT_TRUE(participant.ok()) << participant.status();
  return participant.ok() ? std::move(*participant) : nullptr;
}

// Watches a loop's thread from its hundredth cycle on; not what the simulated iron does there to tell its truth.
class LoopWatch {
 public:
  template <typename Iron>
  void AfterCycle(Iron&& iron) {
    counter = nullptr;
    iron();
    ++cycles;
    counter = cycles >= 100 ? &allocations : nullptr;
  }
  std::atomic<std::uint64_t> allocations = 0;
  std::atomic<std::uint64_t> cycles = 0;
};

class LoopAllocations : public testing::Test {
 protected:
  void SetUp() override {
    machine_ = *ReadMachineFile(test::SourceDir() + "/deploy/config/machine.yaml");
    simulated_plant::PlantOptions plant{.plant = test::SourceDir() + "/deploy/plants/shipped.yaml",
                                        .seed = 3};
    drive_bus_ = Join("drive", domain_.number());
    motion_bus_ = Join("main_motion", domain_.number());
    drive_plant_ = *simulated_plant::SimulatedDrive::Open(*drive_bus_, plant);
    motion_plant_ = *simulated_plant::SimulatedMainMotion::Open(*motion_bus_, plant);
    // This host may stand still; that is not what is asked here.
    drive::NodeConfig drive_config;
    drive_config.core.peer_deadline_s = 0.5;
    drive_config.core.setpoint_lead_s = 0.2;
    drive_config.core.overruns_allowed = 100;
    main_motion::NodeConfig motion_config;
    motion_config.core.drive_deadline_s = 0.5;
    motion_config.core.overruns_allowed = 100;
    drive_ = *drive::DriveNode::Open(
        {*drive_bus_, clock_, log_, metrics_}, drive_config, drive_plant_->hardware(),
        [this](const DriveState& state) { drive_watch_.AfterCycle([&] { drive_plant_->Publish(state); }); },
        [] {});
    motion_ = *main_motion::MainMotionNode::Open(
        {*motion_bus_, clock_, log_, metrics_}, motion_config, motion_plant_->hardware(),
        [this] { motion_plant_->Refresh(); },
        [this](const MainMotionState& state) {
          motion_watch_.AfterCycle([&] { motion_plant_->Publish(state); });
        },
        [] {});
    cell_ = std::make_unique<BusCell>(domain_.number(), machine_);
    ASSERT_TRUE(test::Eventually([&] {
      return cell_->drive().mode == ModuleMode::kSafe && cell_->main_motion().mode == ModuleMode::kSafe;
    }));
    cell_->PublishDescription();
  }

  Plan Circles() {
    HandMadePlan plan(machine_);
    plan.From(300, 300);
    plan.LineTo(340, 300, 250);
    plan.Gate(GateKind::kPierce, 0.2);
    for (int round = 0; round < 2; ++round) {
      plan.CircleAround(320, 300, 100);
    }
    plan.EventAt(ProcessAction::kAbrasiveOff, plan.s_mm() - 20);
    plan.EventAt(ProcessAction::kJetOff, plan.s_mm() - 20);
    plan.LineTo(300, 300, 250);
    return plan.Finish(77);
  }

  test::PrivateDomain domain_;
  MachineDescription machine_;
  CommonClock clock_;
  Log log_{{.house = "test", .level = LogLevel::kError}};
  Metrics metrics_;
  LoopWatch drive_watch_, motion_watch_;
  std::unique_ptr<Participant> drive_bus_, motion_bus_;
  std::unique_ptr<simulated_plant::SimulatedDrive> drive_plant_;
  std::unique_ptr<simulated_plant::SimulatedMainMotion> motion_plant_;
  std::unique_ptr<drive::DriveNode> drive_;
  std::unique_ptr<main_motion::MainMotionNode> motion_;
  std::unique_ptr<BusCell> cell_;
};

TEST_F(LoopAllocations, NoneWhileAPlanIsPlayed) {
  ASSERT_TRUE(cell_->Begin(Circles()));
  const auto drive_before = drive_watch_.allocations.load();
  const auto motion_before = motion_watch_.allocations.load();
  const auto cycles_before = drive_watch_.cycles.load();
  ASSERT_TRUE(test::Eventually(
      [&] {
        return cell_->drive().mode == ModuleMode::kComplete &&
               cell_->main_motion().mode == ModuleMode::kComplete;
      },
      std::chrono::seconds(60)));
  const auto cycles = drive_watch_.cycles.load() - cycles_before;
  std::printf(
      "allocations while a plan was played, DDS writes included: drive %lu, main motion %lu in %lu cycles; "
      "from the "
      "hundredth cycle to its start: %lu, %lu\n",
      drive_watch_.allocations.load() - drive_before, motion_watch_.allocations.load() - motion_before,
      cycles, drive_before, motion_before);
  EXPECT_GT(cycles, 1000u);
  EXPECT_EQ(drive_watch_.allocations.load() - drive_before, 0u);
  ASSERT_TRUE(test::Eventually([&] { return cell_->records().size() == 2; })) << "published beside the loop";
  EXPECT_EQ(motion_watch_.allocations.load() - motion_before, 0u);
}

}  // namespace
}  // namespace lambdajet::tests
