// A hexapod's programs over the same TrajectoryService: admission in steps, plans, points, lists, files, and bad input.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>

#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/hexapod_file.hpp"
#include "platform/rpc/channel.hpp"
#include "platform/rpc/rpc_server.hpp"
#include "platform/rpc/status_mapping.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "trajectory/rpc/trajectory_rpc.hpp"

namespace lambdajet::trajectory {
namespace {

using Stub = v1::TrajectoryService::Stub;
using Step = v1::AdmissionStep;
using Code = absl::StatusCode;

const char* const kTilted =
    "G21 G90\nG64 P0.02\nG0 X-20 Y0 Z20\nG1 X20 B10 F1200\nG81 R2 Z-8 F300\nG80\nM2\n";

class SpatialServiceTest : public testing::Test {
 protected:
  SpatialServiceTest()
      : desk_(metrics_),
        own_(Model()),
        rpc_([](std::optional<std::uint32_t>) { return nullptr; }, {}, desk_, own_),
        bare_([](std::optional<std::uint32_t>) { return nullptr; }, {}, desk_),
        server_({}, nullptr, nullptr),
        bare_server_({}, nullptr, nullptr) {
    server_.Add(rpc_, v1::TrajectoryService::service_full_name());
    bare_server_.Add(bare_, v1::TrajectoryService::service_full_name());
    EXPECT_TRUE(server_.Start().ok() && bare_server_.Start().ok());
    stub_ = StubAt(server_);
  }
  ~SpatialServiceTest() override {
    desk_.CancelAll();
    server_.Shutdown();
    bare_server_.Shutdown();
  }

  static std::shared_ptr<const HexapodModel> Model() {
    const auto file = ReadHexapodFile(test::SourceDir() + "/deploy/config/hexapod.yaml");
    EXPECT_TRUE(file.ok()) << file.status();
    return std::make_shared<const HexapodModel>(
        HexapodModel{file->machine_id, HexapodHash(*file), file->geometry, file->motion});
  }
  static std::unique_ptr<Stub> StubAt(const RpcServer& server) {
    return v1::TrajectoryService::NewStub(
        *OpenChannel({.address = "127.0.0.1:" + std::to_string(server.port())}));
  }
  static std::string Holes() {
    std::ifstream file(test::SourceDir() + "/deploy/parts/tilted_holes/tilted_holes.ngc");
    return {std::istreambuf_iterator<char>(file), {}};
  }
  template <typename Request>
  static Request Ask(const std::string& program) {
    Request request;
    request.set_program(program);
    request.mutable_options()->set_mechanism(v1::MECHANISM_HEXAPOD);
    return request;
  }

  std::vector<Step> Steps(const std::string& program, absl::Status& status) {
    grpc::ClientContext context;
    SetDeadline(context, 60.0);
    const auto stream = stub_->AdmitProgramInSteps(&context, Ask<v1::AdmitProgramRequest>(program));
    std::vector<Step> steps;
    for (Step step; stream->Read(&step);) {
      steps.push_back(step);
    }
    status = lambdajet::FromWire(stream->Finish());
    return steps;
  }

  v1::GetPlanResponse PlanAndWait(const std::string& program) {
    v1::PlanProgramResponse asked;
    const absl::Status status = Call(&Stub::PlanProgram, *stub_, Ask<v1::PlanProgramRequest>(program), asked);
    EXPECT_TRUE(status.ok()) << status;
    v1::GetPlanRequest get;
    get.set_plan_id(asked.plan_id());
    v1::GetPlanResponse plan;
    EXPECT_TRUE(test::Eventually([&] {
      plan.Clear();
      EXPECT_TRUE(Call(&Stub::GetPlan, *stub_, get, plan).ok());
      return plan.operation().state() != type::v1::OPERATION_STATE_RUNNING;
    }));
    return plan;
  }

  absl::Status ExportAll(const v1::ExportRequest& request, std::string& text) {
    grpc::ClientContext context;
    SetDeadline(context, 60.0);
    const auto stream = stub_->Export(&context, request);
    text.clear();
    for (v1::ExportPiece piece; stream->Read(&piece);) {
      text += piece.content();
    }
    return lambdajet::FromWire(stream->Finish());
  }

