#include "platform/config/schema.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <utility>

#include "foundation/contract/expects.hpp"

namespace lambdajet {
namespace {

// Levenshtein distance, one row at a time.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) {
    row[j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

std::string NumberText(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.15g", number);
  return text;
}

std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += '\\';
    }
    quoted += c;
  }
  return quoted + '"';
}

struct ValueAsYaml {
  std::string operator()(const std::string* text) const { return Quoted(*text); }
  std::string operator()(const Setting::Path& path) const { return Quoted(*path.text); }
  std::string operator()(const double* number) const { return NumberText(*number); }
  std::string operator()(const std::int64_t* number) const { return std::to_string(*number); }
  std::string operator()(const int* number) const { return std::to_string(*number); }
  std::string operator()(const bool* flag) const { return *flag ? "true" : "false"; }
  std::string operator()(const std::vector<std::string>* list) const {
    std::string text = "[";
    for (const std::string& entry : *list) {
      text += (text.size() > 1 ? ", " : "") + Quoted(entry);
    }
    return text + "]";
  }
};

}  // namespace

std::string Setting::EnvironmentName() const {
  std::string text = "LAMBDAJET_";
  for (const char c : name) {
    text += c == '.' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return text;
}

std::string Setting::ValueText() const { return std::visit(ValueAsYaml{}, target); }

std::string Setting::Expected() const {
  if (!choices.empty()) {
    std::string text = "one of";
    for (const std::string& choice : choices) {
      text += " " + choice;
    }
    return text;
  }
  if (number_range) {
    return "a number from " + NumberText(number_range->least) + " to " + NumberText(number_range->most);
  }
  if (integer_range) {
    return "a whole number from " + std::to_string(integer_range->least) + " to " +
           std::to_string(integer_range->most);
  }
  if (std::holds_alternative<bool*>(target)) {
    return "true or false";
  }
  return std::holds_alternative<std::vector<std::string>*>(target) ? "a list of texts" : "a text";
}

void ConfigSchema::Insert(Setting setting) {
  for (const Setting& other : settings_) {
    Expects(other.EnvironmentName() != setting.EnvironmentName(), "two settings share a name");
  }
  settings_.push_back(std::move(setting));
}

void ConfigSchema::Add(std::string name, std::string* text, std::string description) {
  Insert({.name = std::move(name), .target = text, .description = std::move(description)});
}
void ConfigSchema::Add(std::string name, bool* flag, std::string description) {
  Insert({.name = std::move(name), .target = flag, .description = std::move(description)});
}
void ConfigSchema::Add(std::string name, double* number, NumberRange range, std::string description) {
  Insert({.name = std::move(name),
          .target = number,
          .number_range = range,
          .description = std::move(description)});
}
void ConfigSchema::Add(std::string name, int* number, IntegerRange range, std::string description) {
  Insert({.name = std::move(name),
          .target = number,
          .integer_range = range,
          .description = std::move(description)});
}
void ConfigSchema::Add(std::string name, std::int64_t* number, IntegerRange range, std::string description) {
  Insert({.name = std::move(name),
          .target = number,
          .integer_range = range,
          .description = std::move(description)});
}
void ConfigSchema::Add(std::string name, std::vector<std::string>* list, std::string description) {
  Insert({.name = std::move(name), .target = list, .description = std::move(description)});
}
void ConfigSchema::AddChoice(std::string name, std::string* text, std::vector<std::string> choices,
                             std::string description) {
  Insert({.name = std::move(name),
          .target = text,
          .choices = std::move(choices),
          .description = std::move(description)});
}
void ConfigSchema::AddPath(std::string name, std::string* path, std::string description) {
  Insert({.name = std::move(name), .target = Setting::Path{path}, .description = std::move(description)});
}

Setting* ConfigSchema::Find(std::string_view name) {
  const auto found =
      std::find_if(settings_.begin(), settings_.end(), [&](const Setting& s) { return s.name == name; });
  return found == settings_.end() ? nullptr : &*found;
}

std::string ConfigSchema::NearestName(std::string_view name) const {
  const auto nearest =
      std::min_element(settings_.begin(), settings_.end(), [&](const Setting& a, const Setting& b) {
        return EditDistance(a.name, name) < EditDistance(b.name, name);
      });
  return nearest == settings_.end() ? std::string() : nearest->name;
}

}  // namespace lambdajet
