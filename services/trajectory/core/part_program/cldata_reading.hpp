// Holds what a CLDATA reader knows between two statements, and what it has found so far; the reader's own, not for others.
//
// Model: one statement after another changes the modes (cldata_modes.cpp), switches the machine (cldata_switches.cpp) or
// moves it (cldata_motion.cpp, cldata_arcs.cpp, cldata_holes.cpp); what each word means stands in cldata_reader.hpp.
// Frames: W. Units: mm, s, rad. Threads: none of its own. Errors: a function that is false has noted a fault.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "trajectory/core/part_program/cldata_cycle.hpp"
#include "trajectory/core/part_program/cldata_majors.hpp"
#include "trajectory/core/part_program/cldata_reader.hpp"
#include "trajectory/core/part_program/cldata_words.hpp"

namespace lambdajet::trajectory {

inline constexpr double kCldataAxisTolerance = 1e-6;    // of a unit vector's components
inline constexpr double kCldataVectorTolerance = 1e-3;  // of a tool axis' length

using CldataVector = std::array<double, 3>;

inline double Dot(const CldataVector& a, const CldataVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The circle that the next points belong to.
struct CldataCircle {
  CldataVector center{};
  std::size_t normal = 2;  // index of the coordinate along its axis
  double radius_mm = 0.0;
  std::size_t operation = 0;  // of its arc; valid if begun
  bool begun = false;
  CldataVector start{};
  double swept_rad = 0.0;
  CldataPlace place;
  double said_sweep_rad = 0.0;  // MOVARC; 0: CIRCLE
};

class CldataReading {
 public:
  CldataReading(std::string_view text, const CldataOptions& options);

  PartProgram Read();

 private:
  using Vector = CldataVector;
  enum class Verdict : std::uint8_t { kMoved, kNotOnCircle, kFault };

  // ---- one statement: cldata_reader.cpp ----
  void CloseProgram();
  bool Obey();
  static bool MovesWithoutHole(CldataMajor major);
  bool Obey(CldataMajor major);
  bool ObeySwitch(CldataMajor major);

  // ---- modes: cldata_modes.cpp ----
  bool Units();
  bool Feedrate();
  bool FeedIn(const CldataParameter& unit, const CldataParameter& number);
  bool SetFeed(const CldataParameter& number, double feed_mm_per_s);
  bool Cutter();
  bool ToolCompensation();
  void SetKerf();
  bool Multax();
  bool Frame();
  bool Tolerance();
  bool LoadTool();
  bool NameTool(double number);
  bool ChangeTool(double number);

  // ---- switches: cldata_switches.cpp ----
  bool Spindle();
  bool SetSpindleSpeed(const CldataParameter& p);
  bool HasSpindle() const { return Has(kAxisZ); }
  bool Turn(bool off, double sense);
  bool Pierce(double time_s);
  bool JetOff();
  bool Abrasive(bool on);
  bool Coolant();
  bool Delay();
  bool Auxiliary();
  bool Machine(double m, const double* p);
  bool Output(bool on, const double* p);
  bool Mark(double m, const double* p);
  bool End();

  // ---- motion: cldata_motion.cpp ----
  bool From();
  bool Goto();
  bool GoDelta();
  bool Traverse(const Vector& target);
  bool Line(const Vector& target);
  bool SetPace(Operation& o, double length_mm);
  bool HasFeed();
  bool Target(Vector& target);
  bool Coordinate(const CldataParameter& p);
  bool ToolAxis(std::size_t first);
  static bool Upright(const Vector& axis);
  bool Has(AxisBit bit) const { return (options_.axes & bit) != 0; }
  bool Driven(const Vector& target);

  // ---- arcs: cldata_arcs.cpp ----
  bool CircleFrom(CldataCircle& circle);
  bool StartsOn(const CldataCircle& circle);
  bool ReadCircle();
  bool MoveArc();
  Verdict AlongCircle(const Vector& target);
  bool DirectionKnown(const CldataCircle& c, double turn);
  bool Sweep(CldataCircle& c, const Vector& target, double turn);

  // ---- holes: cldata_holes.cpp ----
  bool Cycle();
  bool Drill(const Vector& entry);
  bool StandsAt(const Vector& p) const;
  bool DrillsHere(double feed_mm_per_s);
  Vector Over(const Vector& entry, double height_mm) const;
  double HeightOver(const Vector& entry, const Vector& p) const;
  bool WithinReach(const Vector& entry);
  bool CoordinatesFit(const Vector& p);
  bool RiseOver(const Vector& entry);
  bool Leans();

  // ---- leaves: cldata_reading.cpp ----
  std::size_t Size() const { return statement_.parameters.size(); }
  const CldataParameter& At(std::size_t i) const { return statement_.parameters[i]; }
  bool Count(std::size_t least, std::size_t most);
  Operation* Add(OperationKind kind);
  void SetPosition(Operation& o, const Vector& p) const;
  Operation& Move(OperationKind kind, const Vector& target);
  static std::string Number(double value);
  bool Fault(const CldataPlace& place, const char* reason, std::string message);

  std::string_view text_;
  const CldataOptions& options_;
  CldataLines lines_;
  PartProgram program_;
  CldataStatement statement_;
  bool anything_ = false, moved_ = false, cut_ = false, ended_ = false, finished_ = false, stopped_ = false;

  Vector position_{};
  Vector axis_{0.0, 0.0, 1.0};
  Vector stands_{0.0, 0.0, 1.0};  // the axis at the last motion's end
  bool multax_ = false;
  std::optional<CldataCycle> cycle_;
  bool drills_ = false;
  bool rapid_ = false;
  std::optional<CldataCircle> circle_;
  double unit_mm_ = 1.0;
  double feed_mm_per_s_ = 0.0;
  double move_s_ = 0.0;  // inverse time feed: how long every move takes
  double spindle_per_min_ = 0.0;
  double spindle_sense_ = 1.0;  // clockwise positive
  double turns_per_min_ = 0.0;
  bool spindle_turns_ = false;
  double cutter_mm_ = 0.0;
  double side_ = 0.0;
  double kerf_offset_mm_ = 0.0;
  std::optional<double> tool_;
  bool jet_on_ = false;
  bool abrasive_on_ = false;
};

}  // namespace lambdajet::trajectory
