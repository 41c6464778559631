// A plan that travels to the modules in batches arrives as it left: every kind of gate, input, event and number of it. And
// nothing of a batch is left as the writer's last one had it, so that no field of the wire is ever forgotten.
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

#include "foundation/motion/plan_batches.hpp"
#include "lambdajet/trajectory/v1/plan.h"
#include "link/wire/link_wire.hpp"

namespace lambdajet {
namespace {

using WireSegments = idl::trajectory::v1::SegmentBatch;
using WireProcess = idl::trajectory::v1::ProcessBatch;

constexpr std::uint32_t kGateKinds = 6;
constexpr std::uint32_t kActions = 7;
static_assert(static_cast<std::uint32_t>(GateKind::kInput) + 1 == kGateKinds);
static_assert(static_cast<std::uint32_t>(ProcessAction::kAbrasiveFlow) + 1 == kActions);

// What a module must know of it, member by member: taken apart, so that a new member does not compile here until it is
// compared or named as staying with the planner.
void ExpectSame(const Segment& sent, const Segment& came) {
  const auto& [index, start_s, duration_s, q_mm, lead_mm, s_mm, gate_at_end] = sent;
  EXPECT_EQ(came.index, index);
  EXPECT_EQ(came.start_s, start_s);
  EXPECT_EQ(came.duration_s, duration_s);
  for (std::size_t a = 0; a < kActuatorCount; ++a) {
    EXPECT_EQ(came.q_mm[a].c, q_mm[a].c);
    EXPECT_EQ(came.lead_mm[a].c, lead_mm[a].c);
  }
  EXPECT_EQ(came.s_mm.c, s_mm.c);
  EXPECT_EQ(came.gate_at_end, gate_at_end);
}

void ExpectSame(const Gate& sent, const Gate& came) {
  const auto& [id, kind, s_mm, argument, source_line, condition] = sent;
  EXPECT_EQ(came.id, id);
  EXPECT_EQ(came.kind, kind);
  EXPECT_EQ(came.s_mm, s_mm);
  EXPECT_EQ(came.argument, argument);
  EXPECT_EQ(came.source_line, 0U) << "stays with the planner";
  EXPECT_EQ(came.condition, condition);
}

void ExpectSame(const ProcessEvent& sent, const ProcessEvent& came) {
  const auto& [index, action, s_mm, argument, source_line] = sent;
  EXPECT_EQ(came.index, index);
  EXPECT_EQ(came.action, action);
  EXPECT_EQ(came.s_mm, s_mm);
  EXPECT_EQ(came.argument, argument);
  EXPECT_EQ(came.source_line, 0U) << "stays with the planner";
}

template <typename Entry>
void ExpectSame(const std::vector<Entry>& sent, const std::vector<Entry>& came) {
  ASSERT_EQ(came.size(), sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    ExpectSame(sent[i], came[i]);
  }
}

void ExpectSame(const Plan& sent, const Plan& came) {
  const auto& [id, machine_id, machine_version, compensated, elastic_lag_s2, duration_s, length_mm, segments,
               gates, events] = sent;
  EXPECT_EQ(came.id, id);
  EXPECT_EQ(came.elastic_lag_s2, elastic_lag_s2);
  EXPECT_EQ(came.duration_s, duration_s);
  ExpectSame(segments, came.segments);
  ExpectSame(gates, came.gates);
  ExpectSame(events, came.events);
}

// Each number is drawn anew, so that two fields that change places differ.
class RandomPlan {
 public:
  explicit RandomPlan(std::uint64_t seed) : chance_(seed) {}

  Plan Draw() {
    Plan plan;
    plan.id = chance_();
    plan.elastic_lag_s2 = Number();
    plan.duration_s = Number();
    plan.segments.resize(chance_() % 40);
    plan.gates.resize(chance_() % 150);
    plan.events.resize(chance_() % 150);
    std::uint32_t index = 0;
    for (Segment& segment : plan.segments) {
      segment = DrawSegment(index++);
    }
    // Every kind with every input and event of it comes in turn, from a place drawn.
    const auto turn = static_cast<std::uint32_t>(chance_() % 1000);
    std::uint32_t id = 0;
    for (Gate& gate : plan.gates) {
      ++id;
      gate = DrawGate(id, turn + id);
    }
    std::uint32_t place = 0;
    for (ProcessEvent& event : plan.events) {
      event = {place, static_cast<ProcessAction>((turn + place) % kActions), Number(), Number(), Line()};
      ++place;
    }
    return plan;
  }

  SampleHeader DrawHeader() { return {chance_(), chance_(), static_cast<std::int64_t>(chance_())}; }

