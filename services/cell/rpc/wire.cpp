#include "cell/rpc/wire.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <ctime>

#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::cell {
namespace {

constexpr std::size_t kLongestId = 128;
constexpr std::size_t kLongestName_bytes = 128;
constexpr double kLargestFeedScale = 1.2;
constexpr std::size_t kLargestToolpath_bytes = 64u << 10;

bool IsWord(std::string_view text) {
  return !text.empty() && text.size() <= kLongestId && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  });
}

std::string Sha256(std::string_view text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  EVP_Digest(text.data(), text.size(), digest.data(), &size, EVP_sha256(), nullptr);
  std::string hex;
  for (unsigned int i = 0; i < size; ++i) {
    hex += fmt::format("{:02x}", digest[i]);
  }
  return hex;
}

v1::ProgramFault ToWire(const ProgramFault& fault) {
  v1::ProgramFault wire;
  wire.set_line(fault.line);
  wire.set_column(fault.column);
  wire.set_reason(fault.reason);
  wire.set_message(fault.message);
  return wire;
}

void FillVersion(const ModelVersion& version, machine::v1::ModelVersion& wire) {
  wire.set_machine_id(version.machine_id);
  wire.set_version(version.version);
  wire.set_hash(version.hash);
}

}  // namespace

std::string TimeText(std::int64_t time_ns) {
  if (time_ns == 0) {
    return "";
  }
  const std::time_t seconds = time_ns / 1'000'000'000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::array<char, 32> text{};
  const std::size_t size = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  return fmt::format("{}.{:03}Z", std::string_view(text.data(), size), time_ns / 1'000'000 % 1000);
}

absl::Status CheckJobId(const std::string& job_id) {
  ArgumentChecks checks;
  checks.Require(IsWord(job_id), "job_id", "BAD_ID",
                 fmt::format("'{}' is no job id; 1 to {} of A-Z a-z 0-9 . _ - are right",
                             job_id.substr(0, kLongestId), kLongestId));
  return checks.status();
}

std::optional<JobState> FromWire(v1::JobState state) {
  if (state == v1::JOB_STATE_UNSPECIFIED || !v1::JobState_IsValid(state)) {
    return std::nullopt;
  }
  return static_cast<JobState>(state);
}

namespace {

// The settings themselves are trajectory's to judge; here they must only have a drawing, and be small enough to keep.
void CheckFormat(const v1::SubmitJobRequest& request, ArgumentChecks& checks) {
  checks.Require(type::v1::ProgramFormat_IsValid(request.program_format()), "program_format",
                 "UNKNOWN_FORMAT",
                 fmt::format("{} is none of the formats", static_cast<int>(request.program_format())));
  checks.Require(!request.has_toolpath() || request.program_format() == type::v1::PROGRAM_FORMAT_DXF,
                 "toolpath", "TOOLPATH_NOT_WANTED",
                 "settings of a toolpath are for drawings, PROGRAM_FORMAT_DXF");
  checks.Require(request.toolpath().ByteSizeLong() <= kLargestToolpath_bytes, "toolpath", "TOO_LARGE",
                 fmt::format("{} bytes; at most {} are kept", request.toolpath().ByteSizeLong(),
                             kLargestToolpath_bytes));
}

// One text for what one client may say twice; the same settings give the same bytes.
std::string ContentOf(const Submission& s) {
  std::string content = fmt::format("{} {} {} {}", s.program_sha256, s.compensate, s.feed_scale,
                                    s.machine_version ? static_cast<std::int64_t>(*s.machine_version) : -1);
  if (s.program_format != ProgramFormat::kByContent) {
    content += fmt::format(" {} {}", static_cast<std::uint32_t>(s.program_format), s.toolpath);
  }
  return content;
}

}  // namespace

absl::StatusOr<Submission> FromWire(const v1::SubmitJobRequest& request) {
  ArgumentChecks checks;
  checks.Require(IsWord(request.request_id()), "request_id", "BAD_ID",
                 fmt::format("{} bytes; 1 to {} of A-Z a-z 0-9 . _ - are right", request.request_id().size(),
                             kLongestId));
  checks.Text("name", request.name(), kLongestName_bytes);
  checks.NonEmpty("program", request.program());
  checks.Require(request.program().size() <= kLargestProgram_bytes, "program", "PROGRAM_TOO_LARGE",
                 fmt::format("the program has {} bytes; at most {} are taken", request.program().size(),
                             kLargestProgram_bytes));
  const bool drawing = request.program_format() == type::v1::PROGRAM_FORMAT_DXF;
  if (checks.ok() && !drawing) {
    checks.Text("program", request.program(), kLargestProgram_bytes);
  }
  CheckFormat(request, checks);
  if (request.has_feed_scale()) {
    checks.Positive("feed_scale", request.feed_scale());
    checks.InRange("feed_scale", request.feed_scale(), 0.0, kLargestFeedScale);
  }
  if (!checks.ok()) {
    return checks.status();
  }
  Submission submission{request.request_id(),
                        request.name(),
                        request.program(),
                        Sha256(request.program()),
                        "",
                        request.compensate(),
                        request.has_feed_scale() ? request.feed_scale() : 1.0,
                        std::nullopt,
                        ProgramFormat::kByContent,
                        ""};
  if (request.has_machine_version()) {
    submission.machine_version = request.machine_version();
  }
  submission.program_format = static_cast<ProgramFormat>(request.program_format());
  submission.toolpath = request.toolpath().SerializeAsString();
  submission.content_sha256 = Sha256(ContentOf(submission));
  return submission;
}

