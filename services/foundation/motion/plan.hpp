// Carries a planned motion from the planner to the module that plays it: segments, gates and process events.
//
// Model: program time tau runs from 0 to the plan's duration; the drive plays it with a rate w = d tau/dt in [0, 1.2], so
// feed hold, override and resume never change the contour. A segment holds, in local time t = tau - start_s, for each
// actuator the rigid setpoint q(t), the elastic lead e(t) at rate 1, and the path length s(t). The setpoint played is
//     q(t) + w^2 e(t) + elastic_lag_s2 * q'(t) * dw/dt
// which is the spring-mass inversion x_s = r + (m/k) r'' of the effector's path at any rate (seed paper 000, elastic error;
// damping is contained in e). A plan without compensation has e = 0 and elastic_lag_s2 = 0.
// Path length s counts every feed and rapid millimetre of the jet on the sheet from the program's start.
// Units: mm, s. Shapes: coefficients ascend, value = c0 + c1 t + … + c5 t^5.
// Threads: values.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace lambdajet {

inline constexpr int kActuatorCount = 2;
inline constexpr int kPolynomialSize = 6;  // degree 5

struct Polynomial {
  std::array<double, kPolynomialSize> c{};

  double value(double t) const { return ((((c[5] * t + c[4]) * t + c[3]) * t + c[2]) * t + c[1]) * t + c[0]; }
  double first(double t) const { return (((5 * c[5] * t + 4 * c[4]) * t + 3 * c[3]) * t + 2 * c[2]) * t + c[1]; }
  double second(double t) const { return ((20 * c[5] * t + 12 * c[4]) * t + 6 * c[3]) * t + 2 * c[2]; }
  double third(double t) const { return (60 * c[5] * t + 24 * c[4]) * t + 6 * c[3]; }
};

enum class GateKind : std::uint8_t { kNone, kPierce, kMeasure, kDwell, kStop, kInput };

// What main motion can tell of itself while the drive waits.
enum class ProcessInput : std::uint8_t {
  kPumpAtPressure,   // the pump gives the pressure to cut with
  kAbrasivePresent,  // the hopper holds abrasive
};
inline constexpr std::uint32_t kProcessInputs = 2;

// Rise and fall: a change after the gate was reached; high and low: also what is so already.
enum class InputEvent : std::uint8_t { kNone, kRise, kFall, kHigh, kLow };

inline constexpr std::uint32_t kInputEvents = 5;

// Both in one byte, as a long program holds one in each of its operations.
struct InputCondition {
  std::uint8_t code = 0;  // 8 * input + event

  static InputCondition Of(ProcessInput input, InputEvent event) {
    return {static_cast<std::uint8_t>(8 * static_cast<int>(input) + static_cast<int>(event))};
  }
  ProcessInput input() const { return static_cast<ProcessInput>(code / 8); }
  InputEvent event() const { return static_cast<InputEvent>(code % 8); }
  friend bool operator==(const InputCondition&, const InputCondition&) = default;
};

// A place on the path where the drive stands still until main motion reports the gate as passed. A dwell is passed by
// the drive itself after its time; a stop (M0) by the operator's resume; an input by its event, and where that does not
// come in time both modules hold.
struct Gate {
  std::uint32_t id = 0;         // 1, 2, … in path order; 0 is no gate
  GateKind kind = GateKind::kNone;
  double s_mm = 0.0;
  double argument = 0.0;        // pierce, dwell, and the longest wait for an input: s; measure: id of the mark
  std::uint32_t source_line = 0;
  InputCondition condition;     // of an input
};

enum class ProcessAction : std::uint8_t {
  kJetOn, kJetOff, kAbrasiveOn, kAbrasiveOff, kCameraTrackOn, kCameraTrackOff, kAbrasiveFlow
};

// Something main motion does when the path length reaches s_mm, early by its valve's delay, at its own instant.
// Jet-on and abrasive-on of a pierce are not events: they belong to the pierce gate.
struct ProcessEvent {
  std::uint32_t index = 0;      // 0, 1, … in path order
  ProcessAction action = ProcessAction::kJetOff;
  double s_mm = 0.0;
  double argument = 0.0;        // camera track: id of the mark; abrasive flow: g/min
  std::uint32_t source_line = 0;
};

struct Segment {
  std::uint32_t index = 0;
  double start_s = 0.0;         // program time tau
  double duration_s = 0.0;
  std::array<Polynomial, kActuatorCount> q_mm;
  std::array<Polynomial, kActuatorCount> lead_mm;
  Polynomial s_mm;
  std::uint32_t gate_at_end = 0;  // id of the gate that closes at this segment's end; 0: none
};

// One point of the plan as people and predictors see it; equally spaced in tau within a stretch.
struct PlanSample {
  double tau_s = 0.0;
  double s_mm = 0.0;
  double x_W_mm = 0.0;          // planned place of the jet on the sheet
  double y_W_mm = 0.0;
  double vx_W_mm_per_s = 0.0;
  double vy_W_mm_per_s = 0.0;
  double ax_W_mm_per_s2 = 0.0;
  double ay_W_mm_per_s2 = 0.0;
  bool cutting = false;         // jet on
  std::uint32_t source_line = 0;
};

struct Plan {
  std::uint64_t id = 0;                 // hash of program, options and machine version: the same inputs, the same plan
  std::string machine_id;
  std::uint32_t machine_version = 0;
  bool compensated = false;
  double elastic_lag_s2 = 0.0;
  double duration_s = 0.0;
  double length_mm = 0.0;
  std::vector<Segment> segments;
  std::vector<Gate> gates;
  std::vector<ProcessEvent> events;
};

}  // namespace lambdajet
