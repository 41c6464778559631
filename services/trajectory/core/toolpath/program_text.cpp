#include "trajectory/core/toolpath/program_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

#include "trajectory/core/part_program/gcode_writer.hpp"

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

std::string_view KindName(CutKind kind) {
  return kind == CutKind::kMark ? "mark" : kind == CutKind::kHole ? "hole" : "outline";
}

class ProgramWriter {
 public:
  ProgramWriter(const ContourSet& contours, const Toolpath& toolpath, const ToolpathOptions& options)
      : set_(contours), toolpath_(toolpath), options_(options) {}

  std::string Write(std::string_view title) {
    Line("%");
    Line("(" + GcodeComment(title) + ": kerf " + Number(options_.kerf_mm, 3) + " mm, centreline of the jet)");
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
         (mark ? "" : ", layer " + GcodeComment(set_.contours[cut.contour].layer)) + ")");
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

}  // namespace

std::string ProgramText(const ContourSet& contours, const Toolpath& toolpath, const ToolpathOptions& options,
                        std::string_view title) {
  return ProgramWriter(contours, toolpath, options).Write(title);
}

std::string ReferenceDrawingText(const ContourSet& contours, const Toolpath& toolpath,
                                 const ToolpathOptions& options, std::string_view name, double tolerance_mm) {
  std::string text = "# Finished geometry, mm, in W. Written with the toolpath of the drawing.\nname: " +
                     GcodeComment(name) + "\nkerf_width_mm: " + Number(options.kerf_mm) + "\nfeatures:\n";
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
