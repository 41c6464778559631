// TrajectoryService over real gRPC: admission in steps, plans as resources, long lists and files, and bad input met with statuses
// and answers only.
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <set>
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

std::string Shipped(const std::string& name) {
  std::ostringstream text;
  text << std::ifstream(test::SourceDir() + "/deploy/parts/" + name).rdbuf();
  EXPECT_FALSE(text.str().empty()) << name;
  return text.str();
}

// Short legs at right angles: more slow stretches than one answer carries.
std::string Zigzag(int legs) {
  std::string program = "G21 G90\nG0 X200 Y200\nM3 P0.3\nF3600\n";
  for (int i = 1; i <= legs; ++i) {
    program += "G1 X" + std::to_string(200 + (i + 1) / 2) + " Y" + std::to_string(200 + i / 2) + "\n";
  }
  return program + "M5\nM2\n";
}

TEST_F(TrajectoryServiceTest, TellsWhereTheFeedIsNotHeldAsTheCoreKnowsIt) {
  for (const std::string& program : {std::string(kPlate), Shipped("bracket.ngc"), Zigzag(260)}) {
    const v1::PlanSummary told = PlanAndWait(program).summary();
    const std::vector<SlowStretch> known = PlanToTolerance(program, *machine_, {}).planned.slow;
    ASSERT_GT(known.size(), 0u);
    EXPECT_EQ(told.slow_stretch_count(), known.size());
    ASSERT_EQ(static_cast<std::size_t>(told.slow_stretches_size()), std::min<std::size_t>(known.size(), 200));
    for (int i = 0; i < told.slow_stretches_size(); ++i) {
      const v1::SlowStretch& wire = told.slow_stretches(i);
      const SlowStretch& core = known[static_cast<std::size_t>(i)];
      EXPECT_EQ(wire.from_s_mm(), core.from_s_mm);
      EXPECT_EQ(wire.to_s_mm(), core.to_s_mm);
      EXPECT_EQ(wire.line(), core.line);
      EXPECT_EQ(wire.limit(), FeedLimitName(core.limit));
      EXPECT_EQ(wire.programmed_mm_per_s(), core.programmed_mm_per_s);
      EXPECT_EQ(wire.lowest_mm_per_s(), core.lowest_mm_per_s);
      EXPECT_EQ(wire.nearest(), FeedLimitName(core.nearest));
      EXPECT_TRUE(wire.has_reached_share() && wire.has_at_s_mm() && wire.has_share());
      EXPECT_EQ(wire.reached_share(), core.reached_share);
      EXPECT_EQ(wire.at_s_mm(), core.at_s_mm);
      EXPECT_EQ(wire.share(), core.share);
    }
  }
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

// A program in one of the formats, with what a drawing needs to be cut.
struct Written {
  std::string text;
  type::v1::ProgramFormat format = type::v1::PROGRAM_FORMAT_UNSPECIFIED;

  template <typename Request>
  void Fill(Request& request) const {
    request.set_program(text);
    if constexpr (std::is_same_v<Request, v1::ExportRequest>) {
      request.set_program_format(format);
    } else {
      request.set_format(format);
    }
    if (format == type::v1::PROGRAM_FORMAT_DXF) {
      request.mutable_toolpath()->add_ignore_layers("CENTRE");
      request.mutable_toolpath()->set_lead_mm(6.0);
    }
  }
};

// An operation's kind and numbers, of those that are the same in every notation; modes and the source's lines are not.
struct Canonical {
  std::string kind;
  std::vector<std::pair<std::string, double>> numbers;
};

std::vector<Canonical> CanonicalOf(const std::string& listing) {
  static const std::set<std::string> kModes = {"UNITS_CHANGE", "DISTANCE_CHANGE", "WORK_OFFSET_CHANGE",
                                               "FEED_CHANGE"};
  std::vector<Canonical> operations;
  std::istringstream lines(listing);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    Canonical operation;
    std::string source_line;
    words >> source_line >> operation.kind;
    for (std::string word; words >> word;) {
      const std::size_t sign = word.find('=');
      if (sign != std::string::npos) {
        operation.numbers.emplace_back(word.substr(0, sign), std::stod(word.substr(sign + 1)));
      }
    }
    if (kModes.count(operation.kind) == 0) {
      operations.push_back(std::move(operation));
    }
  }
  return operations;
}

