// lambdajet_load: open-loop load on a running cell; see tests/load/README.md.
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdio>
#include <fstream>
#include <functional>

#include "platform/rpc/channel.hpp"
#include "tests/load/load_report.hpp"
#include "tests/load/scenarios.hpp"

namespace {

using namespace lambdajet;

struct Options {
  load::Pace pace;
  std::string address;
  std::string html = "load.html";
  std::string json;
  int connections = 4;
  int watchers = 20;
  int batch_poses = 1000;
};

void AddOptions(CLI::App& scenario, Options& options) {
  scenario.add_option("--address", options.address, "host:port")->required();
  scenario.add_option("--rate", options.pace.rate_per_s, "questions a second")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  scenario.add_option("--duration", options.pace.duration_s, "s")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  scenario.add_option("--connections", options.connections, "HTTP/2 connections")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  scenario.add_option("--html", options.html, "the report")->capture_default_str();
  scenario.add_option("--json", options.json, "the same figures for programs");
}

using Scenario = std::function<absl::StatusOr<load::Measured>(const load::Channels&)>;

// 0: no errors; 1: some questions had trouble; 3: the scenario could not begin.
int Run(const Options& options, const Scenario& scenario) {
  load::Channels channels;
  for (int i = 0; i < options.connections; ++i) {
    ChannelOptions channel;
    channel.address = options.address;
    channels.push_back(OpenChannel(channel).value_or(nullptr));
  }
  const auto measured = scenario(channels);
  if (!measured.ok()) {
    std::fprintf(stderr, "lambdajet_load: %s\n", measured.status().ToString().c_str());
    return 3;
  }
  std::fputs(load::ToText(*measured).c_str(), stdout);
  if (!options.json.empty()) {
    std::ofstream(options.json) << load::ToJson({*measured}) << "\n";
  }
  const absl::Status written = load::WriteHtml(options.html, {*measured});
  if (!written.ok()) {
    std::fprintf(stderr, "lambdajet_load: %s\n", written.ToString().c_str());
  }
  return written.ok() && measured->error_count() == 0 ? 0 : 1;
}

}  // namespace

int main(int count, char** words) {
  Options options;
  CLI::App app(
      "lambdajet_load: asks a running cell at a fixed rate and measures from when each question was due");
  app.require_subcommand(1);
  CLI::App* mes = app.add_subcommand("mes", "a MES that polls jobs while people watch, on the cell");
  CLI::App* cam = app.add_subcommand("cam", "a CAM system that solves poses in batches, on kinematics");
  CLI::App* plans =
      app.add_subcommand("plans", "programs admitted, planned, listed and sampled, on trajectory");
  for (CLI::App* scenario : {mes, cam, plans}) {
    AddOptions(*scenario, options);
  }
  mes->add_option("--watchers", options.watchers, "open WatchJobs streams")
      ->check(CLI::Range(0, 500))
      ->capture_default_str();
  cam->add_option("--batch", options.batch_poses, "poses in a question")
      ->check(CLI::Range(1, 65536))
      ->capture_default_str();
  CLI11_PARSE(app, count, words);
  return Run(options, [&](const load::Channels& channels) {
    return mes->parsed()   ? load::RunMesPolling(channels, options.pace, options.watchers)
           : cam->parsed() ? load::RunCamBatches(channels, options.pace, options.batch_poses)
                           : load::RunPlanning(channels, options.pace);
  });
}
