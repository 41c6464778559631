#include "trajectory/bus/plan_streamer.hpp"

#include <optional>
#include <thread>

#include "foundation/motion/plan_batches.hpp"
#include "lambdajet/drive/v1/state.h"
#include "lambdajet/drive/v1/state.schema.hpp"
#include "lambdajet/drive/v1/statePubSubTypes.h"
#include "lambdajet/main_motion/v1/state.h"
#include "lambdajet/main_motion/v1/state.schema.hpp"
#include "lambdajet/main_motion/v1/statePubSubTypes.h"
#include "lambdajet/trajectory/v1/plan.h"
#include "lambdajet/trajectory/v1/plan.schema.hpp"
#include "lambdajet/trajectory/v1/planPubSubTypes.h"
#include "link/wire/link_wire.hpp"
#include "platform/bus/participant.hpp"
#include "platform/bus/reader.hpp"
#include "platform/bus/sample_slots.hpp"
#include "platform/bus/writer.hpp"
#include "platform/process/common_clock.hpp"
#include "platform/process/periodic_loop.hpp"
#include "platform/telemetry/metrics.hpp"
#include "trajectory/core/streaming/stream_pacer.hpp"

namespace lambdajet::trajectory {
namespace {

namespace plan_wire = lambdajet::idl::trajectory::v1;
namespace drive_wire = lambdajet::idl::drive::v1;
namespace motion_wire = lambdajet::idl::main_motion::v1;

constexpr std::int64_t kPeriod_ns = 5'000'000;
constexpr std::int64_t kFresh_ns = 200'000'000;
constexpr int kMostBatchesPerTurn = 4;

}  // namespace

struct PlanStreamer::Link {
  explicit Link(const Clock& common_clock) : clock(common_clock) {}

  SampleHeader NextHeader(std::uint64_t& number) const { return {session, ++number, clock.now_ns()}; }

  bool WriteSegments(const PlanRange& range);
  bool WriteProcess(const ProcessRange& range);

  const Clock& clock;
  std::uint64_t session = 0;
  std::uint64_t segment_number = 0;
  std::uint64_t process_number = 0;
  LatestSample<drive_wire::State> drive;
  LatestSample<motion_wire::State> motion;
  std::optional<Writer<plan_wire::SegmentBatchPubSubType>> segments;
  std::optional<Writer<plan_wire::ProcessBatchPubSubType>> process;
  std::optional<Reader<drive_wire::StatePubSubType>> drive_reader;
  std::optional<Reader<motion_wire::StatePubSubType>> motion_reader;
  Counter segments_sent, resends, refused;
  Gauge streaming;

