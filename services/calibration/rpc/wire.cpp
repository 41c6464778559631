#include "calibration/rpc/wire.hpp"

#include <charconv>
#include <cstdio>
#include <ctime>

#include "platform/rpc/argument_checks.hpp"

namespace lambdajet::calibration {
namespace {

constexpr std::uint32_t kFewestLooks = 4, kMostLooks = 60, kMostPierces = 10;
constexpr std::uint32_t kFewestVerifyingLooks = 2, kMostVerifyingLooks = 12;

std::string Rfc3339(std::int64_t utc_ns) {
  const std::time_t seconds = static_cast<std::time_t>(utc_ns / 1000000000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[64];
  std::snprintf(text, sizeof text, "%04d-%02d-%02dT%02d:%02d:%02d.%03dZ", utc.tm_year + 1900, utc.tm_mon + 1,
                utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, static_cast<int>(utc_ns / 1000000 % 1000));
  return text;
}

void InRange(ArgumentChecks& checks, const char* field, std::uint32_t value, std::uint32_t least,
             std::uint32_t most) {
  checks.Require(
      value >= least && value <= most, field, "OUT_OF_RANGE",
      std::to_string(value) + "; " + std::to_string(least) + " to " + std::to_string(most) + " is right");
}

}  // namespace

absl::StatusOr<MeasuringPlanOptions> FromWire(const v1::PlanMeasuringRunRequest& request) {
  MeasuringPlanOptions options;
  ArgumentChecks checks;
  if (request.has_looks()) {
    InRange(checks, "looks", request.looks(), kFewestLooks, kMostLooks);
    options.looks = static_cast<int>(request.looks());
  }
  if (request.has_trial_pierces()) {
    InRange(checks, "trial_pierces", request.trial_pierces(), 0, kMostPierces);
    options.trial_pierces = static_cast<int>(request.trial_pierces());
  }
  options.elasticity = !request.skip_elasticity();
  return checks.ok() ? absl::StatusOr<MeasuringPlanOptions>(options) : checks.status();
}

absl::StatusOr<int> FromWire(const v1::PlanVerificationRequest& request) {
  const std::uint32_t looks = request.has_looks() ? request.looks() : 3;
  ArgumentChecks checks;
  InRange(checks, "looks", looks, kFewestVerifyingLooks, kMostVerifyingLooks);
  return checks.ok() ? absl::StatusOr<int>(static_cast<int>(looks)) : checks.status();
}

absl::StatusOr<Page> PageFromWire(std::int32_t page_size, const std::string& page_token) {
  Page page;
  ArgumentChecks checks;
  checks.Require(page_size >= 0 && page_size <= kLargestPageSize, "page_size", "OUT_OF_RANGE",
                 std::to_string(page_size) + "; 1 to 100, or 0 for 20, is right");
  if (page_size > 0) {
    page.size = page_size;
  }
  if (!page_token.empty()) {
    std::int64_t before = 0;
    const auto [end, error] =
        std::from_chars(page_token.data(), page_token.data() + page_token.size(), before);
    checks.Require(error == std::errc() && end == page_token.data() + page_token.size() && before >= 0,
                   "page_token", "BAD_PAGE_TOKEN", "it is not one that this service gave");
    page.before = before;
  }
  return checks.ok() ? absl::StatusOr<Page>(page) : checks.status();
}

absl::Status CheckPlan(std::uint64_t plan_id) {
  ArgumentChecks checks;
  checks.Require(plan_id != 0, "plan_id", "EMPTY",
                 "0 names no plan; the id of the plan that took the looks is right");
  return checks.status();
}

absl::Status CheckAuthor(const std::string& author) {
  ArgumentChecks checks;
  checks.Text("author", author, 128);
  return checks.status();
}

absl::Status CheckOperationId(const std::string& id) {
  ArgumentChecks checks;
  checks.Id("operation_id", id);
  return checks.status();
}

void ToWire(const MachineDescription& machine, machine::v1::ModelVersion& wire) {
  wire.set_machine_id(machine.machine_id);
  wire.set_version(machine.version);
  wire.set_hash(machine.hash);
}

void ToWire(const RunHead& run, v1::Run& wire) {
  wire.set_plan_id(run.plan);
  wire.set_looks(run.looks);
  wire.set_unseen(run.unseen);
  wire.set_first_exposure_ns(run.first_exposure_ns);
}

void ToWire(const RecordedLook& look, v1::Look& wire) {
  wire.set_mark(look.look.mark);
  wire.set_exposure_ns(look.look.exposure_ns);
  wire.set_seen(look.look.seen);
  wire.set_x_c_mm(look.look.p_C_mm.x());
  wire.set_y_c_mm(look.look.p_C_mm.y());
  wire.set_gate(look.gate);
  for (const double q : look.look.actuator_position_mm) {
    wire.add_actuator_position_mm(q);
  }
}

void ToWire(const Verification& found, const MachineDescription& machine, v1::VerifyBaseResponse& wire) {
  wire.set_verdict(std::string(VerdictName(found.verdict)));
  wire.set_chi_square(found.chi_square);
  wire.set_degrees_of_freedom(static_cast<std::uint32_t>(found.degrees_of_freedom));
  wire.set_p_value(found.p_value);
  wire.set_shift_x_mm(found.mean_shift_C_mm.x());
  wire.set_shift_y_mm(found.mean_shift_C_mm.y());
  wire.set_turn_rad(found.move.z());
  wire.set_rms_mm(found.rms_mm);
  wire.set_message(found.explanation);
  ToWire(machine, *wire.mutable_model_version());
}

void ToWire(const OperationView& operation, type::v1::Operation& wire) {
  wire.set_id(operation.id);
  wire.set_state(static_cast<type::v1::OperationState>(operation.state));
  wire.set_progress(operation.progress);
  wire.set_phase(operation.phase);
  wire.set_reason(operation.reason);
  wire.set_message(operation.message);
}

void ToWire(const ParameterChange& change, v1::ParameterChange& wire) {
  wire.set_name(std::string(ParameterName(change.parameter)));
  wire.set_unit(std::string(ParameterUnit(change.parameter)));
  wire.set_before(change.before);
  wire.set_before_sigma(change.before_sigma);
  wire.set_after(change.after);
  wire.set_after_sigma(change.after_sigma);
}

void ToWire(const IdentificationReport& report, const Version& parent, const Version& made,
            v1::IdentificationResult& wire) {
  wire.set_version(report.version);
  for (const ParameterChange& change : Compare(parent, made)) {
    ToWire(change, *wire.add_parameters());
  }
  wire.set_rms_before_mm(report.rms_before_mm);
  wire.set_rms_after_mm(report.rms_after_mm);
  wire.set_rms_hold_out_mm(report.rms_hold_out_mm);
  wire.set_chi_square(report.chi_square);
  wire.set_degrees_of_freedom(report.degrees_of_freedom);
  wire.set_rank(report.rank);
  for (const std::string& words : report.weak_directions) {
    wire.add_weak_directions(words);
  }
  for (const std::string& words : report.outliers) {
    wire.add_outliers(words);
  }
  wire.set_place_bound_95_mm(report.place_bound_95_mm);
  wire.set_stiffness_n_per_mm(report.stiffness_n_per_mm);
}

void ToWire(const Version& version, const MachineDescription& machine, bool active, v1::Version& wire) {
  ToWire(machine, *wire.mutable_model_version());
  wire.set_parent(version.parent);
  wire.set_author(version.author);
  wire.set_created(Rfc3339(version.created_utc_ns));
  wire.set_active(active);
  wire.set_run_plan_id(version.run);
}

}  // namespace lambdajet::calibration
