#include "simulated_plant/plant_file/plant_file.hpp"

#include <yaml-cpp/yaml.h>

#include <array>
#include <cmath>
#include <cstddef>

#include "platform/machine_file/yaml_map_reader.hpp"
#include "platform/process/atomic_file.hpp"

namespace lambdajet::simulated_plant {
namespace {

using yaml_file::Findings;
using yaml_file::MapReader;

constexpr std::size_t kMostFileBytes = 4 << 20;
constexpr std::size_t kMostEntries = 10'000;
constexpr int kLargestSeed = 2'000'000'000;
constexpr std::array<const char*, 6> kFaultNames = {"stall",         "sensor_freeze", "sensor_fault",
                                                    "pressure_loss", "valve_delay",   "hopper_empty"};

// The two visitors have the same members; Visit() below names each key once for both.
class Reading {
 public:
  Reading(MapReader& map, Findings& findings) : map_(map), findings_(findings) {}

  void Number(const char* key, double& value) { value = map_.Number(key); }
  void NotNegative(const char* key, double& value) {
    value = map_.Number(key);
    if (value < 0.0) {
      findings_.Add(map_.prefix() + key, map_.LineOfKey(key),
                    "is " + yaml_file::ShortestText(value) + "; right is 0 or more", "WRONG_VALUE");
    }
  }
  void Sign(const char* key, int& value) {
    value = map_.Integer(key, -1, 1);
    if (value == 0) {
      findings_.Add(map_.prefix() + key, map_.LineOfKey(key), "is 0; right is -1 or 1", "WRONG_VALUE");
    }
  }
  void Whole(const char* key, int& value, int least, int most) { value = map_.Integer(key, least, most); }
  void Seed(const char* key, std::uint64_t& value) {
    value = static_cast<std::uint64_t>(map_.Integer(key, 0, kLargestSeed));
  }
  void Text(const char* key, std::string& value) { value = map_.Text(key); }
  void Choice(const char* key, FaultKind& value) {
    const std::string text = map_.Text(key);
    for (std::size_t i = 0; i < kFaultNames.size(); ++i) {
      if (text == kFaultNames[i]) {
        value = static_cast<FaultKind>(i);
        return;
      }
    }
    findings_.Add(
        map_.prefix() + key, map_.LineOfKey(key),
        "is '" + text.substr(0, 64) +
            "'; right is stall, sensor_freeze, sensor_fault, pressure_loss, valve_delay or hopper_empty",
        "WRONG_VALUE");
  }
  template <typename Members>
  void Group(const char* key, Members&& members) {
    MapReader child(map_.Child(key), map_.prefix() + key + ".", findings_);
    Reading reading(child, findings_);
    members(reading);
  }
  template <typename Entry, std::size_t N, typename Members>
  void List(const char* key, std::array<Entry, N>& entries, Members&& members) {
    const YAML::Node node = map_.Child(key);
    if (!node.IsDefined()) {
      return;
    }
    if (!node.IsSequence() || node.size() != N) {
      findings_.Add(map_.prefix() + key, map_.LineOfKey(key), "is not a list of " + std::to_string(N),
                    "WRONG_TYPE");
      return;
    }
    for (std::size_t i = 0; i < N; ++i) {
      ReadEntry(key, node[i], i, entries[i], members);
    }
  }
  template <typename Entry, typename Members>
  void List(const char* key, std::vector<Entry>& entries, Members&& members) {
    if (!map_.Has(key)) {
      return;
    }
    const YAML::Node node = map_.Child(key);
    if (!node.IsSequence() || node.size() > kMostEntries) {
      findings_.Add(map_.prefix() + key, map_.LineOfKey(key),
                    "is not a list of at most " + std::to_string(kMostEntries), "WRONG_TYPE");
      return;
    }
    entries.resize(node.size());
    for (std::size_t i = 0; i < entries.size(); ++i) {
      ReadEntry(key, node[i], i, entries[i], members);
    }
  }

 private:
  template <typename Entry, typename Members>
  void ReadEntry(const char* key, const YAML::Node& node, std::size_t i, Entry& entry, Members&& members) {
    MapReader child(node, map_.prefix() + key + "." + std::to_string(i + 1) + ".", findings_);
    Reading reading(child, findings_);
    members(reading, entry);
  }

  MapReader& map_;
  Findings& findings_;
};

class Writing {
 public:
  Writing(std::string& text, std::string indent, std::string first)
      : text_(text), indent_(indent), first_(first) {}
  Writing(std::string& text, const std::string& indent) : Writing(text, indent, indent) {}

