#include "trajectory/core/part_program/cldata_writer.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

namespace lambdajet::trajectory {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kStep_rad = 2.0 * kPi / 3.0;
constexpr double kSecondsPerMinute = 60.0;
constexpr int kSettlingLimit = 20;

using Vector = std::array<double, 3>;

// Shortest digits that read back as the same number.
std::string Exact(double value) {
  char text[400];
  const auto [end, error] =
      std::to_chars(text, text + sizeof text, value == 0.0 ? 0.0 : value, std::chars_format::fixed);
  return {text, error == std::errc() ? end : text};
}

// A feed in mm/min: twelve digits, so that a division and a multiplication by 60 leave no trace.
std::string Feed(double mm_per_s) {
  char text[48];
  std::snprintf(text, sizeof text, "%.12g", mm_per_s * kSecondsPerMinute);
  return text;
}

std::string Twelve(double value) {
  char text[48];
  std::snprintf(text, sizeof text, "%.12f", value);
  return std::string(text) == "-0.000000000000" ? "0.000000000000" : text;
}

// The axis to twelve decimals, rounded until reading and writing it again changes nothing.
std::string AxisText(ToolAngles meaning, HeadAngles angles) {
  std::string text;
  for (int i = 0; i < kSettlingLimit; ++i) {
    const Vector axis = AxisOf(meaning, angles);
    Vector read;
    std::string next;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string number = Twelve(axis[k]);
      read[k] = std::strtod(number.c_str(), nullptr);
      next += "," + number;
    }
    const double length = std::sqrt(read[0] * read[0] + read[1] * read[1] + read[2] * read[2]);
    angles = AnglesOf(meaning, {read[0] / length, read[1] / length, read[2] / length});
    if (next == text) {
      break;
    }
    text = std::move(next);
  }
  return text;
}

class Writer {
 public:
  explicit Writer(ToolAngles tool_angles) : tool_angles_(tool_angles) {}

  CldataText Write(const std::vector<Operation>& operations, std::string_view part,
                   const std::vector<std::string>& notes) {
    result_.text.reserve(operations.size() * 48 + 200);
    Line("PARTNO/'" + OneLine(part) + "'");
    for (const std::string& note : notes) {
      Line("PPRINT/'" + OneLine(note) + "'");
    }
    Line("UNITS/MM");
    const auto tilts = [](const Operation& o) { return (o.axes & (kAxisA | kAxisB)) != 0; };
    multax_ = std::any_of(operations.begin(), operations.end(), tilts);
    if (multax_) {
      Line("MULTAX/ON");
    }
    for (const Operation& o : operations) {
      WriteOne(o);
    }
    Line("FINI");
    if (!result_.faults.empty()) {
      result_.text.clear();
    }
    return std::move(result_);
  }