 private:
  double Number() {
    constexpr double kEdges[] = {0.0, -0.0, std::numeric_limits<double>::max(),
                                 std::numeric_limits<double>::denorm_min()};
    if (chance_() % 50 == 0) {
      return kEdges[chance_() % 4];
    }
    return std::uniform_real_distribution<double>(-1e4, 1e4)(chance_);
  }
  std::uint32_t Line() { return 1 + static_cast<std::uint32_t>(chance_() % 1000); }

  Polynomial DrawPolynomial() {
    Polynomial polynomial;
    for (double& c : polynomial.c) {
      c = Number();
    }
    return polynomial;
  }

  Segment DrawSegment(std::uint32_t index) {
    return {index,
            Number(),
            Number(),
            {DrawPolynomial(), DrawPolynomial()},
            {DrawPolynomial(), DrawPolynomial()},
            DrawPolynomial(),
            static_cast<std::uint32_t>(chance_())};
  }

  Gate DrawGate(std::uint32_t id, std::uint32_t turn) {
    const auto kind = static_cast<GateKind>(turn % kGateKinds);
    const std::uint32_t state = turn / kGateKinds;
    const auto input = static_cast<ProcessInput>(state % kProcessInputs);
    std::uint32_t event = state / kProcessInputs % kInputEvents;
    if (kind == GateKind::kInput && event == 0) {
      event = 1;  // an input without an event is refused
    }
    return {id, kind, Number(), Number(), Line(), InputCondition::Of(input, static_cast<InputEvent>(event))};
  }

