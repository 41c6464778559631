#include "tests/support/cut_trial.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "accuracy/core/prediction.hpp"
#include "calibration/core/identification.hpp"
#include "calibration/core/measuring_plan.hpp"
#include "inspection/drawing_file/drawing_file.hpp"
#include "platform/process/atomic_file.hpp"
#include "simulated_plant/core/nominal_plant.hpp"
#include "tests/support/virtual_cell.hpp"
#include "trajectory/core/tolerance/plan_to_tolerance.hpp"

namespace lambdajet::tests {
namespace {

using inspection::Arc;
using inspection::Feature;
using inspection::FeatureKind;
using inspection::Line;
using inspection::Side;
using trajectory::PlannedProgram;

constexpr double kTurn = 2.0 * std::numbers::pi;

class ProgramText {
 public:
  explicit ProgramText(double feed_mm_per_s) : feed_(60.0 * feed_mm_per_s) { Add("G17 G21 G90 G64 P0.02"); }
  void Pierce(double x, double y) { Add("G0 X%.4f Y%.4f\nM3", x, y); }
  void LineTo(double x, double y) { Add("G1 X%.4f Y%.4f F%.1f", x, y, feed_); }
  void ArcTo(double x, double y, double i, double j) {
    Add("G3 X%.4f Y%.4f I%.4f J%.4f F%.1f", x, y, i, j, feed_);
  }
  void End() { Add("M5"); }
  std::string Take() { return text_ + "M2\n"; }

 private:
  template <class... Numbers>
  void Add(const char* format, Numbers... numbers) {
    char line[160];
    if constexpr (sizeof...(numbers) == 0) {
      std::snprintf(line, sizeof line, "%s", format);
    } else {
      std::snprintf(line, sizeof line, format, numbers...);
    }
    text_ += line;
    text_ += '\n';
  }
  double feed_;
  std::string text_;
};

void AddHole(double x, double y, double radius, double kerf, ProgramText& program,
             inspection::Drawing& drawing) {
  const double r = radius - 0.5 * kerf;
  const double overlap = 3.0 / r;
  program.Pierce(x + 0.4 * r, y);
  program.LineTo(x + r, y);
  program.ArcTo(x - r, y, -r, 0.0);
  program.ArcTo(x + r, y, r, 0.0);
  program.ArcTo(x + r * std::cos(overlap), y + r * std::sin(overlap), -r, 0.0);
  program.End();
  drawing.features.push_back({"hole " + std::to_string(drawing.features.size() + 1),
                              FeatureKind::kHole,
                              Side::kInside,
                              0.15,
                              {Arc{{x, y}, radius, 0.0, kTurn}}});
}

void AddPlate(double kerf, ProgramText& program, inspection::Drawing& drawing) {
  const double o = 0.5 * kerf;
  program.Pierce(300.0, 110.0);
  program.LineTo(300.0, 120.0 - o);
  program.LineTo(450.0 + o, 120.0 - o);
  program.LineTo(450.0 + o, 305.0);
  program.ArcTo(435.0, 320.0 + o, -15.0 - o, 0.0);
  program.LineTo(155.0, 320.0 + o);
  program.ArcTo(150.0 - o, 315.0, 0.0, -5.0 - o);
  program.LineTo(150.0 - o, 120.0 - o);
  program.LineTo(303.0, 120.0 - o);
  program.LineTo(303.0, 112.0);
  program.End();
  constexpr double kQuarter = 0.25 * kTurn;
  drawing.features.push_back(
      {"plate",
       FeatureKind::kContour,
       Side::kOutside,
       0.15,
       {Line{{150, 120}, {450, 120}}, Line{{450, 120}, {450, 305}}, Arc{{435, 305}, 15, 0.0, kQuarter},
        Line{{435, 320}, {155, 320}}, Arc{{155, 315}, 5, kQuarter, kQuarter}, Line{{150, 315}, {150, 120}}}});
}

inspection::CutPath PathOf(const CellRun& run) {
  inspection::Truth truth;
  truth.lag_time_s = run.jet_lag_time_s;
  for (const auto& s : run.drive_truth) {
    truth.sheet.push_back({s.time_ns, s.X_DW.x_mm, s.X_DW.y_mm, s.X_DW.theta_rad});
  }
  for (const auto& s : run.jet_truth) {
    truth.jet.push_back({s.time_ns, s.p_DJ_mm.x(), s.p_DJ_mm.y()});
  }
  for (const auto& s : run.switches) {
    truth.switches.push_back({s.time_ns, s.on});
  }
  return inspection::JoinTruth(std::move(truth));
}

double EventP99(const CellRun& run) {
  std::vector<double> deviations;
  for (const ProcessRecord& record : run.process_records) {
    deviations.push_back(std::abs(record.deviation_mm));
  }
  std::ranges::sort(deviations);
  return deviations.empty() ? 0.0 : deviations[std::min(deviations.size() - 1, deviations.size() * 99 / 100)];
}

std::vector<calibration::Measurement> LooksOf(const CellRun& run) {
  const auto pair = [](const std::array<double, kActuatorCount>& v) { return Eigen::Vector2d(v[0], v[1]); };
  std::vector<calibration::Measurement> looks;
  for (const lambdajet::Measurement& m : run.measurements) {
    looks.push_back({calibration::KindOf(m.gate, m.mark),
                     m.seen,
                     m.mark,
                     m.exposure_ns,
                     {m.x_C_mm, m.y_C_mm},
                     pair(m.actuator_position_mm),
                     pair(m.actuator_velocity_mm_per_s),
                     pair(m.actuator_acceleration_mm_per_s2),
                     pair(m.jet_pierce_actuator_position_mm)});
  }
  return looks;
}

std::string FirstFault(const PlannedProgram& planned) {
  const auto& fault = planned.faults.front();
  return "line " + std::to_string(fault.line) + ": " + std::string(fault.reason) + ": " + fault.message;
}

void FillWorst(const inspection::Inspection& found, const inspection::Drawing& drawing, CutResult& result) {
  double largest = -1.0;
  for (const inspection::Deviation& d : found.deviations) {
    if (d.cut && std::abs(d.deviation_mm) > largest) {
      largest = std::abs(d.deviation_mm);
      result.worst_feature = drawing.features[d.feature].name;
      result.worst_x_W_mm = d.p_W_mm.x();
      result.worst_y_W_mm = d.p_W_mm.y();
    }
  }
}

std::string LastWords(const std::vector<ModeChange>& changes) {
  return changes.empty()
             ? "nothing"
             : std::string(Name(changes.back().to)) + " " + std::string(Name(changes.back().reason));
}

std::string WhyNotComplete(const CellRun& run) {
  return " was not completed: drive " + LastWords(run.drive_changes) + ", main motion " +
         LastWords(run.main_motion_changes);
}

class Trial {
 public:
  Trial(const MachineDescription& as_designed, const simulated_plant::PlantTruth& truth,
        const TrialPart& part, std::uint64_t seed)
      : part_(part), machine_(as_designed), cell_(as_designed, truth, OptionsOf(seed)) {
    trial_.seed = seed;
  }

