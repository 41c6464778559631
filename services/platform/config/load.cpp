#include "platform/config/load.hpp"

#include <yaml-cpp/yaml.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <set>

#include "platform/process/atomic_file.hpp"

namespace lambdajet {
namespace {

constexpr std::size_t kMostFileBytes = 1 << 20;
constexpr std::size_t kMostFaults = 20;
constexpr int kMostDepth = 8;
constexpr std::size_t kMostEcho = 256;

std::string Echo(const std::string& text) {
  return text.size() <= kMostEcho ? text : text.substr(0, kMostEcho) + "…";
}

// Puts one text into a setting; false if it is not what the setting expects.
class Assign {
 public:
  Assign(const Setting& setting, const std::string& text) : setting_(setting), text_(text) {}

  bool operator()(std::string* field) const {
    if (!setting_.choices.empty()) {
      bool known = false;
      for (const std::string& choice : setting_.choices) {
        known = known || choice == text_;
      }
      if (!known) {
        return false;
      }
    }
    *field = text_;
    return true;
  }
  bool operator()(const Setting::Path& field) const {
    *field.text = text_;
    return true;
  }
  bool operator()(bool* field) const {
    *field = text_ == "true";
    return text_ == "true" || text_ == "false";
  }
  bool operator()(double* field) const {
    double number = 0.0;
    const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), number);
    const bool good = error == std::errc() && end == text_.data() + text_.size() && std::isfinite(number) &&
                      number >= setting_.number_range->least && number <= setting_.number_range->most;
    *field = good ? number : *field;
    return good;
  }
  bool operator()(std::int64_t* field) const { return AssignInteger(field); }
  bool operator()(int* field) const { return AssignInteger(field); }
  bool operator()(std::vector<std::string>* field) const {
    field->clear();
    for (std::size_t start = 0; start < text_.size();) {
      const std::size_t comma = std::min(text_.find(',', start), text_.size());
      field->push_back(text_.substr(start, comma - start));
      start = comma + 1;
    }
    return true;
  }

 private:
  template <typename Integer>
  bool AssignInteger(Integer* field) const {
    Integer number = 0;
    const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), number);
    const bool good = error == std::errc() && end == text_.data() + text_.size() &&
                      number >= setting_.integer_range->least && number <= setting_.integer_range->most;
    *field = good ? number : *field;
    return good;
  }

  const Setting& setting_;
  const std::string& text_;
};

class Loader {
 public:
  Loader(ConfigSchema& schema, const ConfigSources& sources) : schema_(schema), sources_(sources) {}

  ConfigOutcome Load() {
    ReadArguments();
    if (help_) {
      return {0, HelpText(), ""};
    }
    const std::string file =
        !file_flag_.empty() ? file_flag_ : sources_.environment("LAMBDAJET_CONFIG").value_or("");
    if (!file.empty()) {
      ReadFile(file);
    }
    ReadEnvironment();
    for (const auto& [name, value] : flags_) {
      Set(*schema_.Find(name), value, "--" + name, "flag");
    }
    if (!faults_.empty()) {
      return {kExitConfig, "", FaultText()};
    }
    return print_ ? ConfigOutcome{0, PrintedConfig(), ""} : ConfigOutcome{};
  }

 private:
  void Fault(std::string text) { faults_.push_back(std::move(text)); }

