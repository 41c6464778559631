// The judge on files, without any service: compare.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "clients/cli/csv.hpp"
#include "clients/cli/text_file.hpp"
#include "clients/cli/verbs.hpp"
#include "inspection/core/comparison.hpp"
#include "inspection/drawing_file/drawing_file.hpp"

namespace lambdajet::cli {
namespace {

using inspection::CutPath;
using inspection::Drawing;
using inspection::FeatureResult;
using inspection::Inspection;

struct CompareFiles {
  std::string truth;
  std::string path;
  std::string drawing;
  std::string deviations;
  double lag_time_s = 0.0;
};

// The columns as rows of numbers.
absl::StatusOr<std::vector<std::vector<double>>> ReadNumbers(const std::string& file,
                                                             const std::vector<std::string>& columns) {
  const auto table = ReadCsv(file);
  if (!table.ok()) {
    return table.status();
  }
  std::vector<std::vector<double>> rows(table->rows().size(), std::vector<double>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const auto numbers = table->Numbers(columns[c]);
    if (!numbers.ok()) {
      return numbers.status();
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i][c] = (*numbers)[i];
    }
  }
  return rows;
}

// X_DW and p_DJ over time; the water switches between two rows at the later one's stamp.
absl::StatusOr<CutPath> JoinFile(const std::string& file, double lag_time_s) {
  const auto rows =
      ReadNumbers(file, {"time_s", "x_DW_mm", "y_DW_mm", "theta_DW_rad", "x_DJ_mm", "y_DJ_mm", "jet_on"});
  if (!rows.ok()) {
    return rows.status();
  }
  inspection::Truth truth;
  truth.lag_time_s = lag_time_s;
  bool on = false;
  for (const std::vector<double>& row : *rows) {
    const auto time_ns = static_cast<std::int64_t>(std::llround(1e9 * row[0]));
    truth.sheet.push_back({time_ns, row[1], row[2], row[3]});
    truth.jet.push_back({time_ns, row[4], row[5]});
    if ((row[6] != 0.0) != on) {
      on = !on;
      truth.switches.push_back({time_ns, on});
    }
  }
  return inspection::JoinTruth(std::move(truth));
}

// The path of the cut front as `lambdajet inspection path` writes it.
absl::StatusOr<CutPath> ReadPath(const std::string& file) {
  const auto rows = ReadNumbers(file, {"time_s", "x_W_mm", "y_W_mm", "jet_on"});
  if (!rows.ok()) {
    return rows.status();
  }
  CutPath path;
  bool on = false;
  for (const std::vector<double>& row : *rows) {
    if (!on) {
      path.cuts.emplace_back();
    }
    path.cuts.back().push_back({row[0], {row[1], row[2]}});
    path.cutting_time_s += on ? row[0] - path.cuts.back()[path.cuts.back().size() - 2].time_s : 0.0;
    on = row[3] != 0.0;
  }
  return path;
}

nlohmann::json JsonOf(const FeatureResult& r) {
  return {{"name", r.name},       {"p50_mm", r.p50_mm},
          {"p95_mm", r.p95_mm},   {"max_mm", r.max_mm},
          {"mean_mm", r.mean_mm}, {"rms_mm", r.rms_mm},
          {"passed", r.passed},   {"tolerance_mm", r.tolerance_mm},
          {"not_cut", r.not_cut}, {"conforming", r.conforming},
          {"points", r.points}};
}

std::vector<std::string> Row(const FeatureResult& r) {
  return {r.name,
          Fixed(r.p50_mm, 4),
          Fixed(r.p95_mm, 4),
          Fixed(r.max_mm, 4),
          Fixed(r.mean_mm, 4),
          Fixed(r.rms_mm, 4),
          Fixed(r.tolerance_mm, 3),
          Fixed(100.0 * r.conforming, 1),
          std::to_string(r.not_cut),
          r.passed ? "yes" : "no"};
}

void Print(const Inspection& found, const CutPath& path, Output& output) {
  if (output.json()) {
    nlohmann::json features = nlohmann::json::array();
    for (const FeatureResult& feature : found.features) {
      features.push_back(JsonOf(feature));
    }
    output.Json({{"all", JsonOf(found.all)},
                 {"features", features},
                 {"missing", path.missing},
                 {"cutting_time_s", path.cutting_time_s}});
    return;
  }
  TextTable table{{"feature", "p50_mm", "p95_mm", "max_mm", "mean_mm", "rms_mm", "tolerance_mm",
                   "conforming_%", "not cut", "passed"},
                  {Row(found.all)}};
  for (const FeatureResult& feature : found.features) {
    table.rows.push_back(Row(feature));
  }
  output.Table(table);
  if (path.missing > 0) {
    output.Text(fmt::format("{} samples of truth are missing: the result is worth less", path.missing),
                Tone::kWarning);
  }
}

absl::Status CompareFromFiles(const CompareFiles& files, Output& output) {
  const auto yaml = ReadTextFile(files.drawing);
  if (!yaml.ok()) {
    return yaml.status();
  }
  const auto drawing = inspection::ReadDrawing(*yaml);
  if (!drawing.ok()) {
    return drawing.status();
  }
  const auto path = files.path.empty() ? JoinFile(files.truth, files.lag_time_s) : ReadPath(files.path);
  if (!path.ok()) {
    return path.status();
  }
  const Inspection found = inspection::CompareWithDrawing(*path, *drawing);
  Print(found, *path, output);
  if (files.deviations.empty()) {
    return absl::OkStatus();
  }
  CsvTable table({"x_W_mm", "y_W_mm", "deviation_mm", "feature"});
  for (const inspection::Deviation& d : found.deviations) {
    if (d.cut) {
      table.AddRow(
          std::vector<double>{d.p_W_mm.x(), d.p_W_mm.y(), d.deviation_mm, static_cast<double>(d.feature)});
    }
  }
  return WriteCsv(files.deviations, table);
}

}  // namespace

void AddInspectionVerbs(CLI::App& noun, Output& output) {
  auto files = std::make_shared<CompareFiles>();
  CLI::App* compare =
      noun.add_subcommand("compare", "a cut from a file against a drawing, feature by feature");
  auto* truth = compare->add_option(
      "--truth", files->truth,
      "CSV: time_s, x_DW_mm, y_DW_mm, theta_DW_rad, x_DJ_mm, y_DJ_mm, jet_on; - is standard input");
  auto* path = compare->add_option("--path", files->path,
                                   "CSV: time_s, x_W_mm, y_W_mm, jet_on, as `inspection path` writes it");
  truth->excludes(path);
  compare->add_option("--drawing", files->drawing, "YAML, see services/inspection/README.md")->required();
  compare->add_option("--lag-s", files->lag_time_s, "with --truth: how far the cut front trails the jet")
      ->check(CLI::Range(0.0, 1.0));
  compare->add_option("--deviations", files->deviations, "CSV of every point's deviation");
  compare->callback([files, &output] {
    if (files->truth.empty() && files->path.empty()) {
      output.Fail(ExitCode::kUsage, "NO_CUT_GIVEN", "one of --truth and --path is needed");
      return;
    }
    output.Finish(CompareFromFiles(*files, output));
  });
}

}  // namespace lambdajet::cli
