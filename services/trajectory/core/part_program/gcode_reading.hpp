// Holds what a G-code reader knows between two lines, and what it has found so far; the reader's own, not for others.
//
// Model: RS-274/NGC's world model as LinuxCNC documents it. position = zero + written, zero = origin of the work offset +
// shift of G92 or G52 + tool offset, per axis; all in W.
// Units: mm and degrees here, mm and rad in the operations. Threads: none of its own.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "trajectory/core/part_program/gcode_doubt.hpp"
#include "trajectory/core/part_program/gcode_parameters.hpp"
#include "trajectory/core/part_program/gcode_reader.hpp"
#include "trajectory/core/part_program/gcode_words.hpp"

namespace lambdajet::trajectory {

constexpr double kSecondsPerMinute = 60.0;
constexpr double kInchMm = 25.4;
constexpr int kNoCode = -1;
constexpr int kInputResult = 5399;  // the parameter in which M66 leaves what it saw

inline constexpr std::size_t kAxisCount = 6;  // X Y Z A B C
inline constexpr std::size_t kLinearAxes = 3;
inline constexpr std::size_t kWorkOffsets = 9;
inline constexpr std::array<char, kAxisCount> kAxisLetters = {'X', 'Y', 'Z', 'A', 'B', 'C'};
using AxisValues = std::array<double, kAxisCount>;

// Of words that cannot stand together in a line.
enum Group : int {
  kMotion,
  kOnce,
  kPlane,
  kUnits,
  kKerf,
  kLength,
  kOffset,
  kPathMode,
  kDistance,
  kArcDistance,
  kFeedMode,
  kReturnMode,
  kStopping,
  kTool,
  kJet,
  kAbrasive,
  kOutput,
  kMachineWord,
  kCallWord,
  kGroupCount
};

// What drilling cycles remember from line to line.
struct CycleMemory {
  bool active = false;
  int motion = kNoCode;     // the cycle of the line before
  double initial_mm = 0.0;  // Z in W before the series
  double z_mm = 0.0;        // as written, as the next two
  double r_mm = 0.0;
  double q_mm = 0.0;
  double dwell_s = 0.0;
};

struct ModalState {
  AxisValues position{};
  AxisValues zero{};  // see above, kept by UpdateZero
  std::array<AxisValues, kWorkOffsets> offsets{};
  AxisValues origin{}, shift{}, saved_shift{}, tool{};
  AxisValues home_28{}, home_30{};
  std::size_t offset = 0;
  int motion = kNoCode;  // tenfold
  ArcPlane plane = ArcPlane::kXy;
  bool shifted = false;
  bool length_on = false;
  bool absolute = true;
  bool arc_absolute = false;
  bool inverse_time = false;
  bool return_to_r = false;
  double unit_mm = 1.0;
  double path_tolerance_mm = 1e9;  // of G64 P
  double feed_per_min = 0.0;       // as F is written
  double feed_mm_per_s = 0.0;
  double feed_deg_per_s = 0.0;
  int kerf_code = 400;
  double kerf_offset_mm = 0.0;
  bool kerf_ends = false;  // G40 stands before the next motion
  bool jet_on = false;
  bool waited_for_input = false;  // since #5399 was set
  bool abrasive_on = false;       // or the coolant, where there is a spindle
  int selected_tool = -1;         // by T; -1: none yet
  int mounted_tool = 0;           // 0: none, the jet is the machine's own
  double spindle_per_min = 0.0;   // of S
  double turns_per_min = 0.0;     // as the spindle turns, clockwise positive; 0: it stands
  CycleMemory cycle;
  std::optional<std::array<double, 2>>
      spline_end;  // from the last spline's end to its second control point, mm

  void UpdateZero() {
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      zero[i] = origin[i] + shift[i] + tool[i];
    }
  }
};

struct JetTool {
  double radius_mm = 0.0;
  AxisValues offset{};
};

// What M98 and M99 ask of the flow of the program.
struct FlowRequest {
  bool call = false;
  bool leave = false;
  std::string label;
  int repeats = 1;
};

