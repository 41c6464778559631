#include "platform/machine_file/hexapod_file.hpp"

#include <array>

#include "platform/machine_file/machine_file.hpp"
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

constexpr std::size_t kMostHexapodFileBytes = 1 << 20;

struct JointKey {
  const char* name;
  double UniversalJoint::*member;
};
constexpr std::array<JointKey, 10> kJointKeys = {{{"a1x_mm", &UniversalJoint::a1x_mm},
                                                  {"a1y_mm", &UniversalJoint::a1y_mm},
                                                  {"a1z_mm", &UniversalJoint::a1z_mm},
                                                  {"dx_rad", &UniversalJoint::dx_rad},
                                                  {"dz_rad", &UniversalJoint::dz_rad},
                                                  {"ex_mm", &UniversalJoint::ex_mm},
                                                  {"ez_mm", &UniversalJoint::ez_mm},
                                                  {"eps_rad", &UniversalJoint::eps_rad},
                                                  {"h_mm", &UniversalJoint::h_mm},
                                                  {"nu_rad", &UniversalJoint::nu_rad}}};

struct LimitKey {
  const char* name;
  double HexapodLimits::*member;
};
constexpr std::array<LimitKey, 5> kLimitKeys = {{{"strut_min_mm", &HexapodLimits::strut_min_mm},
                                                 {"strut_max_mm", &HexapodLimits::strut_max_mm},
                                                 {"base_cone_rad", &HexapodLimits::base_cone_rad},
                                                 {"platform_cone_rad", &HexapodLimits::platform_cone_rad},
                                                 {"singular_margin", &HexapodLimits::singular_margin}}};

struct MotionKey {
  const char* name;
  double HexapodMotion::*member;
};
constexpr std::array<MotionKey, 9> kMotionKeys = {
    {{"strut_velocity_mm_per_s", &HexapodMotion::strut_velocity_mm_per_s},
     {"strut_acceleration_mm_per_s2", &HexapodMotion::strut_acceleration_mm_per_s2},
     {"strut_jerk_mm_per_s3", &HexapodMotion::strut_jerk_mm_per_s3},
     {"feed_mm_per_s", &HexapodMotion::feed_mm_per_s},
     {"rapid_mm_per_s", &HexapodMotion::rapid_mm_per_s},
     {"path_acceleration_mm_per_s2", &HexapodMotion::path_acceleration_mm_per_s2},
     {"path_jerk_mm_per_s3", &HexapodMotion::path_jerk_mm_per_s3},
     {"corner_tolerance_mm", &HexapodMotion::corner_tolerance_mm},
     {"corner_tolerance_rad", &HexapodMotion::corner_tolerance_rad}}};

// Of a machine that has one.
constexpr std::array<MotionKey, 3> kSpindleKeys = {{{"least_per_min", &HexapodMotion::spindle_least_per_min},
                                                    {"most_per_min", &HexapodMotion::spindle_most_per_min},
                                                    {"run_up_s", &HexapodMotion::spindle_run_up_s}}};

Pose ReadPose(MapReader& file, const std::string& key, Findings& findings) {
  MapReader reader(file.Child(key), key + ".", findings);
  const Eigen::Vector3d p(reader.Number("x_mm"), reader.Number("y_mm"), reader.Number("z_mm"));
  return Pose::FromKrylov(p,
                          {reader.Number("psi_rad"), reader.Number("theta_rad"), reader.Number("gamma_rad")});
}

Eigen::Vector3d ReadPoint(MapReader& strut, const std::string& key, Findings& findings) {
  const YAML::Node node = strut.Child(key);
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  bool good = node.IsDefined() && node.IsSequence() && node.size() == 3;
  for (std::size_t i = 0; good && i < 3; ++i) {
    double number = 0.0;
    good = node[i].IsScalar() && ParseNumber(node[i].Scalar(), number) && std::isfinite(number);
    point[static_cast<Eigen::Index>(i)] = number;
  }
  if (node.IsDefined() && !good) {
    findings.Add(strut.prefix() + key, strut.LineOfKey(key), "is not three finite numbers in mm",
                 "WRONG_VALUE");
  }
  return point;
}

