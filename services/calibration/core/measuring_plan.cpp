#include "calibration/core/measuring_plan.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "calibration/core/place_accuracy.hpp"
#include "calibration/core/prior.hpp"

namespace lambdajet::calibration {
namespace {

constexpr double kEdge_mm = 6.0;  // a trial hole stays this far inside the sheet
constexpr double kHolePitch_mm = 8.0;
constexpr double kMarkClearance_mm = 8.0;
constexpr double kShakeRadius_mm = 4.0;
constexpr double kShakeShare = 0.9;  // of the path's acceleration
constexpr int kTurns = 4;
constexpr double kSwingOut_s = 0.4;
constexpr double kWatch_s = 0.4;  // three swings and more
constexpr double kStepAside_mm = 0.3;
constexpr double kLook_s = 0.15;  // exposure, gate and start of the next move, beside settling

struct Candidate {
  int id = 0;
  Eigen::Vector2d jet_W_mm = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, kAll> rows = Eigen::Matrix<double, 2, kAll>::Zero();  // whitened, to z
};

struct Hole {
  Eigen::Vector2d p_W_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d look_W_mm = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, kAll> rows = Eigen::Matrix<double, 2, kAll>::Zero();
};

Eigen::Matrix2d LookCovariance(const MachineDescription& machine, const Eigen::Vector2d& q) {
  const EffectorPlace place = PlaceEffector(machine, machine.parameters, q);
  return StraightnessCovariance(machine, place) + BacklashCovariance(machine, place);
}

Eigen::Matrix<double, 2, kAll> Whitened(const Eigen::Matrix2d& covariance, const ParameterJacobian2& J,
                                        const Prior& prior) {
  const Eigen::LLT<Eigen::Matrix2d> root(covariance + 1e-12 * Eigen::Matrix2d::Identity());
  return root.matrixL().solve(J * prior.scale);
}

std::vector<Candidate> MarksInReach(const MachineDescription& machine, const Prior& prior) {
  std::vector<Candidate> candidates;
  const double fixed =
      std::pow(machine.uncertainties.camera_mm, 2) + std::pow(machine.uncertainties.mark_mm, 2);
  for (const SheetMark& mark : machine.marks) {
    Candidate c;
    c.id = mark.id;
    c.jet_W_mm = JetPlaceForLook(machine.parameters, {mark.x_W_mm, mark.y_W_mm});
    const auto q = ReadingsForJet(machine, machine.parameters, c.jet_W_mm);
    if (!q) {
      continue;
    }
    Measurement look;
    look.mark = mark.id;
    look.actuator_position_mm = *q;
    const LookPrediction predicted = PredictLook(machine, machine.parameters, look);
    if (predicted.closed) {
      c.rows =
          Whitened(LookCovariance(machine, *q) + fixed * Eigen::Matrix2d::Identity(), predicted.J, prior);
      candidates.push_back(c);
    }
  }
  return candidates;
}

std::optional<Hole> HoleAt(const MachineDescription& machine, const Prior& prior,
                           const Eigen::Vector2d& p_W_mm) {
  for (const SheetMark& mark : machine.marks) {
    if ((Eigen::Vector2d(mark.x_W_mm, mark.y_W_mm) - p_W_mm).norm() < kMarkClearance_mm) {
      return std::nullopt;
    }
  }
  Hole hole{p_W_mm, JetPlaceForLook(machine.parameters, p_W_mm), {}};
  const auto pierce = ReadingsForJet(machine, machine.parameters, hole.p_W_mm);
  const auto look_q = ReadingsForJet(machine, machine.parameters, hole.look_W_mm);
  if (!pierce || !look_q) {
    return std::nullopt;
  }
  Measurement look;
  look.kind = LookKind::kHole;
  look.mark = kFirstHole + 1;
  look.actuator_position_mm = *look_q;
  look.pierce_actuator_position_mm = *pierce;
  const LookPrediction predicted = PredictLook(machine, machine.parameters, look);
  if (!predicted.closed) {
    return std::nullopt;
  }
  const double fixed =
      std::pow(machine.uncertainties.camera_mm, 2) + std::pow(machine.uncertainties.jet_wander_mm, 2);
  hole.rows = Whitened(LookCovariance(machine, *look_q) + LookCovariance(machine, *pierce) +
                           fixed * Eigen::Matrix2d::Identity(),
                       predicted.J, prior);
  return hole;
}

// Free places for holes in a row along the sheet's x, from a corner inwards.
std::vector<Hole> HolesFrom(const MachineDescription& machine, const Prior& prior,
                            const Eigen::Vector2d& corner, int count) {
  const bool right = corner.x() > 0.5 * machine.sheet_width_mm;
  const bool top = corner.y() > 0.5 * machine.sheet_height_mm;
  const double room = 0.25 * machine.sheet_width_mm;  // of the edge: the rest belongs to parts
  std::vector<Hole> holes;
  for (double along = kEdge_mm; along <= room && static_cast<int>(holes.size()) < count;
       along += kHolePitch_mm) {
    const Eigen::Vector2d p_W(corner.x() + (right ? -along : along),
                              corner.y() + (top ? -kEdge_mm : kEdge_mm));
    if (auto hole = HoleAt(machine, prior, p_W)) {
      holes.push_back(*hole);
    }
  }
  return holes;
}

// In turn in every corner, since holes side by side share one error of the rails; empty if there is no room for all.
std::vector<Hole> TrialHoles(const MachineDescription& machine, const Prior& prior,
                             const MeasuringPlanOptions& options) {
  const double w = machine.sheet_width_mm;
  const double h = machine.sheet_height_mm;
  std::vector<Eigen::Vector2d> corners = {{w, h}, {w, 0.0}, {0.0, h}, {0.0, 0.0}};
  if (options.scrap_W_mm) {
    corners = {*options.scrap_W_mm};
  }
  std::vector<std::vector<Hole>> free;
  for (const Eigen::Vector2d& corner : corners) {
    free.push_back(HolesFrom(machine, prior, corner, options.trial_pierces));
  }
  std::vector<Hole> holes;
  for (std::size_t round = 0; round < static_cast<std::size_t>(options.trial_pierces); ++round) {
    for (const std::vector<Hole>& of_corner : free) {
      if (round < of_corner.size() && static_cast<int>(holes.size()) < options.trial_pierces) {
        holes.push_back(of_corner[round]);
      }
    }
  }
  return static_cast<int>(holes.size()) == options.trial_pierces ? holes : std::vector<Hole>{};
}

// Greedy D-optimal choice; `information` starts with what is known anyway and takes up what is chosen.
std::vector<Candidate> ChooseMarks(std::vector<Candidate> candidates, int count,
                                   ParameterCovariance& information) {
  std::vector<Candidate> chosen;
  while (!candidates.empty() && static_cast<int>(chosen.size()) < count) {
    const Eigen::LLT<ParameterCovariance> known(information);
    std::size_t best = 0;
    double best_gain = -1.0;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const Eigen::Matrix<double, 2, kAll>& rows = candidates[i].rows;
      const Eigen::Matrix2d growth = Eigen::Matrix2d::Identity() + rows * known.solve(rows.transpose());
      const double gain = growth.determinant();
      if (gain > best_gain) {
        best_gain = gain;
        best = i;
      }
    }
    information += candidates[best].rows.transpose() * candidates[best].rows;
    chosen.push_back(candidates[best]);
    candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(best));
  }
  return chosen;
}