void ExpectSame(const std::vector<Canonical>& a, const std::vector<Canonical>& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].kind, b[i].kind) << i;
    ASSERT_EQ(a[i].numbers.size(), b[i].numbers.size()) << i << " " << a[i].kind;
    for (std::size_t k = 0; k < a[i].numbers.size(); ++k) {
      ASSERT_EQ(a[i].numbers[k].first, b[i].numbers[k].first) << i << " " << a[i].kind;
      ASSERT_NEAR(a[i].numbers[k].second, b[i].numbers[k].second, tolerance)
          << i << " " << a[i].kind << " " << a[i].numbers[k].first;
    }
  }
}

const std::vector<Written>& ProgramsInAllFormats() {
  static const std::vector<Written> programs = {
      {kPlate},
      {Shipped("cover/cover.ngc"), type::v1::PROGRAM_FORMAT_GCODE},
      {Shipped("cover/cover.cldata"), type::v1::PROGRAM_FORMAT_CLDATA},
      {Shipped("cover/cover.dxf"), type::v1::PROGRAM_FORMAT_DXF},
      {Shipped("bracket.ngc"), type::v1::PROGRAM_FORMAT_GCODE},
      {"G21 G90 G43 H1\nG0 X100 Y100 Z5\nM3 P0.5\nG1 Z-3 F3000\nG1 X180 Z-3\nG2 X200 Y120 I0 J20\nM5\nG0 "
       "Z25\nM2\n",
       type::v1::PROGRAM_FORMAT_FLAT_GCODE},
      {"G20 G90 G64 P0.001\nG0 X8 Y8\nM3\nG93 G1 X9 F40\nG2 X10 Y8 I0.5 J0 F30\nG94 G1 X10.5 "
       "F100\nG61\nM5\nG4 "
       "P0.2\nG0 X12\nM62 P0\nG91 G1 X1\nM63 P0\nM100 P2\nM2\n"}};
  return programs;
}

TEST_F(TrajectoryServiceTest, WhatIsWrittenOutReadsBackTheSame) {
  const auto exported = [this](const Written& program, v1::ExportRequest::Format as) {
    v1::ExportRequest request;
    program.Fill(request);
    request.set_format(as);
    std::string text;
    const absl::Status status = ExportAll(request, text);
    EXPECT_TRUE(status.ok()) << status;
    return text;
  };
  for (std::size_t i = 0; i < ProgramsInAllFormats().size(); ++i) {
    const Written& program = ProgramsInAllFormats()[i];
    const auto wanted = CanonicalOf(exported(program, v1::ExportRequest::FORMAT_CANONICAL));
    ASSERT_GT(wanted.size(), 5u);
    for (const auto& [as, format] :
         {std::pair{v1::ExportRequest::FORMAT_GCODE, type::v1::PROGRAM_FORMAT_GCODE},
          std::pair{v1::ExportRequest::FORMAT_CLDATA, type::v1::PROGRAM_FORMAT_CLDATA}}) {
      SCOPED_TRACE("program " + std::to_string(i) + " as " + v1::ExportRequest::Format_Name(as));
      const Written written{exported(program, as), format};
      ExpectSame(wanted, CanonicalOf(exported(written, v1::ExportRequest::FORMAT_CANONICAL)), 2e-6);
      EXPECT_EQ(exported(written, as), written.text) << "written again it is the same text";
    }
  }
}