void ReadStruts(MapReader& file, Findings& findings, HexapodGeometry& geometry) {
  const YAML::Node list = file.Child("struts");
  if (!list.IsDefined() || !list.IsSequence() || list.size() != static_cast<std::size_t>(kStruts)) {
    findings.Add("struts", file.LineOfKey("struts"), "is not a list of six struts", "WRONG_TYPE");
    return;
  }
  for (std::size_t j = 0; j < static_cast<std::size_t>(kStruts); ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    const std::string prefix = "struts." + std::to_string(j + 1) + ".";
    MapReader strut(list[j], prefix, findings);
    geometry.p_MA_mm.col(column) = ReadPoint(strut, "p_MA_mm", findings);
    geometry.p_PB_mm.col(column) = ReadPoint(strut, "p_PB_mm", findings);
    geometry.length_zero_mm[column] = strut.Number("length_zero_mm");
    if (strut.Has("joint")) {
      MapReader joint(strut.Child("joint"), prefix + "joint.", findings);
      for (const JointKey& key : kJointKeys) {
        geometry.joints[j].*key.member = joint.Number(key.name);
      }
    }
  }
}

// A section that stands in the file is a spindle's: one that cannot turn is left out instead.
void ReadSpindle(MapReader& file, Findings& findings, HexapodMotion& motion) {
  MapReader spindle(file.Child("spindle"), "spindle.", findings);
  for (const MotionKey& key : kSpindleKeys) {
    motion.*key.member = spindle.Number(key.name);
  }
  const auto judge = [&](const std::string& key, double value, bool good, const std::string& right) {
    if (spindle.Has(key) && !good) {
      findings.Add("spindle." + key, spindle.LineOfKey(key),
                   "is " + ShortestText(value) + "; right is " + right, "WRONG_VALUE");
    }
  };
  const double most = motion.spindle_most_per_min, least = motion.spindle_least_per_min;
  if (findings.any()) {
    return;  // numbers that could not be read are not judged
  }
  judge("most_per_min", most, most > 0.0 && most <= kFastestSpindle_per_min,
        "above 0 and at most " + ShortestText(kFastestSpindle_per_min) + " turns a minute");
  judge("least_per_min", least, least >= 0.0 && least <= most, "0 up to most_per_min");
  judge("run_up_s", motion.spindle_run_up_s,
        motion.spindle_run_up_s >= 0.0 && motion.spindle_run_up_s <= kLongestRunUp_s,
        "0 to " + ShortestText(kLongestRunUp_s) + " s");
}

HexapodMachine ReadHexapod(const YAML::Node& root, Findings& findings) {
  HexapodMachine machine;
  MapReader file(root, "", findings);
  machine.machine_id = file.Text("machine_id");
  if (file.Has("machine_id") && !IsId(machine.machine_id)) {
    findings.Add("machine_id", file.LineOfKey("machine_id"), "is not 1 to 63 of a-z, 0-9 and '-'",
                 "WRONG_VALUE");
  }
  ReadStruts(file, findings, machine.geometry);
  machine.geometry.X_MP_home = ReadPose(file, "home", findings);
  machine.geometry.X_PT = ReadPose(file, "tool", findings);
  MapReader limits(file.Child("limits"), "limits.", findings);
  for (const LimitKey& key : kLimitKeys) {
    machine.geometry.limits.*key.member = limits.Number(key.name);
  }
  machine.geometry.screw_lead_mm = file.Number("screw_lead_mm");
  MapReader motion(file.Child("motion"), "motion.", findings);
  for (const MotionKey& key : kMotionKeys) {
    machine.motion.*key.member = motion.Number(key.name);
  }
  machine.motion.X_MT_zero = ReadPose(file, "program_zero", findings);
  if (file.Has("spindle")) {
    ReadSpindle(file, findings, machine.motion);
  }
  return machine;
}

