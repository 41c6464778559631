// Jobs over CellService: submit, start, hold, resume, stop, cancel, override, list, show, watch, report.
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>

#include "clients/cli/csv.hpp"
#include "clients/cli/service_verbs.hpp"
#include "clients/cli/text_file.hpp"
#include "clients/cli/trajectory_service.hpp"
#include "foundation/contract/trouble.hpp"
#include "lambdajet/cell/v1/cell.grpc.pb.h"

namespace lambdajet::cli {
namespace {

namespace cell_v1 = cell::v1;
using cell_v1::CellService;

std::string StateName(cell_v1::JobState state) {
  const std::string name = cell_v1::JobState_Name(state);
  constexpr std::string_view kPrefix = "JOB_STATE_";
  return name.substr(name.rfind(kPrefix, 0) == 0 ? kPrefix.size() : 0);
}

std::string FormatWords(type::v1::ProgramFormat format) {
  return format == type::v1::PROGRAM_FORMAT_GCODE        ? "  from G-code"
         : format == type::v1::PROGRAM_FORMAT_CLDATA     ? "  from CLDATA"
         : format == type::v1::PROGRAM_FORMAT_DXF        ? "  from DXF"
         : format == type::v1::PROGRAM_FORMAT_FLAT_GCODE ? "  from flat G-code"
                                                         : "";
}

Tone ToneOf(cell_v1::JobState state) {
  switch (state) {
    case cell_v1::JOB_STATE_COMPLETED:
      return Tone::kGood;
    case cell_v1::JOB_STATE_HELD:
    case cell_v1::JOB_STATE_INTERRUPTED:
      return Tone::kWarning;
    case cell_v1::JOB_STATE_REFUSED:
    case cell_v1::JOB_STATE_FAILED:
    case cell_v1::JOB_STATE_CANCELLED:
      return Tone::kBad;
    default:
      return Tone::kPlain;
  }
}

bool HasEnded(cell_v1::JobState state) {
  return state == cell_v1::JOB_STATE_COMPLETED || state == cell_v1::JOB_STATE_CANCELLED ||
         state == cell_v1::JOB_STATE_FAILED || state == cell_v1::JOB_STATE_REFUSED;
}

std::string Line(const cell_v1::Job& job) {
  std::string line = fmt::format("{} {}", job.job_id(), StateName(job.state()));
  if (!job.reason().empty()) {
    line += fmt::format(" {}", job.reason());
  }
  if (!job.message().empty()) {
    line += fmt::format(": {}", job.message());
  }
  return line;
}

void PrintJob(const cell_v1::Job& job, Output& output) {
  if (output.json()) {
    return PrintJson(job, output);
  }
  output.Text(Line(job), ToneOf(job.state()));
  for (const auto& fault : job.faults()) {
    output.Text(fmt::format("  line {}, column {}: {}: {}", fault.line(), fault.column(), fault.reason(),
                            fault.message()));
  }
  output.Text(fmt::format("  name {}  request {}  machine {} version {}{}", job.name(), job.request_id(),
                          job.model_version().machine_id(), job.model_version().version(),
                          FormatWords(job.program_format())));
  const std::string bound = job.predicted_95_mm() > 0.0
                                ? fmt::format(", predicted 95 % bound {:.3f} mm", job.predicted_95_mm())
                                : "";
  output.Text(fmt::format("  {:.1f} of {:.1f} mm ({:.0f} %), expected {:.1f} s{}{}", job.s_mm(),
                          job.length_mm(), job.progress() * 100, job.expected_duration_s(), bound,
                          job.compensated() ? ", compensated" : ""));
  output.Text(fmt::format("  plan {}  submitted {}  started {}  ended {}", job.plan_id(), job.submitted(),
                          job.started(), job.ended()));
}

// A refused job is an answer, but a script must see it.
void ExitAs(const cell_v1::Job& job, Output& output) {
  output.Exit(job.state() == cell_v1::JOB_STATE_REFUSED || job.state() == cell_v1::JOB_STATE_FAILED
                  ? ExitCode::kRefused
              : job.state() == cell_v1::JOB_STATE_INTERRUPTED ? ExitCode::kPrecondition
                                                              : ExitCode::kOk);
}

// Follows jobs until `enough` says so; the stream itself has no deadline.
absl::Status Watch(const Connections& connections, const std::string& job_id, std::uint64_t token,
                   double period_s, const std::function<bool(const cell_v1::JobEvent&)>& enough) {
  const auto channel = connections.Open("cell");
  if (!channel.ok()) {
    return channel.status();
  }
  CellService::Stub stub(*channel);
  grpc::ClientContext context;
  cell_v1::WatchJobsRequest request;
  request.set_job_id(job_id);
  request.set_resume_token(token);
  request.set_period_s(period_s);
  const auto stream = stub.WatchJobs(&context, request);
  cell_v1::JobEvent event;
  while (stream->Read(&event)) {
    if (enough(event)) {
      context.TryCancel();
      (void)stream->Finish();
      return absl::OkStatus();
    }
  }
  return connections.Named("cell", FromWire(stream->Finish()));
}

absl::StatusOr<cell_v1::Job> Show(const Connections& connections, const std::string& job_id) {
  cell_v1::GetJobRequest request;
  request.set_job_id(job_id);
  cell_v1::GetJobResponse response;
  const absl::Status status =
      connections.Ask<CellService>("cell", &CellService::Stub::GetJob, request, response);
  if (!status.ok()) {
    return status;
  }
  return response.job();
}

// Follows one job to its end, or until it needs a person.
absl::Status Follow(const Connections& connections, const std::string& job_id, Output& output) {
  auto job = Show(connections, job_id);
  if (!job.ok()) {
    return job.status();
  }
  cell_v1::JobState told = cell_v1::JOB_STATE_UNSPECIFIED;
  std::string reason;
  const auto tell = [&](const cell_v1::Job& now) {
    *job = now;
    output.Progress(now.progress(), fmt::format("{} {:.1f}/{:.1f} mm {:.1f} mm/s", StateName(now.state()),
                                                now.s_mm(), now.length_mm(), now.feed_mm_per_s()));
    if (now.state() != told || now.reason() != reason) {
      output.EndProgress();
      told = now.state();
      reason = now.reason();
      if (output.json()) {
        PrintJson(now, output);
      } else {
        output.Text(Line(now), ToneOf(now.state()));
      }
    }
    return HasEnded(now.state()) || now.state() == cell_v1::JOB_STATE_INTERRUPTED;
  };
  absl::Status status = tell(*job) ? absl::OkStatus()
                                   : Watch(connections, job_id, 0, 0.2,
                                           [&](const cell_v1::JobEvent& event) { return tell(event.job()); });
  if (status.ok()) {
    ExitAs(*job, output);
  }
  return status;
}

struct SubmitOptions {
  std::string file;
  FormatOptions format;
  std::string request_id;
  std::string name;
  bool compensate = false;
  std::optional<double> feed_scale;
  std::optional<std::uint32_t> machine_version;
  bool start = false;
  bool watch = false;
};

std::string NewRequestId() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return fmt::format("cli-{}-{}", std::chrono::duration_cast<std::chrono::microseconds>(now).count(),
                     getpid());
}

absl::Status Submit(const SubmitOptions& options, const Connections& connections, Output& output) {
  const auto program = ReadTextFile(options.file);
  if (!program.ok()) {
    return program.status();
  }
  cell_v1::SubmitJobRequest request;
  request.set_request_id(options.request_id.empty() ? NewRequestId() : options.request_id);
  request.set_name(options.name.empty()
                       ? options.file.substr(options.file.find_last_of('/') + 1).substr(0, 128)
                       : options.name);
  request.set_program(*program);
  request.set_program_format(FormatOf(options.format, options.file));
  if (options.format.toolpath_given) {
    *request.mutable_toolpath() = options.format.toolpath;
  }
  request.set_compensate(options.compensate);
  if (options.feed_scale) {
    request.set_feed_scale(*options.feed_scale);
  }
  if (options.machine_version) {
    request.set_machine_version(*options.machine_version);
  }
  cell_v1::SubmitJobResponse response;
  absl::Status status =
      connections.Ask<CellService>("cell", &CellService::Stub::SubmitJob, request, response);
  if (!status.ok()) {
    return status;
  }
  cell_v1::Job job = response.job();
  if (job.state() == cell_v1::JOB_STATE_ADMITTING && options.start) {
    status = Watch(connections, job.job_id(), 0, 0.2, [&](const cell_v1::JobEvent& event) {
      job = event.job();
      return job.state() != cell_v1::JOB_STATE_ADMITTING;
    });
  }
  if (!status.ok() || !options.start || job.state() != cell_v1::JOB_STATE_READY) {
    PrintJob(job, output);
    ExitAs(job, output);
    return status;
  }
  cell_v1::StartJobRequest start;
  start.set_job_id(job.job_id());
  cell_v1::StartJobResponse started;
  status = connections.Ask<CellService>("cell", &CellService::Stub::StartJob, start, started);
  if (!status.ok() || options.watch) {
    return status.ok() ? Follow(connections, job.job_id(), output) : status;
  }
  PrintJob(started.job(), output);
  return status;
}

// Verbs that name a job and answer it.
template <typename Request, typename Response>
void AddJobVerb(CLI::App& noun, const char* name, const char* what,
                grpc::Status (CellService::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                Output& output, const Connections& connections) {
  auto request = std::make_shared<Request>();
  auto job_id = std::make_shared<std::string>();
  CLI::App* verb = noun.add_subcommand(name, what);
  verb->add_option("JOB", *job_id, "the job's id")->required();
  verb->callback([request, job_id, method, &output, &connections] {
    request->set_job_id(*job_id);
    Response response;
    const absl::Status status = connections.Ask<CellService>("cell", method, *request, response);
    if (status.ok()) {
      PrintJob(response.job(), output);
    }
    output.Finish(status);
  });
}

absl::Status List(const std::string& state, bool all, const Connections& connections, Output& output) {
  cell_v1::ListJobsRequest request;
  request.set_page_size(all ? 100 : 20);
  cell_v1::JobState wanted = cell_v1::JOB_STATE_UNSPECIFIED;
  if (!state.empty() && !cell_v1::JobState_Parse("JOB_STATE_" + state, &wanted)) {
    return Trouble(absl::StatusCode::kInvalidArgument, "UNKNOWN_STATE",
                   state + " is no job state; READY, RUNNING, COMPLETED and the like are right");
  }
  request.set_state(wanted);
  cell_v1::ListJobsResponse whole;
  do {
    cell_v1::ListJobsResponse page;
    absl::Status status = connections.Ask<CellService>("cell", &CellService::Stub::ListJobs, request, page);
    if (!status.ok()) {
      return status;
    }
    whole.mutable_jobs()->MergeFrom(page.jobs());
    request.set_page_token(page.next_page_token());
  } while (all && !request.page_token().empty());
  if (output.json()) {
    PrintJson(whole, output);
    return absl::OkStatus();
  }
  TextTable table{{"job", "state", "done_%", "length_mm", "name", "submitted", "reason"}, {}};
  for (const cell_v1::Job& job : whole.jobs()) {
    table.rows.push_back({job.job_id(), StateName(job.state()), Fixed(job.progress() * 100, 0),
                          Fixed(job.length_mm(), 1), job.name(), job.submitted(), job.reason()});
  }
  output.Table(table);
  return absl::OkStatus();
}

absl::Status WatchAll(std::uint64_t token, const Connections& connections, Output& output) {
  return Watch(connections, "", token, 0.5, [&](const cell_v1::JobEvent& event) {
    if (output.json()) {
      PrintJson(event, output);
    } else if (event.token() != 0) {
      output.Text(fmt::format("{} [{}] {}", event.time(), event.token(), Line(event.job())),
                  ToneOf(event.job().state()));
    } else {
      output.Progress(event.job().progress(),
                      fmt::format("{} {:.1f} mm/s", event.job().job_id(), event.job().feed_mm_per_s()));
    }
    return false;
  });
}

CsvTable Strided(std::vector<std::string> columns, const google::protobuf::RepeatedField<double>& values) {
  const int stride = static_cast<int>(columns.size());
  CsvTable table(std::move(columns));
  for (int i = 0; i + stride <= values.size(); i += stride) {
    table.AddRow(std::vector<double>(values.begin() + i, values.begin() + i + stride));
  }
  return table;
}

absl::Status Report(const std::string& job_id, const std::string& trace, const std::string& events,
                    const Connections& connections, Output& output) {
  cell_v1::GetReportRequest request;
  request.set_job_id(job_id);
  cell_v1::GetReportResponse report;
  absl::Status status = connections.Ask<CellService>("cell", &CellService::Stub::GetReport, request, report);
  if (status.ok() && !trace.empty()) {
    status = WriteCsv(trace, Strided({"time_s", "actuator_1_mm", "actuator_2_mm", "actuator_1_mm_per_s",
                                      "actuator_2_mm_per_s", "s_mm"},
                                     report.slider_trace()));
  }
  if (status.ok() && !events.empty()) {
    status = WriteCsv(events,
                      Strided({"s_wanted_mm", "s_rate_mm_per_s", "deviation_mm"}, report.event_deviations()));
  }
  if (!status.ok()) {
    return status;
  }
  if (output.json()) {
    PrintJson(report, output);
    return status;
  }
  PrintJob(report.job(), output);
  output.Table({{"what", "value", "unit"},
                {{"duration", Fixed(report.duration_s(), 1), "s"},
                 {"cutting", Fixed(report.cutting_time_s(), 1), "s"},
                 {"held", Fixed(report.held_time_s(), 1), "s"},
                 {"interruptions", std::to_string(report.interruptions()), ""},
                 {"events in motion", std::to_string(report.event_deviations_size() / 3), ""},
                 {"event deviation 50 %", Fixed(report.event_deviation_p50_mm(), 4), "mm"},
                 {"event deviation 99 %", Fixed(report.event_deviation_p99_mm(), 4), "mm"},
                 {"message age 50 %", Fixed(report.message_age_p50_s() * 1e3, 2), "ms"},
                 {"message age 99 %", Fixed(report.message_age_p99_s() * 1e3, 2), "ms"},
                 {"drive overruns", std::to_string(report.drive_overruns()), ""},
                 {"main motion overruns", std::to_string(report.main_motion_overruns()), ""}}});
  return status;
}

void AddSubmit(CLI::App& noun, Output& output, const Connections& connections) {
  auto options = std::make_shared<SubmitOptions>();
  CLI::App* verb = noun.add_subcommand("submit", "store a part program as a job and have it admitted");
  verb->add_option("FILE", options->file, "G-code, CLDATA or DXF; - is standard input")->required();
  AddFormatOptions(*verb, options->format);
  verb->add_option("--request-id", options->request_id,
                   "the same id and content answer the same job; default: a new one");
  verb->add_option("--name", options->name, "for people; default: the file's name");
  verb->add_flag("--compensate", options->compensate,
                 "elastic feed-forward, corner feed from predicted error");
  verb->add_option("--feed-scale", options->feed_scale, "factor on programmed feeds, up to 1.2");
  verb->add_option("--machine-version", options->machine_version, "only with this version of the machine");
  verb->add_flag("--start", options->start, "start it once it is admitted");
  verb->add_flag("--watch", options->watch, "with --start: follow it to its end");
  verb->callback([options, &output, &connections] {
    const absl::Status status = Submit(*options, connections, output);
    if (!status.ok()) {
      output.Fail(status);
    }
  });
}

void AddReading(CLI::App& noun, Output& output, const Connections& connections) {
  auto state = std::make_shared<std::string>();
  auto all = std::make_shared<bool>(false);
  CLI::App* list = noun.add_subcommand("list", "jobs, newest first");
  list->add_option("--state", *state, "only those that are READY, RUNNING, …");
  list->add_flag("--all", *all, "not only the newest 20");
  list->callback(
      [state, all, &output, &connections] { output.Finish(List(*state, *all, connections, output)); });

  auto job_id = std::make_shared<std::string>();
  auto token = std::make_shared<std::uint64_t>(0);
  CLI::App* watch = noun.add_subcommand("watch", "follow a job to its end, or everything with no job named");
  watch->add_option("JOB", *job_id, "the job's id");
  watch->add_option("--from", *token, "everything since this place in the journal");
  watch->callback([job_id, token, &output, &connections] {
    const absl::Status status =
        job_id->empty() ? WatchAll(*token, connections, output) : Follow(connections, *job_id, output);
    if (!status.ok()) {
      output.Fail(status);
    }
  });

  auto trace = std::make_shared<std::string>();
  auto events = std::make_shared<std::string>();
  auto reported = std::make_shared<std::string>();
  CLI::App* report = noun.add_subcommand("report", "what a job did: times, event deviations, overruns");
  report->add_option("JOB", *reported, "the job's id")->required();
  report->add_option("--trace", *trace, "CSV of slider positions and speeds");
  report->add_option("--events", *events, "CSV of process-event deviations");
  report->callback([reported, trace, events, &output, &connections] {
    output.Finish(Report(*reported, *trace, *events, connections, output));
  });
}

void AddResumeStopOverride(CLI::App& noun, Output& output, const Connections& connections) {
  auto resumed = std::make_shared<cell_v1::ResumeJobRequest>();
  auto resumed_id = std::make_shared<std::string>();
  auto overlap = std::make_shared<std::optional<double>>();
  CLI::App* resume =
      noun.add_subcommand("resume", "go on after a hold, or after an interruption from what was cut");
  resume->add_option("JOB", *resumed_id, "the job's id")->required();
  resume->add_option("--overlap-mm", *overlap, "after an interruption: back up this far; default 3");
  resume->callback([resumed, resumed_id, overlap, &output, &connections] {
    resumed->set_job_id(*resumed_id);
    if (*overlap) {
      resumed->set_overlap_mm(**overlap);
    }
    cell_v1::ResumeJobResponse response;
    const absl::Status status =
        connections.Ask<CellService>("cell", &CellService::Stub::ResumeJob, *resumed, response);
    if (status.ok()) {
      PrintJob(response.job(), output);
    }
    output.Finish(status);
  });

  auto stopped = std::make_shared<std::string>();
  CLI::App* stop =
      noun.add_subcommand("stop", "stop both modules on the path (category 1); latched until machine reset");
  stop->add_option("JOB", *stopped, "only if this job runs; none named: whatever runs");
  stop->callback([stopped, &output, &connections] {
    cell_v1::StopJobRequest request;
    request.set_job_id(*stopped);
    cell_v1::StopJobResponse response;
    const absl::Status status =
        connections.Ask<CellService>("cell", &CellService::Stub::StopJob, request, response);
    if (status.ok() && response.has_job()) {
      PrintJob(response.job(), output);
    } else if (status.ok()) {
      PrintJson(response, output);
      output.Text("stopped; no job was running; reset the machine before the next start");
    }
    output.Finish(status);
  });

  auto factor = std::make_shared<double>(1.0);
  CLI::App* override_verb = noun.add_subcommand("override", "feed override, 0 to 1.2");
  override_verb->add_option("FACTOR", *factor, "1 is as programmed")->required();
  override_verb->callback([factor, &output, &connections] {
    cell_v1::SetFeedOverrideRequest request;
    request.set_feed_override(*factor);
    cell_v1::SetFeedOverrideResponse response;
    const absl::Status status =
        connections.Ask<CellService>("cell", &CellService::Stub::SetFeedOverride, request, response);
    if (status.ok()) {
      output.Text(fmt::format("feed override {}", Fixed(response.feed_override(), 2)));
      PrintJson(response, output);
    }
    output.Finish(status);
  });
}

}  // namespace

void AddJobVerbs(CLI::App& noun, Output& output, const Connections& connections) {
  AddSubmit(noun, output, connections);
  AddJobVerb<cell_v1::StartJobRequest, cell_v1::StartJobResponse>(
      noun, "start", "load, arm and start a READY job", &CellService::Stub::StartJob, output, connections);
  AddJobVerb<cell_v1::HoldJobRequest, cell_v1::HoldJobResponse>(
      noun, "hold", "feed hold on the path", &CellService::Stub::HoldJob, output, connections);
  AddResumeStopOverride(noun, output, connections);
  AddJobVerb<cell_v1::CancelJobRequest, cell_v1::CancelJobResponse>(
      noun, "cancel", "give up a job that is not running", &CellService::Stub::CancelJob, output,
      connections);
  AddJobVerb<cell_v1::GetJobRequest, cell_v1::GetJobResponse>(
      noun, "show", "one job", &CellService::Stub::GetJob, output, connections);
  AddReading(noun, output, connections);
}

}  // namespace lambdajet::cli
