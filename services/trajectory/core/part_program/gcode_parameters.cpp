#include "trajectory/core/part_program/gcode_parameters.hpp"

#include <algorithm>
#include <utility>

namespace lambdajet::trajectory {

double Parameters::Numbered(int index) const {
  if (const std::optional<double> value = state_.Numbered(index)) {
    return *value;
  }
  return numbered_.empty() ? 0.0 : numbered_[static_cast<std::size_t>(index)];
}

std::optional<double> Parameters::Named(const std::string& name) const {
  const bool global = name.front() == '_';
  const auto& names = global ? global_names_ : names_;
  if (const auto found = names.find(name); found != names.end()) {
    return found->second;
  }
  return global ? state_.Named(name) : std::nullopt;
}

void Parameters::Settle() {
  for (Setting& setting : pending_) {
    if (setting.name.empty()) {
      if (!state_.SetNumbered(setting.index, setting.value)) {
        Allocate();
        numbered_[static_cast<std::size_t>(setting.index)] = setting.value;
      }
    } else {
      auto& names = setting.name.front() == '_' ? global_names_ : names_;
      names[std::move(setting.name)] = setting.value;
    }
  }
  pending_.clear();
}

void Parameters::Enter(const std::vector<double>& arguments) {
  Allocate();
  Frame& frame = frames_.emplace_back();
  std::copy_n(numbered_.begin() + 1, kArguments, frame.arguments.begin());
  std::fill_n(numbered_.begin() + 1, kArguments, 0.0);
  std::copy(arguments.begin(), arguments.end(), numbered_.begin() + 1);
  frame.names.swap(names_);
  global_names_["_value"] = 0.0;
  global_names_["_value_returned"] = 0.0;
}

void Parameters::Leave(std::optional<double> value) {
  Frame& frame = frames_.back();
  std::copy(frame.arguments.begin(), frame.arguments.end(), numbered_.begin() + 1);
  names_.swap(frame.names);
  frames_.pop_back();
  global_names_["_value"] = value.value_or(0.0);
  global_names_["_value_returned"] = value ? 1.0 : 0.0;
}

void Parameters::Allocate() {
  if (numbered_.empty()) {
    numbered_.resize(kLastParameter + 1, 0.0);
  }
}

}  // namespace lambdajet::trajectory
