#include "clients/cli/kinematics_hexapod.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "clients/cli/answer_table.hpp"
#include "clients/cli/csv.hpp"
#include "foundation/contract/trouble.hpp"
#include "kinematics/core/hexapod_singularity.hpp"
#include "kinematics/core/hexapod_workspace.hpp"
#include "kinematics/core/service_area.hpp"
#include "kinematics/core/service_rectangle.hpp"
#include "platform/machine_file/hexapod_file.hpp"

namespace lambdajet::cli {
namespace {

using namespace lambdajet::kinematics;

constexpr std::array<const char*, 6> kPoseColumns = {"x_mm",    "y_mm",      "z_mm",
                                                     "psi_rad", "theta_rad", "gamma_rad"};

std::string StrutColumn(int strut, const char* what) { return fmt::format("strut_{}_{}", strut + 1, what); }

std::vector<std::string> StrutColumns() {
  std::vector<std::string> columns;
  for (int j = 0; j < kStruts; ++j) {
    columns.push_back(StrutColumn(j, "mm"));
  }
  return columns;
}

absl::StatusOr<Hexapod> ReadHexapod(const std::string& path) {
  auto machine = ReadHexapodFile(path);
  if (!machine.ok()) {
    return machine.status();
  }
  return Hexapod(machine->geometry);
}

// Six columns of numbers, row by row.
absl::StatusOr<std::vector<std::array<double, 6>>> SixNumbers(const CsvTable& table,
                                                              const std::vector<std::string>& columns) {
  std::vector<std::array<double, 6>> rows(table.rows().size());
  for (std::size_t c = 0; c < 6; ++c) {
    const auto numbers = table.Numbers(columns[c]);
    if (!numbers.ok()) {
      return numbers.status();
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i][c] = (*numbers)[i];
    }
  }
  return rows;
}

Pose ToolPose(const std::array<double, 6>& row) {
  return Pose::FromKrylov({row[0], row[1], row[2]}, {row[3], row[4], row[5]});
}

void AppendReason(std::vector<std::string>& cells, const HexapodInverse& answer) {
  cells.emplace_back(ReasonName(answer.reason));
  cells.emplace_back(answer.bound == HexapodBound::kNone ? "" : BoundName(answer.bound));
  cells.emplace_back(answer.strut < 0 ? "" : std::to_string(answer.strut + 1));
  Append(cells, answer.excess);
}

// Reads machine and poses, lets `fill` write one row a pose; `fill` returns whether it was solved.
template <class Fill>
absl::Status ForEachPose(const PoseTables& files, const std::vector<std::string>& in_columns,
                         std::vector<std::string> out_columns, Output& output, const Fill& fill) {
  const auto hexapod = ReadHexapod(files.machine);
  if (!hexapod.ok()) {
    return hexapod.status();
  }
  const auto table = ReadCsv(files.in);
  if (!table.ok()) {
    return table.status();
  }
  const auto rows = SixNumbers(*table, in_columns);
  if (!rows.ok()) {
    return rows.status();
  }
  CsvTable answers(std::move(out_columns));
  std::size_t refused = 0;
  LongWork solving(output, "solving rows");
  for (const std::array<double, 6>& row : *rows) {
    solving.At(static_cast<double>(answers.rows().size()) / static_cast<double>(rows->size()));
    std::vector<std::string> cells;
    refused += fill(*hexapod, row, cells) ? 0 : 1;
    answers.AddRow(std::move(cells));
  }
  solving.Done();
  return DeliverTable(answers, files.out, Counted(rows->size(), refused), output);
}

std::vector<std::string> PoseColumns() { return {kPoseColumns.begin(), kPoseColumns.end()}; }

absl::Status CheckWorkspace(const HexapodWorkspaceRequest& request) {
  const std::string_view fault = FaultOf(request);
  return fault.empty() ? absl::OkStatus()
                       : Trouble(absl::StatusCode::kInvalidArgument, "BAD_WORKSPACE", fault);
}

struct ServiceAreaOptions {
  std::vector<std::string> set;
  std::string sweep;
  double from = 0.0, to = 0.0;
  int points = 21;
  std::string out = "-";
};

const ServiceNumber* KeyNamed(const std::string& name) {
  for (const ServiceNumber& key : kServiceNumbers) {
    if (name == key.name) {
      return &key;
    }
  }
  return nullptr;
}

absl::Status BadServiceArea(const std::string& message) {
  return Trouble(absl::StatusCode::kInvalidArgument, "BAD_SERVICE_AREA", message);
}

std::vector<std::string> ServiceColumns(const std::string& swept) {
  return {swept.empty() ? "tilt_rad" : swept,
          "closed_form_mm2",
          "s1_mm2",
          "s2_mm2",
          "s3_mm2",
          "s4_mm2",
          "in_order",
          "paper_region_mm2",
          "intersection_mm2",
          "union_mm2",
          "single_tilt_mm2",
          "rectangle_x_min_mm",
          "rectangle_y_min_mm",
          "rectangle_x_max_mm",
          "rectangle_y_max_mm",
          "left_bound",
          "right_bound",
          "base_bound",
          "table_bound"};
}

void AddServiceRow(const ServiceAreaMachine& machine, double value, CsvTable& table) {
  const PaperServiceArea paper = PaperClosedForm(machine);
  std::vector<std::string> cells;
  Append(cells, value);
  for (const double number : {paper.area_mm2, paper.s1_mm2, paper.s2_mm2, paper.s3_mm2, paper.s4_mm2}) {
    cells.push_back(paper.defined ? Shortest(number) : "");
  }
  cells.emplace_back(paper.in_order ? "1" : "0");
  for (const ServiceRegion region : {ServiceRegion::kPaper, ServiceRegion::kIntersection,
                                     ServiceRegion::kUnion, ServiceRegion::kSingleTilt}) {
    Append(cells, ExactArea(machine, region));
  }
  const ServiceRectangle found = LargestServiceRectangle(machine);
  const Rectangle& r = found.rectangle;
  for (const double number : {r.x_min_mm, r.y_min_mm, r.x_max_mm, r.y_max_mm}) {
    Append(cells, number);
  }
  for (const ServiceBound& bound : found.binding) {
    cells.emplace_back(ServiceLimitName(bound.limit));
  }
  table.AddRow(std::move(cells));
}

absl::Status TabulateServiceArea(const ServiceAreaOptions& options, Output& output) {
  const auto machine = ServiceMachineOf(options.set);
  if (!machine.ok()) {
    return machine.status();
  }
  CsvTable table(ServiceColumns(options.sweep));
  const ServiceNumber* swept = options.sweep.empty() ? nullptr : KeyNamed(options.sweep);
  if (!options.sweep.empty() && (swept == nullptr || options.points < 2 || options.points > 1000)) {
    return BadServiceArea("sweep '" + options.sweep +
                          "': a parameter's name with 2 to 1000 points would be right");
  }
  const int points = swept == nullptr ? 1 : options.points;
  for (int i = 0; i < points; ++i) {
    ServiceAreaMachine at = *machine;
    double value = at.tilt_rad;
    if (swept != nullptr) {
      value = options.from + (options.to - options.from) * i / (points - 1);
      at.*swept->member = value;
    }
    if (const std::string_view fault = FaultOf(at); !fault.empty()) {
      return BadServiceArea(std::string(fault));
    }
    AddServiceRow(at, value, table);
  }
  return DeliverTable(table, options.out, fmt::format("{} {}", points, points == 1 ? "row" : "rows"), output);
}

}  // namespace