class Reading : public StateParameters {
 public:
  explicit Reading(const GcodeOptions& options_in) : options(options_in), parameters(*this) {
    tools[0] = tools[1] = {0.5 * options.kerf_width_mm, {}};
  }

  std::optional<double> Numbered(int index) const override;
  std::optional<double> Named(std::string_view name) const override;
  bool SetNumbered(int index, double value) override;
  bool Unknowable(int index) const override { return index == kInputResult && state.waited_for_input; }

  int code(Group group) const { return codes[group]; }
  bool drives(std::size_t axis) const { return (options.axes >> axis & 1u) != 0; }
  double unit(std::size_t axis) const { return axis < kLinearAxes ? state.unit_mm : 1.0; }
  double mm(double written) const { return written * state.unit_mm; }
  bool HasAxisWords() const;
  // By a word that is obeyed once, or G43.1: then the line's motion mode has none to move with.
  bool AxesTaken() const;
  // A machine that moves Z has a spindle, another one a jet.
  bool has_spindle() const { return drives(2); }

  Operation& Add(OperationKind kind);
  // A motion to there, with the kerf offset that is on.
  Operation& Move(OperationKind kind, const AxisValues& end);

  // Told unless it rests on what is in doubt. False, as the others.
  bool Fault(std::uint32_t column, std::uint32_t length, std::string_view reason, std::string message);
  bool FaultAt(char letter, std::string_view reason, std::string message);
  bool FaultAt(Group group, std::string_view reason, std::string message);
  // At the motion word, or at the first axis word of a line that has none.
  bool FaultAtMotion(std::string_view reason, std::string message);

  // The coordinate of an axis has been written.
  void SettlePlace(std::size_t axis) {
    if (doubt != 0 && (doubt & (kUnitsDoubt | kDistanceDoubt)) == 0 && state.absolute) {
      doubt &= ~(1u << axis);
    }
  }

  const GcodeOptions& options;
  PartProgram program;
  Parameters parameters;
  ModalState state;
  std::map<int, JetTool> tools;
  Block block;
  std::string_view line;
  std::uint32_t line_number = 0;
  bool ended = false;
  Doubt doubt = 0;          // of the state, by faults of lines before
  Doubt left_in_doubt = 0;  // by faults of this line
  bool moved = false;       // in this line
  FlowRequest flow;
  std::array<int, kGroupCount> codes{};
  std::array<std::uint32_t, kGroupCount> columns{};

 private:
  std::uint32_t WordLength(std::uint32_t column) const;
};

std::string ShortNumber(double value);
int GroupOfCode(char letter, int tenfold);  // kNoCode: no word of this reader

// Each does one part of a block in its turn; false after a fault.
bool ChangeOffsets(Reading& r);  // G10 G52 G54 … G59.3 G92, G43 G49
bool GoToReference(Reading& r);  // G28 G30 and their .1
bool ObeyMotion(Reading& r);     // G0 … G5.1, G80 … G83
bool ObeyArc(Reading& r, double turn);
bool ObeySpline(Reading& r, bool cubic);
bool ObeyCycle(Reading& r);
void EndProgram(Reading& r);
void SwitchJetOff(Reading& r);
bool ObeyTool(Reading& r);     // T M6 M61
bool ObeySpindle(Reading& r);  // S M3 M4 M5
void StopSpindle(Reading& r);
bool ObeyBlock(Reading& r);

// Leaves of motion that the parts share.
bool CoordinatesFinite(Reading& r, std::string_view letters);
bool HasFeed(Reading& r);
void FeedFits(Reading& r, double feed_mm_per_s);  // a fault at F otherwise
AxisValues Target(Reading& r);
bool TraverseTo(Reading& r, const AxisValues& end);
// Sets the feed, or the duration, of a motion of such a length in X, Y, Z.
void SetPace(Reading& r, Operation& o, double length_mm, double turned_deg);

}  // namespace lambdajet::trajectory