std::string PointText(const Eigen::Vector3d& p) {
  return "[" + ShortestText(p.x()) + ", " + ShortestText(p.y()) + ", " + ShortestText(p.z()) + "]";
}

std::string PoseText(const std::string& key, const Pose& X) {
  const KrylovAngles a = X.krylov();
  return key + ": {x_mm: " + ShortestText(X.p_mm.x()) + ", y_mm: " + ShortestText(X.p_mm.y()) +
         ", z_mm: " + ShortestText(X.p_mm.z()) + ", psi_rad: " + ShortestText(a.psi_rad) +
         ", theta_rad: " + ShortestText(a.theta_rad) + ", gamma_rad: " + ShortestText(a.gamma_rad) + "}\n";
}

}  // namespace

absl::StatusOr<HexapodMachine> ParseHexapod(const std::string& yaml, const std::string& name) {
  Findings findings(name);
  HexapodMachine machine;
  try {
    machine = ReadHexapod(YAML::Load(yaml), findings);
  } catch (const YAML::Exception& error) {
    findings.Add("the file", error.mark.line + 1, "is not YAML: " + error.msg, "NOT_YAML");
  }
  if (!findings.any()) {
    LayJointFrames(machine.geometry);
    if (const std::string_view fault = FaultOf(machine.geometry); !fault.empty()) {
      findings.Add("the hexapod", 0, "cannot be: " + std::string(fault), "WRONG_VALUE");
    }
    if (const std::string_view fault = FaultOf(machine.motion); !fault.empty()) {
      findings.Add("the hexapod's motion", 0, "cannot be: " + std::string(fault), "WRONG_VALUE");
    }
  }
  if (absl::Status status = findings.status("BAD_HEXAPOD_FILE"); !status.ok()) {
    return status;
  }
  return machine;
}

absl::StatusOr<HexapodMachine> ReadHexapodFile(const std::string& path) {
  const auto text = ReadWholeFile(path, kMostHexapodFileBytes);
  return text.ok() ? ParseHexapod(*text, path) : text.status();
}

std::string HexapodText(const HexapodMachine& machine) {
  const HexapodGeometry& g = machine.geometry;
  std::string text = "machine_id: " + IdText(machine.machine_id) + "\nstruts:\n";
  for (std::size_t j = 0; j < static_cast<std::size_t>(kStruts); ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    text += "  - p_MA_mm: " + PointText(g.p_MA_mm.col(column)) +
            "\n    p_PB_mm: " + PointText(g.p_PB_mm.col(column)) +
            "\n    length_zero_mm: " + ShortestText(g.length_zero_mm[column]) + "\n";
    if (!(g.joints[j] == UniversalJoint{})) {
      text += "    joint: {";
      for (const JointKey& key : kJointKeys) {
        text += (key.member == kJointKeys.front().member ? "" : ", ") + std::string(key.name) + ": " +
                ShortestText(g.joints[j].*key.member);
      }
      text += "}\n";
    }
  }
  text += PoseText("home", g.X_MP_home) + PoseText("tool", g.X_PT) + "limits:\n";
  for (const LimitKey& key : kLimitKeys) {
    text += std::string("  ") + key.name + ": " + ShortestText(g.limits.*key.member) + "\n";
  }
  text += "screw_lead_mm: " + ShortestText(g.screw_lead_mm) + "\nmotion:\n";
  for (const MotionKey& key : kMotionKeys) {
    text += std::string("  ") + key.name + ": " + ShortestText(machine.motion.*key.member) + "\n";
  }
  text += PoseText("program_zero", machine.motion.X_MT_zero);
  if (machine.motion.spindle_most_per_min > 0.0) {
    text += "spindle:\n";
    for (const MotionKey& key : kSpindleKeys) {
      text += std::string("  ") + key.name + ": " + ShortestText(machine.motion.*key.member) + "\n";
    }
  }
  return text;
}

std::string HexapodHash(const HexapodMachine& machine) { return ContentHash(HexapodText(machine)); }

}  // namespace lambdajet