absl::StatusOr<ServiceAreaMachine> ServiceMachineOf(const std::vector<std::string>& settings) {
  ServiceAreaMachine machine;
  machine.tilt_rad = 15.0 * M_PI / 180.0;  // the paper's, as the defaults of the others
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    const ServiceNumber* key = equals == std::string::npos ? nullptr : KeyNamed(setting.substr(0, equals));
    char* end = nullptr;
    const std::string text = equals == std::string::npos ? "" : setting.substr(equals + 1);
    const double value = std::strtod(text.c_str(), &end);
    if (key == nullptr || text.empty() || *end != '\0') {
      return BadServiceArea("'" + setting + "': name=number would be right, as strut_max_mm=1350");
    }
    machine.*key->member = value;
  }
  if (const std::string_view fault = FaultOf(machine); !fault.empty()) {
    return BadServiceArea(std::string(fault));
  }
  return machine;
}

absl::Status SolveHexapodInverse(const PoseTables& files, Output& output) {
  std::vector<std::string> columns = StrutColumns();
  columns.insert(columns.end(), {"reason", "bound", "strut", "excess"});
  return ForEachPose(
      files, PoseColumns(), columns, output,
      [](const Hexapod& hexapod, const std::array<double, 6>& row, std::vector<std::string>& cells) {
        const HexapodInverse answer =
            SolveInverseWithMargin(hexapod, PlatformFromTool(hexapod, ToolPose(row)));
        for (int j = 0; j < kStruts; ++j) {
          Append(cells, answer.actuators_mm[j]);
        }
        AppendReason(cells, answer);
        return answer.reason == Reason::kSolved;
      });
}

