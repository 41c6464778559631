// TrajectoryService over real gRPC: admission in steps, plans as resources, long lists and files, and bad input met with statuses
// and answers only.
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include "tests/rpc/trajectory_service_fixture.hpp"

namespace lambdajet::trajectory {
namespace {

using Stub = v1::TrajectoryService::Stub;
using Step = v1::AdmissionStep;
using test::Eventually;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::vector<std::string> Ended(const std::vector<Step>& steps) {
  std::vector<std::string> names;
  for (const Step& step : steps) {
    if (step.state() != Step::STATE_RUNNING) {
      names.push_back(step.step());
    }
  }
  return names;
}

TEST_F(TrajectoryServiceTest, AdmitsStepByStepAndThePlanStays) {
  v1::AdmitProgramRequest request;
  request.set_program(kPlate);
  absl::Status status;
  const auto steps = Steps(request, status);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(Ended(steps),
            (std::vector<std::string>{"PARSE", "PLACE", "REACH", "LIMITS", "TIME", "ACCURACY"}));
  for (const Step& step : steps) {
    EXPECT_NE(step.state(), Step::STATE_REFUSED);
    EXPECT_TRUE(step.progress() >= 0.0 && step.progress() <= 1.0);
  }
  const v1::PlanSummary& plan = steps.back().plan();
  EXPECT_GT(plan.predicted_95_mm(), 0.0);
  EXPECT_EQ(plan.model_version().version(), 4u);
  const auto found = PlanAndWait(kPlate);
  EXPECT_EQ(found.summary().plan_id(), plan.plan_id());
  EXPECT_EQ(found.summary().duration_s(), plan.duration_s());
}

TEST_F(TrajectoryServiceTest, StopsAtTheStepThatRefuses) {
  const auto refusing = [this](const std::string& program, const v1::PlanOptions& options, const char* step,
                               const char* reason, std::uint32_t line) {
    v1::AdmitProgramRequest request;
    request.set_program(program);
    *request.mutable_options() = options;
    absl::Status status;
    const auto steps = Steps(request, status);
    ASSERT_TRUE(status.ok()) << status;
    ASSERT_FALSE(steps.empty());
    EXPECT_EQ(steps.back().step(), step);
    EXPECT_EQ(steps.back().state(), Step::STATE_REFUSED);
    ASSERT_GT(steps.back().faults_size(), 0);
    EXPECT_EQ(steps.back().faults(0).reason(), reason);
    EXPECT_TRUE(line == 0 || steps.back().faults(0).line() == line) << steps.back().faults(0).line();
  };
  refusing("G21 G90\nG1 X9 Q\nM2\n", {}, "PARSE", "BAD_NUMBER", 2);
  refusing("G21 G90\nG0 X10 Y10\nM3\nG1 X900 F600\nM5\nM2\n", {}, "PLACE", "OUTSIDE_SHEET", 4);
  v1::PlanOptions tight;
  tight.set_tolerance_mm(0.002);
  refusing(kPlate, tight, "ACCURACY", "TOLERANCE_NOT_REACHED", 0);
}

TEST_F(TrajectoryServiceTest, PlansToATolerance) {
  v1::PlanOptions options;
  options.set_tolerance_mm(0.1);
  v1::ToleranceWish& wish = *options.add_tolerances();
  wish.set_tolerance_mm(0.08);
  wish.set_first_line(5);
  wish.set_last_line(5);
  const auto plan = PlanAndWait(kPlate, options);
  ASSERT_EQ(plan.operation().state(), type::v1::OPERATION_STATE_DONE) << plan.DebugString();
  ASSERT_EQ(plan.summary().held_tolerances_size(), 2);
  for (const v1::HeldTolerance& held : plan.summary().held_tolerances()) {
    EXPECT_LE(held.predicted_95_mm(), held.tolerance_mm());
    EXPECT_LE(held.worst_mm(), held.tolerance_mm());
    EXPECT_FALSE(held.worst_source().empty());
  }
  EXPECT_GT(plan.summary().duration_s(), PlanAndWait(kPlate).summary().duration_s());
  options.set_tolerance_mm(0.002);
  const auto refused = PlanAndWait(kPlate, options);
  EXPECT_EQ(refused.operation().state(), type::v1::OPERATION_STATE_FAILED);
  EXPECT_EQ(refused.operation().reason(), "TOLERANCE_NOT_REACHED");
  EXPECT_GT(refused.blame().predicted_mm(), 0.002);
  EXPECT_FALSE(refused.blame().source().empty());
  EXPECT_FALSE(refused.blame().remedy().empty());
}

TEST_F(TrajectoryServiceTest, CancelsAPlanThatIsUnderWay) {
  std::string program = "G21 G90\nG0 X200 Y200\nM3\n";
  for (int i = 0; i < 4000; ++i) {
    program += "G1 X" + std::to_string(200 + i % 60) + " Y" + std::to_string(200 + i % 37) + " F3600\n";
  }
  v1::PlanProgramRequest request;
  request.set_program(program + "M5\nM2\n");
  request.mutable_options()->set_tolerance_mm(0.05);
  v1::PlanProgramResponse asked;
  ASSERT_TRUE(Call(&Stub::PlanProgram, *stub_, request, asked).ok());
  v1::CancelPlanRequest cancel;
  cancel.set_plan_id(asked.plan_id());
  v1::CancelPlanResponse cancelled;
  ASSERT_TRUE(Call(&Stub::CancelPlan, *stub_, cancel, cancelled).ok());
  v1::GetPlanRequest get;
  get.set_plan_id(asked.plan_id());
  v1::GetPlanResponse plan;
  EXPECT_TRUE(Eventually([&] {
    plan.Clear();
    EXPECT_TRUE(Call(&Stub::GetPlan, *stub_, get, plan).ok());
    return plan.operation().state() == type::v1::OPERATION_STATE_CANCELLED;
  }));
  EXPECT_EQ(plan.operation().reason(), "CANCELLED");
}

TEST_F(TrajectoryServiceTest, ListsALongProgramInBatches) {
  std::string program = "G21 G90\nG0 X10 Y10\nM3\n";
  constexpr int kLines = 12000;
  for (int i = 0; i < kLines; ++i) {
    program += "G1 X" + std::to_string(10 + i % 100) + " F600\n";
  }
  program += "M5\nM2\n";
  grpc::ClientContext context;
  v1::ListOperationsRequest request;
  request.set_program(program);
  const auto stream = stub_->StreamOperations(&context, request);
  std::string listed;
  int batches = 0;
  for (v1::OperationBatch batch; stream->Read(&batch); ++batches) {
    EXPECT_LE(batch.operations_size(), 5000);
    EXPECT_EQ(batch.faults_size(), 0);
    for (const std::string& line : batch.operations()) {
      listed += line + "\n";
    }
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_GE(batches, 3);
  v1::ExportRequest as_file;
  as_file.set_format(v1::ExportRequest::FORMAT_CANONICAL);
  as_file.set_program(program);
  std::string file;
  ASSERT_TRUE(ExportAll(as_file, file).ok());
  EXPECT_EQ(file, listed);
  EXPECT_GE(std::count(file.begin(), file.end(), '\n'), kLines);
}

TEST_F(TrajectoryServiceTest, ExportsAPlansPoints) {
  const auto plan = PlanAndWait(kPlate);
  v1::ExportRequest request;
  request.set_format(v1::ExportRequest::FORMAT_SAMPLES_CSV);
  request.set_plan_id(plan.summary().plan_id());
  request.set_step_s(0.01);
  std::string csv;
  ASSERT_TRUE(ExportAll(request, csv).ok());
  EXPECT_EQ(csv.rfind("tau_s,s_mm,x_W_mm", 0), 0u);
  EXPECT_NEAR(static_cast<double>(std::count(csv.begin(), csv.end(), '\n')),
              plan.summary().duration_s() / 0.01 + 2, 1.5);
}

TEST_F(TrajectoryServiceTest, RefusesWhatNoOptionMayBe) {
  for (const double bad : {kNan, kInfinite, -kInfinite, -1.0, 0.0, 1e300}) {
    for (int field = 0; field < 5; ++field) {
      v1::PlanProgramRequest request;
      request.set_program(kPlate);
      v1::PlanOptions& options = *request.mutable_options();
      field == 0   ? options.set_tolerance_mm(bad)
      : field == 1 ? options.set_feed_scale(bad)
      : field == 2 ? options.add_tolerances()->set_tolerance_mm(bad)
      : field == 3 ? options.set_overlap_mm(bad == 0.0 ? -0.5 : bad)
                   : options.set_start_from_s_mm(bad == 0.0 ? -0.5 : bad);
      v1::PlanProgramResponse response;
      const absl::Status status = Call(&Stub::PlanProgram, *stub_, request, response);
      EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << field << " " << bad;
      EXPECT_EQ(TroubleReason(status), std::isfinite(bad) ? "OUT_OF_RANGE" : "NOT_FINITE")
          << field << " " << bad;
    }
  }
  v1::PlanProgramRequest reversed;
  reversed.set_program(kPlate);
  v1::ToleranceWish& wish = *reversed.mutable_options()->add_tolerances();
  wish.set_tolerance_mm(0.1);
  wish.set_first_line(9);
  wish.set_last_line(3);
  v1::PlanProgramResponse response;
  EXPECT_EQ(TroubleReason(Call(&Stub::PlanProgram, *stub_, reversed, response)), "LINES_REVERSED");
}

TEST_F(TrajectoryServiceTest, RefusesWhatIsNoProgramInEveryCallThatTakesOne) {
  const auto check = [this](const std::string& program, absl::StatusCode code, const std::string& reason) {
    v1::AdmitProgramRequest admit;
    admit.set_program(program);
    v1::AdmitProgramResponse admitted;
    v1::PlanProgramRequest plan;
    plan.set_program(program);
    v1::PlanProgramResponse planned;
    v1::ListOperationsRequest list;
    list.set_program(program);
    v1::ListOperationsResponse listed;
    v1::ExportRequest file;
    file.set_format(v1::ExportRequest::FORMAT_CANONICAL);
    file.set_program(program);
    std::string text;
    absl::Status in_steps;
    Steps(admit, in_steps);
    grpc::ClientContext context;
    const auto stream = stub_->StreamOperations(&context, list);
    for (v1::OperationBatch batch; stream->Read(&batch);) {
      ADD_FAILURE() << "a batch came";
    }
    for (const absl::Status& status :
         {Call(&Stub::AdmitProgram, *stub_, admit, admitted, 60.0),
          Call(&Stub::PlanProgram, *stub_, plan, planned, 60.0),
          Call(&Stub::ListOperations, *stub_, list, listed, 60.0), ExportAll(file, text), in_steps,
          lambdajet::FromWire(stream->Finish())}) {
      EXPECT_EQ(status.code(), code) << status;
      EXPECT_EQ(TroubleReason(status), reason) << status;
      EXPECT_LT(std::string(status.message()).size(), 2000u);
    }
  };
  check("", absl::StatusCode::kInvalidArgument, "EMPTY");
  check(std::string(100u << 20, 'G'), absl::StatusCode::kInvalidArgument, "PROGRAM_TOO_LARGE");
}

TEST_F(TrajectoryServiceTest, SaysWhichVersionItHoldsAndThatItHasNone) {
  v1::AdmitProgramRequest request;
  request.set_program(kPlate);
  request.mutable_options()->set_machine_version(17);
  absl::Status status;
  EXPECT_TRUE(Steps(request, status).empty());
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(TroubleReason(status), "MACHINE_VERSION_NOT_HELD");
  machine_ = nullptr;
  EXPECT_TRUE(Steps(request, status).empty());
  EXPECT_EQ(TroubleReason(status), "NO_MACHINE_DESCRIPTION");
}

TEST_F(TrajectoryServiceTest, NamesThePlanThatDoesNotExistInEveryCall) {
  v1::GetPlanRequest get;
  get.set_plan_id(7);
  v1::GetPlanResponse got;
  v1::CancelPlanRequest cancel;
  cancel.set_plan_id(7);
  v1::CancelPlanResponse cancelled;
  v1::StartStreamingRequest start;
  start.set_plan_id(7);
  v1::StartStreamingResponse started;
  v1::ExportRequest file;
  file.set_format(v1::ExportRequest::FORMAT_SAMPLES_CSV);
  file.set_plan_id(7);
  std::string text;
  for (const absl::Status& status :
       {Call(&Stub::GetPlan, *stub_, get, got), Call(&Stub::CancelPlan, *stub_, cancel, cancelled),
        Call(&Stub::StartStreaming, *stub_, start, started), ExportAll(file, text)}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
    EXPECT_EQ(TroubleReason(status), "UNKNOWN_PLAN");
  }
  file.set_format(v1::ExportRequest::FORMAT_UNSPECIFIED);
  EXPECT_EQ(TroubleReason(ExportAll(file, text)), "UNKNOWN_FORMAT");
  file.set_format(v1::ExportRequest::FORMAT_SAMPLES_CSV);
  for (const double step : {kNan, 0.0, 1e-9, 2.0, kInfinite}) {
    file.set_step_s(step);
    EXPECT_EQ(ExportAll(file, text).code(), absl::StatusCode::kInvalidArgument) << step;
  }
}

TEST_F(TrajectoryServiceTest, RefusesACallWhoseDeadlineHasPassed) {
  v1::AdmitProgramRequest request;
  request.set_program(kPlate);
  absl::Status status;
  EXPECT_TRUE(Steps(request, status, -1.0).empty());
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded);
}

}  // namespace
}  // namespace lambdajet::trajectory
