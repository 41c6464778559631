#include "clients/cli/kinematics_planar.hpp"

#include <fmt/format.h>

#include <array>
#include <memory>
#include <nlohmann/json.hpp>

#include "clients/cli/answer_table.hpp"
#include "clients/cli/csv.hpp"
#include "foundation/contract/trouble.hpp"
#include "kinematics/core/swept_collision.hpp"
#include "kinematics/core/workspace.hpp"
#include "kinematics/optimisation/geometry_optimisation.hpp"
#include "platform/machine_file/machine_file.hpp"

namespace lambdajet::cli {
namespace {

using namespace lambdajet::kinematics;
using Eigen::Vector2d;

absl::Status Wrong(const char* reason, const std::string& message) {
  return Trouble(absl::StatusCode::kInvalidArgument, reason, message);
}

void AppendBoth(std::vector<std::string>& cells, const Vector2d& v) {
  Append(cells, v.x());
  Append(cells, v.y());
}

// Two columns of every row; missing columns are zero if they may be missing.
absl::StatusOr<std::vector<Vector2d>> Pairs(const CsvTable& table, const char* first, const char* second,
                                            bool required) {
  std::vector<Vector2d> rows(table.rows().size(), Vector2d::Zero());
  if (!required && !table.Has(first) && !table.Has(second)) {
    return rows;
  }
  const auto a = table.Numbers(first);
  const auto b = table.Numbers(second);
  if (!a.ok() || !b.ok()) {
    return a.ok() ? b.status() : a.status();
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i] = {(*a)[i], (*b)[i]};
  }
  return rows;
}

struct MotionColumns {
  const char *position_1, *position_2, *velocity_1, *velocity_2, *acceleration_1, *acceleration_2;
};
constexpr MotionColumns kTool = {"x_D_mm",        "y_D_mm",         "vx_D_mm_per_s",
                                 "vy_D_mm_per_s", "ax_D_mm_per_s2", "ay_D_mm_per_s2"};
constexpr MotionColumns kActuators = {"actuator_1_mm",
                                      "actuator_2_mm",
                                      "actuator_1_velocity_mm_per_s",
                                      "actuator_2_velocity_mm_per_s",
                                      "actuator_1_acceleration_mm_per_s2",
                                      "actuator_2_acceleration_mm_per_s2"};

struct MotionTable {
  std::vector<Motion> rows;
  bool moves = false;  // velocities were given
};

absl::StatusOr<MotionTable> ReadMotions(const std::string& path, const MotionColumns& columns) {
  const auto table = ReadCsv(path);
  if (!table.ok()) {
    return table.status();
  }
  const auto positions = Pairs(*table, columns.position_1, columns.position_2, true);
  const auto velocities = Pairs(*table, columns.velocity_1, columns.velocity_2, false);
  const auto accelerations = Pairs(*table, columns.acceleration_1, columns.acceleration_2, false);
  for (const auto* part : {&positions, &velocities, &accelerations}) {
    if (!part->ok()) {
      return part->status();
    }
  }
  MotionTable motions;
  motions.moves = table->Has(columns.velocity_1) || table->Has(columns.acceleration_1);
  for (std::size_t i = 0; i < positions->size(); ++i) {
    motions.rows.push_back({(*positions)[i], (*velocities)[i], (*accelerations)[i]});
  }
  return motions;
}

std::vector<std::string> ColumnsOf(const MotionColumns& c, bool moves) {
  std::vector<std::string> columns = {c.position_1, c.position_2};
  if (moves) {
    columns.insert(columns.end(), {c.velocity_1, c.velocity_2, c.acceleration_1, c.acceleration_2});
  }
  return columns;
}

void AppendMotion(std::vector<std::string>& cells, const Motion& motion, bool moves) {
  AppendBoth(cells, motion.position_mm);
  if (moves) {
    AppendBoth(cells, motion.velocity_mm_per_s);
    AppendBoth(cells, motion.acceleration_mm_per_s2);
  }
}

template <class Answer>
void AppendVerdict(std::vector<std::string>& cells, const Answer& answer) {
  cells.push_back(std::to_string(answer.working_mode.s1));
  cells.push_back(std::to_string(answer.working_mode.s2));
  cells.push_back(std::to_string(answer.assembly_mode));
  for (const double number : {answer.reach_margin_mm, answer.serial_distance_mm, answer.parallel_distance_mm,
                              answer.travel_margin_mm, answer.excess_mm}) {
    Append(cells, number);
  }
  cells.emplace_back(ReasonName(answer.reason));
}

const std::vector<std::string> kVerdictColumns = {"s1",
                                                  "s2",
                                                  "assembly_mode",
                                                  "reach_margin_mm",
                                                  "serial_distance_mm",
                                                  "parallel_distance_mm",
                                                  "travel_margin_mm",
                                                  "excess_mm",
                                                  "reason"};

// Position, rates and verdict of every row, from one kind of motion to the other.
template <class SolvePosition, class SolveMotion>
absl::Status SolveTable(const PlanarTables& files, const MotionColumns& from, const MotionColumns& to,
                        Output& output, SolvePosition solve_position, SolveMotion solve_motion) {
  const auto mechanism = ReadMechanism(files.machine, files.mode);
  if (!mechanism.ok()) {
    return mechanism.status();
  }
  const auto motions = ReadMotions(files.in, from);
  if (!motions.ok()) {
    return motions.status();
  }
  std::vector<std::string> columns = ColumnsOf(from, motions->moves);
  for (const auto& more : {ColumnsOf(to, motions->moves), kVerdictColumns}) {
    columns.insert(columns.end(), more.begin(), more.end());
  }
  CsvTable answers(columns);
  std::size_t refused = 0;
  LongWork solving(output, "solving rows");
  for (const Motion& motion : motions->rows) {
    solving.At(static_cast<double>(answers.rows().size()) / static_cast<double>(motions->rows.size()));
    const auto verdict = solve_position(*mechanism, motion.position_mm);
    std::vector<std::string> cells;
    AppendMotion(cells, motion, motions->moves);
    AppendMotion(cells, solve_motion(*mechanism, motion).motion, motions->moves);
    AppendVerdict(cells, verdict);
    refused += verdict.reason != Reason::kSolved;
    answers.AddRow(std::move(cells));
  }
  solving.Done();
  return DeliverTable(answers, files.out, Counted(motions->rows.size(), refused), output);
}

// One row a pose from a function that appends its cells and says whether it was solved.
template <class Fill>
absl::Status ForEachPose(const PlanarTables& files, std::vector<std::string> columns, Output& output,
                         Fill fill) {
  const auto mechanism = ReadMechanism(files.machine, files.mode);
  if (!mechanism.ok()) {
    return mechanism.status();
  }
  const auto motions = ReadMotions(files.in, kTool);
  if (!motions.ok()) {
    return motions.status();
  }
  CsvTable answers(std::move(columns));
  std::size_t refused = 0;
  LongWork solving(output, "solving rows");
  for (const Motion& motion : motions->rows) {
    solving.At(static_cast<double>(answers.rows().size()) / static_cast<double>(motions->rows.size()));
    std::vector<std::string> cells;
    AppendBoth(cells, motion.position_mm);
    refused += fill(*mechanism, motion.position_mm, cells) ? 0 : 1;
    answers.AddRow(std::move(cells));
  }
  solving.Done();
  return DeliverTable(answers, files.out, Counted(motions->rows.size(), refused), output);
}

template <class Derived>
void AppendMatrix(std::vector<std::string>& cells, const Eigen::DenseBase<Derived>& matrix) {
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      Append(cells, matrix(i, j));
    }
  }
}