TEST_F(TrajectoryServiceTest, APlanWrittenOutIsPlannedTheSame) {
  for (const Written& program : ProgramsInAllFormats()) {
    v1::PlanProgramRequest request;
    program.Fill(request);
    const auto plan = PlanAndWait(request);
    ASSERT_EQ(plan.operation().state(), type::v1::OPERATION_STATE_DONE) << plan.DebugString();
    for (const auto as : {v1::ExportRequest::FORMAT_GCODE, v1::ExportRequest::FORMAT_CLDATA}) {
      v1::ExportRequest file;
      file.set_plan_id(plan.summary().plan_id());
      file.set_format(as);
      std::string text;
      ASSERT_TRUE(ExportAll(file, text).ok());
      const auto again = PlanAndWait(text);
      EXPECT_NEAR(again.summary().duration_s(), plan.summary().duration_s(),
                  2e-5 * plan.summary().duration_s());
      EXPECT_NEAR(again.summary().cutting_length_mm(), plan.summary().cutting_length_mm(), 1e-4);
      EXPECT_EQ(again.summary().gate_count(), plan.summary().gate_count());
      EXPECT_EQ(again.summary().event_count(), plan.summary().event_count());
    }
  }
}

TEST_F(TrajectoryServiceTest, APlanOfALargeProgramIsWrittenOutInPieces) {
  std::string program = "G21 G90\nG0 X200 Y200\nM3 P0.3\nF6000\n";
  for (int i = 0; program.size() <= PlanDesk::kMostKeptBytes; ++i) {
    program +=
        "G1 X" + std::to_string(200.0 + 0.001 * (i % 40000)) + " Y200 (" + std::string(50, 'x') + ")\n";
  }
  program += "M5\nM2\n";
  const auto plan = PlanAndWait(program);
  ASSERT_EQ(plan.operation().state(), type::v1::OPERATION_STATE_DONE) << plan.DebugString();
  const auto pieces = [this](const v1::ExportRequest& request) {
    grpc::ClientContext context;
    SetDeadline(context, 60.0);
    const auto stream = stub_->Export(&context, request);
    std::vector<std::string> all;
    for (v1::ExportPiece piece; stream->Read(&piece);) {
      EXPECT_LE(piece.content().size(), 1u << 20);
      all.push_back(piece.content());
    }
    EXPECT_TRUE(stream->Finish().ok());
    return all;
  };
  for (const auto as : {v1::ExportRequest::FORMAT_GCODE, v1::ExportRequest::FORMAT_CLDATA,
                        v1::ExportRequest::FORMAT_CANONICAL}) {
    v1::ExportRequest of_plan, of_program;
    of_plan.set_plan_id(plan.summary().plan_id());
    of_plan.set_format(as);
    of_program.set_program(program);
    of_program.set_format(as);
    const auto kept = pieces(of_plan);
    EXPECT_GE(kept.size(), 2u);
    EXPECT_EQ(kept, pieces(of_program)) << v1::ExportRequest::Format_Name(as);
  }
}

TEST_F(TrajectoryServiceTest, ABurstOfPlansDoesNotPushOutOneThatIsDone) {
  const std::uint64_t done = PlanAndWait(kPlate).summary().plan_id();
  v1::PlanProgramRequest request;
  request.set_program(kPlate);
  for (std::size_t i = 0; i < PlanDesk::kMostPlans; ++i) {  // each takes some twenty plans
    request.mutable_options()->set_tolerance_mm(0.1 + 1e-4 * static_cast<double>(i));
    v1::PlanProgramResponse asked;
    ASSERT_TRUE(Call(&Stub::PlanProgram, *stub_, request, asked).ok());
  }
  v1::GetPlanRequest get;
  get.set_plan_id(done);
  v1::GetPlanResponse plan;
  const absl::Status status = Call(&Stub::GetPlan, *stub_, get, plan);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(plan.summary().plan_id(), done);
}