  std::mt19937_64 chance_;
};

template <typename Batch, typename Wire>
Batch Travelled(const Batch& batch, Wire& wire) {
  link::ToWire(batch, wire);
  Batch came;
  EXPECT_TRUE(link::FromWire(wire, came));
  EXPECT_EQ(came.header.session, batch.header.session);
  EXPECT_EQ(came.header.sequence_number, batch.header.sequence_number);
  EXPECT_EQ(came.header.time_ns, batch.header.time_ns);
  EXPECT_EQ(came.plan, batch.plan);
  return came;
}

// The plan in batches over the wire; one wire sample carries them all, as in the streamer.
Plan Travelled(const Plan& plan, RandomPlan& random) {
  Plan came;
  WireSegments segment_wire;
  WireProcess process_wire;
  do {
    SegmentBatch batch;
    batch.header = random.DrawHeader();
    FillBatch(plan, {static_cast<std::uint32_t>(came.segments.size()), kSegmentsPerBatch}, batch);
    const SegmentBatch arrived = Travelled(batch, segment_wire);
    came.id = arrived.plan;
    came.elastic_lag_s2 = arrived.elastic_lag_s2;
    came.duration_s = arrived.duration_s;
    EXPECT_EQ(arrived.segment_count, plan.segments.size());
    came.segments.insert(came.segments.end(), arrived.segments.begin(),
                         arrived.segments.begin() + arrived.count);
  } while (came.segments.size() < plan.segments.size() && !testing::Test::HasFailure());
  while (came.gates.size() + came.events.size() < plan.gates.size() + plan.events.size() &&
         !testing::Test::HasFailure()) {
    ProcessBatch batch;
    batch.header = random.DrawHeader();
    const PlanRange gates{static_cast<std::uint32_t>(came.gates.size()) + 1, kEventsPerBatch};
    const PlanRange events{static_cast<std::uint32_t>(came.events.size()), kEventsPerBatch};
    FillBatch(plan, ProcessRange{gates, events}, batch);
    const ProcessBatch arrived = Travelled(batch, process_wire);
    EXPECT_EQ(arrived.gate_total, plan.gates.size());
    EXPECT_EQ(arrived.event_total, plan.events.size());
    came.gates.insert(came.gates.end(), arrived.gates.begin(), arrived.gates.begin() + arrived.gate_count);
    came.events.insert(came.events.end(), arrived.events.begin(),
                       arrived.events.begin() + arrived.event_count);
  }
  return came;
}

TEST(PlanWire, APlanArrivesAsItLeft) {
  for (std::uint64_t seed = 1; seed <= 300 && !HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    RandomPlan random(seed);
    const Plan plan = random.Draw();
    ExpectSame(plan, Travelled(plan, random));
  }
}

// A sample whose every field, known here or not, holds the bytes given: read from them as if they came over the wire.
template <typename Wire>
Wire Filled(char byte) {
  std::vector<char> bytes(Wire::getMaxCdrSerializedSize(), byte);
  eprosima::fastcdr::FastBuffer buffer(bytes.data(), bytes.size());
  eprosima::fastcdr::Cdr stream(buffer);
  Wire wire;
  wire.deserialize(stream);
  return wire;
}

// Where a field of the IDL is not written, the two samples keep what they held before.
template <typename Wire, typename Batch>
void ExpectEveryFieldWritten(const Batch& full) {
  Wire one = Filled<Wire>('\1');
  Wire other = Filled<Wire>('\2');
  ASSERT_FALSE(one == other);
  link::ToWire(full, one);
  link::ToWire(full, other);
  EXPECT_TRUE(one == other);
}

Plan FullPlan() {
  for (std::uint64_t seed = 1;; ++seed) {
    Plan plan = RandomPlan(seed).Draw();
    if (plan.segments.size() >= kSegmentsPerBatch && plan.gates.size() >= kEventsPerBatch &&
        plan.events.size() >= kEventsPerBatch) {
      return plan;
    }
  }
}

TEST(PlanWire, EveryFieldOfAFullBatchIsWritten) {
  const Plan plan = FullPlan();
  SegmentBatch segments;
  FillBatch(plan, {0, kSegmentsPerBatch}, segments);
  ExpectEveryFieldWritten<WireSegments>(segments);
  ProcessBatch process;
  FillBatch(plan, ProcessRange{{1, kEventsPerBatch}, {0, kEventsPerBatch}}, process);
  ExpectEveryFieldWritten<WireProcess>(process);
}

TEST(PlanWire, ABatchHoldsWhatThePlanHasFromThereOn) {
  const Plan plan = FullPlan();
  SegmentBatch segments;
  FillBatch(plan, {static_cast<std::uint32_t>(plan.segments.size()) - 3, 100}, segments);
  EXPECT_EQ(segments.count, 3U);
  FillBatch(plan, {static_cast<std::uint32_t>(plan.segments.size()) + 1, 100}, segments);
  EXPECT_EQ(segments.count, 0U);
  FillBatch(plan, {0, 5}, segments);
  EXPECT_EQ(segments.count, 5U);
  ProcessBatch process;
  FillBatch(plan, ProcessRange{{1, 1000}, {0, 1000}}, process);
  EXPECT_EQ(process.gate_count, kEventsPerBatch);
  EXPECT_EQ(process.event_count, kEventsPerBatch);
  FillBatch(plan, ProcessRange{{0, 1000}, {0, 0}}, process);  // gate 0 is none
  EXPECT_EQ(process.gate_count, 0U);
  EXPECT_EQ(process.event_count, 0U);
}

TEST(PlanWire, RefusesWhatNoSoundWriterSends) {
  const Plan plan = FullPlan();
  SegmentBatch segments, came;
  FillBatch(plan, {0, kSegmentsPerBatch}, segments);
  for (double* number : {&segments.segments[3].q_mm[1].c[5], &segments.segments[7].lead_mm[0].c[0],
                         &segments.segments[0].s_mm.c[2], &segments.duration_s}) {
    const double sound = *number;
    *number = std::numeric_limits<double>::quiet_NaN();
    WireSegments wire;
    link::ToWire(segments, wire);
    EXPECT_FALSE(link::FromWire(wire, came));
    *number = sound;
  }
  WireSegments long_wire;
  link::ToWire(segments, long_wire);
  ASSERT_TRUE(link::FromWire(long_wire, came));
  long_wire.count(kSegmentsPerBatch + 1);
  EXPECT_FALSE(link::FromWire(long_wire, came));

  ProcessBatch process, heard;
  FillBatch(plan, ProcessRange{{1, kEventsPerBatch}, {0, kEventsPerBatch}}, process);
  const auto refused = [&](auto&& spoil) {
    WireProcess wire;
    link::ToWire(process, wire);
    EXPECT_TRUE(link::FromWire(wire, heard));
    spoil(wire);
    return !link::FromWire(wire, heard);
  };
  EXPECT_TRUE(refused([](WireProcess& wire) { wire.gates()[31].kind(kGateKinds); }));
  EXPECT_TRUE(refused([](WireProcess& wire) { wire.gates()[5].input(kProcessInputs); }));
  EXPECT_TRUE(refused([](WireProcess& wire) { wire.gates()[5].input_event(kInputEvents); }));
  EXPECT_TRUE(refused([](WireProcess& wire) {
    wire.gates()[5].kind(static_cast<std::uint32_t>(GateKind::kInput));
    wire.gates()[5].input_event(0);
  }));
  EXPECT_TRUE(refused([](WireProcess& wire) { wire.events()[31].action(kActions); }));
  EXPECT_TRUE(refused([](WireProcess& wire) { wire.gate_count(kEventsPerBatch + 1); }));
  EXPECT_TRUE(refused([](WireProcess& wire) { wire.event_count(kEventsPerBatch + 1); }));
}

}  // namespace
}  // namespace lambdajet