std::vector<std::string> JacobianColumns() {
  std::vector<std::string> columns = {"x_D_mm",  "y_D_mm",  "q1_by_x", "q1_by_y", "q2_by_x",
                                      "q2_by_y", "x_by_q1", "x_by_q2", "y_by_q1", "y_by_q2"};
  for (const char* what : {"q1", "q2", "x", "y"}) {
    for (int i = 0; i < kMechanismParameterCount; ++i) {
      columns.push_back(fmt::format("{}_by_{}", what, ParameterName(static_cast<Parameter>(i))));
    }
  }
  columns.insert(columns.end(), {"determinant", "condition", "smallest_singular_value", "reason"});
  return columns;
}

std::string_view TypeName(SingularityType type) {
  switch (type) {
    case SingularityType::kRegular:
      return "REGULAR";
    case SingularityType::kSerial:
      return "SERIAL";
    case SingularityType::kParallel:
      return "PARALLEL";
    case SingularityType::kSerialAndParallel:
      return "SERIAL_AND_PARALLEL";
  }
  return "";
}

struct OptimiseOptions {
  std::string machine;
  std::string out;
  std::vector<double> zone_mm;
  std::string objective = "gain";
  double lowest_ratio = 0.5, highest_ratio = 2.0;
  int evaluations = 2000;
};