absl::Status SolveHexapodForward(const PoseTables& files, Output& output) {
  std::vector<std::string> columns = PoseColumns();
  columns.insert(columns.end(), {"iterations", "residual_mm", "reason"});
  return ForEachPose(
      files, StrutColumns(), columns, output,
      [](const Hexapod& hexapod, const std::array<double, 6>& row, std::vector<std::string>& cells) {
        const HexapodForward answer =
            SolveForwardFromHome(hexapod, Eigen::Map<const StrutVector>(row.data()));
        const bool solved = answer.reason == Reason::kSolved;
        const PlatformPose tool = PlatformPose::Of(ToolFromPlatform(hexapod, answer.X_MP));
        for (const double number :
             {tool.x_mm, tool.y_mm, tool.z_mm, tool.psi_rad, tool.theta_rad, tool.gamma_rad}) {
          cells.push_back(solved ? Shortest(number) : "");
        }
        cells.push_back(std::to_string(answer.iterations));
        Append(cells, answer.residual_mm);
        cells.emplace_back(ReasonName(answer.reason));
        return solved;
      });
}

absl::Status TabulateHexapodJacobian(const PoseTables& files, Output& output) {
  constexpr std::array<const char*, 6> kBy = {"per_x_mm_per_mm",       "per_y_mm_per_mm",
                                              "per_z_mm_per_mm",       "per_turn_x_mm_per_rad",
                                              "per_turn_y_mm_per_rad", "per_turn_z_mm_per_rad"};
  std::vector<std::string> columns;
  for (int j = 0; j < kStruts; ++j) {
    for (const char* by : kBy) {
      columns.push_back(StrutColumn(j, by));
    }
  }
  for (int j = 0; j < kStruts; ++j) {
    for (int p = 0; p < kStrutParameters; ++p) {
      const std::string name(StrutParameterName(static_cast<StrutParameter>(p)));
      columns.push_back(
          StrutColumn(j, ("per_" + name + (name.ends_with("_mm") ? "_mm_per_mm" : "_mm_per_rad")).c_str()));
    }
  }
  columns.push_back("reason");
  return ForEachPose(
      files, PoseColumns(), columns, output,
      [](const Hexapod& hexapod, const std::array<double, 6>& row, std::vector<std::string>& cells) {
        const Pose X_MP = PlatformFromTool(hexapod, ToolPose(row));
        const HexapodInverse answer = SolveInverse(hexapod, X_MP);
        const PoseJacobian J = ActuatorJacobian(hexapod, X_MP);
        const ParameterJacobian P = ActuatorParameterJacobian(hexapod, X_MP);
        const bool finite = J.allFinite() && P.allFinite();
        for (int j = 0; j < kStruts; ++j) {
          for (int c = 0; c < 6; ++c) {
            cells.push_back(finite ? Shortest(J(j, c)) : "");
          }
        }
        for (int j = 0; j < kStruts; ++j) {
          for (int p = 0; p < kStrutParameters; ++p) {
            cells.push_back(finite ? Shortest(P(j, p)) : "");
          }
        }
        cells.emplace_back(ReasonName(answer.reason));
        return answer.reason == Reason::kSolved;
      });
}

absl::Status TabulateHexapodSingularity(const PoseTables& files, Output& output) {
  return ForEachPose(
      files, PoseColumns(),
      {"signed_margin", "smallest_singular_value", "largest_singular_value", "determinant",
       "determinant_krylov_mm3", "characteristic_length_mm", "reason"},
      output, [](const Hexapod& hexapod, const std::array<double, 6>& row, std::vector<std::string>& cells) {
        const Pose X_MP = PlatformFromTool(hexapod, ToolPose(row));
        const HexapodSingularity s = AnalyseSingularity(hexapod, X_MP);
        for (const double number : {s.signed_margin, s.smallest_singular_value, s.largest_singular_value,
                                    s.determinant, s.determinant_krylov_mm3, s.characteristic_length_mm}) {
          Append(cells, number);
        }
        const Reason reason = SolveInverseWithMargin(hexapod, X_MP).reason;
        cells.emplace_back(ReasonName(reason));
        return reason == Reason::kSolved;
      });
}

