// Declares the settings of a house: name, where the value goes, what it may be, and what it is for.
//
// Model: a setting's name is a dotted path ("rpc.address"): nested keys in YAML, LAMBDAJET_RPC_ADDRESS in the
// environment,
// --rpc.address=VALUE as a flag. The fields keep their addresses: a schema is filled with pointers into
// structs that outlive it, and the struct's initial values are the defaults. Units: last in the name.
// Threads: start-up only. Example:
//   schema.Add("rpc.address", &config.address, "where gRPC listens; port 0 takes a free one");
//   schema.Add("path.feed_mm_per_s", &config.feed_mm_per_s, {0.1, 500.0}, "fastest cutting feed");
//   schema.AddChoice("log_level", &config.log_level, {"debug", "info", "warning", "error"}, "least level
//   written");
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace lambdajet {

struct NumberRange {
  double least;
  double most;
};

struct IntegerRange {
  std::int64_t least;
  std::int64_t most;
};

// One declared setting; made by ConfigSchema, read by the loader.
struct Setting {
  struct Path {
    std::string* text;
  };
  using Target =
      std::variant<std::string*, double*, std::int64_t*, int*, bool*, std::vector<std::string>*, Path>;

  std::string name;
  Target target;
  std::optional<NumberRange> number_range = {};
  std::optional<IntegerRange> integer_range = {};
  std::vector<std::string> choices = {};
  std::string description;
  std::string origin = "default";  // "default", "FILE:LINE", the environment variable's name, or "flag"

  std::string EnvironmentName() const;
  std::string ValueText() const;  // as YAML
  std::string Expected() const;   // what is right, in words: "a number from 0.1 to 500"
};

class ConfigSchema {
 public:
  void Add(std::string name, std::string* text, std::string description);
  void Add(std::string name, bool* flag, std::string description);
  void Add(std::string name, double* number, NumberRange range, std::string description);
  void Add(std::string name, int* number, IntegerRange range, std::string description);
  void Add(std::string name, std::int64_t* number, IntegerRange range, std::string description);
  void Add(std::string name, std::vector<std::string>* list, std::string description);  // YAML list, or a,b,c
  void AddChoice(std::string name, std::string* text, std::vector<std::string> choices,
                 std::string description);
  // A path that is relative in the file starts at the file's folder; elsewhere at the working folder.
  void AddPath(std::string name, std::string* path, std::string description);

  std::vector<Setting>& settings() { return settings_; }
  const std::vector<Setting>& settings() const { return settings_; }
  Setting* Find(std::string_view name);
  std::string NearestName(std::string_view name) const;  // by edit distance

 private:
  void Insert(Setting setting);
  std::vector<Setting> settings_;
};

}  // namespace lambdajet
