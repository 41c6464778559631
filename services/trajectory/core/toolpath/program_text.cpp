#include "trajectory/core/toolpath/program_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;
constexpr double kSecondsPerMinute = 60.0;
constexpr double kGrain = 1e6;  // decimals written
constexpr double kTouch_mm = 1e-6;

double Rounded(double value) { return std::round(value * kGrain) / kGrain; }

std::string Number(double value, int digits = 6) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  std::string number = text;
  if (number.find('.') != std::string::npos) {
    number.erase(number.find_last_not_of('0') + 1);
    if (number.back() == '.') {
      number.pop_back();
    }
  }
  return number == "-0" ? "0" : number;
}

// What may stand in a comment: neither brackets nor line ends, nor what a reader may take for another alphabet.
std::string Plain(std::string_view text) {
  std::string plain;
  for (const char c : text.substr(0, 80)) {
    plain += c >= ' ' && c <= '~' && c != '(' && c != ')' && c != ';' && c != '%' && c != '"' && c != '\\'
                 ? c
                 : '_';
  }
  return plain;
}

std::string_view KindName(CutKind kind) {
  return kind == CutKind::kMark ? "mark" : kind == CutKind::kHole ? "hole" : "outline";
}

class ProgramWriter {
 public:
  ProgramWriter(const ContourSet& contours, const Toolpath& toolpath, const ToolpathOptions& options)
      : set_(contours), toolpath_(toolpath), options_(options) {}

  std::string Write(std::string_view title) {
    Line("%");
    Line("(" + Plain(title) + ": kerf " + Number(options_.kerf_mm, 3) + " mm, centreline of the jet)");
    Line("(parts " + std::to_string(set_.part_count) + ", cuts " + std::to_string(toolpath_.cuts.size()) +
         ", pierces " + std::to_string(toolpath_.pierce_count) + "; idle " + Number(toolpath_.idle_mm, 1) +
         " mm, in the drawing's order " + Number(toolpath_.drawing_idle_mm, 1) + " mm)");
    for (const int part : options_.skip_parts) {
      Line("(part " + std::to_string(part) + " is skipped)");
    }
    Line("G21 G90 G17 G40 G94");
    Line("G54");
    Line("G64");
    int part = 0, number = 0;
    for (const Cut& cut : toolpath_.cuts) {
      if (cut.part != part) {
        part = cut.part;
        Line("(part " + std::to_string(part) + ")");
      }
      WriteCut(cut, ++number);
    }
    Line("M2");
    Line("%");
    return std::move(text_);
  }

 private:
  void Line(const std::string& line) { text_ += line + "\n"; }

  void WriteCut(const Cut& cut, int number) {
    const bool mark = cut.kind == CutKind::kMark;
    Line("(" + std::to_string(number) + ": " + std::string(KindName(cut.kind)) +
         (mark ? "" : ", layer " + Plain(set_.contours[cut.contour].layer)) + ")");
    Go(cut.pierce());
    if (mark) {
      Line("M62 P0");
      Feed(options_.mark_feed_mm_per_s);
    } else {
      Start(options_.pierce);
      Feed(options_.pierce == PierceKind::kMoving ? options_.pierce_feed_mm_per_s : options_.feed_mm_per_s);
    }
    Follow(cut.lead_in);
    if (!mark) {
      Feed(options_.feed_mm_per_s);
    }
    FollowWithTabs(cut);
    if (!cut.lead_out.empty()) {
      Follow({cut.lead_out.front()});
    }
    Line("M5");
    if (cut.lead_out.size() > 1) {
      Follow({cut.lead_out.begin() + 1, cut.lead_out.end()});
    }
  }

  void Start(PierceKind kind) {
    if (kind == PierceKind::kStationary) {
      Line(options_.pierce_time_s > 0.0 ? "M3 P" + Number(options_.pierce_time_s) : "M3");
    } else {
      Line("M62 P0");
      Line("M62 P1");
    }
  }

  void FollowWithTabs(const Cut& cut) {
    Pieces rest = cut.path;
    double at_mm = 0.0;
    for (const Tab& tab : cut.tabs) {
      rest = FollowUntil(rest, tab.from_mm - at_mm);
      Line("M5");
      rest = FollowUntil(rest, tab.to_mm - tab.from_mm);
      Start(options_.pierce == PierceKind::kMoving ? PierceKind::kMoving : PierceKind::kStationary);
      at_mm = tab.to_mm;
    }
    Follow(rest);
  }