  void Number(const char* key, double& value) { Line(key, yaml_file::ShortestText(value)); }
  void NotNegative(const char* key, double& value) { Number(key, value); }
  void Sign(const char* key, int& value) { Line(key, std::to_string(value)); }
  void Whole(const char* key, int& value, int, int) { Line(key, std::to_string(value)); }
  void Seed(const char* key, std::uint64_t& value) { Line(key, std::to_string(value)); }
  void Text(const char* key, std::string& value) { Line(key, value); }
  void Choice(const char* key, FaultKind& value) { Line(key, kFaultNames[static_cast<std::size_t>(value)]); }
  template <typename Members>
  void Group(const char* key, Members&& members) {
    Line(key, "");
    Writing writing(text_, indent_ + "  ");
    members(writing);
  }
  template <typename Entries, typename Members>
  void List(const char* key, Entries& entries, Members&& members) {
    Line(key, entries.empty() ? "[]" : "");
    for (auto& entry : entries) {
      Writing writing(text_, indent_ + "    ", indent_ + "  - ");
      members(writing, entry);
    }
  }

 private:
  void Line(const char* key, const std::string& value) {
    text_ += first_ + key + (value.empty() ? ":" : ": ") + value + "\n";
    first_ = indent_;
  }

  std::string& text_;
  std::string indent_;
  std::string first_;
};

template <typename Visitor>
void VisitWave(Visitor& v, Wave& wave) {
  v.NotNegative("amplitude_mm", wave.amplitude_mm);
  v.Number("length_mm", wave.length_mm);
  v.Number("phase_rad", wave.phase_rad);
}

template <typename Visitor>
void VisitPose(Visitor& v, PlanarPose& pose) {
  v.Number("x_mm", pose.x_mm);
  v.Number("y_mm", pose.y_mm);
  v.Number("theta_rad", pose.theta_rad);
}

template <typename Visitor>
void VisitValve(Visitor& v, ValveTruth& valve) {
  v.NotNegative("on_delay_s", valve.on_delay_s);
  v.NotNegative("off_delay_s", valve.off_delay_s);
  v.NotNegative("scatter_s", valve.scatter_s);
  v.NotNegative("sensor_s", valve.sensor_s);
}

template <typename Visitor>
void VisitDrive(Visitor& v, PlantTruth& t) {
  v.Group("mechanism", [&](Visitor& g) {
    g.Number("main_link_length_mm", t.main_link_length_mm);
    g.Number("attach_length_mm", t.attach_length_mm);
    g.Number("second_link_length_mm", t.second_link_length_mm);
    g.Sign("assembly_mode", t.assembly_mode);
  });
  v.List("rails", t.rails, [](Visitor& g, RailTruth& rail) {
    g.Number("angle_rad", rail.angle_rad);
    g.Number("offset_mm", rail.offset_mm);
    g.List("straightness", rail.straightness, [](Visitor& w, Wave& wave) { VisitWave(w, wave); });
  });
  v.List("actuators", t.actuators, [](Visitor& g, ActuatorTruth& actuator) {
    g.Number("zero_mm", actuator.zero_mm);
    g.NotNegative("encoder_step_mm", actuator.encoder_step_mm);
    g.Group("encoder_wave", [&](Visitor& w) { VisitWave(w, actuator.encoder_wave); });
    g.NotNegative("backlash_mm", actuator.backlash_mm);
    g.Number("servo_bandwidth_hz", actuator.servo_bandwidth_hz);
    g.Number("servo_damping", actuator.servo_damping);
  });
  v.Group("home", [&](Visitor& g) {
    g.Number("slider_1_mm", t.home_position_mm[0]);
    g.Number("slider_2_mm", t.home_position_mm[1]);
  });
  v.Group("levers", [&](Visitor& g) {
    g.Number("moving_mass_kg", t.levers.moving_mass_kg);
    g.Number("stiffness_x_n_per_mm", t.levers.stiffness_x_n_per_mm);
    g.Number("stiffness_y_n_per_mm", t.levers.stiffness_y_n_per_mm);
    g.NotNegative("damping_ratio", t.levers.damping_ratio);
  });
  v.Group("clamp", [&](Visitor& g) {
    g.NotNegative("creep_mm", t.clamp.creep_mm);
    g.NotNegative("creep_turn_rad", t.clamp.creep_turn_rad);
    g.Number("creep_time_s", t.clamp.creep_time_s);
    g.Group("parallelogram", [&](Visitor& w) {
      w.NotNegative("turn_rad", t.clamp.parallelogram.amplitude_mm);
      w.Number("length_mm", t.clamp.parallelogram.length_mm);
      w.Number("phase_rad", t.clamp.parallelogram.phase_rad);
    });
  });
}

template <typename Visitor>
void VisitJet(Visitor& v, PlantTruth& t) {
  v.Group("head_X_DH", [&](Visitor& g) { VisitPose(g, t.X_DH); });
  v.Group("sheet_X_EW", [&](Visitor& g) { VisitPose(g, t.X_EW); });
  v.Group("jet_stack", [&](Visitor& g) {
    g.Number("mixing_chamber_tilt_rad", t.stack.mixing_chamber_tilt_rad);
    g.NotNegative("mixing_chamber_lever_mm", t.stack.mixing_chamber_lever_mm);
    g.Number("mixing_chamber_azimuth_rad", t.stack.mixing_chamber_azimuth_rad);
    g.Number("focusing_tube_tilt_rad", t.stack.focusing_tube_tilt_rad);
    g.NotNegative("focusing_tube_lever_mm", t.stack.focusing_tube_lever_mm);
    g.Number("focusing_tube_azimuth_rad", t.stack.focusing_tube_azimuth_rad);
    g.NotNegative("radial_offset_mm", t.stack.radial_offset_mm);
    g.Number("radial_azimuth_rad", t.stack.radial_azimuth_rad);
  });
  v.Group("jet", [&](Visitor& g) {
    g.NotNegative("wander_mm", t.jet_wander_mm);
    g.Number("wander_time_s", t.jet_wander_time_s);
    g.NotNegative("lag_time_s", t.jet_lag_time_s);
  });
  v.Group("jet_valve", [&](Visitor& g) { VisitValve(g, t.jet_valve); });
  v.Group("abrasive_valve", [&](Visitor& g) { VisitValve(g, t.abrasive_valve); });
  v.Group("pump", [&](Visitor& g) {
    g.Number("pressure_mpa", t.pump.pressure_mpa);
    g.NotNegative("ripple_mpa", t.pump.ripple_mpa);
    g.NotNegative("ripple_hz", t.pump.ripple_hz);
    g.Number("rise_time_s", t.pump.rise_time_s);
    g.NotNegative("abrasive_g_per_min", t.pump.abrasive_g_per_min);
  });
  v.Group("camera", [&](Visitor& g) {
    g.Number("p_HC_x_mm", t.camera.p_HC_x_mm);
    g.Number("p_HC_y_mm", t.camera.p_HC_y_mm);
    g.NotNegative("noise_mm", t.camera.noise_mm);
    g.Number("field_of_view_mm", t.camera.field_of_view_mm);
    g.NotNegative("latency_s", t.camera.latency_s);
  });
}

template <typename Visitor>
void Visit(Visitor& v, PlantTruth& t) {
  v.Text("name", t.name);
  v.Text("machine_id", t.machine_id);
  v.Seed("seed", t.seed);
  VisitDrive(v, t);
  VisitJet(v, t);
  v.List("marks", t.marks, [](Visitor& g, SheetMark& mark) {
    g.Whole("id", mark.id, 0, 999);
    g.Number("x_W_mm", mark.x_W_mm);
    g.Number("y_W_mm", mark.y_W_mm);
  });
  v.List("faults", t.faults, [](Visitor& g, Fault& fault) {
    g.Choice("kind", fault.kind);
    g.Whole("index", fault.index, 0, 1);
    g.NotNegative("from_s", fault.from_s);
    g.NotNegative("for_s", fault.for_s);
    g.Number("value", fault.value);
  });
}

}  // namespace

void PlantOptions::Declare(ConfigSchema& schema) {
  schema.AddPath("plant", &plant, "plant file: what the simulated machine truly is");
  schema.Add("seed", &seed, {0, kLargestSeed}, "seed of the simulated machine's noise");
}

absl::StatusOr<PlantTruth> ReadPlantFile(const std::string& path) {
  const absl::StatusOr<std::string> text = ReadWholeFile(path, kMostFileBytes);
  return text.ok() ? ParsePlant(*text, path) : absl::StatusOr<PlantTruth>(text.status());
}

absl::StatusOr<PlantTruth> ParsePlant(const std::string& yaml, const std::string& name) {
  PlantTruth truth;
  Findings findings(name);
  try {
    const YAML::Node root = YAML::Load(yaml);
    MapReader map(root, "", findings);
    Reading reading(map, findings);
    Visit(reading, truth);
  } catch (const YAML::Exception& trouble) {
    findings.Add("the file", trouble.mark.line + 1, "is not YAML: " + trouble.msg, "NOT_YAML");
  }
  if (!findings.any()) {
    for (const DescriptionFault& fault : Validate(truth)) {
      findings.Add(fault.key, findings.LineOf(fault.key),
                   "is " + yaml_file::ShortestText(fault.value) + "; right is " + fault.should,
                   "WRONG_VALUE");
    }
  }
  return findings.any() ? absl::StatusOr<PlantTruth>(findings.status("BAD_PLANT_FILE")) : truth;
}

std::string PlantText(const PlantTruth& truth) {
  PlantTruth copy = truth;
  std::string text;
  Writing writing(text, "");
  Visit(writing, copy);
  return text;
}

absl::Status WritePlantFile(const std::string& path, const PlantTruth& truth) {
  return WriteFileAtomically(path, PlantText(truth));
}

}  // namespace lambdajet::simulated_plant
