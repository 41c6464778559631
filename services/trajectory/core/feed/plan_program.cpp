#include "trajectory/core/feed/plan_program.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <optional>

#include "trajectory/core/feed/moving_time.hpp"
#include "trajectory/core/feed/program_path.hpp"
#include "trajectory/core/feed/reach.hpp"
#include "trajectory/core/feed/resume.hpp"
#include "trajectory/core/feed/stretch.hpp"
#include "trajectory/core/part_program/read_program.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kFaultLimit = 100;
constexpr double kAdmissionStep_mm = 2.0;
constexpr double kSheetSlack_mm = 1e-6;

// FNV-1a over bytes.
class Hash {
 public:
  void Bytes(std::string_view bytes) {
    for (const char c : bytes) {
      Byte(static_cast<unsigned char>(c));
    }
    Number(static_cast<double>(bytes.size()));
  }
  void Number(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int i = 0; i < 64; i += 8) {
      Byte(static_cast<unsigned char>(bits >> i));
    }
  }
  std::uint64_t value() const { return hash_ == 0 ? 1 : hash_; }

 private:
  void Byte(unsigned char b) { hash_ = (hash_ ^ b) * 1099511628211ull; }
  std::uint64_t hash_ = 14695981039346656037ull;
};

PathDefaults DefaultsOf(const MachineDescription& machine, const PlanOptions& options) {
  PathDefaults d;
  d.tolerance_mm = machine.path.corner_tolerance_mm;
  d.pierce_time_s = machine.process.pierce_time_s;
  d.feed_scale = options.feed_scale;
  d.fastest_feed_mm_per_s = machine.path.feed_mm_per_s;
  return d;
}

ReadOptions ReaderOptionsOf(const MachineDescription& machine, const PlanOptions& wanted) {
  ReadOptions options;
  options.notation = wanted.notation;
  options.compensate_kerf = true;
  options.gcode.default_tolerance_mm = machine.path.corner_tolerance_mm;
  options.gcode.kerf_width_mm = machine.process.kerf_width_mm;
  options.gcode.abrasive_flow_max_g_per_min = machine.process.abrasive_flow_max_g_per_min;
  options.gcode.fault_limit = options.cldata.fault_limit = kFaultLimit;
  return options;
}

bool OnSheet(const MachineDescription& m, const Vector2d& p) {
  return p.x() >= -kSheetSlack_mm && p.y() >= -kSheetSlack_mm && p.x() <= m.sheet_width_mm + kSheetSlack_mm &&
         p.y() <= m.sheet_height_mm + kSheetSlack_mm;
}

ProgramFault SheetFault(const MachineDescription& m, const Vector2d& p, std::uint32_t line) {
  char text[200];
  std::snprintf(text, sizeof text, "the cut leaves the sheet at X%.3f Y%.3f mm; the sheet is %.3f x %.3f mm",
                p.x(), p.y(), m.sheet_width_mm, m.sheet_height_mm);
  const bool x = p.x() < -kSheetSlack_mm || p.x() > m.sheet_width_mm + kSheetSlack_mm;
  return {line, 0, "OUTSIDE_SHEET", x ? "X" : "Y", text};
}

// Faults of place, one a line at most.
class PlaceCheck {
 public:
  PlaceCheck(const MachineDescription& machine, std::vector<ProgramFault>& faults)
      : machine_(machine), sheet_(machine), faults_(faults) {}

  void Check(const ProgramPath& path) {
    for (const PathElement& e : path.elements) {
      for (const PathPiece& piece : e.pieces) {
        Piece(piece);
      }
      if (e.kind == ElementKind::kIdle) {
        Point(e.to_mm, e.line, false);
      }
      if (faults_.size() >= kFaultLimit) {
        return;
      }
    }
  }

 private:
  void Piece(const PathPiece& piece) {
    const int count = std::max(1, static_cast<int>(std::ceil(piece.length_mm / kAdmissionStep_mm)));
    for (int k = 0; k <= count; ++k) {
      if (!Point(PointOn(piece, piece.length_mm * k / count).p_mm, piece.line, true)) {
        return;
      }
    }
  }

  bool Point(const Vector2d& p, std::uint32_t line, bool cutting) {
    if (line == last_line_) {
      return false;
    }
    if (cutting && !OnSheet(machine_, p)) {
      faults_.push_back(SheetFault(machine_, p, line));
    } else if (sheet_.Position(p).reason != kinematics::Reason::kSolved) {
      faults_.push_back(ReachFault(sheet_, p, line));
    } else {
      return true;
    }
    last_line_ = line;
    return false;
  }

  const MachineDescription& machine_;
  SheetMotion sheet_;
  std::vector<ProgramFault>& faults_;
  std::uint32_t last_line_ = 0;
};