  // Follows a length of the path; what is left of it.
  Pieces FollowUntil(const Pieces& path, double length_mm) {
    Pieces rest;
    for (const Piece& piece : path) {
      const double length = Length(piece);
      if (!rest.empty() || length_mm <= kTouch_mm) {
        rest.push_back(piece);
      } else if (length <= length_mm) {
        Follow({piece});
        length_mm -= length;
      } else {
        Follow({Part(piece, 0.0, length_mm / length)});
        rest.push_back(Part(piece, length_mm / length, 1.0));
      }
    }
    return rest;
  }

  void Follow(const Pieces& pieces) {
    for (const Piece& piece : pieces) {
      const double x = Rounded(piece.to_mm.x()), y = Rounded(piece.to_mm.y());
      if (x == x_ && y == y_) {
        continue;
      }
      std::string line = piece.is_arc() ? (piece.sweep_rad > 0.0 ? "G3" : "G2") : "G1";
      line += " X" + Number(x) + " Y" + Number(y);
      if (piece.is_arc()) {
        line += " I" + Number(piece.center_mm.x() - x_) + " J" + Number(piece.center_mm.y() - y_);
      }
      Line(line);
      x_ = x;
      y_ = y;
    }
  }

  void Go(const Vector2d& to) {
    x_ = Rounded(to.x());
    y_ = Rounded(to.y());
    Line("G0 X" + Number(x_) + " Y" + Number(y_));
  }

  void Feed(double mm_per_s) {
    if (mm_per_s != feed_) {
      Line("F" + Number(mm_per_s * kSecondsPerMinute, 3));
      feed_ = mm_per_s;
    }
  }

  const ContourSet& set_;
  const Toolpath& toolpath_;
  const ToolpathOptions& options_;
  std::string text_;
  double x_ = 0.0, y_ = 0.0, feed_ = -1.0;
};

std::string OutlineElement(const Piece& piece) {
  if (!piece.is_arc()) {
    return "{line: [" + Number(piece.from_mm.x()) + ", " + Number(piece.from_mm.y()) + ", " +
           Number(piece.to_mm.x()) + ", " + Number(piece.to_mm.y()) + "]}";
  }
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  const Vector2d out = piece.from_mm - piece.center_mm;
  return "{arc: {center: [" + Number(piece.center_mm.x()) + ", " + Number(piece.center_mm.y()) +
         "], radius: " + Number(Radius(piece)) +
         ", start_deg: " + Number(std::atan2(out.y(), out.x()) * kDegrees, 9) +
         ", sweep_deg: " + Number(piece.sweep_rad * kDegrees, 9) + "}}";
}

class OperationWriter {
 public:
  // False: the operation has no words here.
  bool Write(const Operation& o) {
    switch (o.kind) {
      case OperationKind::kTraverse:
      case OperationKind::kFeedLine:
      case OperationKind::kFeedArc:
        return Motion(o);
      case OperationKind::kUnitsChange:
      case OperationKind::kDistanceChange:
      case OperationKind::kWorkOffsetChange:
        return true;  // resolved in the coordinates
      case OperationKind::kFeedChange:
        Feed(o.feed_mm_per_s);
        return true;
      case OperationKind::kPathTolerance:
        Line(o.value > 0.0 ? "G64 P" + Number(o.value) : "G61");
        return true;
      case OperationKind::kPierce:
        Line(o.value > 0.0 ? "M3 P" + Number(o.value) : "M3");
        return true;
      default:
        Line(Word(o));
        return true;
    }
  }

  std::string text;

 private:
  void Line(const std::string& line) { text += line + "\n"; }