  void ReadArguments() {
    const std::vector<std::string>& arguments = sources_.arguments;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
      const std::string& argument = arguments[i];
      if (argument == "--help" || argument == "-h") {
        help_ = true;
      } else if (argument == "--print-config") {
        print_ = true;
      } else if (!argument.starts_with("--")) {
        Fault("unexpected argument '" + Echo(argument) + "': flags are --name=value");
      } else {
        const std::size_t equals = argument.find('=');
        const std::string name = argument.substr(2, equals == std::string::npos ? equals : equals - 2);
        if (equals != std::string::npos) {
          TakeFlag(name, argument.substr(equals + 1));
        } else if (i + 1 < arguments.size()) {
          TakeFlag(name, arguments[++i]);
        } else {
          Fault("flag --" + Echo(name) + " has no value");
        }
      }
    }
  }

  void TakeFlag(const std::string& name, const std::string& value) {
    if (name == "config") {
      file_flag_ = value;
    } else if (schema_.Find(name) != nullptr) {
      flags_.emplace_back(name, value);
    } else {
      Fault("unknown flag --" + Echo(name) + "; the nearest is --" + schema_.NearestName(name));
    }
  }

  void ReadEnvironment() {
    for (Setting& setting : schema_.settings()) {
      const std::string variable = setting.EnvironmentName();
      if (const auto value = sources_.environment(variable)) {
        Set(setting, *value, variable, variable);
      }
    }
  }

  bool Set(Setting& setting, const std::string& value, const std::string& where, const std::string& origin) {
    if (!std::visit(Assign(setting, value), setting.target)) {
      Fault(where + ": " + setting.name + " is '" + Echo(value) + "'; right is " + setting.Expected());
      return false;
    }
    setting.origin = origin;
    return true;
  }

  void ReadFile(const std::string& file) {
    file_ = file;
    const auto content = ReadWholeFile(file, kMostFileBytes);
    if (!content.ok()) {
      Fault("config file: " + std::string(content.status().message()) +
            "; --config names it, deploy/config holds one for every house");
      return;
    }
    try {
      const YAML::Node root = YAML::Load(*content);
      if (root.IsMap()) {
        ReadMap(root, "", 0);
      } else if (!root.IsNull()) {
        Fault(file + ": must be a map of settings");
      }
    } catch (const YAML::Exception& error) {
      Fault(file + ":" + std::to_string(error.mark.line + 1) + ": " + error.msg);
    }
  }

  std::string At(const YAML::Node& node) const { return file_ + ":" + std::to_string(node.Mark().line + 1); }

  void ReadMap(const YAML::Node& map, const std::string& prefix, int depth) {
    std::set<std::string> seen;
    for (const auto& entry : map) {
      if (!entry.first.IsScalar()) {
        Fault(At(entry.first) + ": a key must be a text");
        continue;
      }
      const std::string name = prefix + entry.first.Scalar();
      if (!seen.insert(name).second) {
        Fault(At(entry.first) + ": " + Echo(name) + " stands here a second time");
      } else if (Setting* setting = schema_.Find(name)) {
        ReadValue(*setting, entry.second, At(entry.first));
      } else if (entry.second.IsMap() && IsGroup(name) && depth < kMostDepth) {
        ReadMap(entry.second, name + ".", depth + 1);
      } else {
        Fault(At(entry.first) + ": unknown key " + Echo(name) + "; the nearest known key is " +
              schema_.NearestName(name));
      }
      if (faults_.size() > kMostFaults) {
        return;
      }
    }
  }

  bool IsGroup(const std::string& name) const {
    for (const Setting& setting : schema_.settings()) {
      if (setting.name.starts_with(name + ".")) {
        return true;
      }
    }
    return false;
  }

  void ReadValue(Setting& setting, const YAML::Node& node, const std::string& where) {
    if (auto* const* list = std::get_if<std::vector<std::string>*>(&setting.target);
        list && node.IsSequence()) {
      std::vector<std::string> entries;
      for (const YAML::Node& entry : node) {
        if (!entry.IsScalar()) {
          Fault(where + ": " + setting.name + " must be a list of texts");
          return;
        }
        entries.push_back(entry.Scalar());
      }
      **list = std::move(entries);
      setting.origin = where;
      return;
    }
    if (!node.IsScalar() && !node.IsNull()) {
      Fault(where + ": " + setting.name + " is a " + (node.IsMap() ? "map" : "list") + "; right is " +
            setting.Expected());
      return;
    }
    const std::string value = node.IsNull() ? "" : node.Scalar();
    if (Set(setting, value, where, where)) {
      if (const auto* path = std::get_if<Setting::Path>(&setting.target)) {
        AnchorAtFolder(*path->text);
      }
    }
  }

  void AnchorAtFolder(std::string& path) const {
    const std::size_t slash = file_.rfind('/');
    if (!path.empty() && path.front() != '/' && slash != std::string::npos) {
      path = file_.substr(0, slash + 1) + path;
    }
  }

  std::string FaultText() const {
    std::string text;
    for (std::size_t i = 0; i < faults_.size() && i < kMostFaults; ++i) {
      text += sources_.program + ": " + faults_[i] + "\n";
    }
    if (faults_.size() > kMostFaults) {
      text += sources_.program + ": and more; these are the first " + std::to_string(kMostFaults) + "\n";
    }
    return text + sources_.program + ": the configuration is not usable; --help lists every setting\n";
  }

  std::string HelpText() const {
    std::string text =
        sources_.program + ": " + sources_.about +
        "\n\nEvery setting stands in a YAML file (--config FILE or LAMBDAJET_CONFIG), in the environment, "
        "or as a flag;\na flag wins over the environment, that over the file.\n\n"
        "  --config FILE     the YAML file\n  --print-config    print every setting, its value and "
        "where it comes from\n  --help            this text\n\n";
    for (const Setting& setting : schema_.settings()) {
      text += "  --" + setting.name + "=" + setting.ValueText() + "\n        " + setting.description + " (" +
              setting.Expected() + "; " + setting.EnvironmentName() + ")\n";
    }
    return text;
  }

  std::string PrintedConfig() const {
    std::string text;
    for (const Setting& setting : schema_.settings()) {
      text += setting.name + ": " + setting.ValueText() + "  # " + setting.origin + "\n";
    }
    return text;
  }

  ConfigSchema& schema_;
  const ConfigSources& sources_;
  bool help_ = false;
  bool print_ = false;
  std::string file_flag_;
  std::string file_;
  std::vector<std::pair<std::string, std::string>> flags_;
  std::vector<std::string> faults_;
};

}  // namespace

ConfigOutcome LoadConfig(ConfigSchema& schema, const ConfigSources& sources) {
  return Loader(schema, sources).Load();
}

std::optional<int> LoadConfig(ConfigSchema& schema, int argc, const char* const* argv,
                              const std::string& about) {
  ConfigSources sources;
  const std::string path = argc > 0 ? argv[0] : "lambdajet";
  sources.program = path.substr(path.rfind('/') + 1);
  sources.about = about;
  sources.arguments.assign(argv + (argc > 0 ? 1 : 0), argv + argc);
  sources.environment = [](const std::string& name) -> std::optional<std::string> {
    const char* value = std::getenv(name.c_str());
    return value != nullptr ? std::optional<std::string>(value) : std::nullopt;
  };
  const ConfigOutcome outcome = LoadConfig(schema, sources);
  std::fputs(outcome.out.c_str(), stdout);
  std::fputs(outcome.err.c_str(), stderr);
  return outcome.exit_code;
}

}  // namespace lambdajet