class Planner {
 public:
  Planner(const ProgramPath& path, const PlanningModel& model, const PlanProgress& progress,
          double begin_s_mm)
      : path_(path), model_(model), progress_(progress), s_mm_(begin_s_mm), at_(path.start_mm) {
    result_.start_W_mm = path.start_mm;
  }

  PlannedProgram Run() {
    std::size_t first = 0;
    const std::vector<PathElement>& elements = path_.elements;
    for (std::size_t i = 0; i <= elements.size() && result_.faults.empty(); ++i) {
      const bool gate = i < elements.size() && elements[i].kind == ElementKind::kGate;
      if (!gate && i < elements.size()) {
        continue;
      }
      if (gate || i > first || result_.plan.segments.empty()) {
        Stretch(first, i);
        if (gate && result_.faults.empty()) {
          Gate(elements[i]);
        }
      }
      first = i + 1;
      if (progress_ && !progress_(static_cast<double>(i) / static_cast<double>(elements.size() + 1))) {
        result_.faults.push_back({0, 0, "CANCELLED", "", "planning was cancelled"});
      }
    }
    Finish();
    return std::move(result_);
  }

 private:
  void Stretch(std::size_t first, std::size_t end) {
    const std::span<const PathElement> elements(path_.elements.data() + first, end - first);
    const double done = static_cast<double>(first) / static_cast<double>(path_.elements.size() + 1);
    StretchPlan stretch =
        PlanStretch(model_, elements, at_, s_mm_, [this, done] { return progress_ && !progress_(done); });
    if (!stretch.faults.empty()) {
      result_.faults = std::move(stretch.faults);
      return;
    }
    Events(elements, stretch);
    Append(stretch);
    if (!elements.empty()) {
      at_ = elements.back().to_mm;
    }
  }

  void Events(std::span<const PathElement> elements, const StretchPlan& stretch) {
    for (std::size_t i = 0; i < elements.size(); ++i) {
      result_.element_begin_s_mm.push_back(stretch.places[i].begin_s_mm);
      EventsOf(elements[i], stretch.places[i].begin_s_mm);
      if (elements[i].kind == ElementKind::kIdle) {
        result_.idle_length_mm += stretch.places[i].end_s_mm - stretch.places[i].begin_s_mm;
      }
    }
  }

  void EventsOf(const PathElement& element, double begin_s_mm) {
    for (const PathEvent& e : element.events) {
      const double s = begin_s_mm + e.offset_mm;
      result_.plan.events.push_back(
          {static_cast<std::uint32_t>(result_.plan.events.size()), e.action, s, e.argument, e.line});
      if (e.action == ProcessAction::kJetOn || e.action == ProcessAction::kJetOff) {
        Jet(s, e.action == ProcessAction::kJetOn);
      }
    }
  }

  void Jet(double s, bool on) { jet_changes_.push_back({s, on}); }

  void Append(StretchPlan& stretch) {
    Plan& plan = result_.plan;
    const double begin = plan.duration_s;
    for (Segment& segment : stretch.segments) {
      segment.index = static_cast<std::uint32_t>(plan.segments.size());
      segment.start_s = begin + segment.start_s;
      plan.segments.push_back(segment);
    }
    for (PlanSample& sample : stretch.samples) {
      sample.tau_s += begin;
      if (result_.samples.empty() || sample.tau_s > result_.samples.back().tau_s + 1e-9) {
        result_.samples.push_back(sample);
      }
    }
    plan.duration_s = begin + stretch.duration_s;
    s_mm_ = stretch.end_s_mm;
    result_.contour_deviation_mm = std::max(result_.contour_deviation_mm, stretch.contour_deviation_mm);
    for (const BindingLength& b : stretch.binding) {
      binding_[static_cast<std::size_t>(b.limit)] += b.length_mm;
    }
    result_.slow.insert(result_.slow.end(), stretch.slow.begin(), stretch.slow.end());
    result_.idle.insert(result_.idle.end(), stretch.idle.begin(), stretch.idle.end());
  }

  void Gate(const PathElement& element) {
    result_.element_begin_s_mm.push_back(s_mm_);
    EventsOf(element, s_mm_);
    if (element.gate == GateKind::kNone) {
      return;
    }
    Plan& plan = result_.plan;
    const auto id = static_cast<std::uint32_t>(plan.gates.size() + 1);
    plan.gates.push_back(
        {id, element.gate, s_mm_, element.gate_argument, element.line, element.gate_condition});
    plan.segments.back().gate_at_end = id;
    if (element.gate == GateKind::kPierce) {
      Jet(s_mm_, true);
      ++result_.pierce_count;
    }
    result_.gate_time_s += GateTime(element);
  }