  static std::string Word(const Operation& o) {
    switch (o.kind) {
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

  void Feed(double mm_per_s) {
    if (mm_per_s > 0.0 && mm_per_s != feed_) {
      Line(timed_ ? "G94 F" + Number(mm_per_s * kSecondsPerMinute)
                  : "F" + Number(mm_per_s * kSecondsPerMinute));
      feed_ = mm_per_s;
      timed_ = false;
    }
  }

  // What a motion says of its pace in its own line: nothing under G94, one over its minutes under G93.
  std::string Pace(const Operation& o) {
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

  void Kerf(double offset_mm) {
    if (offset_mm == kerf_mm_) {
      return;
    }
    if (kerf_mm_ != 0.0) {
      Line("G40");
    }
    if (offset_mm != 0.0) {
      Line((offset_mm > 0.0 ? "G41.1 D" : "G42.1 D") + Number(2.0 * std::abs(offset_mm)));
    }
    kerf_mm_ = offset_mm;
  }

  bool Motion(const Operation& o) {
    if (o.plane != ArcPlane::kXy) {
      return false;
    }
    Kerf(o.kerf_offset_mm);
    const bool arc = o.kind == OperationKind::kFeedArc;
    const std::string pace = o.kind == OperationKind::kTraverse ? "" : Pace(o);
    std::string line = arc                                  ? (o.sweep_rad > 0.0 ? "G3" : "G2")
                       : o.kind == OperationKind::kTraverse ? "G0"
                                                            : "G1";
    const double x = Rounded(o.x_W_mm), y = Rounded(o.y_W_mm);
    line += " X" + Number(x) + " Y" + Number(y);
    constexpr double kDegrees = 180.0 / std::numbers::pi;
    const auto axis = [&](AxisBit bit, const char* letter, double value) {
      line += (o.axes & bit) != 0 ? letter + Number(value) : "";
    };
    axis(kAxisZ, " Z", o.z_W_mm);
    axis(kAxisA, " A", o.a_rad * kDegrees);
    axis(kAxisB, " B", o.b_rad * kDegrees);
    axis(kAxisC, " C", o.c_rad * kDegrees);
    if (arc) {
      line += " I" + Number(o.center_x_W_mm - x_) + " J" + Number(o.center_y_W_mm - y_);
      const int turns = static_cast<int>(std::ceil(std::abs(o.sweep_rad) / (2.0 * std::numbers::pi) - 1e-9));
      line += turns > 1 ? " P" + std::to_string(turns) : "";
    }
    Line(line + pace);
    x_ = x;
    y_ = y;
    return true;
  }

  double x_ = 0.0, y_ = 0.0, feed_ = -1.0, kerf_mm_ = 0.0;
  bool timed_ = false;  // G93
};

}  // namespace

std::optional<std::string> OperationsText(const std::vector<Operation>& operations, std::string_view title) {
  OperationWriter writer;
  writer.text = "%\n(" + Plain(title) + ")\nG21 G90 G17 G40 G94\nG54\n";
  for (const Operation& o : operations) {
    if (!writer.Write(o)) {
      return std::nullopt;
    }
  }
  return writer.text + "%\n";
}

std::string ProgramText(const ContourSet& contours, const Toolpath& toolpath, const ToolpathOptions& options,
                        std::string_view title) {
  return ProgramWriter(contours, toolpath, options).Write(title);
}

std::string ReferenceDrawingText(const ContourSet& contours, const Toolpath& toolpath,
                                 const ToolpathOptions& options, std::string_view name, double tolerance_mm) {
  std::string text =
      "# Finished geometry, mm, in W. Written with the toolpath of the drawing.\nname: " + Plain(name) +
      "\nkerf_width_mm: " + Number(options.kerf_mm) + "\nfeatures:\n";
  std::map<int, int> holes;
  for (const Cut& cut : toolpath.cuts) {
    if (cut.kind == CutKind::kMark) {
      continue;
    }
    const Contour& contour = contours.contours[cut.contour];
    const std::string feature = "part_" + std::to_string(cut.part) +
                                (contour.hole ? "_hole_" + std::to_string(++holes[cut.part]) : "_outline");
    text += "  - name: " + feature + "\n    kind: " + (contour.hole ? "hole" : "contour") +
            "\n    side: " + (contour.hole ? "inside" : "outside") +
            "\n    tolerance_mm: " + Number(tolerance_mm) + "\n    outline:\n";
    for (const Piece& piece : contour.pieces) {
      text += "      - " + OutlineElement(piece) + "\n";
    }
  }
  return text;
}

}  // namespace lambdajet::trajectory
