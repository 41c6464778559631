#include "clients/cli/pilger_die_file.hpp"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <numbers>
#include <set>

#include "clients/cli/text_file.hpp"
#include "foundation/contract/trouble.hpp"

namespace lambdajet::cli {
namespace {

using trajectory::HalfAxisLaw;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

// Collects the first trouble; what is read after it is not used.
class DieReader {
 public:
  explicit DieReader(std::string path) : path_(std::move(path)) {}

  absl::StatusOr<PilgerDieFile> Read(const YAML::Node& root) {
    PilgerDieFile file;
    Keys(root, {"name", "die", "wheel", "passes", "program"});
    file.name = Word(root, "name");
    ReadDie(Map(root, "die"), file.die.groove);
    const YAML::Node wheel = Map(root, "wheel");
    Keys(wheel, {"radius_mm", "profile_radius_mm"});
    file.die.wheel = {Number(wheel, "radius_mm"), Number(wheel, "profile_radius_mm")};
    const YAML::Node passes = Map(root, "passes");
    Keys(passes, {"alpha_from_deg", "alpha_to_deg", "scallop_mm"});
    file.die.alpha_from_rad = Number(passes, "alpha_from_deg") * kRadPerDeg;
    file.die.alpha_to_rad = Number(passes, "alpha_to_deg") * kRadPerDeg;
    file.die.scallop_mm = Number(passes, "scallop_mm");
    ReadProgram(Map(root, "program"), file.die);
    return trouble_.ok() ? absl::StatusOr<PilgerDieFile>(std::move(file)) : trouble_;
  }

 private:
  void ReadDie(const YAML::Node& node, trajectory::Groove& groove) {
    Keys(node, {"radius_mm", "zone_deg", "half_width_mm", "half_depth_mm"});
    groove.die_radius_mm = Number(node, "radius_mm");
    groove.zone_rad = Number(node, "zone_deg") * kRadPerDeg;
    groove.width = Law(Map(node, "half_width_mm"), groove.zone_rad);
    groove.depth = Law(Map(node, "half_depth_mm"), groove.zone_rad);
  }

  void ReadProgram(const YAML::Node& node, trajectory::PilgerDie& die) {
    Keys(node, {"step_deg", "turn_s", "approach_mm", "idle"});
    die.step_rad = Number(node, "step_deg") * kRadPerDeg;
    die.turn_s = Number(node, "turn_s");
    die.approach_mm = Number(node, "approach_mm");
    const std::string idle = Word(node, "idle");
    if (trouble_.ok() && idle != "smooth" && idle != "paper") {
      Refuse(node["idle"], "YAML_VALUE", "idle is smooth or paper");
    }
    die.idle = idle == "paper" ? trajectory::IdleWish::kPaper : trajectory::IdleWish::kSmooth;
  }

  // One of: table_deg_mm, rows of angle and length; polynomial_mm, coefficients of u = angle / zone; power.
  HalfAxisLaw Law(const YAML::Node& node, double zone_rad) {
    Keys(node, {"table_deg_mm", "polynomial_mm", "power"});
    if (!trouble_.ok()) {
      return {};
    }
    if (node.size() != 1) {
      Refuse(node, "YAML_VALUE", "a half-axis is one of table_deg_mm, polynomial_mm and power");
      return {};
    }
    if (node["table_deg_mm"]) {
      return Table(node["table_deg_mm"]);
    }
    if (node["power"]) {
      const YAML::Node power = Map(node, "power");
      Keys(power, {"from_mm", "to_mm", "exponent"});
      const double exponent = Number(power, "exponent");
      if (trouble_.ok() && exponent != 1.0 && !(exponent >= 3.0 && exponent <= 20.0)) {
        Refuse(power["exponent"], "YAML_VALUE",
               "an exponent is 1, or 3 to 20: between, the wheel's acceleration breaks");
      }
      return HalfAxisLaw::MakePower(zone_rad, Number(power, "from_mm"), Number(power, "to_mm"), exponent);
    }
    std::vector<double> coefficients;
    for (const YAML::Node& c : node["polynomial_mm"]) {
      coefficients.push_back(Value(c));
    }
    return HalfAxisLaw::MakePolynomial(zone_rad, std::move(coefficients));
  }