  Metrics metrics_;
  PlanDesk desk_;
  std::shared_ptr<const HexapodModel> own_;
  TrajectoryRpc rpc_, bare_;
  RpcServer server_, bare_server_;
  std::unique_ptr<Stub> stub_;
};

TEST_F(SpatialServiceTest, AdmitsStepByStepAndThePlanIsThatOfTheCore) {
  absl::Status status;
  const auto steps = Steps(Holes(), status);
  ASSERT_TRUE(status.ok()) << status;
  std::vector<std::string> ended;
  for (const Step& step : steps) {
    EXPECT_NE(step.state(), Step::STATE_REFUSED) << step.DebugString();
    EXPECT_TRUE(step.progress() >= 0.0 && step.progress() <= 1.0);
    if (step.state() == Step::STATE_PASSED) {
      ended.push_back(step.step());
    }
  }
  EXPECT_EQ(ended, (std::vector<std::string>{"PARSE", "PLACE", "REACH", "LIMITS", "TIME"}));
  const v1::PlanSummary& plan = steps.back().plan();
  const PlannedSpatialProgram core = PlanSpatialText(Holes(), *own_, {});
  EXPECT_EQ(plan.plan_id(), core.plan.id);
  EXPECT_EQ(plan.duration_s(), core.plan.duration_s);
  EXPECT_EQ(plan.model_version().machine_id(), own_->machine_id);
  EXPECT_EQ(plan.model_version().hash(), own_->hash);
  EXPECT_EQ(plan.spatial().longest_strut_mm(), core.longest_mm.maxCoeff());
  EXPECT_GT(plan.spatial().singular_margin_ratio(), 0.15);
  EXPECT_GT(core.slow.size(), 0u);
  EXPECT_EQ(plan.slow_stretch_count(), core.slow.size());
  for (const v1::SlowStretch& slow : plan.slow_stretches()) {
    EXPECT_FALSE(slow.limit().empty());
    EXPECT_TRUE(!slow.nearest().empty() && slow.has_reached_share() && slow.has_at_s_mm() && slow.has_share());
  }
  EXPECT_EQ(PlanAndWait(Holes()).summary().plan_id(), plan.plan_id());
  v1::ListPlansResponse listed;
  ASSERT_TRUE(Call(&Stub::ListPlans, *stub_, v1::ListPlansRequest(), listed).ok());
  ASSERT_EQ(listed.plans_size(), 1);
  EXPECT_TRUE(listed.plans(0).has_spatial());
}

TEST_F(SpatialServiceTest, StreamsPointsOverTimeAndTheSameAsFile) {
  const auto plan = PlanAndWait(kTilted);
  ASSERT_EQ(plan.operation().state(), type::v1::OPERATION_STATE_DONE) << plan.DebugString();
  const PlannedSpatialProgram core = PlanSpatialText(kTilted, *own_, {});
  v1::StreamSamplesRequest request;
  request.set_plan_id(plan.summary().plan_id());
  request.set_step_s(0.01);
  grpc::ClientContext context;
  const auto stream = stub_->StreamSamples(&context, request);
  std::size_t points = 0;
  for (v1::SampleBatch batch; stream->Read(&batch);) {
    EXPECT_EQ(batch.values_size(), 0);
    ASSERT_EQ(batch.spatial_values_size(), 22 * batch.cutting_size());
    ASSERT_EQ(batch.source_line_size(), batch.cutting_size());
    for (int i = 0; i < batch.cutting_size(); ++i, ++points) {
      const double* p = batch.spatial_values().data() + 22 * i;
      const SpatialPlanPoint want = PointAt(core, p[0]);
      ASSERT_NEAR(p[0], 0.01 * static_cast<double>(points), 1e-9);
      ASSERT_EQ(p[4], want.p_W_mm.z());
      ASSERT_EQ(p[6], want.turn.pitch_rad);
      ASSERT_EQ(p[10], want.struts.q_mm[0]);
      ASSERT_EQ(p[21], want.struts.first[5]);
    }
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(points, static_cast<std::size_t>(std::floor(core.plan.duration_s / 0.01 + 1e-9)) + 1);
  v1::ExportRequest as_file;
  as_file.set_format(v1::ExportRequest::FORMAT_SAMPLES_CSV);
  as_file.set_plan_id(plan.summary().plan_id());
  as_file.set_step_s(0.01);
  std::string csv;
  ASSERT_TRUE(ExportAll(as_file, csv).ok());
  EXPECT_EQ(csv.rfind("tau_s,s_mm,x_W_mm,y_W_mm,z_W_mm,a_rad", 0), 0u);
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')), points + 1);
}

// From G-code to CLDATA and back over the wire: the same list of motions, and a plan as long.
TEST_F(SpatialServiceTest, ListsAndWritesProgramsInSixAxes) {
  v1::ListOperationsRequest list;
  list.set_program(kTilted);
  list.set_mechanism(v1::MECHANISM_HEXAPOD);
  v1::ListOperationsResponse listed;
  ASSERT_TRUE(Call(&Stub::ListOperations, *stub_, list, listed).ok());
  ASSERT_EQ(listed.faults_size(), 0);
  EXPECT_NE(listed.DebugString().find("b_rad=0.174532925"), std::string::npos);
  list.clear_mechanism();
  listed.Clear();
  ASSERT_TRUE(Call(&Stub::ListOperations, *stub_, list, listed).ok());
  EXPECT_GT(listed.faults_size(), 0);  // the open-base machine drives no B
  const auto plan = PlanAndWait(Holes());
  v1::ExportRequest as_cldata;
  as_cldata.set_format(v1::ExportRequest::FORMAT_CLDATA);
  as_cldata.set_plan_id(plan.summary().plan_id());
  std::string cldata;
  ASSERT_TRUE(ExportAll(as_cldata, cldata).ok());
  EXPECT_NE(cldata.find("MULTAX/ON"), std::string::npos);
  const auto again = PlanAndWait(cldata);
  EXPECT_NEAR(again.summary().duration_s(), plan.summary().duration_s(), 1e-6);
  v1::ExportRequest turned;
  turned.set_format(v1::ExportRequest::FORMAT_CLDATA);
  turned.set_program("G0 X0 Y0 Z20\nG1 X10 C20 F600\nM2\n");
  turned.set_mechanism(v1::MECHANISM_HEXAPOD);
  const absl::Status status = ExportAll(turned, cldata);
  EXPECT_EQ(status.code(), Code::kFailedPrecondition);
  EXPECT_EQ(TroubleReason(status), "AXIS_NOT_WRITABLE");
}

// Arcs in every plane of a hexapod's plan, as G-code over the wire and planned again.
TEST_F(SpatialServiceTest, WritesArcsInEveryPlaneAsGcode) {
  const auto plan = PlanAndWait(
      "G21 G90\nG0 X0 Y0 Z30\nF1200\nG18 G2 X10 Z30 I5 K0 Y3\nG19 G3 Y10 Z30 J3.5 K0\nG17 G2 X0 Y0 R12 "
      "Z28\nG18 G3 "
      "X0 Z28 I2 K2 P2\nM2\n");
  ASSERT_EQ(plan.operation().state(), type::v1::OPERATION_STATE_DONE) << plan.DebugString();
  v1::ExportRequest as_gcode;
  as_gcode.set_format(v1::ExportRequest::FORMAT_GCODE);
  as_gcode.set_plan_id(plan.summary().plan_id());
  std::string gcode;
  const absl::Status status = ExportAll(as_gcode, gcode);
  ASSERT_TRUE(status.ok()) << status;
  for (const char* plane : {"G18\n", "G19\n", "G17\n"}) {
    EXPECT_NE(gcode.find(plane), std::string::npos) << gcode;
  }
  const auto again = PlanAndWait(gcode);
  ASSERT_EQ(again.operation().state(), type::v1::OPERATION_STATE_DONE) << again.DebugString();
  EXPECT_NEAR(again.summary().duration_s(), plan.summary().duration_s(), 1e-6);
  EXPECT_NEAR(again.summary().length_mm(), plan.summary().length_mm(), 1e-6);
}

TEST_F(SpatialServiceTest, RefusesWithStepReasonValueAndLine) {
  struct Wrong {
    const char* program;
    const char* step;
    const char* reason;
    std::uint32_t line;
    const char* says;
  };
  for (const Wrong& w :
       {Wrong{"G0 Z20\nG1 X9 Q\nM2\n", "PARSE", "BAD_NUMBER", 2, ""},
        Wrong{"G0 Z20\nG1 XNAN F600\nM2\n", "PARSE", "BAD_NUMBER", 2, ""},
        Wrong{"G0 Z20\nG1 X500 F600\nM2\n", "PLACE", "ACTUATOR_LIMIT", 2, "STRUT_MAX of strut"},
        Wrong{"G0 Z20\nG1 A45 F600\nM2\n", "PLACE", "JOINT_LIMIT", 2, "PLATFORM_JOINT_CONE"},
        Wrong{"G0 Z20\nG1 Z-400 F600\nM2\n", "PLACE", "ACTUATOR_LIMIT", 2, "mm; move the part"},
        Wrong{"G0 X-60 Z20\nG3 X60 I60 J-200 F600\nM2\n", "REACH", "ACTUATOR_LIMIT", 2, "STRUT_MAX"},
        Wrong{"PARTNO A\nFROM/0,0,20\nCYCLE/DRILL,9,60,MMPM,2\nFINI\n", "PARSE", "CYCLE_NUMBER_WITHOUT_WORD",
              3, "a word must say what this number means"}}) {
    SCOPED_TRACE(w.program);
    absl::Status status;
    const auto steps = Steps(w.program, status);
    ASSERT_TRUE(status.ok()) << status;
    ASSERT_FALSE(steps.empty());
    EXPECT_EQ(steps.back().step(), w.step);
    EXPECT_EQ(steps.back().state(), Step::STATE_REFUSED);
    ASSERT_GT(steps.back().faults_size(), 0);
    EXPECT_EQ(steps.back().faults(0).reason(), w.reason);
    EXPECT_EQ(steps.back().faults(0).line(), w.line);
    EXPECT_NE(steps.back().faults(0).message().find(w.says), std::string::npos) << steps.back().DebugString();
    v1::AdmitProgramResponse admitted;
    ASSERT_TRUE(Call(&Stub::AdmitProgram, *stub_, Ask<v1::AdmitProgramRequest>(w.program), admitted).ok());
    EXPECT_FALSE(admitted.admitted());
    EXPECT_EQ(admitted.faults(0).reason(), w.reason);
    const auto plan = PlanAndWait(w.program);
    EXPECT_EQ(plan.operation().state(), type::v1::OPERATION_STATE_FAILED);
    EXPECT_EQ(plan.operation().reason(), w.reason);
    EXPECT_EQ(plan.faults(0).line(), w.line);
  }
}

TEST_F(SpatialServiceTest, RefusesRequestsThatCannotBeMeant) {
  const auto plan = [this](const v1::PlanProgramRequest& request) {
    v1::PlanProgramResponse response;
    return Call(&Stub::PlanProgram, *stub_, request, response);
  };
  const auto wrong = [&](auto set, Code code, const char* reason) {
    auto request = Ask<v1::PlanProgramRequest>(kTilted);
    set(request);
    const absl::Status status = plan(request);
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_EQ(TroubleReason(status), reason) << status;
  };
  wrong([](auto& r) { r.mutable_options()->set_mechanism(static_cast<v1::Mechanism>(99)); },
        Code::kInvalidArgument, "UNKNOWN_MECHANISM");
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    wrong([bad](auto& r) { r.mutable_options()->set_feed_scale(bad); }, Code::kInvalidArgument, "NOT_FINITE");
  }
  wrong([](auto& r) { r.mutable_options()->set_feed_scale(1.5); }, Code::kInvalidArgument, "OUT_OF_RANGE");
  wrong([](auto& r) { r.mutable_options()->set_tolerance_mm(0.1); }, Code::kInvalidArgument,
        "NOT_FOR_HEXAPOD");
  wrong([](auto& r) { r.mutable_options()->set_compensate(true); }, Code::kInvalidArgument,
        "NOT_FOR_HEXAPOD");
  wrong([](auto& r) { r.set_format(type::v1::PROGRAM_FORMAT_DXF); }, Code::kInvalidArgument,
        "NOT_FOR_HEXAPOD");
  wrong([](auto& r) { r.set_format(type::v1::PROGRAM_FORMAT_FLAT_GCODE); }, Code::kInvalidArgument,
        "NOT_FOR_HEXAPOD");
  wrong([](auto& r) { r.set_program("G1 X1 (\xff\xfe)\nM2\n"); }, Code::kInvalidArgument, "NOT_UTF8");
  wrong([](auto& r) { r.set_program(""); }, Code::kInvalidArgument, "EMPTY");
  v1::ListOperationsRequest list;
  list.set_program(kTilted);
  list.set_mechanism(static_cast<v1::Mechanism>(7));
  v1::ListOperationsResponse listed;
  EXPECT_EQ(TroubleReason(Call(&Stub::ListOperations, *stub_, list, listed)), "UNKNOWN_MECHANISM");
  v1::PlanProgramResponse late;
  EXPECT_EQ(Call(&Stub::PlanProgram, *stub_, Ask<v1::PlanProgramRequest>(kTilted), late, -1.0).code(),
            Code::kDeadlineExceeded);
  const auto bare = StubAt(bare_server_);
  const absl::Status none = Call(&Stub::PlanProgram, *bare, Ask<v1::PlanProgramRequest>(kTilted), late);
  EXPECT_EQ(none.code(), Code::kFailedPrecondition);
  EXPECT_EQ(TroubleReason(none), "NO_HEXAPOD");
  v1::StartStreamingRequest start;
  start.set_plan_id(PlanAndWait(kTilted).summary().plan_id());
  v1::StartStreamingResponse started;
  const absl::Status unplayed = Call(&Stub::StartStreaming, *stub_, start, started);
  EXPECT_EQ(unplayed.code(), Code::kFailedPrecondition);
  EXPECT_EQ(TroubleReason(unplayed), "MECHANISM_NOT_PLAYED");
}

}  // namespace
}  // namespace lambdajet::trajectory