  PlantTrial Run() {
    if (Cut(TrialStage::kSetUp, false) && Identify() && Cut(TrialStage::kIdentified, false)) {
      Cut(TrialStage::kCompensated, true);
    }
    return std::move(trial_);
  }

  PlantTrial RunToTolerances(double identified_mm, double compensated_mm) {
    if (Identify() && Cut(TrialStage::kIdentified, false, identified_mm)) {
      Cut(TrialStage::kCompensated, true, compensated_mm);
    }
    return std::move(trial_);
  }

 private:
  static CellOptions OptionsOf(std::uint64_t seed) {
    CellOptions options;
    options.seed = seed;
    return options;
  }

  bool Refuse(const std::string& why) {
    trial_.trouble = why;
    return false;
  }

  bool Cut(TrialStage stage, bool compensate, double tolerance_mm = 0.0) {
    trajectory::PlanOptions options;
    options.compensate = compensate;
    if (tolerance_mm > 0.0) {
      options.hold.push_back({tolerance_mm});
    }
    const trajectory::TolerancePlan answer = PlanToTolerance(part_.program, machine_, options);
    const PlannedProgram& planned = answer.planned;
    if (!planned.faults.empty()) {
      return Refuse(FirstFault(planned));
    }
    CutResult& result = trial_.cuts[static_cast<std::size_t>(stage)];
    const auto prediction = accuracy::Predict(machine_, planned.samples, compensate);
    result.predicted_95_mm = prediction.predicted_95_mm;
    result.predicted_95_linear_mm = prediction.predicted_95_linear_mm;
    result.expected_95_mm = prediction.expected_95_mm;
    for (const trajectory::HeldTolerance& held : answer.report.held) {
      result.promised_95_mm = std::max(result.promised_95_mm, held.predicted_95_mm);
    }
    result.planned_s = planned.plan.duration_s;
    result.fastest_s = answer.report.fastest_s;
    result.largest_source =
        prediction.budget.empty() ? "" : std::string(accuracy::SourceName(prediction.budget[0].source));
    const CellRun run = cell_.Run(planned.plan);
    if (!run.complete) {
      return Refuse("the cut" + WhyNotComplete(run));
    }
    const inspection::CutPath path = PathOf(run);
    const inspection::Inspection found = inspection::CompareWithDrawing(path, part_.drawing);
    result.cut = true;
    result.p50_mm = found.all.p50_mm;
    result.p95_mm = found.all.p95_mm;
    result.max_mm = found.all.max_mm;
    result.not_cut = found.all.not_cut;
    result.missing = path.missing;
    FillWorst(found, part_.drawing, result);
    result.holds =
        static_cast<int>(std::ranges::count(run.drive_changes, ModuleMode::kHolding, &ModeChange::to));
    result.cutting_time_s = path.cutting_time_s;
    result.event_p99_mm = EventP99(run);
    return true;
  }