double Travel(const MachineDescription& machine, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const double way = (to - from).norm();
  const double v = machine.path.rapid_mm_per_s;
  const double a = machine.path.acceleration_mm_per_s2;
  return way < v * v / a ? 2.0 * std::sqrt(way / a) : way / v + v / a;
}

void Shorten(std::vector<Candidate>& order) {
  for (std::size_t i = 0; i + 1 < order.size(); ++i) {  // nearest neighbour
    const auto nearest = std::min_element(order.begin() + static_cast<std::ptrdiff_t>(i + 1), order.end(),
                                          [&](const Candidate& a, const Candidate& b) {
                                            return (a.jet_W_mm - order[i].jet_W_mm).norm() <
                                                   (b.jet_W_mm - order[i].jet_W_mm).norm();
                                          });
    std::iter_swap(order.begin() + static_cast<std::ptrdiff_t>(i + 1), nearest);
  }
  const auto way = [&](std::size_t a, std::size_t b) {
    return (order[a].jet_W_mm - order[b].jet_W_mm).norm();
  };
  bool better = true;
  for (int pass = 0; better && pass < 50; ++pass) {  // 2-opt, the first look stays first
    better = false;
    for (std::size_t i = 0; i + 2 < order.size(); ++i) {
      for (std::size_t j = i + 2; j < order.size(); ++j) {
        const double after = j + 1 < order.size() ? way(j, j + 1) - way(i + 1, j + 1) : 0.0;
        if (way(i, j) < way(i, i + 1) + after - 1e-9) {
          std::reverse(order.begin() + static_cast<std::ptrdiff_t>(i + 1),
                       order.begin() + static_cast<std::ptrdiff_t>(j + 1));
          better = true;
        }
      }
    }
  }
}

