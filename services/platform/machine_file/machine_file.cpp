#include "platform/machine_file/machine_file.hpp"

#include <openssl/sha.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <map>
#include <set>

#include "foundation/contract/expects.hpp"
#include "foundation/contract/trouble.hpp"
#include "platform/machine_file/yaml_map_reader.hpp"
#include "platform/process/atomic_file.hpp"

namespace lambdajet {
namespace {

using yaml_file::Findings;
using yaml_file::IdText;
using yaml_file::IsId;
using yaml_file::MapReader;
using yaml_file::ParseNumber;
using yaml_file::ShortestText;
using yaml_file::UnitOf;

constexpr std::size_t kMostFileBytes = 4 << 20;
constexpr std::size_t kMostMarks = 10'000;
constexpr double kSigmaAgreement = 1e-6;  // relative, where a sigma and a covariance are both given

std::string KeyOf(std::size_t index) { return std::string(ParameterName(static_cast<Parameter>(index))); }

void ReadParameters(MapReader& file, Findings& findings, MachineDescription& machine) {
  MapReader parameters(file.Child("parameters"), "parameters.", findings);
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const std::string key = KeyOf(i);
    if (!parameters.Has(key)) {
      parameters.Child(key);
      continue;
    }
    MapReader parameter(parameters.Child(key), "parameters." + key + ".", findings);
    machine.parameters[at] = parameter.Number("value", key);
    const double sigma = parameter.Number("sigma", key);
    if (sigma < 0.0) {
      findings.Add("parameters." + key + ".sigma", parameter.LineOfKey("sigma"),
                   "is " + ShortestText(sigma) + "; right is 0 or above", "WRONG_VALUE");
    }
    machine.covariance(at, at) = sigma * sigma;
  }
}

void ReadCovariance(MapReader& file, Findings& findings, MachineDescription& machine) {
  if (!file.Has("covariance")) {
    return;
  }
  const YAML::Node rows = file.Child("covariance");
  const int line = file.LineOfKey("covariance");
  bool good = rows.IsSequence() && rows.size() == kParameterCount;
  ParameterCovariance covariance = ParameterCovariance::Zero();
  for (std::size_t i = 0; good && i < kParameterCount; ++i) {
    good = rows[i].IsSequence() && rows[i].size() == kParameterCount;
    for (std::size_t j = 0; good && j < kParameterCount; ++j) {
      good = rows[i][j].IsScalar() &&
             ParseNumber(rows[i][j].Scalar(),
                         covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
    }
  }
  if (!good) {
    findings.Add("covariance", line, "is not " + std::to_string(kParameterCount) + " rows of as many numbers",
                 "WRONG_VALUE");
    return;
  }
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double variance = machine.covariance(at, at);
    if (std::abs(covariance(at, at) - variance) > 2.0 * kSigmaAgreement * std::abs(variance)) {
      findings.Add("covariance", line, "and the sigma of " + KeyOf(i) + " disagree", "CONTRADICTION");
    }
  }
  machine.covariance = covariance;
}

void ReadMechanism(MapReader& file, Findings& findings, MachineDescription& machine) {
  MapReader mechanism(file.Child("mechanism"), "mechanism.", findings);
  MapReader mode(mechanism.Child("working_mode"), "mechanism.working_mode.", findings);
  machine.working_mode.s1 = mode.Integer("s1", -1, 1);
  machine.working_mode.s2 = mode.Integer("s2", -1, 1);
  machine.assembly_mode = mechanism.Integer("assembly_mode", -1, 1);
}

void ReadActuators(MapReader& file, Findings& findings, MachineDescription& machine) {
  const YAML::Node list = file.Child("actuators");
  if (!list.IsDefined() || !list.IsSequence() || list.size() != machine.actuators.size()) {
    findings.Add("actuators", file.LineOfKey("actuators"), "is not a list of two actuators", "WRONG_TYPE");
    return;
  }
  for (std::size_t i = 0; i < machine.actuators.size(); ++i) {
    MapReader reader(list[i], "actuators." + std::to_string(i + 1) + ".", findings);
    ActuatorLimits& limits = machine.actuators[i];
    limits.position_min_mm = reader.Number("position_min_mm");
    limits.position_max_mm = reader.Number("position_max_mm");
    limits.velocity_mm_per_s = reader.Number("velocity_mm_per_s");
    limits.acceleration_mm_per_s2 = reader.Number("acceleration_mm_per_s2");
    limits.jerk_mm_per_s3 = reader.Number("jerk_mm_per_s3");
  }
}

// The plain groups: keys and the numbers they stand for, in the order in which they are written.
template <typename Machine, typename Visit>
void VisitGroup(Machine& machine, const std::string& group, Visit&& visit) {
  if (group == "path") {
    visit("feed_mm_per_s", machine.path.feed_mm_per_s);
    visit("rapid_mm_per_s", machine.path.rapid_mm_per_s);
    visit("acceleration_mm_per_s2", machine.path.acceleration_mm_per_s2);
    visit("jerk_mm_per_s3", machine.path.jerk_mm_per_s3);
    visit("corner_tolerance_mm", machine.path.corner_tolerance_mm);
  } else if (group == "process") {
    visit("kerf_width_mm", machine.process.kerf_width_mm);
    visit("jet_lag_time_s", machine.process.jet_lag_time_s);
    visit("pierce_time_s", machine.process.pierce_time_s);
    visit("jet_on_delay_s", machine.process.jet_on_delay_s);
    visit("jet_off_delay_s", machine.process.jet_off_delay_s);
    visit("abrasive_on_delay_s", machine.process.abrasive_on_delay_s);
    visit("abrasive_off_delay_s", machine.process.abrasive_off_delay_s);
    visit("abrasive_flow_g_per_min", machine.process.abrasive_flow_g_per_min);
    visit("abrasive_flow_max_g_per_min", machine.process.abrasive_flow_max_g_per_min);
    visit("measuring_settle_time_s", machine.process.measuring_settle_time_s);
  } else if (group == "uncertainties") {
    visit("straightness_mm", machine.uncertainties.straightness_mm);
    visit("backlash_mm", machine.uncertainties.backlash_mm);
    visit("following_mm", machine.uncertainties.following_mm);
    visit("camera_mm", machine.uncertainties.camera_mm);
    visit("mark_mm", machine.uncertainties.mark_mm);
    visit("jet_wander_mm", machine.uncertainties.jet_wander_mm);
    visit("jet_lag_relative", machine.uncertainties.jet_lag_relative);
  } else if (group == "elasticity") {
    visit("moving_mass_kg", machine.moving_mass_kg);
  }
}

constexpr const char* kPlainGroups[] = {"path", "process", "uncertainties", "elasticity"};

void ReadSheet(MapReader& file, Findings& findings, MachineDescription& machine) {
  MapReader sheet(file.Child("sheet"), "sheet.", findings);
  machine.sheet_width_mm = sheet.Number("width_mm");
  machine.sheet_height_mm = sheet.Number("height_mm");
  findings.Stands("sheet_width_mm", sheet.LineOfKey("width_mm"));
  findings.Stands("sheet_height_mm", sheet.LineOfKey("height_mm"));
  const YAML::Node list = sheet.Child("marks");
  if (!list.IsDefined() || !list.IsSequence() || list.size() > kMostMarks) {
    findings.Add("sheet.marks", sheet.LineOfKey("marks"), "is not a list of at most 10000 marks",
                 "WRONG_TYPE");
    return;
  }
  std::set<int> ids;
  for (std::size_t i = 0; i < list.size(); ++i) {
    MapReader reader(list[i], "sheet.marks." + std::to_string(i + 1) + ".", findings);
    const SheetMark mark{reader.Integer("id", 1, 1'000'000), reader.Number("x_W_mm"),
                         reader.Number("y_W_mm")};
    if (!ids.insert(mark.id).second) {
      findings.Add(reader.prefix() + "id", reader.LineOfKey("id"),
                   "is " + std::to_string(mark.id) + ", which another mark has already", "DUPLICATE");
    }
    if (mark.x_W_mm < 0.0 || mark.x_W_mm > machine.sheet_width_mm || mark.y_W_mm < 0.0 ||
        mark.y_W_mm > machine.sheet_height_mm) {
      findings.Add(reader.prefix() + "x_W_mm", reader.LineOfKey("x_W_mm"), "and y_W_mm are not on the sheet",
                   "WRONG_VALUE");
    }
    machine.marks.push_back(mark);
  }
}

MachineDescription ReadAll(const YAML::Node& root, Findings& findings) {
  MachineDescription machine;
  MapReader file(root, "", findings);
  machine.machine_id = file.Text("machine_id");
  if (file.Has("machine_id") && !IsId(machine.machine_id)) {
    findings.Add("machine_id", file.LineOfKey("machine_id"), "is not 1 to 63 of a-z, 0-9 and '-'",
                 "WRONG_VALUE");
  }
  machine.version = static_cast<std::uint32_t>(file.Integer("version", 0, 1'000'000'000));
  ReadMechanism(file, findings, machine);
  ReadParameters(file, findings, machine);
  ReadCovariance(file, findings, machine);
  ReadActuators(file, findings, machine);
  for (const std::string group : kPlainGroups) {
    MapReader reader(file.Child(group), group + ".", findings);
    VisitGroup(machine, group, [&](const char* key, double& number) { number = reader.Number(key); });
  }
  ReadSheet(file, findings, machine);
  machine.singular_margin_mm = file.Number("singular_margin_mm");
  machine.control_period_s = file.Number("control_period_s");
  return machine;
}

std::string GroupText(const MachineDescription& machine, const std::string& group) {
  std::string text = group + ":\n";
  VisitGroup(machine, group, [&](const char* key, double number) {
    text += std::string("  ") + key + ": " + ShortestText(number) + "\n";
  });
  return text;
}

std::string ParametersText(const MachineDescription& machine) {
  std::string text = "parameters:\n";
  bool diagonal = true;
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double sigma = std::sqrt(machine.covariance(at, at));
    diagonal = diagonal && sigma * sigma == machine.covariance(at, at);
    text += "  " + KeyOf(i) + ": {value: " + ShortestText(machine.parameters[at]) +
            ", sigma: " + ShortestText(sigma) + "}\n";
  }
  ParameterCovariance beside = machine.covariance;
  beside.diagonal().setZero();
  if (diagonal && beside.isZero(0.0)) {
    return text;
  }
  text += "covariance:\n";
  for (Eigen::Index i = 0; i < machine.covariance.rows(); ++i) {
    text += "  - [";
    for (Eigen::Index j = 0; j < machine.covariance.cols(); ++j) {
      text += (j > 0 ? ", " : "") + ShortestText(machine.covariance(i, j));
    }
    text += "]\n";
  }
  return text;
}

std::string ActuatorsText(const MachineDescription& machine) {
  std::string text = "actuators:\n";
  for (const ActuatorLimits& limits : machine.actuators) {
    text += "  - position_min_mm: " + ShortestText(limits.position_min_mm) +
            "\n    position_max_mm: " + ShortestText(limits.position_max_mm) +
            "\n    velocity_mm_per_s: " + ShortestText(limits.velocity_mm_per_s) +
            "\n    acceleration_mm_per_s2: " + ShortestText(limits.acceleration_mm_per_s2) +
            "\n    jerk_mm_per_s3: " + ShortestText(limits.jerk_mm_per_s3) + "\n";
  }
  return text;
}

// All that decides what a calculation gives.
std::string ContentText(const MachineDescription& machine) {
  std::string text = "mechanism:\n  working_mode: {s1: " + std::to_string(machine.working_mode.s1) +
                     ", s2: " + std::to_string(machine.working_mode.s2) +
                     "}\n  assembly_mode: " + std::to_string(machine.assembly_mode) + "\n";
  text += ParametersText(machine) + ActuatorsText(machine);
  for (const char* group : kPlainGroups) {
    text += GroupText(machine, group);
  }
  text += "sheet:\n  width_mm: " + ShortestText(machine.sheet_width_mm) +
          "\n  height_mm: " + ShortestText(machine.sheet_height_mm) +
          "\n  marks:" + (machine.marks.empty() ? " []\n" : "\n");
  for (const SheetMark& mark : machine.marks) {
    text += "    - {id: " + std::to_string(mark.id) + ", x_W_mm: " + ShortestText(mark.x_W_mm) +
            ", y_W_mm: " + ShortestText(mark.y_W_mm) + "}\n";
  }
  return text + "singular_margin_mm: " + ShortestText(machine.singular_margin_mm) +
         "\ncontrol_period_s: " + ShortestText(machine.control_period_s) + "\n";
}

}  // namespace

absl::StatusOr<MachineDescription> ParseMachine(const std::string& yaml, const std::string& name) {
  Findings findings(name);
  MachineDescription machine;
  try {
    machine = ReadAll(YAML::Load(yaml), findings);
  } catch (const YAML::Exception& error) {
    findings.Add("the file", error.mark.line + 1, "is not YAML: " + error.msg, "NOT_YAML");
  }
  if (!findings.any()) {
    for (const DescriptionFault& fault : Validate(machine)) {
      const std::string unit = UnitOf(fault.key);
      findings.Add(
          fault.key, findings.LineOf(fault.key),
          "is " + ShortestText(fault.value) + (unit.empty() ? "" : " " + unit) + "; right is " + fault.should,
          "WRONG_VALUE");
    }
  }
  if (absl::Status status = findings.status("BAD_MACHINE_FILE"); !status.ok()) {
    return status;
  }
  machine.hash = MachineHash(machine);
  return machine;
}

absl::StatusOr<MachineDescription> ReadMachineFile(const std::string& path) {
  const auto text = ReadWholeFile(path, kMostFileBytes);
  return text.ok() ? ParseMachine(*text, path) : text.status();
}

std::string MachineText(const MachineDescription& machine) {
  return "machine_id: " + IdText(machine.machine_id) + "\nversion: " + std::to_string(machine.version) +
         "\n" + ContentText(machine);
}

absl::Status WriteMachineFile(const std::string& path, const MachineDescription& machine) {
  return WriteFileAtomically(path, MachineText(machine));
}

std::string MachineHash(const MachineDescription& machine) { return ContentHash(ContentText(machine)); }

std::string ContentHash(const std::string& text) {
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest);
  std::string hash;
  for (int i = 0; i < 6; ++i) {
    static constexpr char kHex[] = "0123456789abcdef";
    hash += kHex[digest[i] >> 4];
    hash += kHex[digest[i] & 15];
  }
  return hash;
}

