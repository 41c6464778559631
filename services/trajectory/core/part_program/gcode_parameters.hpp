// Keeps the parameters of a G-code program: numbered, named of a subroutine, named of all; the reader's own, not for others.
//
// Model: RS-274/NGC as LinuxCNC documents it. #1 … #30 and named parameters belong to the subroutine that runs, #31 … #5601
// and names that begin with "_" to the whole program; numbered ones start at 0. A setting takes effect when its line has been
// read. What the modal state knows (positions, offsets, modes) is asked of it. Threads: none of its own.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lambdajet::trajectory {

inline constexpr int kLastParameter = 5601;
inline constexpr std::size_t kArguments = 30;

// The parameters that are views on the modal state.
class StateParameters {
 public:
  virtual ~StateParameters() = default;
  virtual std::optional<double> Numbered(int index) const = 0;
  virtual std::optional<double> Named(std::string_view name) const = 0;
  // False where the parameter is none of the state's.
  virtual bool SetNumbered(int index, double value) = 0;
  // What only the machine will know, once the program runs.
  virtual bool Unknowable(int index) const = 0;
};

class Parameters {
 public:
  explicit Parameters(StateParameters& state) : state_(state) {}

  double Numbered(int index) const;
  bool Unknowable(int index) const { return state_.Unknowable(index); }
  std::optional<double> Named(const std::string& name) const;  // in small letters, without spaces

  bool ReadOnly(const std::string& name) const { return state_.Named(name).has_value(); }

  // Settings of the line that is being read.
  void Defer(int index, double value) { pending_.push_back({index, {}, value}); }
  void Defer(std::string name, double value) { pending_.push_back({0, std::move(name), value}); }
  bool pending() const { return !pending_.empty(); }
  void Forget() { pending_.clear(); }
  void Settle();

  // A subroutine has its own #1 … #30 (beyond its arguments: 0) and its own names.
  void Enter(const std::vector<double>& arguments);
  // The value that it gave back, if it did.
  void Leave(std::optional<double> value);
  std::size_t depth() const { return frames_.size(); }

 private:
  struct Setting {
    int index;
    std::string name;
    double value;
  };
  struct Frame {
    std::array<double, kArguments> arguments{};  // of the caller
    std::map<std::string, double> names;         // of the caller
  };
  void Allocate();

  StateParameters& state_;
  std::vector<double> numbered_;  // empty until the first setting
  std::map<std::string, double> names_;
  std::map<std::string, double> global_names_;
  std::vector<Setting> pending_;
  std::vector<Frame> frames_;
};

}  // namespace lambdajet::trajectory