v1::Job ToWire(const LiveJob& live) {
  const JobOrder& order = live.job.order;
  const JobProgress& progress = live.job.progress;
  v1::Job wire;
  wire.set_job_id(order.job_id);
  wire.set_request_id(order.request_id);
  wire.set_name(order.name);
  wire.set_state(static_cast<v1::JobState>(progress.state));
  wire.set_reason(progress.reason);
  wire.set_message(progress.message);
  for (const ProgramFault& fault : progress.faults) {
    *wire.add_faults() = ToWire(fault);
  }
  wire.set_program_sha256(order.program_sha256);
  FillVersion(progress.model_version, *wire.mutable_model_version());
  wire.set_plan_id(progress.plan_id);
  for (const std::uint64_t plan : progress.plan_ids) {
    wire.add_plan_ids(plan);
  }
  wire.set_s_mm(progress.s_mm);
  wire.set_length_mm(progress.length_mm);
  wire.set_progress(progress.state == JobState::kCompleted ? 1.0
                    : progress.length_mm > 0.0 ? std::clamp(progress.s_mm / progress.length_mm, 0.0, 1.0)
                                               : 0.0);
  wire.set_expected_duration_s(progress.expected_duration_s);
  wire.set_compensated(order.compensate);
  wire.set_predicted_95_mm(progress.predicted_95_mm);
  wire.set_submitted(TimeText(order.submitted_ns));
  wire.set_started(TimeText(progress.started_ns));
  wire.set_ended(TimeText(progress.ended_ns));
  wire.set_feed_mm_per_s(live.feed_mm_per_s);
  wire.set_program_format(static_cast<type::v1::ProgramFormat>(order.program_format));
  return wire;
}

v1::JobEvent ToWire(const JournalRecord& record) {
  v1::JobEvent wire;
  wire.set_token(record.token);
  *wire.mutable_job() = ToWire(LiveJob{record.job});
  wire.set_time(TimeText(record.time_ns));
  return wire;
}

v1::MachineState ToWire(const MachineWord& machine) {
  v1::MachineState wire;
  for (const NodeWord& node : machine.nodes) {
    v1::NodeState& state = *wire.add_nodes();
    state.set_name(node.name);
    state.set_mode(node.mode);
    state.set_reason(node.reason);
    state.set_age_s(node.age_s);
  }
  for (const std::string& veto : machine.vetoes) {
    wire.add_vetoes(veto);
  }
  FillVersion(machine.model_version, *wire.mutable_model_version());
  wire.set_job_id(machine.job_id);
  return wire;
}

v1::GetReportResponse ToWire(const LiveJob& live, const JobRecord& record, std::int64_t now_ns) {
  const JobProgress& progress = live.job.progress;
  const DeviationSummary summary = Summarise(record.events);
  v1::GetReportResponse wire;
  *wire.mutable_job() = ToWire(live);
  const std::int64_t end_ns = progress.ended_ns != 0 ? progress.ended_ns : now_ns;
  wire.set_duration_s(progress.started_ns == 0 ? 0.0 : SecondsBetween(progress.started_ns, end_ns));
  wire.set_cutting_time_s(record.cutting_time_s);
  wire.set_held_time_s(record.held_time_s);
  wire.set_interruptions(progress.interruptions);
  for (const EventDeviation& event : record.events) {
    if (event.s_rate_mm_per_s >= kMotion_mm_per_s) {
      wire.add_event_deviations(event.s_wanted_mm);
      wire.add_event_deviations(event.s_rate_mm_per_s);
      wire.add_event_deviations(event.deviation_mm);
    }
  }
  wire.set_event_deviation_p50_mm(summary.p50_mm);
  wire.set_event_deviation_p99_mm(summary.p99_mm);
  wire.set_drive_overruns(record.drive_overruns);
  wire.set_main_motion_overruns(record.main_motion_overruns);
  for (const TracePoint& point : record.trace) {
    for (const double value : {point.time_s, point.actuator_1_mm, point.actuator_2_mm,
                               point.actuator_1_mm_per_s, point.actuator_2_mm_per_s, point.s_mm}) {
      wire.add_slider_trace(value);
    }
  }
  wire.set_message_age_p50_s(summary.message_age_p50_s);
  wire.set_message_age_p99_s(summary.message_age_p99_s);
  return wire;
}

}  // namespace lambdajet::cell
