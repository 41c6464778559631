// Counts, gauges and measures what a house does, and serves it to Prometheus.
//
// Model: one registry a process; names are `lambdajet_<what>_<base unit>`, counters end in `_total`. A metric
// handle is a small value that stays valid as long as its Metrics. Units: base units (seconds, meters,
// bytes), as Prometheus' users expect. Threads: any. Cost: an increment is an atomic addition; adding a
// metric takes a lock and allocates, so add at start. Errors: MetricsExporter::Start says ADDRESS_IN_USE or
// BAD_ADDRESS and names the address.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace prometheus {
class Counter;
class Gauge;
class Histogram;
class Registry;
}  // namespace prometheus

namespace lambdajet {

using MetricLabels = std::map<std::string, std::string>;

class Counter {
 public:
  Counter() = default;  // counts nowhere
  explicit Counter(prometheus::Counter* counter) : counter_(counter) {}
  void Increment(double by = 1.0) const;
  double value() const;

 private:
  prometheus::Counter* counter_ = nullptr;
};

class Gauge {
 public:
  Gauge() = default;
  explicit Gauge(prometheus::Gauge* gauge) : gauge_(gauge) {}
  void Set(double value) const;
  void Add(double by) const;
  double value() const;

 private:
  prometheus::Gauge* gauge_ = nullptr;
};

class Histogram {
 public:
  Histogram() = default;
  explicit Histogram(prometheus::Histogram* histogram) : histogram_(histogram) {}
  void Observe(double value) const;

 private:
  prometheus::Histogram* histogram_ = nullptr;
};

class Metrics {
 public:
  Metrics();
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // The same name and labels give the same metric again.
  Counter AddCounter(const std::string& name, const std::string& help, const MetricLabels& labels = {});
  Gauge AddGauge(const std::string& name, const std::string& help, const MetricLabels& labels = {});
  Histogram AddHistogram(const std::string& name, const std::string& help,
                         const std::vector<double>& upper_bounds, const MetricLabels& labels = {});

  // lambdajet_build_info{house,version} 1.
  void AddBuildInfo(const std::string& house, const std::string& version);

  // Everything in Prometheus' text format, for tests and tools.
  std::string Text() const;

  std::shared_ptr<prometheus::Registry> registry() const { return registry_; }

 private:
  std::shared_ptr<prometheus::Registry> registry_;
};

// Serves /metrics over HTTP until it is destroyed.
class MetricsExporter {
 public:
  // Address as "127.0.0.1:9101"; port 0 takes a free one.
  static absl::StatusOr<std::unique_ptr<MetricsExporter>> Start(const Metrics& metrics,
                                                                const std::string& address);
  ~MetricsExporter();
  int port() const { return port_; }

 private:
  class Server;
  MetricsExporter();
  std::unique_ptr<Server> server_;
  std::string host_;
  int port_ = 0;
};

}  // namespace lambdajet
