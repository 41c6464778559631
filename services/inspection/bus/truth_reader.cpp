#include "inspection/bus/truth_reader.hpp"

#include <array>
#include <cmath>
#include <optional>

#include "lambdajet/plant/v1/truth.h"
#include "lambdajet/plant/v1/truth.schema.hpp"
#include "lambdajet/plant/v1/truthPubSubTypes.h"
#include "platform/bus/participant.hpp"
#include "platform/bus/reader.hpp"

namespace lambdajet::inspection {
namespace {

namespace wire = lambdajet::idl::plant::v1;

BatchOrigin OriginOf(const lambdajet::idl::link::v1::Header& header, std::uint64_t plan) {
  return {header.session(), header.sequence_number(), plan};
}

bool FromWire(const wire::DriveTruth& batch, std::array<SheetTruth, 10>& samples) {
  if (batch.count() > samples.size()) {
    return false;
  }
  bool finite = true;
  for (std::size_t i = 0; i < batch.count(); ++i) {
    const wire::SheetSample& s = batch.samples()[i];
    samples[i] = {s.time_ns(), s.x_mm(), s.y_mm(), s.theta_rad()};
    finite = finite && std::isfinite(s.x_mm()) && std::isfinite(s.y_mm()) && std::isfinite(s.theta_rad());
  }
  return finite;
}

bool FromWire(const wire::JetTruth& batch, std::array<JetTruth, 10>& samples,
              std::array<WaterSwitch, 8>& switches) {
  if (batch.count() > samples.size() || batch.switch_count() > switches.size()) {
    return false;
  }
  bool finite = std::isfinite(batch.lag_time_s()) && batch.lag_time_s() >= 0.0;
  for (std::size_t i = 0; i < batch.count(); ++i) {
    const wire::JetSample& s = batch.samples()[i];
    samples[i] = {s.time_ns(), s.x_D_mm(), s.y_D_mm()};
    finite = finite && std::isfinite(s.x_D_mm()) && std::isfinite(s.y_D_mm());
  }
  for (std::size_t i = 0; i < batch.switch_count(); ++i) {
    switches[i] = {batch.switches()[i].time_ns(), batch.switches()[i].on()};
  }
  return finite;
}

}  // namespace

struct TruthReader::Readers {
  std::optional<Reader<wire::DriveTruthPubSubType>> sheet;
  std::optional<Reader<wire::JetTruthPubSubType>> jet;
};

TruthReader::TruthReader() : readers_(std::make_unique<Readers>()) {}
TruthReader::~TruthReader() = default;

int TruthReader::writers() const { return readers_->sheet->matched() + readers_->jet->matched(); }

absl::StatusOr<std::unique_ptr<TruthReader>> TruthReader::Open(Participant& bus, Recorder& recorder) {
  std::unique_ptr<TruthReader> truth(new TruthReader());
  TruthReader* self = truth.get();
  auto sheet = Reader<wire::DriveTruthPubSubType>::Open(
      bus, {wire::DRIVE_TRUTH_TOPIC, idl::schema::k_lambdajet_plant_v1_truth, "setpoint"},
      [self, &recorder](const wire::DriveTruth& batch, const Arrival&) {
        std::array<SheetTruth, 10> samples;
        if (FromWire(batch, samples)) {
          recorder.TakeSheet(OriginOf(batch.header(), batch.plan()), std::span(samples).first(batch.count()));
        } else {
          self->refused_.fetch_add(1, std::memory_order_relaxed);
        }
      });
  if (!sheet.ok()) {
    return sheet.status();
  }
  auto jet = Reader<wire::JetTruthPubSubType>::Open(
      bus, {wire::JET_TRUTH_TOPIC, idl::schema::k_lambdajet_plant_v1_truth, "setpoint"},
      [self, &recorder](const wire::JetTruth& batch, const Arrival&) {
        std::array<JetTruth, 10> samples;
        std::array<WaterSwitch, 8> switches;
        if (FromWire(batch, samples, switches)) {
          recorder.TakeJet(OriginOf(batch.header(), batch.plan()), std::span(samples).first(batch.count()),
                           std::span(switches).first(batch.switch_count()), batch.jet_on(),
                           batch.lag_time_s());
        } else {
          self->refused_.fetch_add(1, std::memory_order_relaxed);
        }
      });
  if (!jet.ok()) {
    return jet.status();
  }
  truth->readers_->sheet.emplace(std::move(*sheet));
  truth->readers_->jet.emplace(std::move(*jet));
  return truth;
}

}  // namespace lambdajet::inspection