// The mark nearest to the middle of those in reach, about which the whole shaking is in reach too.
const Candidate* MarkToShakeAt(const MachineDescription& machine, const std::vector<Candidate>& candidates) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Candidate& c : candidates) {
    middle += c.jet_W_mm / static_cast<double>(candidates.size());
  }
  const Candidate* best = nullptr;
  for (const Candidate& c : candidates) {
    bool reached = true;
    for (const double x : {-1.5 * kShakeRadius_mm, 1.5 * kShakeRadius_mm}) {
      for (const double y : {-1.5 * kShakeRadius_mm, 1.5 * kShakeRadius_mm}) {
        reached = reached &&
                  ReadingsForJet(machine, machine.parameters, c.jet_W_mm + Eigen::Vector2d(x, y)).has_value();
      }
    }
    if (reached && (best == nullptr || (c.jet_W_mm - middle).norm() < (best->jet_W_mm - middle).norm())) {
      best = &c;
    }
  }
  return best;
}

class ProgramText {
 public:
  explicit ProgramText(const MachineDescription& machine) : machine_(machine) {}
  void Line(const char* format, ...) {
    char line[256];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    text_ += line;
    text_ += '\n';
  }
  void GoTo(const Eigen::Vector2d& p_W) {
    time_s_ += started_ ? Travel(machine_, at_, p_W) : 0.0;
    started_ = true;
    at_ = p_W;
    Line("G0 X%.4f Y%.4f", p_W.x(), p_W.y());
  }
  // Pictures from the stop on while the sheet swings out: identification takes the swing out of them, so nobody waits for it.
  void Look(const Eigen::Vector2d& jet_W, int id) {
    GoTo(jet_W);
    if (!marked_) {  // the one gate with a look: a run begins with it, should the same program be played again
      marked_ = true;
      Line("M100 P%d", id);
      time_s_ += machine_.process.measuring_settle_time_s + kLook_s;
    }
    Line("M101 P%d", id);
    Line("G4 P%.2f", kWatch_s);
    Line("G0 X%.4f", jet_W.x() + kStepAside_mm);  // the way on which M102 can take place
    Line("M102");
    at_ = {jet_W.x() + kStepAside_mm, jet_W.y()};
    time_s_ += kWatch_s + kLook_s;
  }
  void Spend(double time_s) { time_s_ += time_s; }
  void Pierce(const Eigen::Vector2d& p_W, double pierce_s) {
    GoTo(p_W);
    Line("M3 P%.3f", pierce_s);
    Line("M5");
    time_s_ += pierce_s + 1.0;  // stand-off and pressure
  }
  double time_s() const { return time_s_; }
  std::string Take() { return std::move(text_); }

 private:
  const MachineDescription& machine_;
  std::string text_;
  Eigen::Vector2d at_ = Eigen::Vector2d::Zero();
  double time_s_ = 0.0;
  bool started_ = false;
  bool marked_ = false;
};

