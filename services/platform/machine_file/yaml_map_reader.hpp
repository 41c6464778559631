// Reads maps of a YAML file strictly and collects what is wrong with them, each with key, value, unit and line.
//
// Model: every key is asked for once; what was not asked for is unknown and is told, too. For the readers of this folder.
// Threads: values. Errors: collected in Findings; its status carries up to 20 of them.
#pragma once

#include <yaml-cpp/yaml.h>

#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::yaml_file {

inline constexpr std::size_t kMostFaults = 20;

// The unit that ends a key, in words; empty for a pure number.
inline std::string UnitOf(std::string_view key) {
  static constexpr std::pair<std::string_view, std::string_view> kUnits[] = {
      {"_mm_per_s3", "mm/s^3"}, {"_mm_per_s2", "mm/s^2"}, {"_mm_per_s", "mm/s"}, {"_mm", "mm"},
      {"_rad", "rad"},          {"_s2", "s^2"},           {"_s", "s"},           {"_kg", "kg"}};
  for (const auto& [end, unit] : kUnits) {
    if (key.ends_with(end)) {
      return std::string(unit);
    }
  }
  return "";
}

inline std::string ShortestText(double number) {
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof text, number);
  return {text, end};
}

inline bool ParseNumber(const std::string& text, double& number) {
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

// Whether a text may be a machine's name, here as on the wire.
inline bool IsId(const std::string& text) {
  return !text.empty() && text.size() <= 63 &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos;
}

// A machine's name as it is written: in quotes where YAML would read a list or nothing at all.
inline std::string IdText(const std::string& id) {
  return id.starts_with('-') || id == "null" ? '"' + id + '"' : id;
}

// What is wrong with a file so far, and on which line each key stands.
class Findings {
 public:
  explicit Findings(std::string name) : name_(std::move(name)) {}

  void Add(const std::string& key, int line, const std::string& what, const std::string& reason) {
    if (violations_.size() < kMostFaults) {
      violations_.push_back(
          {key, name_ + (line > 0 ? ":" + std::to_string(line) : "") + ": " + key + " " + what, reason});
    }
  }
  void Stands(const std::string& key, int line) { lines_[key] = line; }

  // Validate() names keys without their group, so the end of the key is enough.
  int LineOf(const std::string& key) const {
    for (const auto& [stands, line] : lines_) {
      if (stands == key || stands.ends_with("." + key)) {
        return line;
      }
    }
    return 0;
  }

  absl::Status status(const std::string& reason) const {
    if (violations_.empty()) {
      return absl::OkStatus();
    }
    std::string message = violations_.front().description;
    for (std::size_t i = 1; i < violations_.size(); ++i) {
      message += "\n" + violations_[i].description;
    }
    return InvalidFields(reason, message, violations_);
  }
  bool any() const { return !violations_.empty(); }

 private:
  std::string name_;
  std::map<std::string, int> lines_;
  std::vector<FieldViolation> violations_;
};

inline int LineOf(const YAML::Node& node) { return node.Mark().line + 1; }

// One map of the file; each key is asked for once, and what was not asked for is unknown.
class MapReader {
 public:
  MapReader(const YAML::Node& node, std::string prefix, Findings& findings)
      : node_(node), prefix_(std::move(prefix)), findings_(findings) {
    if (!node_.IsMap()) {
      findings_.Add(Shown(), node_.IsDefined() ? LineOf(node_) : 0, "is not a map of keys", "WRONG_TYPE");
      return;
    }
    for (const auto& entry : node_) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "(not a text)";
      if (!entries_.emplace(key, entry.second).second) {
        findings_.Add(prefix_ + key, LineOf(entry.first), "stands here a second time", "DUPLICATE");
      }
      lines_[key] = LineOf(entry.first);
      findings_.Stands(prefix_ + key, LineOf(entry.first));
    }
  }
  ~MapReader() {
    for (const auto& [key, value] : entries_) {
      if (!asked_.contains(key)) {
        findings_.Add(prefix_ + key, lines_[key], "is not a known key", "UNKNOWN_KEY");
      }
    }
  }
  MapReader(const MapReader&) = delete;
  MapReader& operator=(const MapReader&) = delete;

  bool Has(const std::string& key) const { return entries_.contains(key); }

  YAML::Node Child(const std::string& key) {
    asked_.insert(key);
    const auto found = entries_.find(key);
    if (found == entries_.end()) {
      if (node_.IsMap()) {
        findings_.Add(prefix_ + key, LineOf(node_), "is missing", "MISSING");
      }
      return YAML::Node(YAML::NodeType::Undefined);
    }
    return found->second;
  }

  double Number(const std::string& key, const std::string& unit_key = "") {
    const YAML::Node node = Child(key);
    double number = 0.0;
    if (node.IsDefined() &&
        !(node.IsScalar() && ParseNumber(node.Scalar(), number) && std::isfinite(number))) {
      Wrong(key, node, "a finite number", UnitOf(unit_key.empty() ? key : unit_key));
    }
    return number;
  }

  int Integer(const std::string& key, int least, int most) {
    const YAML::Node node = Child(key);
    double number = least;
    if (node.IsDefined() && !(node.IsScalar() && ParseNumber(node.Scalar(), number) &&
                              number == std::floor(number) && number >= least && number <= most)) {
      Wrong(key, node, "a whole number from " + std::to_string(least) + " to " + std::to_string(most), "");
      return least;
    }
    return static_cast<int>(number);
  }

  std::string Text(const std::string& key) {
    const YAML::Node node = Child(key);
    if (node.IsDefined() && !node.IsScalar()) {
      Wrong(key, node, "a text", "");
    }
    return node.IsDefined() && node.IsScalar() ? node.Scalar() : "";
  }

  int LineOfKey(const std::string& key) const {
    const auto found = lines_.find(key);
    return found == lines_.end() ? 0 : found->second;
  }
  const std::string& prefix() const { return prefix_; }

 private:
  std::string Shown() const { return prefix_.empty() ? "the file" : prefix_.substr(0, prefix_.size() - 1); }

  void Wrong(const std::string& key, const YAML::Node& node, const std::string& right,
             const std::string& unit) {
    const std::string value = node.IsScalar() ? "'" + node.Scalar().substr(0, 64) + "'" : "no plain value";
    findings_.Add(prefix_ + key, LineOfKey(key),
                  "is " + value + "; right is " + right + (unit.empty() ? "" : " in " + unit), "WRONG_VALUE");
  }

  const YAML::Node node_;
  const std::string prefix_;
  Findings& findings_;
  std::map<std::string, YAML::Node> entries_;
  std::map<std::string, int> lines_;
  std::set<std::string> asked_;
};

}  // namespace lambdajet::yaml_file