absl::StatusOr<Rectangle> ZoneOf(const std::vector<double>& zone_mm) {
  if (zone_mm.size() != 4 || !(zone_mm[2] > zone_mm[0]) || !(zone_mm[3] > zone_mm[1])) {
    return Wrong("BAD_ZONE", "--zone-mm takes x_min y_min x_max y_max, the maxima above the minima");
  }
  return Rectangle{zone_mm[0], zone_mm[1], zone_mm[2], zone_mm[3]};
}

absl::Status Optimise(const OptimiseOptions& options, Output& output) {
  auto machine = ReadMachineFile(options.machine);
  const auto zone = ZoneOf(options.zone_mm);
  if (!machine.ok() || !zone.ok()) {
    return machine.ok() ? zone.status() : machine.status();
  }
  OptimisationTask task;
  task.start = LambdaMechanism::FromDescription(*machine);
  task.zone = *zone;
  task.objective = options.objective == "gain" ? Objective::kErrorGain : Objective::kRectangle;
  task.lowest_ratio = options.lowest_ratio;
  task.highest_ratio = options.highest_ratio;
  task.evaluations = options.evaluations;
  LongWork search(output, "trying geometries");
  int tried = 0;
  task.cancelled = [&] {
    search.At(static_cast<double>(tried++) / options.evaluations);
    return false;
  };
  const OptimisationAnswer answer = OptimiseGeometry(task);
  search.Done();  // the search may end before it has used all evaluations
  nlohmann::json json = {
      {"reason", ReasonName(answer.reason)},
      {"objective", options.objective == "gain" ? "error_gain_mm_per_mm" : "rectangle_mm2"},
      {"before", answer.before},
      {"after", answer.after},
      {"evaluations", answer.evaluations}};
  TextTable table{{"parameter", "before", "after"}, {}};
  for (int i = 0; i < kMechanismParameterCount; ++i) {
    const std::string name(ParameterName(static_cast<Parameter>(i)));
    const double before = machine->parameters[i];
    const double after = answer.found.parameters[i];
    table.rows.push_back({name, Fixed(before, 4), Fixed(after, 4)});
    json["parameters"][name] = after;
    machine->parameters[i] = after;
  }
  output.Table(table);
  output.Text(fmt::format("{}: {} before, {} after, {} evaluations",
                          options.objective == "gain" ? "worst error gain, mm/mm" : "largest rectangle, mm2",
                          Fixed(answer.before, 4), Fixed(answer.after, 4), answer.evaluations));
  output.Json(json);
  if (answer.reason != Reason::kSolved) {
    output.Fail(
        ExitCode::kRefused, ReasonName(answer.reason),
        "no geometry between the bounds serves the whole zone; make the zone smaller or the bounds wider");
    return absl::OkStatus();
  }
  machine->hash = MachineHash(*machine);
  return options.out.empty() ? absl::OkStatus() : WriteMachineFile(options.out, *machine);
}

struct SweepOptions {
  std::string machine;
  std::string in = "-";
  std::vector<double> bodies_mm;  // four numbers a body
  double margin_mm = 0.0;
};