 private:
  static std::string OneLine(std::string_view text) {
    std::string line;
    for (const char c : text.substr(0, 200)) {
      line += c == '\'' || static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
    return line;
  }

  void Line(const std::string& line) {
    result_.text += line;
    result_.text += '\n';
  }

  void Fault(const Operation& o, const char* reason, const char* message) {
    result_.faults.push_back({o.line, 0, reason, std::string(OperationName(o.kind)), message});
  }

  void WriteOne(const Operation& o) {
    switch (o.kind) {
      case OperationKind::kTraverse:
      case OperationKind::kFeedLine:
      case OperationKind::kFeedArc:
        Motion(o);
        break;
      case OperationKind::kFeedChange:
        SetFeed(o.feed_mm_per_s);
        break;
      case OperationKind::kDwell:
        Line("DELAY/" + Exact(o.value));
        break;
      case OperationKind::kPathTolerance:
        Line("TOLER/" + Exact(o.value));
        break;
      case OperationKind::kStop:
        Line("STOP");
        break;
      case OperationKind::kEnd:
        Line("END");
        break;
      case OperationKind::kUnitsChange:
      case OperationKind::kDistanceChange:
      case OperationKind::kWorkOffsetChange:
        break;
      default:
        Switch(o);
    }
  }

  void Switch(const Operation& o) {
    switch (o.kind) {
      case OperationKind::kPierce:
        Line(o.value > 0.0 ? "AUXFUN/3," + Exact(o.value) : "SPINDL/ON");
        break;
      case OperationKind::kJetOn:
        Line("AUXFUN/62,0");
        break;
      case OperationKind::kJetOff:
        Line("AUXFUN/63,0");
        break;
      case OperationKind::kAbrasiveOn:
        Line("AUXFUN/62,1");
        break;
      case OperationKind::kAbrasiveOff:
        Line("AUXFUN/63,1");
        break;
      case OperationKind::kMeasure:
        Line("AUXFUN/100," + Exact(o.value));
        break;
      case OperationKind::kCameraTrackOn:
        Line("AUXFUN/101," + Exact(o.value));
        break;
      case OperationKind::kCameraTrackOff:
        Line("AUXFUN/102");
        break;
      case OperationKind::kSpindleOn:
        Line("SPINDL/" + Exact(std::abs(o.value)) + (o.value > 0.0 ? ",RPM,CLW" : ",RPM,CCLW"));
        break;
      case OperationKind::kSpindleOff:
        Line("SPINDL/OFF");
        break;
      case OperationKind::kCoolantOn:
        Line("COOLNT/ON");
        break;
      case OperationKind::kCoolantOff:
        Line("COOLNT/OFF");
        break;
      case OperationKind::kToolChange:
      case OperationKind::kToolNumber:
        Tool(o);
        break;
      default:
        Fault(o, "NOT_WRITABLE", "CLDATA has no word for this operation");
    }
  }

  // The first LOADTL before all cuts only names a tool: where it is to be mounted, STOP stands before it.
  void Tool(const Operation& o) {
    const bool only_names = !tool_named_ && !cut_;
    if (o.kind == OperationKind::kToolNumber && !only_names) {
      Fault(o, "NOT_WRITABLE", "CLDATA names the mounted tool before the first cut only");
      return;
    }
    if (o.kind == OperationKind::kToolChange && only_names) {
      Line("STOP");
    }
    Line("LOADTL/" + Exact(o.value));
    tool_named_ = true;
  }

  void SetFeed(double feed_mm_per_s) {
    const std::string feed = Feed(feed_mm_per_s) + ",MMPM";
    if (feed_mm_per_s > 0.0 && feed != feed_) {
      feed_ = feed;
      Line("FEDRAT/" + feed_);
      on_circle_ = false;
    }
  }

  void SetDuration(double s) {
    char text[48];
    std::snprintf(text, sizeof text, "%.12g,INVERS", kSecondsPerMinute / s);
    if (feed_ != text) {
      feed_ = text;
      Line("FEDRAT/" + feed_);
      on_circle_ = false;
    }
  }

  void SetKerf(double offset_mm) {
    if (offset_mm == kerf_mm_) {
      return;
    }
    kerf_mm_ = offset_mm;
    on_circle_ = false;
    if (offset_mm != 0.0) {
      Line("CUTTER/" + Exact(2.0 * std::abs(offset_mm)));
    }
    Line(offset_mm > 0.0 ? "TLCOMP/LEFT" : offset_mm < 0.0 ? "TLCOMP/RIGHT" : "TLCOMP/OFF");
  }

  void Motion(const Operation& o) {
    const bool head = tool_angles_ == ToolAngles::kRotaryHead;
    const double quarter = head ? o.b_rad : o.a_rad, half = head ? o.a_rad : o.b_rad;
    if (o.c_rad != 0.0 || std::abs(quarter) > 0.5 * kPi || std::abs(half) > kPi) {
      Fault(o, "AXIS_NOT_WRITABLE",
            head ? "a tool's axis is written by A within half a turn, B within a quarter and no C"
                 : "a tool's axis is written by B within half a turn, A within a quarter and no C");
      return;
    }
    const Vector end = {o.x_W_mm, o.y_W_mm, o.z_W_mm};
    const bool cuts = o.kind != OperationKind::kTraverse;
    cut_ = cut_ || cuts;
    if (cuts && o.value > 0.0) {  // before the side of the path, where a feed that is read stands
      SetDuration(o.value);
    } else if (cuts) {
      SetFeed(o.feed_mm_per_s);
    }
    SetKerf(o.kerf_offset_mm);
    if (!cuts) {
      Line("RAPID");
      on_circle_ = false;
    }
    if (o.kind == OperationKind::kFeedArc) {
      Arc(o, end);
    } else {
      EndCircleBefore(end);
      Goto(end, o);
    }
    position_ = end;
  }

  // A straight move to a point of the circle just cut would read as more of its arc.
  void EndCircleBefore(const Vector& end) {
    if (on_circle_) {
      const double off = std::hypot(end[u_] - center_[u_], end[v_] - center_[v_]) - radius_mm_;
      if (std::abs(off) < 1.0) {
        Line("FEDRAT/" + feed_);
      }
    }
    on_circle_ = false;
  }

  void Arc(const Operation& o, const Vector& end) {
    const std::size_t normal = o.plane == ArcPlane::kXy ? 2 : o.plane == ArcPlane::kZx ? 1 : 0;
    u_ = (normal + 1) % 3;
    v_ = (normal + 2) % 3;
    center_ = {o.center_x_W_mm, o.center_y_W_mm, o.center_z_W_mm};
    center_[normal] = end[normal];
    radius_mm_ = std::hypot(position_[u_] - center_[u_], position_[v_] - center_[v_]);
    Vector axis{};
    axis[normal] = 1.0;
    std::string circle = "CIRCLE/";
    for (const double number : {center_[0], center_[1], center_[2], axis[0], axis[1], axis[2], radius_mm_}) {
      circle += Exact(number) + ",";
    }
    circle.pop_back();
    Line(circle);
    const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(o.sweep_rad) / kStep_rad)));
    const double from = std::atan2(position_[v_] - center_[v_], position_[u_] - center_[u_]);
    for (int i = 1; i < steps; ++i) {
      const double part = static_cast<double>(i) / steps, angle = from + part * o.sweep_rad;
      Vector between;
      between[u_] = center_[u_] + radius_mm_ * std::cos(angle);
      between[v_] = center_[v_] + radius_mm_ * std::sin(angle);
      between[normal] = position_[normal] + part * (end[normal] - position_[normal]);
      Goto(between, o);
    }
    Goto(end, o);
    on_circle_ = true;
  }

  void Goto(const Vector& p, const Operation& o) {
    Line("GOTO/" + Exact(p[0]) + "," + Exact(p[1]) + "," + Exact(p[2]) +
         (multax_ ? AxisText(tool_angles_, {o.a_rad, o.b_rad}) : ""));
  }

  CldataText result_;
  ToolAngles tool_angles_;
  bool multax_ = false;
  bool tool_named_ = false, cut_ = false;
  Vector position_{};
  std::string feed_;
  double kerf_mm_ = 0.0;
  bool on_circle_ = false;
  Vector center_{};
  double radius_mm_ = 0.0;
  std::size_t u_ = 0, v_ = 1;
};

}  // namespace

CldataText WriteCldata(const std::vector<Operation>& operations, std::string_view part,
                       const std::vector<std::string>& notes, ToolAngles tool_angles) {
  return Writer(tool_angles).Write(operations, part, notes);
}

}  // namespace lambdajet::trajectory