  bool Identify() {
    const auto run_plan = calibration::PlanMeasuringRun(machine_);
    if (run_plan.reason != calibration::PlanReason::kPlanned) {
      return Refuse(run_plan.explanation);
    }
    const PlannedProgram planned = trajectory::PlanPartProgram(run_plan.program, machine_, {});
    if (!planned.faults.empty()) {
      return Refuse("measuring run: " + FirstFault(planned));
    }
    const CellRun run = cell_.Run(planned.plan);
    if (!run.complete) {
      return Refuse("the measuring run" + WhyNotComplete(run));
    }
    trial_.measuring_time_s = run.duration_s;
    const auto found = calibration::Identify(machine_, LooksOf(run));
    if (found.reason != calibration::IdentificationReason::kIdentified) {
      return Refuse(found.explanation);
    }
    trial_.identified_place_mm = found.worst_place_mm;
    machine_.parameters = found.parameters;
    machine_.covariance = found.covariance;
    ++machine_.version;
    cell_.AdoptMachine(machine_);
    return true;
  }

  const TrialPart& part_;
  MachineDescription machine_;
  VirtualCell cell_;
  PlantTrial trial_;
};

}  // namespace

TrialPart PlateWithHoles(double kerf_width_mm, double feed_mm_per_s) {
  TrialPart part;
  part.drawing.name = "plate with holes";
  part.drawing.kerf_width_mm = kerf_width_mm;
  ProgramText program(feed_mm_per_s);
  AddHole(220.0, 220.0, 30.0, kerf_width_mm, program, part.drawing);
  AddHole(330.0, 180.0, 8.0, kerf_width_mm, program, part.drawing);
  AddHole(390.0, 260.0, 20.0, kerf_width_mm, program, part.drawing);
  AddPlate(kerf_width_mm, program, part.drawing);
  part.program = program.Take();
  return part;
}

absl::StatusOr<TrialPart> ReadTrialPart(const std::string& stem) {
  constexpr std::size_t kMostBytes = 4u << 20;
  const auto program = ReadWholeFile(stem + ".ngc", kMostBytes);
  const auto yaml = ReadWholeFile(stem + ".drawing.yaml", kMostBytes);
  if (!program.ok() || !yaml.ok()) {
    return program.ok() ? yaml.status() : program.status();
  }
  const auto drawing = inspection::ReadDrawing(*yaml);
  if (!drawing.ok()) {
    return drawing.status();
  }
  return TrialPart{*program, *drawing};
}

PlantTrial RunTrial(const MachineDescription& as_designed, const simulated_plant::PlantTruth& truth,
                    const TrialPart& part, std::uint64_t seed) {
  return Trial(as_designed, truth, part, seed).Run();
}

PlantTrial RunToleranceTrial(const MachineDescription& as_designed, const TrialPart& part, std::uint64_t seed,
                             double identified_mm, double compensated_mm) {
  return Trial(as_designed, simulated_plant::RandomPlant(as_designed, seed), part, seed)
      .RunToTolerances(identified_mm, compensated_mm);
}

PlantTrial RunTrial(const MachineDescription& as_designed, const TrialPart& part, std::uint64_t seed) {
  return RunTrial(as_designed, simulated_plant::RandomPlant(as_designed, seed), part, seed);
}

}  // namespace lambdajet::tests