  // What a gate costs besides its own time: the drive sees that it stands and starts again a control period late each; where
  // main motion opens the gate, states go to it and back besides, one every 2 and 4 ms.
  static constexpr double kStoppedAndStarted_s = 0.002;
  static constexpr double kAskedAcrossTheLink_s = 0.0085;

  double GateTime(const PathElement& gate) const {
    switch (gate.gate) {
      case GateKind::kPierce: {  // counted from when water and abrasive are there
        const ProcessModel& process = model_.machine.process;
        return gate.gate_argument + std::max(process.jet_on_delay_s, process.abrasive_on_delay_s) +
               kAskedAcrossTheLink_s;
      }
      case GateKind::kDwell:
        return gate.gate_argument + kStoppedAndStarted_s;
      case GateKind::kMeasure:
        return model_.machine.process.measuring_settle_time_s + kAskedAcrossTheLink_s;
      default:
        return 0.0;
    }
  }

  void Finish() {
    Plan& plan = result_.plan;
    if (!result_.faults.empty()) {
      result_.samples.clear();
      plan.segments.clear();
      return;
    }
    plan.length_mm = s_mm_;
    plan.compensated = model_.options.compensate;
    plan.elastic_lag_s2 = model_.elastic_lag_s2;
    plan.machine_id = model_.machine.machine_id;
    plan.machine_version = model_.machine.version;
    MarkCutting();
    for (std::size_t j = 0; j < kFeedLimitCount; ++j) {
      if (binding_[j] > 0.0) {
        result_.binding.push_back({static_cast<FeedLimit>(j), binding_[j]});
      }
    }
    std::stable_sort(
        result_.binding.begin(), result_.binding.end(),
        [](const BindingLength& a, const BindingLength& b) { return a.length_mm > b.length_mm; });
  }

  // A sample cuts if the jet is on at its path length; at a pierce from the first movement on.
  void MarkCutting() {
    std::size_t next = 0;
    bool on = !path_.elements.empty() && path_.elements.front().jet_on;
    PlanSample* last = nullptr;
    for (PlanSample& sample : result_.samples) {
      while (next < jet_changes_.size() && jet_changes_[next].first < sample.s_mm - 1e-12) {
        on = jet_changes_[next++].second;
      }
      sample.cutting = on;
      if (last != nullptr && on && last->cutting) {
        result_.cutting_time_s += sample.tau_s - last->tau_s;
        result_.cutting_length_mm += sample.s_mm - last->s_mm;
      }
      last = &sample;
    }
  }

  const ProgramPath& path_;
  const PlanningModel& model_;
  const PlanProgress& progress_;
  PlannedProgram result_;
  double s_mm_ = 0.0;
  Vector2d at_;
  std::vector<std::pair<double, bool>> jet_changes_;
  std::array<double, kFeedLimitCount> binding_{};
};

std::vector<ProgramFault> OptionFaults(const PlanOptions& o) {
  std::vector<ProgramFault> faults;
  const auto require = [&faults](bool holds, const char* word, const char* should) {
    if (!holds) {
      faults.push_back({0, 0, "OPTION_OUT_OF_RANGE", word, should});
    }
  };
  require(o.feed_scale > 0.0 && o.feed_scale <= 1.2, "feed_scale", "above 0 and at most 1.2");
  require(o.tolerance_mm > 0.0 && o.tolerance_mm <= 10.0, "tolerance_mm", "above 0 and at most 10 mm");
  require(o.overlap_mm >= 0.0 && o.overlap_mm <= 100.0, "overlap_mm", "0 to 100 mm");
  require(!o.start_from_s_mm || (*o.start_from_s_mm >= 0.0 && *o.start_from_s_mm < 1e9), "start_from_s_mm",
          "0 to the program's path length");
  require(o.knot_s >= 2.5e-4 && o.knot_s <= 0.02, "knot_s", "0.00025 to 0.02 s");
  require(o.knots_per_segment >= 1 && o.knots_per_segment <= 16, "knots_per_segment", "1 to 16");
  require(o.sample_s >= 2.5e-4 && o.sample_s <= 1.0, "sample_s", "0.00025 to 1 s");
  return faults;
}

PlannedProgram PlanPath(const ProgramPath& path, const PlanningModel& model, const PlanProgress& progress) {
  return Planner(path, model, progress, path.begin_s_mm).Run();
}

}  // namespace