  std::shared_ptr<const Plan> plan;  // the loop's
  SegmentPacer segment_pacer;
  ProcessPacer process_pacer;
  std::uint64_t resent_counted = 0;
  std::uint64_t gates_sent_to = 0;  // session of the drive
  std::size_t gates_sent = 0;
  SegmentBatch segment_batch;
  ProcessBatch process_batch;
  plan_wire::SegmentBatch segment_wire;
  plan_wire::ProcessBatch process_wire;
  std::thread loop;
};

bool PlanStreamer::Link::WriteSegments(const PlanRange& range) {
  segment_batch.header = NextHeader(segment_number);
  FillBatch(*plan, range, segment_batch);
  link::ToWire(segment_batch, segment_wire);
  if (segments->Write(segment_wire)) {
    return true;
  }
  --segment_number;
  refused.Increment();
  return false;
}

bool PlanStreamer::Link::WriteProcess(const ProcessRange& range) {
  process_batch.header = NextHeader(process_number);
  FillBatch(*plan, range, process_batch);
  link::ToWire(process_batch, process_wire);
  if (process->Write(process_wire)) {
    return true;
  }
  --process_number;
  refused.Increment();
  return false;
}

PlanStreamer::PlanStreamer() = default;

PlanStreamer::~PlanStreamer() {
  stop_.store(true, std::memory_order_release);
  if (link_ != nullptr && link_->loop.joinable()) {
    link_->loop.join();
  }
}

absl::StatusOr<std::unique_ptr<PlanStreamer>> PlanStreamer::Open(Participant& bus, const Clock& clock,
                                                                 Metrics& metrics) {
  std::unique_ptr<PlanStreamer> streamer(new PlanStreamer());
  streamer->link_ = std::make_unique<Link>(clock);
  Link* link = streamer->link_.get();
  auto segments = Writer<plan_wire::SegmentBatchPubSubType>::Open(
      bus, {plan_wire::SEGMENT_TOPIC, idl::schema::k_lambdajet_trajectory_v1_plan, "setpoint"});
  auto process = Writer<plan_wire::ProcessBatchPubSubType>::Open(
      bus, {plan_wire::PROCESS_TOPIC, idl::schema::k_lambdajet_trajectory_v1_plan, "setpoint"});
  auto drive = Reader<drive_wire::StatePubSubType>::Open(
      bus, {drive_wire::STATE_TOPIC, idl::schema::k_lambdajet_drive_v1_state, "state"},
      [link](const drive_wire::State& s, const Arrival& a) { link->drive.Put(s, a); });
  auto motion = Reader<motion_wire::StatePubSubType>::Open(
      bus, {motion_wire::STATE_TOPIC, idl::schema::k_lambdajet_main_motion_v1_state, "state"},
      [link](const motion_wire::State& s, const Arrival& a) { link->motion.Put(s, a); });
  for (const absl::Status& status : {segments.status(), process.status(), drive.status(), motion.status()}) {
    if (!status.ok()) {
      return status;
    }
  }
  link->segments.emplace(std::move(*segments));
  link->process.emplace(std::move(*process));
  link->drive_reader.emplace(std::move(*drive));
  link->motion_reader.emplace(std::move(*motion));
  link->session = static_cast<std::uint64_t>(clock.now_ns());
  link->segments_sent = metrics.AddCounter("lambdajet_segments_sent_total", "Segments sent to the modules.");
  link->resends = metrics.AddCounter("lambdajet_segment_resends_total",
                                     "Times sending began anew from what a module lacked.");
  link->refused =
      metrics.AddCounter("lambdajet_batches_postponed_total", "Batches the bus could not take at once.");
  link->streaming = metrics.AddGauge("lambdajet_streaming", "1 while a plan is being streamed.");
  link->loop = std::thread([self = streamer.get()] { self->Run(); });
  return streamer;
}

void PlanStreamer::Start(std::shared_ptr<const Plan> plan) {
  const std::lock_guard lock(mutex_);
  wanted_ = std::move(plan);
}

std::uint64_t PlanStreamer::Stop(std::uint64_t plan_id) {
  const std::lock_guard lock(mutex_);
  if (wanted_ == nullptr || (plan_id != 0 && wanted_->id != plan_id)) {
    return 0;
  }
  const std::uint64_t was = wanted_->id;
  wanted_.reset();
  return was;
}

std::uint64_t PlanStreamer::streaming() const {
  const std::lock_guard lock(mutex_);
  return wanted_ == nullptr ? 0 : wanted_->id;
}

void PlanStreamer::Run() {
  PeriodicLoop loop({.period_ns = kPeriod_ns});
  loop.Run(stop_, [this](const CycleTime&) { Turn(); });
}

void PlanStreamer::Turn() {
  Link& link = *link_;
  {
    const std::lock_guard lock(mutex_);
    if (wanted_ == nullptr || link.plan == nullptr || wanted_->id != link.plan->id) {
      link.segment_pacer = SegmentPacer();
      link.process_pacer = ProcessPacer();
      link.resent_counted = 0;
      link.gates_sent_to = 0;
    }
    link.plan = wanted_;
  }
  link.streaming.Set(link.plan != nullptr ? 1.0 : 0.0);
  if (link.plan != nullptr) {
    const std::int64_t now_ns = MonotonicNow();
    SendSegments(now_ns);
    SendProcess(now_ns);
  }
}

void PlanStreamer::SendSegments(std::int64_t now_ns) {
  Link& link = *link_;
  const auto drive = link.drive.Latest();
  if (!drive || now_ns - drive->second.monotonic_ns > kFresh_ns) {
    return;
  }
  const DriveWish wish{drive->first.plan(), drive->first.next_segment(), drive->first.tau_s()};
  for (int i = 0; i < kMostBatchesPerTurn; ++i) {
    const auto range = link.segment_pacer.Next(*link.plan, wish, now_ns);
    if (!range) {
      break;
    }
    if (!link.WriteSegments(*range)) {
      break;
    }
    link.segment_pacer.Sent(*range, now_ns);
    link.segments_sent.Increment(range->count);
  }
  link.resends.Increment(static_cast<double>(link.segment_pacer.resent() - link.resent_counted));
  link.resent_counted = link.segment_pacer.resent();
}

// All gates, without events, to a drive that has newly taken the plan; main motion knows what it has already.
void PlanStreamer::SendGatesToDrive(std::uint64_t drive_session) {
  Link& link = *link_;
  if (link.gates_sent_to != drive_session) {
    link.gates_sent_to = drive_session;
    link.gates_sent = 0;
  }
  const std::vector<Gate>& gates = link.plan->gates;
  while (link.gates_sent < gates.size()) {
    const PlanRange range{static_cast<std::uint32_t>(link.gates_sent) + 1, kEventsPerBatch};
    if (!link.WriteProcess({.gates = range, .events = {}})) {
      return;
    }
    link.gates_sent += link.process_batch.gate_count;
  }
}

void PlanStreamer::SendProcess(std::int64_t now_ns) {
  Link& link = *link_;
  const auto drive = link.drive.Latest();
  if (!drive || drive->first.plan() != link.plan->id) {
    link.gates_sent_to = 0;
    return;
  }
  SendGatesToDrive(drive->first.header().session());
  const auto motion = link.motion.Latest();
  if (!motion || now_ns - motion->second.monotonic_ns > kFresh_ns) {
    return;
  }
  const ProcessWish wish{motion->first.plan(), motion->first.next_event(), motion->first.next_gate()};
  const auto range = link.process_pacer.Next(*link.plan, wish, now_ns);
  if (range && link.WriteProcess(*range)) {
    link.process_pacer.Sent(wish, now_ns);
  }
}

}  // namespace lambdajet::trajectory