absl::Status CutHexapodWorkspace(const HexapodWorkspaceOptions& options, Output& output) {
  const auto hexapod = ReadHexapod(options.machine);
  if (!hexapod.ok()) {
    return hexapod.status();
  }
  auto request = WorkspaceRequestFor(*hexapod, options.step_mm, options.tilt_rad);
  if (const absl::Status status = CheckWorkspace(request); !status.ok()) {
    return status;
  }
  std::vector<double> heights = options.z_mm;
  for (int i = 0; heights.size() < 9 && options.z_mm.empty(); ++i) {
    heights.push_back(request.box.z_min_mm + (i + 0.5) / 9.0 * (request.box.z_max_mm - request.box.z_min_mm));
  }
  CsvTable table(
      {"z_mm", "y_mm", "from_x_mm", "to_x_mm", "from_bound", "from_strut", "to_bound", "to_strut"});
  TextTable areas{{"z_mm", "area_mm2"}, {}};
  LongWork cutting(output, "cutting slices");
  const double rows = std::ceil((request.box.y_max_mm - request.box.y_min_mm) / request.step_mm) + 1.0;
  double row = 0.0;
  request.cancelled = [&] {
    cutting.At(row++ / (rows * static_cast<double>(heights.size())));
    return false;
  };
  for (const double z : heights) {
    const HexapodSlice slice = CutSlice(*hexapod, request, z);
    areas.rows.push_back({Shortest(z), Fixed(slice.area_mm2, 0)});
    for (const HexapodSpan& span : slice.spans) {
      const auto strut = [](const HexapodBorder& b) {
        return b.strut < 0 ? std::string() : std::to_string(b.strut + 1);
      };
      table.AddRow({Shortest(z), Shortest(span.y_mm), Shortest(span.from_x_mm), Shortest(span.to_x_mm),
                    std::string(BoundName(span.from.bound)), strut(span.from),
                    std::string(BoundName(span.to.bound)), strut(span.to)});
    }
  }
  cutting.Done();
  if (options.out != "-" && !output.json()) {
    output.Table(areas);
  }
  return DeliverTable(table, options.out, fmt::format("{} slices", heights.size()), output);
}

HexapodWorkspaceRequest WorkspaceRequestFor(const Hexapod& hexapod, double step_mm,
                                            const std::vector<double>& tilt_rad) {
  // No strut reaches farther than its base joint allows, so this box holds everything.
  const HexapodLimits& limits = hexapod.geometry().limits;
  const double longest =
      std::isfinite(limits.strut_max_mm) ? limits.strut_max_mm : 1.5 * hexapod.home_lengths_mm().maxCoeff();
  const Eigen::Vector3d home = ToolFromPlatform(hexapod, hexapod.geometry().X_MP_home).p_mm;
  HexapodWorkspaceRequest request;
  request.box = {home.x() - 0.7 * longest, home.x() + 0.7 * longest, home.y() - 0.7 * longest,
                 home.y() + 0.7 * longest, home.z() - 0.6 * longest, home.z() + 0.6 * longest};
  request.step_mm = step_mm;
  if (!tilt_rad.empty()) {
    request.R_MT.clear();
    const Eigen::Matrix3d R_home = ToolFromPlatform(hexapod, hexapod.geometry().X_MP_home).R;
    for (const double tilt : tilt_rad) {
      request.R_MT.push_back(RotationX(tilt) * R_home);
      if (tilt != 0.0) {
        request.R_MT.push_back(RotationX(-tilt) * R_home);
      }
    }
  }
  return request;
}

void AddServiceAreaVerb(CLI::App& noun, Output& output) {
  auto options = std::make_shared<ServiceAreaOptions>();
  CLI::App* verb = noun.add_subcommand("service-area",
                                       "area for two-sided tilted drilling (seed paper 002), one or a sweep");
  verb->add_option("--set", options->set,
                   "name=number, as tilt_rad=0.26; what is left out keeps the paper's base set");
  verb->add_option("--sweep", options->sweep, "parameter to sweep");
  verb->add_option("--from", options->from, "its first value");
  verb->add_option("--to", options->to, "its last value");
  verb->add_option("--points", options->points, "how many, 2 to 1000");
  verb->add_option("--out", options->out, "CSV; - is standard output");
  verb->callback([options, &output] { output.Finish(TabulateServiceArea(*options, output)); });
}

}  // namespace lambdajet::cli