// Strokes in x and y, whose reversals make the sheet swing, then circles of two sizes, then rest.
void Shake(const MachineDescription& machine, const Candidate& about, ProgramText& program) {
  const double r = kShakeRadius_mm;
  const double a = kShakeShare * machine.path.acceleration_mm_per_s2;
  const double feed = std::min(machine.path.feed_mm_per_s, std::sqrt(a * r));
  const double small_feed = std::min(feed, std::sqrt(a * 0.5 * r));
  const Eigen::Vector2d c = about.jet_W_mm;
  program.GoTo({c.x() + r, c.y()});
  program.Line("G61");
  program.Line("M101 P%d", about.id);
  program.Line("G1 X%.4f Y%.4f F%.1f", c.x() - r, c.y(), 60.0 * machine.path.feed_mm_per_s);
  program.Line("X%.4f", c.x() + r);
  program.Line("X%.4f", c.x());
  program.Line("Y%.4f", c.y() + r);
  program.Line("Y%.4f", c.y() - r);
  program.Line("Y%.4f", c.y());
  program.Line("X%.4f", c.x() + r);
  program.Line("G2 X%.4f Y%.4f I%.4f J0 P%d F%.1f", c.x() + r, c.y(), -r, kTurns, 60.0 * feed);
  program.Line("G1 X%.4f F%.1f", c.x() + 0.5 * r, 60.0 * feed);
  program.Line("G3 X%.4f Y%.4f I%.4f J0 P%d F%.1f", c.x() + 0.5 * r, c.y(), -0.5 * r, kTurns,
               60.0 * small_feed);
  program.Line("G4 P%.2f", kSwingOut_s);
  program.Line("G1 X%.4f F%.1f", c.x() + 0.4 * r, 60.0 * small_feed);
  program.Line("M102");
  program.Line("G64");
  const double stroke = 2.0 * std::sqrt(2.0 * r / a);
  program.Spend(5.0 * stroke + kTurns * 6.2832 * (r / feed + 0.5 * r / small_feed) + kSwingOut_s + 0.5);
}

void Open(const MachineDescription& machine, const char* title, ProgramText& program) {
  program.Line("(%s, machine %s, version %u)", title, machine.machine_id.c_str(), machine.version);
  program.Line("G21 G17 G90 G54");
}

double TimeOf(const MachineDescription& machine, const std::vector<Candidate>& order) {
  double time_s = 0.0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    time_s += kWatch_s + kLook_s + (i > 0 ? Travel(machine, order[i - 1].jet_W_mm, order[i].jet_W_mm) : 0.0);
  }
  return time_s;
}

std::string Text(const char* format, ...) {
  char text[320];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

std::string Write(const MachineDescription& machine, const MeasuringPlanOptions& options,
                  const std::vector<Candidate>& order, const std::vector<Hole>& holes,
                  const Candidate* shaken, double& time_s) {
  ProgramText program(machine);
  Open(machine, "measuring run", program);
  for (const Candidate& c : order) {
    program.Look(c.jet_W_mm, c.id);
  }
  if (shaken != nullptr) {
    Shake(machine, *shaken, program);
  }
  for (std::size_t n = 0; n < holes.size(); ++n) {
    program.Pierce(holes[n].p_W_mm, options.pierce_time_s);
    program.Look(holes[n].look_W_mm, kFirstHole + 1 + static_cast<int>(n));
  }
  program.Line("M2");
  time_s = program.time_s();
  return program.Take();
}

}  // namespace

std::string_view PlanReasonName(PlanReason reason) {
  constexpr std::array<std::string_view, 3> kNames = {"PLANNED", "MARKS_OUT_OF_REACH", "NO_PLACE_TO_PIERCE"};
  return kNames[static_cast<std::size_t>(reason)];
}

