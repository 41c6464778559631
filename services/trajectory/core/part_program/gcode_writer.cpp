#include "trajectory/core/part_program/gcode_writer.hpp"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <utility>

namespace lambdajet::trajectory {
namespace {

constexpr double kSecondsPerMinute = 60.0;
constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kFull = 2.0 * std::numbers::pi;
constexpr double kNoTurn_rad = 1e-12;  // the reader's: less is a full turn
constexpr double kNoise = 8.0;         // of the last digit
constexpr double kGrain = 1e10;        // decimals written

std::string Number(double value) {
  char text[400];
  std::snprintf(text, sizeof text, "%.10f", value);
  std::string number = text;
  number.erase(number.find_last_not_of('0') + 1);
  if (number.back() == '.') {
    number.pop_back();
  }
  return number == "-0" ? "0" : number;
}

// What a conversion of units left in the last digits is taken away.
double WithoutNoise(double value) {
  const double rounded = std::round(value * kGrain) / kGrain;
  return std::abs(rounded - value) <= kNoise * std::numeric_limits<double>::epsilon() * std::abs(value)
             ? rounded
             : value;
}

// Shortest digits that read back as the same number.
std::string Exact(double value) {
  char text[400];
  const auto [end, error] =
      std::to_chars(text, text + sizeof text, value == 0.0 ? 0.0 : value, std::chars_format::fixed);
  return {text, error == std::errc() ? end : text};
}

// A plane's axes in the sense of its rotation.
std::pair<std::size_t, std::size_t> AxesOf(ArcPlane plane) {
  return plane == ArcPlane::kXy   ? std::pair<std::size_t, std::size_t>{0, 1}
         : plane == ArcPlane::kZx ? std::pair<std::size_t, std::size_t>{2, 0}
                                  : std::pair<std::size_t, std::size_t>{1, 2};
}

std::array<double, 3> CenterOf(const Operation& o) {
  return {o.center_x_W_mm, o.center_y_W_mm, o.center_z_W_mm};
}

// Of those that neither move nor set a feed, a tolerance or a kerf.
std::string Word(const Operation& o) {
  switch (o.kind) {
    case OperationKind::kPierce:
      return o.value > 0.0 ? "M3 P" + Number(o.value) : "M3";
    case OperationKind::kPathTolerance:
      return o.value > 0.0 ? "G64 P" + Number(o.value) : "G61";
    case OperationKind::kDwell:
      return "G4 P" + Number(o.value);
    case OperationKind::kMeasure:
      return "M100 P" + Number(o.value);
    case OperationKind::kStop:
      return "M0";
    case OperationKind::kJetOn:
      return "M62 P0";
    case OperationKind::kJetOff:
      return "M63 P0";
    case OperationKind::kAbrasiveOn:
      return "M62 P1";
    case OperationKind::kAbrasiveOff:
      return "M63 P1";
    case OperationKind::kCameraTrackOn:
      return "M101 P" + Number(o.value);
    case OperationKind::kCameraTrackOff:
      return "M102";
    case OperationKind::kAbrasiveFlow:
      return "M67 E0 Q" + Number(o.value);
    case OperationKind::kWaitInput:
      return "M66 P" + std::to_string(static_cast<int>(o.condition.input())) + " L" +
             std::to_string(static_cast<int>(o.condition.event())) + " Q" + Number(o.value);
    case OperationKind::kToolChange:
      return "T" + Number(o.value) + " M6";
    case OperationKind::kToolNumber:
      return "M61 Q" + Number(o.value);
    case OperationKind::kSpindleOn:
      return "S" + Number(std::abs(o.value)) + (o.value > 0.0 ? " M3" : " M4");
    case OperationKind::kSpindleOff:
      return "M5";
    case OperationKind::kCoolantOn:
      return "M8";
    case OperationKind::kCoolantOff:
      return "M9";
    default:
      return "M2";
  }
}

}  // namespace

std::string GcodeComment(std::string_view text) {
  std::string plain;
  for (const char c : text.substr(0, 80)) {
    plain += c >= ' ' && c <= '~' && c != '(' && c != ')' && c != ';' && c != '%' && c != '"' && c != '\\'
                 ? c
                 : '_';
  }
  return plain;
}

GcodeWriter::GcodeWriter(std::string_view title) {
  text_ = "%\n(" + GcodeComment(title) + ")\nG21 G90 G17 G40 G94\nG54\n";
}

void GcodeWriter::Append(const Operation& o) {
  switch (o.kind) {
    case OperationKind::kTraverse:
    case OperationKind::kFeedLine:
    case OperationKind::kFeedArc:
      Motion(o);
      break;
    case OperationKind::kUnitsChange:
    case OperationKind::kDistanceChange:
    case OperationKind::kWorkOffsetChange:
      break;  // resolved in the coordinates
    case OperationKind::kFeedChange:
      Feed(o.feed_mm_per_s);
      break;
    case OperationKind::kToolChange:
      Kerf(0.0);  // with which no tool is changed
      Line(Word(o));
      break;
    default:
      Line(Word(o));
  }
}

void GcodeWriter::End() { Line("%"); }

std::string GcodeWriter::Take() { return std::exchange(text_, {}); }

void GcodeWriter::Line(const std::string& line) { text_ += line + "\n"; }

void GcodeWriter::Feed(double mm_per_s) {
  if (mm_per_s > 0.0 && mm_per_s != feed_) {
    Line((timed_ ? "G94 F" : "F") + Number(mm_per_s * kSecondsPerMinute));
    feed_ = mm_per_s;
    timed_ = false;
  }
}

// What a motion says of its pace in its own line: nothing under G94, one over its minutes under G93.
std::string GcodeWriter::Pace(const Operation& o) {
  if (!(o.value > 0.0) || o.feed_mm_per_s > 0.0) {
    Feed(o.feed_mm_per_s);
    return "";
  }
  if (!timed_) {
    Line("G93");
    timed_ = true;
    feed_ = -1.0;
  }
  char word[40];
  std::snprintf(word, sizeof word, " F%.12g", kSecondsPerMinute / o.value);
  return word;
}

// The kerf is compensated in G17.
void GcodeWriter::Kerf(double offset_mm) {
  if (offset_mm == kerf_mm_) {
    return;
  }
  if (kerf_mm_ != 0.0) {
    Line("G40");
  }
  if (offset_mm != 0.0) {
    Plane(ArcPlane::kXy);
    Line((offset_mm > 0.0 ? "G41.1 D" : "G42.1 D") + Number(2.0 * std::abs(offset_mm)));
  }
  kerf_mm_ = offset_mm;
}

void GcodeWriter::Plane(ArcPlane plane) {
  if (plane != plane_) {
    Line(plane == ArcPlane::kXy ? "G17" : plane == ArcPlane::kZx ? "G18" : "G19");
    plane_ = plane;
  }
}

// As the reader finds the sweep from the coordinates it reads; 0: it would take the arc for a turn more than it is.
int GcodeWriter::Turns(const Operation& o, const std::array<double, 3>& end) const {
  const auto [u, v] = AxesOf(o.plane);
  const std::array<double, 3> center = CenterOf(o);
  const double from = std::atan2(at_[v] - center[v], at_[u] - center[u]);
  const double to = std::atan2(end[v] - center[v], end[u] - center[u]);
  double once = o.sweep_rad > 0.0 ? to - from : from - to;
  while (once <= kNoTurn_rad) {
    once += kFull;
  }
  return static_cast<int>(std::lround((std::abs(o.sweep_rad) - once) / kFull)) + 1;
}

// The centre to ten decimals, rounded until reading, which moves it onto the bisector of the chord, and writing again change
// nothing.
std::string GcodeWriter::ArcWords(const Operation& o, const std::array<double, 3>& end) const {
  constexpr std::array<const char*, 3> kLetters = {" I", " J", " K"};
  constexpr int kSettlingLimit = 20;
  constexpr double kNoChord_mm2 = 1e-12;  // the reader's
  const auto [u, v] = AxesOf(o.plane);
  const double du = end[u] - at_[u], dv = end[v] - at_[v], chord2 = du * du + dv * dv;
  std::array<double, 3> center = CenterOf(o);
  std::string words;
  for (int i = 0; i < kSettlingLimit; ++i) {
    std::string next;
    for (std::size_t k = 0; k < 3; ++k) {
      if (k == u || k == v) {
        const std::string number = Number(center[k] - at_[k]);
        next += kLetters[k] + number;
        center[k] = at_[k] + std::strtod(number.c_str(), nullptr);
      }
    }
    if (next == words || chord2 < kNoChord_mm2) {
      words = next;
      break;
    }
    const double along =
        ((center[u] - 0.5 * (at_[u] + end[u])) * du + (center[v] - 0.5 * (at_[v] + end[v])) * dv) / chord2;
    center[u] -= along * du;
    center[v] -= along * dv;
    words = std::move(next);
  }
  const int turns = Turns(o, end);
  return turns > 1 ? words + " P" + std::to_string(turns) : words;
}

// First the pace: read back, a change of feed is an operation before the motion.
void GcodeWriter::Motion(const Operation& o) {
  const std::string pace = o.kind == OperationKind::kTraverse ? "" : Pace(o);
  Kerf(o.kerf_offset_mm);
  const std::array<double, 3> end = {WithoutNoise(o.x_W_mm), WithoutNoise(o.y_W_mm), WithoutNoise(o.z_W_mm)};
  const bool arc = o.kind == OperationKind::kFeedArc && Turns(o, end) > 0;
  if (arc) {
    Plane(o.plane);
  }
  std::string line = arc                                  ? (o.sweep_rad > 0.0 ? "G3" : "G2")
                     : o.kind == OperationKind::kTraverse ? "G0"
                                                          : "G1";
  const auto axis = [&](AxisBit bit, const char* letter, const std::string& number) {
    line += (o.axes & bit) != 0 ? letter + number : "";
  };
  axis(kAxisX, " X", Exact(end[0]));
  axis(kAxisY, " Y", Exact(end[1]));
  axis(kAxisZ, " Z", Exact(end[2]));
  axis(kAxisA, " A", Number(o.a_rad * kDegrees));
  axis(kAxisB, " B", Number(o.b_rad * kDegrees));
  axis(kAxisC, " C", Number(o.c_rad * kDegrees));
  Line(line + (arc ? ArcWords(o, end) : "") + pace);
  at_ = end;
}

std::string WriteGcode(const std::vector<Operation>& operations, std::string_view title) {
  GcodeWriter writer(title);
  for (const Operation& o : operations) {
    writer.Append(o);
  }
  writer.End();
  return writer.Take();
}

}  // namespace lambdajet::trajectory
