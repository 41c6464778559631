// The judge over InspectionService: begin, end, compare, path.
#include <fmt/format.h>

#include "clients/cli/csv.hpp"
#include "clients/cli/service_verbs.hpp"
#include "clients/cli/text_file.hpp"
#include "lambdajet/inspection/v1/inspection.grpc.pb.h"

namespace lambdajet::cli {
namespace {

namespace inspection_v1 = inspection::v1;
using inspection_v1::InspectionService;

constexpr char kInspectionService[] = "inspection";

std::vector<std::string> Row(const inspection_v1::FeatureResult& feature) {
  return {feature.name(),
          Fixed(feature.p50_mm(), 4),
          Fixed(feature.p95_mm(), 4),
          Fixed(feature.max_mm(), 4),
          Fixed(feature.mean_mm(), 4),
          Fixed(feature.rms_mm(), 4),
          Fixed(feature.tolerance_mm(), 3),
          Fixed(feature.conforming() * 100, 1),
          std::to_string(feature.not_cut())};
}

absl::Status Compare(std::uint64_t plan_id, const std::string& drawing, const std::string& out,
                     const Connections& connections, Output& output) {
  const auto yaml = ReadTextFile(drawing);
  if (!yaml.ok()) {
    return yaml.status();
  }
  inspection_v1::InspectRequest request;
  request.set_plan_id(plan_id);
  request.set_drawing_yaml(*yaml);
  inspection_v1::InspectResponse response;
  absl::Status status = connections.Ask<InspectionService>(
      kInspectionService, &InspectionService::Stub::Inspect, request, response);
  if (status.ok() && !out.empty()) {
    CsvTable table({"x_W_mm", "y_W_mm", "deviation_mm", "feature"});
    for (int i = 0; i + 4 <= response.deviations_size(); i += 4) {
      table.AddRow(
          std::vector<double>(response.deviations().begin() + i, response.deviations().begin() + i + 4));
    }
    status = WriteCsv(out, table);
  }
  if (!status.ok()) {
    return status;
  }
  if (output.json()) {
    PrintJson(response, output);
    return status;
  }
  TextTable table{{"feature", "p50_mm", "p95_mm", "max_mm", "mean_mm", "rms_mm", "tolerance_mm",
                   "conforming_%", "not cut"},
                  {Row(response.all())}};
  for (const inspection_v1::FeatureResult& feature : response.features()) {
    table.rows.push_back(Row(feature));
  }
  output.Table(table);
  output.Text(fmt::format("water on for {:.2f} s", response.cutting_time_s()));
  if (response.missing() != 0) {
    output.Text(fmt::format("{} ms of truth are missing: the result is worth less", response.missing()),
                Tone::kWarning);
  }
  return status;
}

absl::Status Path(std::uint64_t plan_id, const std::string& out, const Connections& connections,
                  Output& output) {
  const auto channel = connections.Open(kInspectionService);
  if (!channel.ok()) {
    return channel.status();
  }
  InspectionService::Stub stub(*channel);
  grpc::ClientContext context;
  SetDeadline(context, connections.timeout_s());
  inspection_v1::StreamCutPathRequest request;
  request.set_plan_id(plan_id);
  const auto stream = stub.StreamCutPath(&context, request);
  CsvTable table({"time_s", "x_W_mm", "y_W_mm", "jet_on"});
  for (inspection_v1::CutPathBatch batch; stream->Read(&batch);) {
    PrintJson(batch, output);
    for (int i = 0; i + 4 <= batch.values_size(); i += 4) {
      table.AddRow(std::vector<double>(batch.values().begin() + i, batch.values().begin() + i + 4));
    }
  }
  const absl::Status status = connections.Named(kInspectionService, FromWire(stream->Finish()));
  return status.ok() && !(output.json() && out == "-") ? WriteCsv(out, table) : status;
}

}  // namespace

void AddInspectionServiceVerbs(CLI::App& noun, Output& output, const Connections& connections) {
  auto begun = std::make_shared<std::uint64_t>(0);
  auto further = std::make_shared<std::vector<std::uint64_t>>();
  CLI::App* begin = AddServiceVerb(noun, "begin", "keep the truth of a plan from now on");
  begin->add_option("PLAN", *begun, "the plan's id")->required();
  begin->add_option("--further", *further, "further plans of the same job");
  begin->callback([=, &output, &connections] {
    inspection_v1::BeginRecordingRequest request;
    request.set_plan_id(*begun);
    request.mutable_further_plan_ids()->Add(further->begin(), further->end());
    inspection_v1::BeginRecordingResponse response;
    const absl::Status status = connections.Ask<InspectionService>(
        kInspectionService, &InspectionService::Stub::BeginRecording, request, response);
    if (status.ok()) {
      PrintJson(response, output);
      output.Text(fmt::format("the truth of plan {} is kept from now on", *begun));
    }
    output.Finish(status);
  });

  auto ended = std::make_shared<std::uint64_t>(0);
  CLI::App* end = AddServiceVerb(noun, "end", "stop keeping it");
  end->add_option("PLAN", *ended, "the plan's id")->required();
  end->callback([=, &output, &connections] {
    inspection_v1::EndRecordingRequest request;
    request.set_plan_id(*ended);
    inspection_v1::EndRecordingResponse response;
    const absl::Status status = connections.Ask<InspectionService>(
        kInspectionService, &InspectionService::Stub::EndRecording, request, response);
    if (status.ok()) {
      PrintJson(response, output);
      output.Text(fmt::format("{} ms of truth kept, {} missing", response.samples(), response.missing()));
    }
    output.Finish(status);
  });

  auto compared = std::make_shared<std::uint64_t>(0);
  auto drawing = std::make_shared<std::string>();
  auto deviations = std::make_shared<std::string>();
  CLI::App* compare =
      AddServiceVerb(noun, "compare", "the contour really cut against the drawing, feature by feature");
  compare->add_option("PLAN", *compared, "the plan's id")->required();
  compare->add_option("--drawing", *drawing, "YAML, see deploy/parts/README.md")->required();
  compare->add_option("--deviations", *deviations, "CSV of every point's deviation");
  compare->callback([=, &output, &connections] {
    output.Finish(Compare(*compared, *drawing, *deviations, connections, output));
  });

  auto pathed = std::make_shared<std::uint64_t>(0);
  auto out = std::make_shared<std::string>("-");
  CLI::App* path = AddServiceVerb(noun, "path", "the recorded path of the cut front on the sheet as CSV");
  path->add_option("PLAN", *pathed, "the plan's id")->required();
  path->add_option("--out", *out, "CSV; - is standard output");
  path->callback([=, &output, &connections] { output.Finish(Path(*pathed, *out, connections, output)); });
}

}  // namespace lambdajet::cli
