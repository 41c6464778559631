#include "platform/telemetry/metrics.hpp"

#include <prometheus/counter.h>
#include <prometheus/exposer.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <exception>

#include "foundation/contract/trouble.hpp"

namespace lambdajet {

void Counter::Increment(double by) const {
  if (counter_ != nullptr) {
    counter_->Increment(by);
  }
}
double Counter::value() const { return counter_ != nullptr ? counter_->Value() : 0.0; }

void Gauge::Set(double value) const {
  if (gauge_ != nullptr) {
    gauge_->Set(value);
  }
}
void Gauge::Add(double by) const {
  if (gauge_ != nullptr) {
    gauge_->Increment(by);
  }
}
double Gauge::value() const { return gauge_ != nullptr ? gauge_->Value() : 0.0; }

void Histogram::Observe(double value) const {
  if (histogram_ != nullptr) {
    histogram_->Observe(value);
  }
}

Metrics::Metrics() : registry_(std::make_shared<prometheus::Registry>()) {}
Metrics::~Metrics() = default;

Counter Metrics::AddCounter(const std::string& name, const std::string& help, const MetricLabels& labels) {
  return Counter(&prometheus::BuildCounter().Name(name).Help(help).Register(*registry_).Add(labels));
}

Gauge Metrics::AddGauge(const std::string& name, const std::string& help, const MetricLabels& labels) {
  return Gauge(&prometheus::BuildGauge().Name(name).Help(help).Register(*registry_).Add(labels));
}

Histogram Metrics::AddHistogram(const std::string& name, const std::string& help,
                                const std::vector<double>& upper_bounds, const MetricLabels& labels) {
  return Histogram(
      &prometheus::BuildHistogram().Name(name).Help(help).Register(*registry_).Add(labels, upper_bounds));
}

void Metrics::AddBuildInfo(const std::string& house, const std::string& version) {
  AddGauge("lambdajet_build_info", "1; the labels say what runs.", {{"house", house}, {"version", version}})
      .Set(1.0);
}

std::string Metrics::Text() const { return prometheus::TextSerializer().Serialize(registry_->Collect()); }

class MetricsExporter::Server {
 public:
  explicit Server(const std::string& address) : exposer(address, 2) {}
  prometheus::Exposer exposer;
};

MetricsExporter::MetricsExporter() = default;
MetricsExporter::~MetricsExporter() = default;

absl::StatusOr<std::unique_ptr<MetricsExporter>> MetricsExporter::Start(const Metrics& metrics,
                                                                        const std::string& address) {
  std::unique_ptr<MetricsExporter> exporter(new MetricsExporter);
  try {
    exporter->server_ = std::make_unique<Server>(address);
    exporter->server_->exposer.RegisterCollectable(metrics.registry());
    exporter->port_ = exporter->server_->exposer.GetListeningPorts().at(0);
  } catch (const std::exception& error) {
    return Trouble(
        absl::StatusCode::kUnavailable, "ADDRESS_IN_USE",
        "cannot serve metrics on " + address + " (" + error.what() +
            "): another process listens there, or the address is not this host's; metrics.address may end "
            "in port 0 for a free port",
        {{"address", address}});
  }
  return exporter;
}

}  // namespace lambdajet