  HalfAxisLaw Table(const YAML::Node& rows) {
    std::vector<double> angle_rad, half_axis_mm;
    for (const YAML::Node& row : rows) {
      if (!row.IsSequence() || row.size() != 2) {
        Refuse(row, "YAML_VALUE", "a row is [angle in degrees, half-axis in mm]");
        return {};
      }
      angle_rad.push_back(Value(row[0]) * kRadPerDeg);
      half_axis_mm.push_back(Value(row[1]));
    }
    const auto law = HalfAxisLaw::MakeTable(angle_rad, half_axis_mm);
    if (!law) {
      Refuse(rows, "YAML_VALUE", "a table has 2 to 500 rows with rising angles");
    }
    return law.value_or(HalfAxisLaw{});
  }

  void Refuse(const YAML::Node& node, const char* reason, const std::string& message) {
    if (trouble_.ok()) {
      const int line = node.IsDefined() ? node.Mark().line + 1 : 0;
      trouble_ = Trouble(absl::StatusCode::kInvalidArgument, reason,
                         path_ + ":" + std::to_string(line) + ": " + message);
    }
  }

  void Keys(const YAML::Node& node, const std::set<std::string>& known) {
    if (!trouble_.ok()) {
      return;
    }
    for (const auto& entry : node) {
      if (!entry.first.IsScalar() || known.count(entry.first.Scalar()) == 0) {
        Refuse(entry.first, "YAML_KEY_UNKNOWN",
               "key '" + (entry.first.IsScalar() ? entry.first.Scalar() : "?") + "' is not known");
      }
    }
  }

  YAML::Node Map(const YAML::Node& node, const char* key) {
    if (!trouble_.ok()) {
      return YAML::Node(YAML::NodeType::Map);
    }
    const YAML::Node child = node[key];
    if (!child.IsDefined() || !child.IsMap()) {
      Refuse(child.IsDefined() ? child : node, "YAML_KEY_MISSING",
             std::string(key) + " is missing or has no keys");
      return YAML::Node(YAML::NodeType::Map);
    }
    return child;
  }

  std::string Word(const YAML::Node& node, const char* key) {
    if (!trouble_.ok() || !node[key].IsDefined() || !node[key].IsScalar()) {
      Refuse(node, "YAML_KEY_MISSING", std::string(key) + " is missing");
      return {};
    }
    return node[key].Scalar();
  }

  double Number(const YAML::Node& node, const char* key) {
    if (!trouble_.ok() || !node[key].IsDefined()) {
      Refuse(node, "YAML_KEY_MISSING", std::string(key) + " is missing");
      return 0.0;
    }
    return Value(node[key]);
  }

  double Value(const YAML::Node& node) {
    double value = 0.0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
      Refuse(node, "YAML_VALUE", "this must be a number");
      return 0.0;
    }
    return value;
  }

  std::string path_;
  absl::Status trouble_;
};

}  // namespace

absl::StatusOr<PilgerDieFile> ReadPilgerDie(const std::string& path) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) {
    return text.status();
  }
  try {
    const YAML::Node root = YAML::Load(*text);
    if (!root.IsMap()) {
      return Trouble(absl::StatusCode::kInvalidArgument, "YAML_VALUE",
                     path + ": a die's file has keys name, die, wheel, passes, program");
    }
    return DieReader(path).Read(root);
  } catch (const YAML::Exception& error) {
    return Trouble(absl::StatusCode::kInvalidArgument, "YAML_SYNTAX", path + ": " + error.what());
  }
}

}  // namespace lambdajet::cli