absl::Status Sweep(const SweepOptions& options, Output& output) {
  const auto machine = ReadMachineFile(options.machine);
  const auto path = ReadMotions(options.in, kTool);
  if (!machine.ok() || !path.ok()) {
    return machine.ok() ? path.status() : machine.status();
  }
  std::vector<std::array<Vector2d, 4>> corners;
  for (std::size_t i = 0; i + 3 < options.bodies_mm.size(); i += 4) {
    const double* b = options.bodies_mm.data() + i;
    corners.push_back(BodyCorners(b[0], b[1], b[2], b[3]));
    if (!IsConvex(corners.back())) {
      return Wrong("BAD_BODY", "--body takes x_min y_min x_max y_max in mm, the maxima above the minima");
    }
  }
  std::vector<Corners> bodies(corners.begin(), corners.end());
  std::vector<Vector2d> points;
  for (const Motion& motion : path->rows) {
    points.push_back(motion.position_mm);
  }
  const auto sheet = SheetCorners(machine->X_EW(), machine->sheet_width_mm, machine->sheet_height_mm);
  const SweptAnswer answer = SweepSheet(sheet, points, bodies, options.margin_mm);
  output.Json({{"collides", answer.collides},
               {"row", answer.stretch + 1},
               {"fraction", answer.fraction},
               {"body", answer.body + 1},
               {"x_D_mm", answer.p_DE_mm.x()},
               {"y_D_mm", answer.p_DE_mm.y()},
               {"clearance_mm", answer.clearance_mm}});
  if (answer.collides) {
    output.Text(fmt::format("the sheet meets body {} after row {}, tool at x_D {} y_D {} mm", answer.body + 1,
                            answer.stretch + 1, Fixed(answer.p_DE_mm.x(), 3), Fixed(answer.p_DE_mm.y(), 3)),
                Tone::kBad);
    output.Exit(ExitCode::kRefused);
  } else {
    output.Text(fmt::format("the sheet passes; nearest to body {} after row {}, {} mm", answer.body + 1,
                            answer.stretch + 1, Fixed(answer.clearance_mm, 3)),
                Tone::kGood);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<LambdaMechanism> ReadMechanism(const std::string& path, const std::string& mode) {
  const auto machine = ReadMachineFile(path);
  if (!machine.ok()) {
    return machine.status();
  }
  const LambdaMechanism mechanism = LambdaMechanism::FromDescription(*machine);
  if (mode.empty()) {
    return mechanism;
  }
  const auto sign = [](char c) { return c == '+' ? 1 : c == '-' ? -1 : 0; };
  if (mode.size() != 2 || sign(mode[0]) == 0 || sign(mode[1]) == 0) {
    return Wrong("BAD_MODE", "--mode takes ++, +-, -+ or --");
  }
  return mechanism.WithModes({sign(mode[0]), sign(mode[1])}, mechanism.assembly_mode);
}

absl::Status SolvePlanarInverse(const PlanarTables& files, Output& output) {
  return SolveTable(
      files, kTool, kActuators, output,
      [](const LambdaMechanism& m, const Vector2d& p) { return SolveInverse(m, p); },
      [](const LambdaMechanism& m, const Motion& tool) { return SolveInverseMotion(m, tool); });
}

absl::Status SolvePlanarForward(const PlanarTables& files, Output& output) {
  return SolveTable(
      files, kActuators, kTool, output,
      [](const LambdaMechanism& m, const Vector2d& q) { return SolveForward(m, q); },
      [](const LambdaMechanism& m, const Motion& actuators) { return SolveForwardMotion(m, actuators); });
}

absl::Status TabulatePlanarJacobian(const PlanarTables& files, Output& output) {
  return ForEachPose(files, JacobianColumns(), output,
                     [](const LambdaMechanism& m, const Vector2d& p, std::vector<std::string>& cells) {
                       const LambdaJacobians j = ComputeJacobians(m, p);
                       AppendMatrix(cells, j.J_q_x);
                       AppendMatrix(cells, j.J_x_q);
                       AppendMatrix(cells, j.J_q_parameters);
                       AppendMatrix(cells, j.J_x_parameters);
                       Append(cells, j.determinant);
                       Append(cells, j.condition);
                       Append(cells, j.smallest_singular_value);
                       cells.emplace_back(ReasonName(j.reason));
                       return j.reason == Reason::kSolved;
                     });
}

absl::Status TabulatePlanarSingularity(const PlanarTables& files, Output& output) {
  return ForEachPose(
      files,
      {"x_D_mm", "y_D_mm", "type", "main_link_distance_mm", "second_link_distance_mm", "parallel_distance_mm",
       "determinant", "serial_determinant_mm2", "parallel_determinant_mm2", "condition",
       "smallest_singular_value", "reason"},
      output, [](const LambdaMechanism& m, const Vector2d& p, std::vector<std::string>& cells) {
        const SingularityReport r = ReportSingularity(m, p);
        cells.emplace_back(TypeName(r.type));
        for (const double number :
             {r.main_link_distance_mm, r.second_link_distance_mm, r.parallel_distance_mm, r.determinant,
              r.serial_determinant_mm2, r.parallel_determinant_mm2, r.condition, r.smallest_singular_value}) {
          Append(cells, number);
        }
        cells.emplace_back(ReasonName(r.reason));
        return r.reason == Reason::kSolved;
      });
}

absl::Status TracePlanarWorkspace(const PlanarWorkspaceOptions& options, Output& output) {
  const auto mechanism = ReadMechanism(options.machine, options.mode);
  if (!mechanism.ok()) {
    return mechanism.status();
  }
  WorkspaceOptions how;
  how.tolerance_mm = options.tolerance_mm;
  const Workspace workspace = ComputeWorkspace(*mechanism, how);
  if (workspace.reason != Reason::kSolved) {
    output.Fail(ExitCode::kRefused, ReasonName(workspace.reason), "the mechanism has no usable pose");
    return absl::OkStatus();
  }
  CsvTable vertices({"outline", "x_D_mm", "y_D_mm"});
  for (std::size_t k = 0; k < workspace.outlines.size(); ++k) {
    for (const Vector2d& p : workspace.outlines[k]) {
      vertices.AddRow({std::to_string(k + 1), Shortest(p.x()), Shortest(p.y())});
    }
  }
  const Rectangle& r = workspace.rectangle;
  constexpr std::array<const char*, 4> kSides = {"left", "right", "bottom", "top"};
  std::string said = fmt::format("area {} mm2; largest rectangle x_D {} to {}, y_D {} to {} mm",
                                 Fixed(workspace.area_mm2, 1), Fixed(r.x_min_mm, 2), Fixed(r.x_max_mm, 2),
                                 Fixed(r.y_min_mm, 2), Fixed(r.y_max_mm, 2));
  for (std::size_t i = 0; i < kSides.size(); ++i) {
    said += fmt::format("\n  {}: {}", kSides[i], PoseLimitSentence(workspace.binding[i]));
  }
  return DeliverTable(vertices, options.out, said, output);
}

void AddOptimiseVerb(CLI::App& noun, Output& output) {
  auto options = std::make_shared<OptimiseOptions>();
  CLI::App* verb = noun.add_subcommand("optimise", "link lengths and rail offset for a wanted zone");
  verb->add_option("--machine", options->machine, "machine file to start from")->required();
  verb->add_option("--zone-mm", options->zone_mm, "x_min y_min x_max y_max in D")->required()->expected(4);
  verb->add_option("--objective", options->objective,
                   "gain: least worst error gain; rectangle: largest usable rectangle")
      ->check(CLI::IsMember({"gain", "rectangle"}));
  verb->add_option("--lowest-ratio", options->lowest_ratio, "shortest length, as a share of the start's")
      ->check(CLI::Range(0.01, 1.0));
  verb->add_option("--highest-ratio", options->highest_ratio, "longest length, as a share of the start's")
      ->check(CLI::Range(1.0, 100.0));
  verb->add_option("--evaluations", options->evaluations, "at most")->check(CLI::Range(10, 20'000));
  verb->add_option("--out", options->out, "machine file with the geometry found");
  verb->callback([options, &output] { output.Finish(Optimise(*options, output)); });
}

void AddSweepVerb(CLI::App& noun, Output& output) {
  auto options = std::make_shared<SweepOptions>();
  CLI::App* verb = noun.add_subcommand("sweep", "whether the sheet meets a fixed body on its way");
  verb->add_option("--machine", options->machine, "machine file")->required();
  verb->add_option("--in", options->in, "CSV with x_D_mm, y_D_mm: the tool's path; - is standard input");
  verb->add_option("--body-mm", options->bodies_mm, "x_min y_min x_max y_max in D; may be given again")
      ->required()
      ->expected(4)
      ->take_all();
  verb->add_option("--margin-mm", options->margin_mm, "distance that counts as contact")
      ->check(CLI::NonNegativeNumber);
  verb->callback([options, &output] { output.Finish(Sweep(*options, output)); });
}

}  // namespace lambdajet::cli