TEST_F(TrajectoryServiceTest, ADrawingThatCannotBeCutIsRefusedWithItsLines) {
  Written open{Shipped("cover/cover.dxf"),
               type::v1::PROGRAM_FORMAT_DXF};  // its centre lines are open contours
  v1::PlanProgramRequest request;
  open.Fill(request);
  request.mutable_toolpath()->clear_ignore_layers();
  const auto plan = PlanAndWait(request);
  EXPECT_EQ(plan.operation().state(), type::v1::OPERATION_STATE_FAILED);
  ASSERT_GT(plan.faults_size(), 0);
  EXPECT_EQ(plan.operation().reason(), plan.faults(0).reason());
  EXPECT_GT(plan.faults(0).line(), 0u);
  EXPECT_NE(plan.faults(0).message().find("CENTRE"), std::string::npos) << plan.faults(0).message();
  v1::AdmitProgramRequest admit;
  open.Fill(admit);
  admit.mutable_toolpath()->clear_ignore_layers();
  absl::Status status;
  const auto steps = Steps(admit, status);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(steps.back().step(), "PARSE");
  EXPECT_EQ(steps.back().state(), Step::STATE_REFUSED);
  EXPECT_EQ(steps.back().faults(0).reason(), plan.faults(0).reason());
}

TEST_F(TrajectoryServiceTest, AKerfThatIsNotGivenIsTheMachines) {
  Written drawing{Shipped("cover/cover.dxf"), type::v1::PROGRAM_FORMAT_DXF};
  const auto plan_id = [&](std::optional<double> kerf_mm) {
    v1::PlanProgramRequest request;
    drawing.Fill(request);
    if (kerf_mm) {
      request.mutable_toolpath()->set_kerf_mm(*kerf_mm);
    }
    v1::PlanProgramResponse response;
    EXPECT_TRUE(Call(&Stub::PlanProgram, *stub_, request, response).ok());
    return response.plan_id();
  };
  EXPECT_EQ(plan_id(std::nullopt), plan_id(machine_->process.kerf_width_mm));
  EXPECT_NE(plan_id(std::nullopt), plan_id(1.0));
}

TEST_F(TrajectoryServiceTest, WatchesAPlanToItsEnd) {
  const auto watched = [this](std::uint64_t plan_id, const std::function<void(int)>& after) {
    grpc::ClientContext context;
    SetDeadline(context, 60.0);
    v1::WatchPlanRequest request;
    request.set_plan_id(plan_id);
    request.set_period_s(0.02);
    const auto stream = stub_->WatchPlan(&context, request);
    std::vector<v1::GetPlanResponse> told;
    for (v1::GetPlanResponse plan; stream->Read(&plan);) {
      told.push_back(plan);
      after(static_cast<int>(told.size()));
    }
    EXPECT_TRUE(stream->Finish().ok());
    return told;
  };
  v1::PlanProgramRequest request;
  request.set_program(kPlate);
  request.mutable_options()->set_tolerance_mm(0.1);
  v1::PlanProgramResponse asked;
  ASSERT_TRUE(Call(&Stub::PlanProgram, *stub_, request, asked).ok());
  const auto told = watched(asked.plan_id(), [](int) {});
  ASSERT_GE(told.size(), 3u) << "some twenty plans have steps to tell";
  for (std::size_t i = 1; i < told.size(); ++i) {
    EXPECT_GE(told[i].operation().progress(), told[i - 1].operation().progress());
    EXPECT_EQ(told[i - 1].operation().state(), type::v1::OPERATION_STATE_RUNNING);
  }
  EXPECT_EQ(told.back().operation().state(), type::v1::OPERATION_STATE_DONE);
  EXPECT_EQ(told.back().summary().plan_id(), asked.plan_id());
  EXPECT_EQ(watched(asked.plan_id(), [](int) {}).size(), 1u) << "an ended plan is told once";

  request.mutable_options()->set_tolerance_mm(0.09);
  ASSERT_TRUE(Call(&Stub::PlanProgram, *stub_, request, asked).ok());
  v1::CancelPlanRequest cancel;
  cancel.set_plan_id(asked.plan_id());
  const auto cancelled = watched(asked.plan_id(), [&](int count) {
    v1::CancelPlanResponse response;
    EXPECT_TRUE(count > 1 || Call(&Stub::CancelPlan, *stub_, cancel, response).ok());
  });
  EXPECT_EQ(cancelled.back().operation().state(), type::v1::OPERATION_STATE_CANCELLED);
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