MeasuringPlan PlanMeasuringRun(const MachineDescription& machine, const MeasuringPlanOptions& options) {
  MeasuringPlan plan;
  const Prior prior = Prior::Of(machine.parameters, machine.covariance);
  const std::vector<Candidate> candidates = MarksInReach(machine, prior);
  if (candidates.size() < 4) {
    plan.explanation = Text("%zu of %zu marks can be brought under the camera, at least 4 are needed",
                            candidates.size(), machine.marks.size());
    return plan;
  }
  const std::vector<Hole> holes =
      options.trial_pierces > 0 ? TrialHoles(machine, prior, options) : std::vector<Hole>{};
  if (options.trial_pierces > 0 && holes.empty()) {
    plan.reason = PlanReason::kNoPlaceToPierce;
    plan.explanation = Text(
        "no corner of the sheet has room for %d trial holes in reach of jet and camera, %.0f mm clear of "
        "marks",
        options.trial_pierces, kMarkClearance_mm);
    return plan;
  }
  const Candidate* shaken = options.elasticity ? MarkToShakeAt(machine, candidates) : nullptr;
  ParameterCovariance of_holes = ParameterCovariance::Identity();
  for (const Hole& hole : holes) {
    of_holes += hole.rows.transpose() * hole.rows;
  }
  std::vector<Candidate> order;
  ParameterCovariance information;
  int looks = options.looks;
  do {  // fewer looks until the machine's time suffices
    information = of_holes;
    order = ChooseMarks(candidates, looks, information);
    Shorten(order);
    plan.program = Write(machine, options, order, holes, shaken, plan.machine_time_s);
    looks = static_cast<int>(order.size()) - 1;
  } while (plan.machine_time_s > options.longest_time_s && looks >= 6);
  plan.reason = PlanReason::kPlanned;
  for (const Candidate& c : order) {
    plan.marks.push_back(c.id);
  }
  for (const Hole& hole : holes) {
    plan.pierces_W_mm.push_back(hole.p_W_mm);
  }
  plan.tracked_mark = shaken != nullptr ? shaken->id : 0;
  const ParameterCovariance after =
      prior.scale * information.llt().solve(ParameterCovariance::Identity()) * prior.scale.transpose();
  plan.expected_before_mm = WorstRadius95(PredictPlaces(machine, machine.parameters, machine.covariance));
  plan.expected_mm = WorstRadius95(PredictPlaces(machine, machine.parameters, after));
  plan.explanation = Text(
      "%zu looks, %zu trial pierces%s, about %.0f s; the jet's place on the sheet is expected to be known to "
      "%.3f mm (95 %%, worst over the sheet; %.3f now)",
      plan.marks.size(), holes.size(), shaken != nullptr ? ", shaking" : "", plan.machine_time_s,
      plan.expected_mm, plan.expected_before_mm);
  return plan;
}

MeasuringPlan PlanVerification(const MachineDescription& machine, int looks) {
  MeasuringPlan plan;
  Prior of_move = Prior::Of(machine.parameters, ParameterCovariance::Zero());
  // What a move can be: the base shifted, the sheet turned; by any amount that a look can tell well.
  of_move.scale(At(Parameter::kBaseXMm), At(Parameter::kBaseXMm)) = 1.0;
  of_move.scale(At(Parameter::kBaseYMm), At(Parameter::kBaseYMm)) = 1.0;
  of_move.scale(At(Parameter::kSheetThetaRad), At(Parameter::kSheetThetaRad)) = 0.01;
  const std::vector<Candidate> candidates = MarksInReach(machine, of_move);
  if (candidates.size() < 2) {
    plan.explanation = Text("%zu of %zu marks can be brought under the camera, at least 2 are needed",
                            candidates.size(), machine.marks.size());
    return plan;
  }
  ParameterCovariance information = ParameterCovariance::Identity();
  std::vector<Candidate> order = ChooseMarks(candidates, looks, information);
  Shorten(order);
  ProgramText program(machine);
  Open(machine, "verify the base", program);
  for (const Candidate& c : order) {
    program.Look(c.jet_W_mm, c.id);
    plan.marks.push_back(c.id);
  }
  program.Line("M2");
  plan.reason = PlanReason::kPlanned;
  plan.machine_time_s = TimeOf(machine, order);
  plan.program = program.Take();
  plan.explanation = Text("%zu looks, about %.0f s", plan.marks.size(), plan.machine_time_s);
  return plan;
}

}  // namespace lambdajet::calibration