std::uint64_t PlanIdOf(std::string_view program, const PlanOptions& o, const MachineDescription& machine) {
  Hash hash;
  hash.Bytes(program);
  for (const double number :
       {o.compensate ? 1.0 : 0.0, o.tolerance_mm, o.feed_scale, o.start_from_s_mm.value_or(-1.0),
        o.start_from_s_mm ? o.overlap_mm : 0.0, o.knot_s, static_cast<double>(o.knots_per_segment),
        static_cast<double>(machine.version)}) {
    hash.Number(number);
  }
  for (const ToleranceWish& wish : o.hold) {
    for (const double number : {wish.tolerance_mm, static_cast<double>(wish.first_line),
                                static_cast<double>(wish.last_line), static_cast<double>(wish.contour)}) {
      hash.Number(number);
    }
  }
  if (o.notation != ProgramNotation::kByContent) {
    hash.Number(static_cast<double>(o.notation));
  }
  hash.Bytes(machine.machine_id);
  hash.Bytes(machine.hash);
  for (Eigen::Index i = 0; i < machine.parameters.size(); ++i) {
    hash.Number(machine.parameters[i]);
  }
  return hash.value();
}

std::optional<ProgramFault> TooLong(const ProgramPath& path) {
  MovingTime time;
  for (const PathElement& e : path.elements) {
    for (const PathPiece& piece : e.pieces) {
      time.Move(piece.length_mm / piece.feed_mm_per_s, piece.line);
    }
    if (e.kind == ElementKind::kGate) {
      time.StandStill();
    }
  }
  return time.TooLong();
}

void CheckPath(const ProgramPath& path, const MachineDescription& machine,
               std::vector<ProgramFault>& faults) {
  PlaceCheck(machine, faults).Check(path);
  if (const std::optional<ProgramFault> fault = TooLong(path)) {
    faults.push_back(*fault);
  }
}

ProgramPath LayOutProgram(std::string_view program, const MachineDescription& machine,
                          const PlanOptions& options, std::vector<ProgramFault>& faults) {
  faults = OptionFaults(options);
  if (!faults.empty()) {
    return {};
  }
  PartProgram read = ReadPartProgram(program, ReaderOptionsOf(machine, options));
  faults = std::move(read.faults);
  if (!faults.empty()) {
    return {};
  }
  ProgramPath path = MakeProgramPath(read.operations, DefaultsOf(machine, options));
  std::vector<Operation>().swap(read.operations);  // a long program's list is not held while it is planned
  CheckPath(path, machine, faults);
  TellWords(program, options.notation, faults);
  return path;
}

PlannedProgram PlanLaidOutProgram(const ProgramPath& path, const MachineDescription& machine,
                                  const PlanOptions& options, const PlanProgress& progress) {
  const PlanningModel model(machine, options);
  const double part =
      options.start_from_s_mm ? 0.5 : 1.0;  // of the work: the whole first, then what is left of it
  const auto of_part = [&progress, part](double before) -> PlanProgress {
    return [&progress, part, before](double share) { return !progress || progress(before + part * share); };
  };
  PlannedProgram result = PlanPath(path, model, of_part(0.0));
  if (result.faults.empty() && options.start_from_s_mm) {
    const std::optional<ProgramPath> rest =
        PathFrom(path, result.element_begin_s_mm, result.plan.length_mm, options, machine);
    if (!rest) {
      result = {};
      result.faults.push_back(
          {0, 0, "START_BEYOND_END", "start_from_s_mm", "nothing of the program is left to cut from there"});
      return result;
    }
    result = PlanPath(*rest, model, of_part(part));
  }
  return result;
}

PlannedProgram PlanPartProgram(std::string_view program, const MachineDescription& machine,
                               const PlanOptions& options, const PlanProgress& progress) {
  PlannedProgram result;
  const ProgramPath path = LayOutProgram(program, machine, options, result.faults);
  if (result.faults.empty()) {
    result = PlanLaidOutProgram(path, machine, options, progress);
    result.plan.id = PlanIdOf(program, options, machine);
  }
  return result;
}

Admission AdmitPartProgram(std::string_view program, const MachineDescription& machine,
                           const PlanOptions& options) {
  Admission admission;
  admission.faults = OptionFaults(options);
  PartProgram read = ReadPartProgram(program, ReaderOptionsOf(machine, options));
  admission.faults.insert(admission.faults.end(), read.faults.begin(), read.faults.end());
  if (!admission.faults.empty()) {
    return admission;
  }
  const ProgramPath path = MakeProgramPath(read.operations, DefaultsOf(machine, options));
  CheckPath(path, machine, admission.faults);
  TellWords(program, options.notation, admission.faults);
  admission.cutting_length_mm = path.cut_length_mm;
  admission.pierce_count = path.pierce_count;
  for (const PathElement& e : path.elements) {
    admission.idle_length_mm += e.kind == ElementKind::kIdle ? (e.to_mm - e.from_mm).norm() : 0.0;
  }
  return admission;
}

}  // namespace lambdajet::trajectory
