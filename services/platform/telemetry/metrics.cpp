#include "platform/telemetry/metrics.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <prometheus/counter.h>
#include <prometheus/exposer.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <thread>

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

namespace {

void Knock(const std::string& host, int port) {
  const int connection = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  if (inet_pton(AF_INET, host.c_str(), &to.sin_addr) != 1 || to.sin_addr.s_addr == htonl(INADDR_ANY)) {
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  }
  static_cast<void>(connect(connection, reinterpret_cast<const sockaddr*>(&to), sizeof to));
  close(connection);
}

}  // namespace

class MetricsExporter::Server {
 public:
  explicit Server(const std::string& address) : exposer(address, 2) {}
  prometheus::Exposer exposer;
};

MetricsExporter::MetricsExporter() = default;

// The HTTP server's accepting thread looks at its stop flag only after a connection or two seconds; so connect.
MetricsExporter::~MetricsExporter() {
  if (server_ == nullptr) {
    return;
  }
  std::atomic<bool> stopped = false;
  std::thread stopping([&] {
    server_.reset();
    stopped = true;
  });
  while (!stopped) {
    Knock(host_, port_);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  stopping.join();
}

absl::StatusOr<std::unique_ptr<MetricsExporter>> MetricsExporter::Start(const Metrics& metrics,
                                                                        const std::string& address) {
  std::unique_ptr<MetricsExporter> exporter(new MetricsExporter);
  try {
    exporter->server_ = std::make_unique<Server>(address);
    exporter->server_->exposer.RegisterCollectable(metrics.registry());
    exporter->host_ = address.substr(0, address.rfind(':'));
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