absl::StatusOr<MachineDescription> DescribedMachine(const DescribedParts& parts) {
  auto machine = ParseMachine(parts.as_designed_yaml, "calibration/machine_description");
  if (!machine.ok()) {
    return machine.status();
  }
  Expects(parts.parameters.size() == kParameterCount &&
              parts.covariance.size() == kParameterCount * kParameterCount,
          "DescribedMachine: the whole parameter vector and its covariance");
  constexpr auto kCount = static_cast<Eigen::Index>(kParameterCount);
  using Rows = Eigen::Matrix<double, kCount, kCount, Eigen::RowMajor>;
  machine->parameters = Eigen::Map<const Eigen::Matrix<double, kCount, 1>>(parts.parameters.data());
  machine->covariance = Eigen::Map<const Rows>(parts.covariance.data());
  machine->version = parts.version;
  if (const auto faults = Validate(*machine); !faults.empty()) {
    return Trouble(absl::StatusCode::kInvalidArgument, "BAD_MACHINE_DESCRIPTION",
                   faults.front().key + " is " + std::to_string(faults.front().value) + "; should be " +
                       faults.front().should);
  }
  machine->hash = MachineHash(*machine);
  if (machine->hash != parts.hash) {
    return Trouble(absl::StatusCode::kInvalidArgument, "DESCRIPTION_HASH_MISMATCH",
                   "the description says hash " + parts.hash + " but is " + machine->hash);
  }
  return machine;
}

}  // namespace lambdajet
